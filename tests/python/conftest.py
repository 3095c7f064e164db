# SPDX-License-Identifier: BSD-3-Clause
import os
import pathlib

import dyntape
import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONFIG = ROOT / "config"
FINGERS = ["panda_finger_joint1", "panda_finger_joint2"]


def reason_of_absence():
    try:
        return "" if dyntape.devices() else "the loader of OpenCL knows no device"
    except dyntape.ToolError as error:
        return str(error)


needs_device = pytest.mark.skipif(bool(reason_of_absence()), reason=reason_of_absence() or "there is one")


@pytest.fixture(scope="session", autouse=True)
def at_root():
    """Docstrings name files of the tree."""
    os.chdir(ROOT)


@pytest.fixture(scope="session")
def panda():
    return dyntape.load(CONFIG / "robots" / "panda.urdf", lock=FINGERS)


@pytest.fixture(scope="session")
def solo():
    return dyntape.load(CONFIG / "robots" / "solo12.urdf", base="floating")


@pytest.fixture
def random():
    return np.random.default_rng(7)


def states(robot, random, *batch):
    """q, v, a of that batch shape."""
    count = int(np.prod(batch)) if batch else 1
    q = robot.random(count, seed=3).reshape(*batch, robot.nq)
    return q, random.normal(size=(*batch, robot.nv)), random.normal(size=(*batch, robot.nv))


def page_section(title):
    """The Python code of a section of docs/bridges.md."""
    section = (ROOT / "docs" / "bridges.md").read_text().split(f"\n## {title}\n")[1].split("\n## ")[0]
    return "\n".join(block.split("```")[0] for block in section.split("```python\n")[1:])
