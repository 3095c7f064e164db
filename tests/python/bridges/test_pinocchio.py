# SPDX-License-Identifier: BSD-3-Clause
"""dyntape.bridges.pinocchio: its models, its states, its numbers."""

import dyntape
import numpy as np
import pytest
from conftest import CONFIG, page_section

pin = pytest.importorskip("pinocchio")
from dyntape.bridges import pinocchio as dp  # noqa: E402


def of_all_joints():
    """A tree with every joint that is read, in random places with random inertias."""
    pin.seed(5)
    unit = np.array([0.48, 0.6, 0.64])
    composite = pin.JointModelComposite()
    composite.addJoint(pin.JointModelRX(), pin.SE3.Random())
    composite.addJoint(pin.JointModelPrismaticUnaligned(unit), pin.SE3.Random())
    composite.addJoint(pin.JointModelSpherical(), pin.SE3.Random())
    joints = [
        pin.JointModelFreeFlyer(), pin.JointModelRY(), pin.JointModelRevoluteUnaligned(unit), pin.JointModelRUBZ(), pin.JointModelPX(),
        pin.JointModelPrismaticUnaligned(unit), pin.JointModelSpherical(),
        pin.JointModelPlanar(), pin.JointModelTranslation(), pin.JointModelSphericalZYX(), composite,
    ]  # fmt: skip
    for name in "JointModelHX", "JointModelHelicalUnaligned", "JointModelUniversal":
        if hasattr(pin, name):
            arguments = {"JointModelHX": (0.3,), "JointModelHelicalUnaligned": (unit, 0.2), "JointModelUniversal": (unit, np.array([0.8, 0, -0.6]))}
            joints.append(getattr(pin, name)(*arguments[name]))
    model = pin.Model()
    for k, joint in enumerate(joints):
        parent = 0 if k == 0 else k if k % 4 else 1  # depth first, as Pinocchio's crba needs it
        index = model.addJoint(parent, joint, pin.SE3.Random(), f"joint_{k}")
        model.appendBodyToJoint(index, pin.Inertia.Random(), pin.SE3.Random())
        model.addFrame(pin.Frame(f"hand_{k}", index, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    model.name = "all"
    return model


MODELS = {
    "humanoid": lambda: pin.buildSampleModelHumanoid(),
    "manipulator": lambda: pin.buildSampleModelManipulator(),
    "panda": lambda: pin.buildModelFromUrdf(str(CONFIG / "robots" / "panda.urdf")),
    "solo": lambda: pin.buildModelFromUrdf(str(CONFIG / "robots" / "solo12.urdf"), pin.JointModelFreeFlyer()),
    "all": of_all_joints,
}


def random_states(model, random, count):
    lower, upper = np.full(model.nq, -1.0), np.full(model.nq, 1.0)
    model.lowerPositionLimit, model.upperPositionLimit = lower, upper
    q = np.array([pin.randomConfiguration(model) for _ in range(count)])
    return q, random.normal(size=(count, model.nv)), random.normal(size=(count, model.nv))


@pytest.mark.parametrize("name", MODELS)
def test_dynamics_and_frames_are_pinocchios(name, random):
    model = MODELS[name]()
    singles = [joint.idx_v for joint in model.joints if joint.nv == 1]
    armature = np.zeros(model.nv)
    armature[singles] = random.uniform(0, 0.1, len(singles))
    model.armature = armature
    robot, data = dp.load(model), model.createData()
    assert (robot.nq, robot.nv, robot.name, robot.left_out) == (model.nq, model.nv, model.name, [])
    pin.seed(3)
    q, v, a = random_states(model, random, 20)
    tau = random.normal(size=v.shape)
    ours = robot.aba(q, v, tau), robot.rnea(q, v, a), robot.crba(q)
    for k in range(len(q)):
        theirs = pin.aba(model, data, q[k], v[k], tau[k]), pin.rnea(model, data, q[k], v[k], a[k]), pin.crba(model, data, q[k])
        for mine, their, what in zip(ours, theirs, ("aba", "rnea", "crba")):
            their = np.triu(their) + np.triu(their, 1).T if what == "crba" else their
            assert np.abs(mine[k] - their).max() <= 1e-12 * np.abs(their).max(), what
    pin.framesForwardKinematics(model, data, q[0])
    for i, frame in enumerate(model.frames):
        if frame.name in robot.frames and model.getFrameId(frame.name) == i and model.existFrame(frame.name, frame.type):
            placed = robot.frame_placement(q[0], frame=frame.name)
            if sum(other.name == frame.name for other in model.frames) == 1:
                np.testing.assert_allclose(placed.p, data.oMf[i].translation, atol=1e-12)
                np.testing.assert_allclose(placed.R, data.oMf[i].rotation, atol=1e-12)


@pytest.mark.parametrize("name", ["panda", "solo"])
def test_it_is_the_robot_that_dyntape_reads_itself(name):
    model = MODELS[name]()
    file = "panda.urdf" if name == "panda" else "solo12.urdf"
    ours = dyntape.load(CONFIG / "robots" / file, base="floating" if name == "solo" else "fixed")
    theirs = dp.load(model)
    assert theirs.joints == ours.joints and set(ours.frames) <= set(theirs.frames)
    for limit in "lower_limits", "upper_limits", "velocity_limits", "effort_limits":
        np.testing.assert_allclose(getattr(theirs, limit), getattr(ours, limit))


def test_what_has_no_counterpart():
    model = pin.buildSampleModelHumanoid()
    armature = np.zeros(model.nv)
    armature[:6] = 1
    model.armature = armature
    assert dp.load(model).left_out == ['armature of joint "root_joint", which has several axes']
    with pytest.raises(dyntape.ArgumentError, match="expected a pinocchio.Model, got str"):
        dp.load("robot.urdf")
    with pytest.raises(dyntape.ArgumentError, match="no joint"):
        dp.load(pin.Model())
    if hasattr(pin, "JointModelEllipsoid"):
        odd = pin.Model()
        odd.addJoint(0, pin.JointModelEllipsoid(1.0, 2.0, 3.0), pin.SE3.Identity(), "egg")
        with pytest.raises(dyntape.ArgumentError, match='joint "egg": dyntape has no JointModelEllipsoid'):
            dp.load(odd)


def test_the_page():
    names = {}
    exec(page_section("Robots from Pinocchio"), names)
    theirs = pin.rnea(names["model"], names["model"].createData(), names["q"], names["v"], names["v"])
    np.testing.assert_allclose(names["tau"], theirs, atol=1e-10)
    assert names["arm"].nv == 2
