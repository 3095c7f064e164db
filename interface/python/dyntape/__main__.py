# SPDX-License-Identifier: BSD-3-Clause
"""python -m dyntape: the command line, and a first picture.

    python -m dyntape demo [FOLDER]
    python -m dyntape solve TASK.info --output FOLDER
    python -m dyntape --help
"""

from __future__ import annotations

import os
import pathlib
import signal
import sys

from . import config_folder
from ._dyntape import command_line


def demo(arguments: list[str]) -> int:
    """An arm that reaches around obstacles: solved, verified, drawn."""
    if len(arguments) > 1 or any(argument.startswith("-") for argument in arguments):
        print("dyntape: demo: expected the name of a folder for the results, or nothing", file=sys.stderr)
        return 2
    folder = pathlib.Path(arguments[0] if arguments else "dyntape_demo")
    task = config_folder() / "tasks" / "arm_around_obstacles.info"
    status = command_line(["dyntape", "solve", os.fspath(task), "--output", os.fspath(folder)])
    if status == 0:
        pictures = [os.fspath(picture) for picture in sorted(folder.glob("*.svg"))]
        print(f"open {folder / 'motion.html'} in a browser" + ("; pictures: " + ", ".join(pictures) if pictures else ""))
    return status


def main() -> int:
    # The commands ask for signals themselves, and end as commands do.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    arguments = sys.argv[1:]
    if arguments[:1] == ["demo"]:
        return demo(arguments[1:])
    status = command_line(["dyntape", *arguments])
    if arguments[:1] in (["--help"], ["-h"]):
        print("In Python besides: dyntape demo [FOLDER], an arm that reaches around obstacles, solved and drawn.")
    return status


if __name__ == "__main__":
    sys.exit(main())
