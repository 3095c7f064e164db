#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A step of a quadruped on four compliant feet beside MuJoCo's, in one run.

    python3 -m venv build/mujoco && build/mujoco/bin/pip install mujoco numpy
    ninja -C build bench_steps
    build/mujoco/bin/python tests/bench/peers/mujoco_steps.py build/bin/bench_steps build/bin/dyntape

The robot is the same URDF, read by both, with a free base, joint damping and springs, spheres at the feet and a plane.  In the
air both are the same mechanical system, and their accelerations are compared.  On the ground they are not: MuJoCo's contacts
are rows of a constraint solver with a soft reference (solref), ours are Hunt and Crossley's springs with smooth friction.  MuJoCo steps
by its Euler integrator with implicit joint damping (its default), ours by semi-implicit Euler.
"""
import json
import pathlib
import subprocess
import sys
import time

import mujoco
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
ROBOT = ROOT / 'config/robots/solo12.urdf'
FEET = ('FL_FOOT', 'FR_FOOT', 'HL_FOOT', 'HR_FOOT')
REST = np.array([0, .8, -1.6, 0, .8, -1.6, 0, -.8, 1.6, 0, -.8, 1.6])
STIFFNESS, DAMPING, ARMATURE, RADIUS = 8.0, 0.05, 4.2e-5 * 81, 0.016
STATES = 256


def quadruped():
    text = ROBOT.read_text().replace(
        '</robot>', '<mujoco><compiler fusestatic="false" discardvisual="true" balanceinertia="false"/></mujoco></robot>')
    spec = mujoco.MjSpec.from_string(text)
    base = spec.body('base_link') or spec.worldbody.first_body()
    base.add_freejoint()
    for joint in spec.joints:
        joint.limited = False
    for geom in list(spec.geoms):
        spec.delete(geom)
    for foot in FEET:
        spec.body(foot).add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[RADIUS, 0, 0], contype=1, conaffinity=2, mass=0)
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], contype=2, conaffinity=1)
    spec.option.timestep = 1e-3
    model = spec.compile()
    act_at_joints(model, STIFFNESS, DAMPING, ARMATURE)
    for joint in range(1, model.njnt):
        model.qpos_spring[model.jnt_qposadr[joint]] = REST[model.jnt_dofadr[joint] - 6]
    return model


def act_at_joints(model, stiffness, damping, armature):
    """Newer versions have polynomials, of which these are the linear parts."""
    model.jnt_stiffness.reshape(model.njnt, -1)[1:, 0] = stiffness
    model.dof_damping.reshape(model.nv, -1)[6:, 0] = damping
    model.dof_armature[6:] = armature


def states(model, data):
    """Of the drop, evenly in time."""
    data.qpos[:] = 0
    data.qpos[2], data.qpos[3] = 0.5, 1
    data.qpos[7:] = REST
    data.qvel[:] = 0
    found = []
    for k in range(2000):
        if k % (2000 // STATES) == 0 and len(found) < STATES:
            found.append((data.qpos.copy(), data.qvel.copy()))
        mujoco.mj_step(model, data)
    return found


def quickest(work, count, rounds=30):
    least = np.inf
    for _ in range(rounds):
        begin = time.perf_counter()
        work()
        least = min(least, time.perf_counter() - begin)
    return least / count


def agreement(model, data, dyntape):
    """Largest relative difference of accelerations in the air, without springs and damping, over random states."""
    random = np.random.default_rng(1)
    rows, theirs = [], []
    act_at_joints(model, 0, 0, 0)
    for _ in range(50):
        quaternion = random.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)  # w x y z
        position, joints = np.array([0, 0, 5.0]), random.normal(size=12)
        v = random.normal(size=18)
        data.qpos[:], data.qvel[:] = np.concatenate([position, quaternion, joints]), v
        R = np.zeros(9)
        mujoco.mju_quat2Mat(R, quaternion)
        R = R.reshape(3, 3)
        data.qvel[:3] = R @ v[:3]  # theirs is in the world, ours in the base
        mujoco.mj_forward(model, data)
        a = data.qacc.copy()
        a[:3] = R.T @ a[:3] - np.cross(v[3:6], v[:3])
        theirs.append(a)
        q = np.concatenate([position, quaternion[1:], quaternion[:1], joints])
        rows.append(np.concatenate([q, v, np.zeros(18)]))
    act_at_joints(model, STIFFNESS, DAMPING, ARMATURE)
    names = [f'q{i}' for i in range(19)] + [f'v{i}' for i in range(18)] + [f'tau{i}' for i in range(18)]
    table = ','.join(names) + '\n' + '\n'.join(','.join(repr(float(x)) for x in row) for row in rows) + '\n'
    done = subprocess.run([dyntape, 'eval', str(ROBOT), '--base', 'floating', '--function', 'aba', '--route', 'analytic', '--input', '-', '--output', '-'],
                          input=table, capture_output=True, text=True, check=True)
    ours = np.array([[float(x) for x in line.split(',')] for line in done.stdout.splitlines()[1:]])[:, -18:]
    return np.max(np.abs(ours - theirs) / np.max(np.abs(theirs), axis=1, keepdims=True))


def main():
    bench, dyntape = sys.argv[1:]
    model = quadruped()
    data = mujoco.MjData(model)
    print(f'solo12, free base, MuJoCo {mujoco.__version__}')
    print(f'accelerations in the air agree to {agreement(model, data, dyntape):.1e}')
    found = states(model, data)

    def steps():
        for q, v in found:
            data.qpos[:], data.qvel[:] = q, v
            mujoco.mj_step(model, data)

    n = 2 * model.nv
    A = np.zeros((n, n))

    def jacobians():
        for q, v in found[::16]:
            data.qpos[:], data.qvel[:] = q, v
            mujoco.mjd_transitionFD(model, data, 1e-6, True, A, None, None, None)

    rows = []
    scene = ROOT / 'tests/bench/quadruped.info'
    for _ in range(3):  # in turn, so that what else the machine does hits both
        theirs = quickest(steps, STATES), quickest(jacobians, len(found[::16]), 3)
        ours = json.loads(subprocess.run([bench, str(scene), 'semi-implicit-euler'], capture_output=True, text=True, check=True).stdout)
        rows.append((*theirs, ours['step'], ours['jacobians'], ours['lanes']))
    step, transition, own, own_jacobians, lanes = np.min(rows, axis=0)
    print(f'{"":24}{"MuJoCo":>12}{"dyntape":>12}{"ratio":>9}')
    for name, a, b in (('step [us]', step, own), ('step and Jacobians [us]', transition, own_jacobians), ('step, of 256 states [us]', step, lanes)):
        print(f'{name:24}{1e6 * a:12.2f}{1e6 * b:12.2f}{b / a:9.3f}')
    print(f'at 1 kHz: {1e-3 / own:.0f} times real time on one core, {1e-3 / lanes:.0f} in lanes')


if __name__ == '__main__':
    main()
