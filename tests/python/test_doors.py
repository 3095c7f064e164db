# SPDX-License-Identifier: BSD-3-Clause
"""One way to solve: the tasks of tests/interface/run/solve/doors by their files and as problems in Python, to the same bits."""

import json
import math
import pathlib

import dyntape
import pytest
from conftest import CONFIG

FOLDER = pathlib.Path(__file__).parents[1] / "interface" / "run" / "solve" / "doors"
ROBOTS = CONFIG / "robots"


def block(duration):
    p = dyntape.load(ROBOTS / "block.urdf").problem(duration)
    p.start_at([0])
    p.end_at([1])
    return p


def arm(form="forward"):
    p = dyntape.load(ROBOTS / "arm_2r.urdf").problem(1, form=form)
    p.start_at([-0.6, 0.3])
    p.end_at([1.2, 1.5])
    return p


def cart_pole():
    p = dyntape.load(ROBOTS / "cart_pole.urdf").problem(2, driven=["slider"])
    p.start_at([0, 0])
    p.end_at([1, math.pi])
    p.limit_positions()
    p.limit_efforts()
    p.add_effort(1)
    return p


def arm_torques(form="forward"):
    p = with_effort(arm(form))
    p.limit_positions()
    return p


def arm_refined():
    p = arm_torques()
    p.limit_velocities()
    return p


def with_effort(p):
    p.add_effort(1)
    return p


def block_free_time():
    p = with_effort(block(1))
    p.add_minimum_time(4)
    p.free_duration(0.2, 5)
    return p


def block_late():
    p = with_effort(block(0.1))
    p.bound_controls(-10, 10)
    return p


def arm_accelerations():
    p = arm()
    p.add_accelerations(1)
    return p


def pendulum_time():
    p = dyntape.load(ROBOTS / "pendulum.urdf").problem(2)
    p.start_at([0])
    p.end_at([math.pi])
    p.free_duration(0.5, 10)
    p.add_minimum_time(1)
    p.bound_controls(-4, 4)
    return p


# What each file says, and how it is solved.
DOORS = {
    "block_effort": (lambda: with_effort(block(1)), dict(intervals=10)),
    "block_free_time": (block_free_time, dict(intervals=10)),
    "block_late": (block_late, dict(intervals=10)),
    "block_riccati": (lambda: with_effort(block(1)), dict(intervals=12, method="riccati")),
    "arm_accelerations": (arm_accelerations, dict(intervals=20)),
    "arm_torques": (lambda: arm_torques("inverse"), dict(intervals=20)),
    "arm_coarse": (arm_torques, dict(intervals=4, scheme="trapezoid")),
    "arm_refined": (arm_refined, dict(intervals=8, refine=True)),
    "arm_iterations": (arm_torques, dict(intervals=20, max_iterations=2)),
    "cart_pole": (cart_pole, dict(intervals=40)),
    "cart_pole_radau": (cart_pole, dict(intervals=30, scheme="radau-3", method="riccati")),
    "pendulum_time": (pendulum_time, dict(intervals=20, refine=True)),
}


@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("*.info")))
def test_a_file_and_a_problem_agree(name):
    task = dyntape.solve(FOLDER / f"{name}.info")
    report = json.loads(task.json)
    make, how = DOORS[name]
    s = make().solve(**how)
    assert s.success == task.success
    assert s.status == report["status"]
    if not how.get("refine"):  # which goes on until the cost stands as well
        assert s.cost == report["cost"]
    keys = ("intervals", "iterations", "cost")
    meshes = report.get("meshes") or [{"intervals": s.intervals, "iterations": report["iterations"], "cost": report["cost"]}]
    assert [[m[k] for k in keys] for m in s.meshes][: len(meshes)] == [[m[k] for k in keys] for m in meshes]
