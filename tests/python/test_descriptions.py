# SPDX-License-Identifier: BSD-3-Clause
"""dyntape.bridges.descriptions: robots by name, from packages that need not be here."""

import sys
import types

import dyntape
import numpy as np
import pytest
from conftest import CONFIG, page_section
from dyntape.bridges import descriptions

on_disk = pytest.mark.skipif(not descriptions.files(), reason="example-robot-data is not installed")


@on_disk
def test_every_robot_is_read_or_says_why():
    refused = {}
    for name in descriptions.files():
        try:
            robot = descriptions.load(name)
        except dyntape.FileError as error:
            refused[name] = str(error)
        else:
            assert np.isfinite(robot.gravity(robot.neutral())).all(), name
    assert len(refused) < 0.2 * len(descriptions.files()), refused


@on_disk
def test_options_reach_the_reader():
    fixed, floating = descriptions.load("solo12"), descriptions.load("solo12", base="floating")
    assert floating.nv == fixed.nv + 6


@on_disk
def test_the_page():
    names = {}
    exec(page_section("Robots by name"), names)
    assert names["robot"].nv == 7


def test_robot_descriptions_give_their_path(monkeypatch):
    """Its modules fetch when they are imported; this one stands for them."""
    module = types.ModuleType("robot_descriptions.pendulum_description")
    module.URDF_PATH = str(CONFIG / "robots" / "pendulum.urdf")
    monkeypatch.setitem(sys.modules, "robot_descriptions", types.ModuleType("robot_descriptions"))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    assert descriptions.load("pendulum_description").nv == 1
    del module.URDF_PATH
    with pytest.raises(dyntape.ArgumentError, match="no URDF file"):
        descriptions.load("pendulum_description")


def test_robot_descriptions_by_git():
    pytest.importorskip("robot_descriptions")
    try:
        robot = descriptions.load("panda_description")
    except Exception as error:
        if "git" not in type(error).__module__:
            raise
        pytest.skip("its repository is out of reach")
    assert robot.nv == 9


def test_a_name_that_nobody_has():
    with pytest.raises(dyntape.ArgumentError, match='no robot is called "pandaa"'):
        descriptions.load("pandaa")
