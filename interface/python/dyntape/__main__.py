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

from . import Error, config_folder, solve
from ._dyntape import command_line


def demo(arguments: list[str]) -> int:
    """An arm that reaches around obstacles: solved, verified, drawn."""
    if len(arguments) > 1 or any(argument.startswith("-") for argument in arguments):
        print("dyntape: demo: expected the name of a folder for the results, or nothing", file=sys.stderr)
        return 2
    folder = pathlib.Path(arguments[0] if arguments else "dyntape_demo")
    solution = solve(config_folder() / "tasks" / "arm_around_obstacles.info")
    unwritten = solution.write(folder)
    print(solution.text())
    for sentence in unwritten:
        print(f"dyntape: {sentence}", file=sys.stderr)
    page = folder / "motion.html"
    if not solution.success or not page.exists():
        print(f"dyntape: {solution.verdict}", file=sys.stderr)
        return 1
    pictures = [os.fspath(picture) for picture in sorted(folder.glob("*.svg"))]
    print(f"open {page} in a browser" + ("; pictures: " + ", ".join(pictures) if pictures else ""))
    return 0


def main() -> int:
    arguments = sys.argv[1:]
    if arguments[:1] == ["demo"]:
        try:
            return demo(arguments[1:])
        except (Error, OSError) as error:
            print(f"dyntape: {error}", file=sys.stderr)
            return 1
        except KeyboardInterrupt:
            return 130
    # The commands ask for signals themselves, and end as commands do.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    status = command_line(["dyntape", *arguments])
    if arguments[:1] in (["--help"], ["-h"]):
        print("In Python besides: dyntape demo [FOLDER], an arm that reaches around obstacles, solved and drawn.")
    return status


if __name__ == "__main__":
    sys.exit(main())
