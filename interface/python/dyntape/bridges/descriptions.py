# SPDX-License-Identifier: BSD-3-Clause
"""Robots by name, from the packages example-robot-data, whose files come with it, and robot_descriptions, which fetches its own.

    from dyntape.bridges import descriptions
    robot = descriptions.load("talos_reduced", base="floating")         # pip install --no-deps example-robot-data
    robot = descriptions.load("panda_description")                      # pip install robot_descriptions
"""

from __future__ import annotations

import difflib
import importlib
import importlib.metadata
import pathlib
from collections import Counter
from typing import Any

from .. import ArgumentError, Robot
from .. import load as load_file


def files() -> dict[str, pathlib.Path]:
    """The URDF files of example-robot-data by the name of the robot; empty where it is not installed.

    The name is that of the file; of two files with one name it is FOLDER/NAME.

    >>> isinstance(files(), dict)
    True
    """
    try:
        listed = importlib.metadata.files("example-robot-data") or []
    except importlib.metadata.PackageNotFoundError:
        return {}
    paths = [pathlib.Path(str(entry.locate())) for entry in listed if entry.suffix == ".urdf"]
    count = Counter(path.stem for path in paths)
    return {path.stem if count[path.stem] == 1 else f"{_folder(path)}/{path.stem}": path for path in paths}


def load(name: str, **options: Any) -> Robot:
    """A robot by its name.

    name: one of files(), as "panda", or the name of a module of robot_descriptions, as "panda_description", which fetches
        its files by git when it is used first.
    options: those of dyntape.load, as base="floating".

    Raises ArgumentError where neither package has it, FileError for what is wrong in its file, and what robot_descriptions
    raises where it cannot fetch.

    >>> robot = descriptions.load("panda", lock=["panda_finger_joint1", "panda_finger_joint2"])  # doctest: +SKIP
    """
    known = files()
    return load_file(known[name] if name in known else _fetched(name, list(known)), **options)


def _folder(path: pathlib.Path) -> str:
    """The robot's, in .../example-robot-data/robots/FOLDER/.../NAME.urdf."""
    return path.parts[path.parts.index("example-robot-data") + 2]


def _fetched(name: str, known: list[str]) -> str:
    try:
        module = importlib.import_module(f"robot_descriptions.{name}")
    except ModuleNotFoundError as missing:
        if missing.name not in ("robot_descriptions", f"robot_descriptions.{name}"):
            raise
        near = difflib.get_close_matches(name, known, 3)
        hint = f"did you mean {', '.join(near)}?" if near else "pip install robot_descriptions, or --no-deps example-robot-data"
        raise ArgumentError(f'descriptions: no robot is called "{name}"; {hint}') from None
    if not hasattr(module, "URDF_PATH"):
        raise ArgumentError(f'descriptions: "{name}" has no URDF file; expected a description that has one')
    return str(module.URDF_PATH)
