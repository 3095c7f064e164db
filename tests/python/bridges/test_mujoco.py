# SPDX-License-Identifier: BSD-3-Clause
"""dyntape.bridges.mujoco: MuJoCo's own model files, accelerations beside MuJoCo's, and what is left out of each."""

import importlib.metadata
import pathlib
import pickle

import dyntape
import numpy as np
import pytest
from conftest import page_section

mj = pytest.importorskip("mujoco")
from dyntape.bridges import mujoco as dm  # noqa: E402

# Package: model files, each with a word of every sentence of what is left out of it.
SUITE, ENVS = "dm_control/suite", "gymnasium/envs/mujoco/assets"
MODELS = {
    "dm-control": {
        f"{SUITE}/acrobot.xml": [],
        f"{SUITE}/cheetah.xml": ["actuators", "sensor"],
        f"{SUITE}/dog.xml": ["actuators"],
        f"{SUITE}/fish.xml": ["actuators", "tendons", "fluid"],
        f"{SUITE}/hopper.xml": ["actuators"],
        f"{SUITE}/humanoid.xml": ["actuators", "sensors"],
        f"{SUITE}/humanoid_CMU.xml": ["actuators", "exclusions"],
        f"{SUITE}/manipulator.xml": ["actuators", "tendons", "equality constraint"],
        f"{SUITE}/quadruped.xml": ["actuators", "tendons", "equality constraints"],
        f"{SUITE}/swimmer.xml": [],
        f"{SUITE}/stacker.xml": [],
        "dm_control/locomotion/walkers/assets/rodent.xml": ["tendons"],
        "dm_control/locomotion/walkers/assets/fruitfly_v2/fruitfly.xml": ["fluid", "tendons"],
        "dm_control/mujoco/testing/assets/model_with_ball_joints.xml": [],
        "dm_control/mujoco/testing/assets/arm.xml": [],
    },
    "gymnasium": {
        f"{ENVS}/{name}.xml": ["actuator"]
        for name in ("ant", "half_cheetah", "humanoid", "humanoidstandup", "inverted_double_pendulum", "pusher_v5", "reacher", "walker2d_v5")
    },
    "gymnasium-robotics": {
        "gymnasium_robotics/envs/assets/hand/reach.xml": ["actuators", "tendons"],
        "gymnasium_robotics/envs/assets/fetch/reach.xml": ["mocap", "equality constraint"],
        "gymnasium_robotics/envs/assets/adroit_hand/adroit_pen.xml": ["actuators", "tendons"],
    },
}


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    """MuJoCo writes its warnings to a file where it is."""
    monkeypatch.chdir(tmp_path)


def path_of(package, name):
    try:
        listed = importlib.metadata.files(package) or []
    except importlib.metadata.PackageNotFoundError:
        pytest.skip(f"{package} is not installed")
    found = [entry for entry in listed if entry.as_posix() == name]
    if not found:
        pytest.skip(f"this version of {package} has no {name}")
    return pathlib.Path(str(found[0].locate()))


def random_states(m, random, count):
    """Configurations around the reference with random rotations, and velocities."""
    qpos = m.qpos0 + 0.5 * random.normal(size=(count, m.nq))
    for j in range(m.njnt):
        if m.jnt_type[j] in (mj.mjtJoint.mjJNT_FREE, mj.mjtJoint.mjJNT_BALL):
            i = m.jnt_qposadr[j] + (3 if m.jnt_type[j] == mj.mjtJoint.mjJNT_FREE else 0)
            quaternion = random.normal(size=(count, 4))
            qpos[:, i : i + 4] = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    return qpos, random.normal(size=(count, m.nv))


def without(m, *flags):
    for flag in flags:
        m.opt.disableflags |= int(getattr(mj.mjtDisableBit, f"mjDSBL_{flag}"))
    return m


def clear_what_is_left_out(m):
    """Armature of joints with several axes, and what carries weight."""
    for j in range(m.njnt):
        if m.jnt_type[j] in (mj.mjtJoint.mjJNT_FREE, mj.mjtJoint.mjJNT_BALL):
            width = 6 if m.jnt_type[j] == mj.mjtJoint.mjJNT_FREE else 3
            m.dof_armature[m.jnt_dofadr[j] :][:width] = 0
    for name in ("actuator_armature", "tendon_armature"):
        if hasattr(m, name):
            getattr(m, name)[:] = 0


CASES = [(package, name) for package, names in MODELS.items() for name in names]


@pytest.mark.parametrize("package, name", CASES, ids=[pathlib.Path(name).stem for _, name in CASES])
def test_accelerations_are_mujocos(package, name, random):
    path = path_of(package, name)
    robot = dm.load(path)
    for word in MODELS[package][name]:
        assert any(word in sentence for sentence in robot.left_out), (word, robot.left_out)
    m = without(mj.MjModel.from_xml_path(str(path)), "CONTACT", "CONSTRAINT", "ACTUATION")
    clear_what_is_left_out(m)
    data = mj.MjData(m)
    assert (robot.nq, robot.nv) == (m.nq, m.nv)
    qpos, qvel = random_states(m, random, 5)
    applied = random.normal(size=qvel.shape)
    theirs, passive = np.empty_like(qvel), np.empty_like(qvel)
    for k in range(len(qpos)):
        data.qpos, data.qvel, data.qfrc_applied = qpos[k], qvel[k], applied[k]
        mj.mj_forward(m, data)
        theirs[k], passive[k] = data.qacc, data.qfrc_passive
    q, v = robot.from_mujoco(qpos, qvel)
    if not ({"tendon", "fluid", "spring", "damping"} & set(" ".join(robot.left_out).replace("s", " ").split())) and not m.ntendon:
        np.testing.assert_allclose(robot.forces_to_mujoco(q, robot.passive(q, v)), passive, rtol=1e-10, atol=1e-10 * (1 + abs(passive).max()))
    ours = robot.aba(q, v, robot.forces_from_mujoco(qpos, applied + passive))
    scale = np.abs(theirs).max(axis=1, keepdims=True)
    assert (np.abs(robot.accelerations_to_mujoco(q, v, ours) - theirs) / scale).max() < 1e-10
    back = robot.accelerations_from_mujoco(qpos, qvel, theirs)
    np.testing.assert_allclose(robot.accelerations_to_mujoco(q, v, back), theirs, rtol=1e-12, atol=1e-12 * scale.max())
    for mine, given in zip(robot.to_mujoco(q, v), (qpos, qvel)):
        np.testing.assert_allclose(mine, given, atol=1e-13)


@pytest.mark.parametrize("package, name", CASES[5:8], ids=[pathlib.Path(name).stem for _, name in CASES[5:8]])
def test_bodies_stand_where_mujocos_do(package, name, random):
    path = path_of(package, name)
    robot, m = dm.load(path), mj.MjModel.from_xml_path(str(path))
    data = mj.MjData(m)
    qpos, qvel = random_states(m, random, 1)
    data.qpos = qpos[0]
    mj.mj_kinematics(m, data)
    q, _ = robot.from_mujoco(qpos[0], qvel[0])
    for kind, count, positions, matrices in ("BODY", m.nbody, data.xpos, data.xmat), ("SITE", m.nsite, data.site_xpos, data.site_xmat):
        for i in range(count):
            frame = mj.mj_id2name(m, getattr(mj.mjtObj, f"mjOBJ_{kind}"), i)
            if frame not in robot.frames or (kind == "SITE" and f"{frame}_site" in robot.frames):
                continue
            placed = robot.frame_placement(q, frame=frame)
            np.testing.assert_allclose(placed.p, positions[i], atol=1e-12)
            np.testing.assert_allclose(placed.R, matrices[i].reshape(3, 3), atol=1e-12)


TOY = """
<mujoco model="toy">
  <option gravity="0 0 -3"/>
  <worldbody>
    <geom type="plane" size="1 1 1"/>
    <body name="cart" pos="0.1 0.2 0.3" quat="0.9 0.1 0.2 0.3">
      <joint name="x" type="slide" axis="1 1 0" ref="0.4" stiffness="3" springref="0.1" damping="0.2" range="-1 2" limited="true"/>
      <joint name="turn" axis="0 1 1" pos="0.1 0 0.2" ref="30" armature="0.3" frictionloss="0.7"/>
      <joint name="twist" axis="1 0 0" pos="0 0.3 0"/>
      <geom name="box" type="box" size="0.1 0.2 0.3" mass="1.5" pos="0.1 0 0"/>
      <site name="cart" pos="0 0 0.1"/>
      <body name="bracket" pos="0 0.1 0.4" quat="1 0 1 0">
        <geom type="capsule" size="0.05 0.2" mass="0.4"/>
        <body name="ball" pos="0.2 0 0">
          <joint name="socket" type="ball" pos="0 0.1 0" damping="0.1"/>
          <geom type="ellipsoid" size="0.1 0.2 0.1" mass="0.7"/>
        </body>
      </body>
    </body>
    <body name="free" pos="1 1 1"><freejoint name="float"/><geom type="cylinder" size="0.1 0.2" mass="2" pos="0.05 0 0"/></body>
  </worldbody>
  <actuator><motor joint="turn" name="drive"/></actuator>
</mujoco>"""


@pytest.fixture
def toy():
    return mj.MjModel.from_xml_string(TOY)


def test_every_kind_of_joint_and_what_comes_along(toy, random):
    robot = dm.load(toy)
    assert robot.name == "toy"
    assert robot.joints == ["x", "turn", "twist", "socket", "float"]
    assert robot.joint_types == ["prismatic", "revolute", "revolute", "spherical", "free-flyer"]
    assert robot.gravity_vector.tolist() == [0, 0, -3]
    np.testing.assert_allclose(robot.lower_limits[0], -1.4)
    np.testing.assert_allclose(robot.upper_limits[0], 1.6)
    assert {"world", "cart", "cart_site", "bracket", "ball", "free"} == set(robot.frames)
    assert robot.left_out == [
        "1 actuator: drive",
        "contacts of 1 geom of the kind ellipsoid",
        "contacts of 1 geom of the kind plane",
        "contacts of 3 other geoms with one another: robot.contacts has where they touch a plane",
    ]
    assert len(robot.contacts) == 8 + 2 + 16
    data = mj.MjData(without(toy, "CONTACT", "CONSTRAINT"))
    qpos, qvel = random_states(toy, random, 20)
    q, v = robot.from_mujoco(qpos, qvel)
    for k in range(20):
        data.qpos, data.qvel = qpos[k], qvel[k]
        mj.mj_forward(toy, data)
        a = robot.aba(q[k], v[k], robot.passive(q[k], v[k]))
        np.testing.assert_allclose(robot.accelerations_to_mujoco(q[k], v[k], a), data.qacc, rtol=1e-10, atol=1e-10)


def test_shapes_and_contact_points_stand_where_geoms_do(toy, random):
    robot, data = dm.load(toy), mj.MjData(toy)
    qpos, qvel = random_states(toy, random, 1)
    data.qpos = qpos[0]
    mj.mj_kinematics(toy, data)
    q, _ = robot.from_mujoco(qpos[0], qvel[0])
    box = mj.mj_name2id(toy, mj.mjtObj.mjOBJ_GEOM, "box")
    shape = next(shape for shape in robot.shapes() if shape.kind == "box")
    placed = robot.frame_placement(q, frame=shape.frame)
    np.testing.assert_allclose(placed.p + placed.R @ shape.placement[:3, 3], data.geom_xpos[box], atol=1e-12)
    np.testing.assert_allclose(shape.scale, [0.2, 0.4, 0.6])
    corners = [placed.p + placed.R @ point.position for point in robot.contacts if point.geom == "box"]
    np.testing.assert_allclose(np.mean(corners, axis=0), data.geom_xpos[box], atol=1e-12)


def test_it_is_a_robot_like_others(toy, random):
    robot = dm.load(toy)
    assert isinstance(robot, dyntape.Robot)
    twin = pickle.loads(pickle.dumps(robot))
    q, v = robot.from_mujoco(*random_states(toy, random, 3))
    assert np.array_equal(twin.aba(q, v, v), robot.aba(q, v, v))
    assert twin.contacts[0].geom == robot.contacts[0].geom and twin.left_out == robot.left_out
    assert np.array_equal(twin.to_mujoco(q, v)[0], robot.to_mujoco(q, v)[0])
    f = dyntape.record(lambda z: robot.aba(z[:14], z[14:], robot.passive(z[:14], z[14:])), robot.nq + robot.nv, x0=[*q[0], *v[0]])
    np.testing.assert_allclose(f([*q[0], *v[0]]), robot.aba(q[0], v[0], robot.passive(q[0], v[0])), rtol=1e-10)


def test_specs_and_what_cannot_be_read(tmp_path):
    assert dm.load(mj.MjSpec.from_string(TOY)).nv == 12
    (tmp_path / "bad.xml").write_text("<mujoco><worldbody><body><joint/></body></worldbody></mujoco>")
    with pytest.raises(dyntape.FileError, match="bad.xml: MuJoCo cannot read it: .*mass"):
        dm.load(tmp_path / "bad.xml")
    with pytest.raises(dyntape.ArgumentError, match="no joint"):
        dm.load(mj.MjModel.from_xml_string("<mujoco/>"))


def test_the_page(tmp_path):
    (tmp_path / "humanoid.xml").write_text(TOY)
    names = {}
    exec(page_section("Robots from MuJoCo"), names)
    assert names["robot"].nv == 12 and np.isfinite(names["data"].qacc).all()
    assert names["motion"].q.shape[1] == names["robot"].nq and np.isfinite(names["motion"].q).all()


def test_a_box_comes_to_rest_on_its_corners_in_a_scene():
    box = mj.MjModel.from_xml_string("""<mujoco><worldbody><geom type="plane" size="1 1 1"/>
      <body name="box" pos="0 0 0.2"><freejoint/><geom type="box" size="0.1 0.1 0.05" mass="1"/></body></worldbody></mujoco>""")
    text = """effects { contacts { contact { shapes collision  stiffness 1e4  dissipation 1  friction 0.7 } } }
      start { base { position "0 0 0.1" } }
      simulation { duration 1  step 2e-4  integrator implicit-velocity }"""
    motion = dyntape.Scene.from_text(text, robot=dm.load(box)).simulate()
    depth = (9.81 / 4e4) ** (2 / 3)  # of four corners that carry it
    assert motion.success and abs(motion.q[-1, 2] - (0.05 - depth)) < 1e-3
