# SPDX-License-Identifier: BSD-3-Clause
"""dyntape.assemble: robots of bodies, in the place of a file; Robot.shapes."""

import copy
import math
import pickle

import dyntape
import numpy as np
import pytest
from conftest import CONFIG

TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def arm():
    return [
        dyntape.Body("base", "free-flyer", mass=3.0, com=[0.1, 0, 0], inertia=np.diag([0.1, 0.2, 0.25])),
        dyntape.Body("hip", parent="base", position=[0.1, 0.2, 0.3], rotation=TURN, axis=[0, 1, 0], mass=1.0, inertia=0.1 * np.eye(3),
                     lower=-1, upper=2, velocity=3, effort=4, armature=0.05, damping=0.1, friction=0.2),
        dyntape.Body("slide", "prismatic", parent="hip", axis=[0.6, 0, 0.8], mass=0.5),
        dyntape.Body("screw", "helical", parent="base", pitch=0.1, mass=0.4, com=[0, 0.1, 0], inertia=0.01 * np.eye(3)),
    ]  # fmt: skip


URDF = """<robot name="arm"><link name="base"><inertial><origin xyz="0.1 0 0"/><mass value="3"/>
  <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.25"/></inertial></link>
<joint name="hip" type="revolute"><parent link="base"/><child link="leg"/><origin xyz="0.1 0.2 0.3" rpy="0 0 1.5707963267948966"/>
  <axis xyz="0 1 0"/><limit lower="-1" upper="2" velocity="3" effort="4"/></joint>
<link name="leg"><inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="leg"/><child link="foot"/><axis xyz="1 0 0"/><limit velocity="3" effort="4"/></joint>
<link name="foot"><inertial><mass value="0.5"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link></robot>"""


def test_the_same_bits_as_of_a_file(random):
    bodies = arm()[:3]
    bodies[1].armature, bodies[2].axis = 0.0, [1, 0, 0]
    ours, read = dyntape.assemble("arm", bodies), dyntape.load_text(URDF, base="floating")
    q, v, tau = read.random(10), random.normal(size=(10, 8)), random.normal(size=(10, 8))
    assert np.array_equal(ours.aba(q, v, tau), read.aba(q, v, tau))
    assert np.array_equal(ours.rnea(q, v, tau, route="generated"), read.rnea(q, v, tau, route="generated"))


def test_what_it_says_of_itself():
    robot = dyntape.assemble("arm", arm(), gravity=[0, 0, -1], left_out=["a thing"], frames={"tip": ("slide", TURN, [0, 0, 1])})
    assert robot.name == "arm" and robot.joints == ["base", "hip", "slide", "screw"]
    assert robot.joint_types == ["free-flyer", "revolute", "prismatic", "helical"]
    assert robot.left_out == ["a thing"] and robot.frames == ["tip"]
    assert robot.lower_limits.tolist()[6:] == [-1, -math.inf, -math.inf]
    assert robot.effort_limits[6] == 4 and robot.velocity_limits[6] == 3
    assert "floating base" in repr(robot)
    without = arm()
    without[1].armature = 0
    q = robot.neutral()
    assert robot.crba(q)[6, 6] == pytest.approx(dyntape.assemble("arm", without).crba(q)[6, 6] + 0.05)


def test_pickles_are_the_same_robot(random):
    mesh = (np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    shapes = [
        dyntape.Shape("hip", "mesh", np.eye(4), np.ones(3), np.array([1, 0, 0, 1.0]), mesh),
        dyntape.Shape("slide", "box", np.eye(4), np.array([1.0, 2, 3])),
    ]
    robot = dyntape.assemble("arm", arm(), shapes=shapes, left_out=["a thing"])
    twin = pickle.loads(pickle.dumps(robot))
    q, v = robot.random(5), random.normal(size=(5, robot.nv))
    assert np.array_equal(twin.aba(q, v, v), robot.aba(q, v, v))
    assert twin.left_out == robot.left_out and copy.deepcopy(robot) is robot
    for other in robot, twin:
        first, second = other.shapes()
        assert (first.frame, first.kind, second.frame, second.kind) == ("hip", "mesh", "slide", "box")
        assert np.array_equal(first.mesh[0], mesh[0]) and np.array_equal(first.mesh[1], mesh[1])
        assert first.color.tolist() == [1, 0, 0, 1] and second.color is None and second.scale.tolist() == [1, 2, 3]


def test_a_problem_of_it_is_solved_and_drawn():
    robot = dyntape.assemble("pendulum", [dyntape.Body("hinge", axis=[0, -1, 0], mass=1.0, com=[0, 0, -1], effort=20.0)],
                             shapes=[dyntape.Shape("hinge", "sphere", np.eye(4), np.full(3, 0.1))])  # fmt: skip
    p = robot.problem(1)
    p.start_at([0.0])
    p.end_at([0.5])
    p.add_cost("torques", lambda s: (s.u**2).sum())
    solution = p.solve(20)
    assert solution.success and solution._repr_html_().startswith("<iframe srcdoc=")


def test_shapes_of_a_file():
    robot = dyntape.load(CONFIG / "robots" / "pendulum.urdf")
    rod, tip = robot.shapes()
    assert (rod.frame, rod.kind, tip.frame, tip.kind) == ("rod", "cylinder", "tip", "sphere")
    assert rod.scale.tolist() == [0.02, 0.02, 1] and rod.placement[:3, 3].tolist() == [0, 0, -0.5]
    assert np.array_equal(tip.placement, np.eye(4)) and tip.color is None


@pytest.mark.parametrize(
    "change, sentence",
    [
        ({"type": "rotary"}, 'joint "hip": expected a type of "revolute", .*got "rotary"'),
        ({"parent": "nobody"}, '"hip" hangs on "nobody"'),
        ({"axis": [0, 0, 2]}, 'axis of joint "hip" has length 2'),
        ({"axis": [0, 0]}, r"expected numbers of shape \(3,\), got \(2,\)"),
        ({"mass": -1.0}, "has the mass -1 kg"),
        ({"mass": math.nan}, "not finite"),
        ({"inertia": np.diag([-1.0, 1, 1])}, "inertia that no body has"),
        ({"inertia": np.array([[1.0, 2, 0], [0, 1, 0], [0, 0, 1]])}, "not symmetric"),
        ({"rotation": 2 * np.eye(3)}, "no rotation"),
        ({"lower": 3.0}, "limits that nothing is within"),
        ({"type": "spherical"}, "only joints about or along one axis have an armature"),
        ({"joint": "base"}, 'two joints are called "base"'),
    ],
)
def test_what_is_no_robot(change, sentence):
    bodies = arm()[:2]
    for name, value in change.items():
        setattr(bodies[1], name, value)
    with pytest.raises(dyntape.ArgumentError, match=sentence):
        dyntape.assemble("arm", bodies)


def test_frames_and_shapes_that_hang_nowhere():
    with pytest.raises(dyntape.ArgumentError, match="no joint; expected one at least"):
        dyntape.assemble("none", [])
    with pytest.raises(dyntape.ArgumentError, match='frame "tip" is on "toe"'):
        dyntape.assemble("arm", arm(), frames={"tip": ("toe", TURN, np.zeros(3))})
    with pytest.raises(dyntape.ArgumentError, match='a shape is on "toe"'):
        dyntape.assemble("arm", arm(), shapes=[dyntape.Shape("toe", "box", np.eye(4), np.ones(3))])
    with pytest.raises(dyntape.ArgumentError, match="expected box, cylinder, sphere or mesh"):
        dyntape.assemble("arm", arm(), shapes=[dyntape.Shape("hip", "cone", np.eye(4), np.ones(3))])


def test_a_scene_of_a_robot_without_a_file(random):
    ball = dyntape.Body("root", "free-flyer", mass=1.0, inertia=0.004 * np.eye(3))
    robot = dyntape.assemble("ball", [ball], contacts=[("root", [0, 0, 0], 0.1)])
    text = """effects { contacts { contact { shapes collision  stiffness 1e4  dissipation 1  friction 0.5 } } }
start { base { position "0 0 0.3" } }
simulation { duration 1  step 1e-3  integrator implicit-velocity }"""
    scene = dyntape.Scene.from_text(text, robot=pickle.loads(pickle.dumps(robot)))
    motion = scene.simulate()
    depth = (9.81 / 1e4) ** (2 / 3)
    assert motion.success and abs(motion.q[-1, 2] - (0.1 - depth)) < 2e-3
    x0 = np.concatenate([scene.q, scene.v])
    assert np.isfinite(scene.rollout(np.stack([x0, x0]), np.zeros((2, 10, 0)))).all()
    assert "<iframe" in motion._repr_html_()


def test_a_scene_of_a_robot_from_a_file():
    robot = dyntape.load(CONFIG / "robots" / "pendulum.urdf")
    scene = dyntape.Scene.from_text("start { q 0.5 }\nsimulation { duration 1 }", robot=robot)
    read = dyntape.Scene.from_text("robot { urdf pendulum.urdf }\nstart { q 0.5 }\nsimulation { duration 1 }", folder=CONFIG / "robots")
    assert np.array_equal(scene.simulate().q, read.simulate().q)
    turning = dyntape.assemble("wheel", [dyntape.Body("axle", "continuous", mass=1.0, inertia=np.eye(3))])
    with pytest.raises(dyntape.ArgumentError, match=r"axle.*\(cos, sin\)"):
        dyntape.Scene.from_text("simulation { duration 1 }", robot=turning)
    with pytest.raises(dyntape.FileError, match="robot"):
        dyntape.Scene.from_text("robot { urdf pendulum.urdf }\nsimulation { duration 1 }", robot=robot)


def test_contacts_that_hang_nowhere():
    with pytest.raises(dyntape.ArgumentError, match='a contact is on "toe"'):
        dyntape.assemble("arm", arm(), contacts=[("toe", [0, 0, 0], 0.1)])
    with pytest.raises(dyntape.ArgumentError, match="no radius"):
        dyntape.assemble("arm", arm(), contacts=[("hip", [0, 0, 0], -0.1)])
