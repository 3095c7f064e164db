#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Roll-outs of thousands of quadrupeds from Python, and their Jacobians, beside mujoco.rollout, in one run on the same cores.

    python3 -m venv build/rollouts && build/rollouts/bin/pip install mujoco numpy dyntape-*.whl
    build/rollouts/bin/python tests/bench/peers/mujoco_rollouts.py [WORLDS [STEPS]]

Robot, feet and what the two do alike and otherwise: mujoco_steps.py.  Both begin at the same states of a drop, in the air and on the ground.
"""
import os
import pathlib
import sys

import dyntape
import mujoco
import mujoco.rollout
import numpy as np
from mujoco_steps import quadruped, quickest, states

SCENE = pathlib.Path(__file__).resolve().parents[1] / 'quadruped.info'


def ours_of(theirs, scene):
    """(time, position, w x y z, joints; velocity in the world) -> x."""
    qpos, qvel = theirs
    q = np.concatenate([qpos[:3], qpos[4:7], qpos[3:4], qpos[7:]])
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, qpos[3:7])
    return np.concatenate([q, R.reshape(3, 3).T @ qvel[:3], qvel[3:]])


def slopes_of_theirs(model, found, rounds=3):
    """Seconds a state of mjd_transitionFD, on one core."""
    data, n = mujoco.MjData(model), 2 * model.nv
    A = np.zeros((n, n))

    def all_of_them():
        for qpos, qvel in found:
            data.qpos[:], data.qvel[:] = qpos, qvel
            mujoco.mjd_transitionFD(model, data, 1e-6, 0, A, None, None, None)

    return quickest(all_of_them, len(found), rounds)


def main():
    worlds, steps = (int(x) for x in (sys.argv[1:] + ['4096', '100'][len(sys.argv) - 1:]))
    cores = len(os.sched_getaffinity(0))
    model = quadruped()
    found = states(model, mujoco.MjData(model))
    start = [found[k % len(found)] for k in range(worlds)]

    theirs = np.array([np.concatenate([[0.0], *state]) for state in start])
    with mujoco.rollout.Rollout(nthread=cores) as pool:
        data = [mujoco.MjData(model) for _ in range(cores)]
        seconds = quickest(lambda: pool.rollout(model, data, theirs, nstep=steps), worlds * steps, 3)
    scene = dyntape.Scene(SCENE)
    x0, u = np.array([ours_of(state, scene) for state in start]), np.zeros((steps, scene.nu))
    scene.rollout(x0[:16], u)  # compiled
    own = quickest(lambda: scene.rollout(x0, u), worlds * steps, 3)
    print(f'{worlds} worlds, {steps} steps, {cores} cores, MuJoCo {mujoco.__version__}')
    print(f'a step                   mujoco.rollout {seconds * 1e6:8.3f} us   dyntape {own * 1e6:8.3f} us   ratio {seconds / own:6.1f}')

    some = max(cores, worlds // 64)
    scene.rollout_jacobians(x0[:cores], u[:1])
    slopes = quickest(lambda: scene.rollout_jacobians(x0[:some], u), some * steps, 3)
    differences = slopes_of_theirs(model, found) / cores
    print(f'a step and its Jacobian  mjd_transitionFD {differences * 1e6:6.1f} us   dyntape {slopes * 1e6:8.1f} us   ratio {differences / slopes:6.1f}')
    by_rollouts = seconds * (1 + 2 * model.nv)
    print(f'                         by {1 + 2 * model.nv} roll-outs {by_rollouts * 1e6:8.1f} us                         ratio {by_rollouts / slopes:6.1f}')


main()
