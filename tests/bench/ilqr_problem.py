#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What an iteration of iLQR takes, by dyntape and by Crocoddyl, in one run.

    python3 -m venv build/crocoddyl
    build/crocoddyl/bin/pip install crocoddyl==3.1.0 libpinocchio==3.8.0 cmeel-urdfdom==4.0.1 cmeel-tinyxml2==10.0.0
    ninja -C build bench_ilqr
    build/crocoddyl/bin/python tests/bench/ilqr_problem.py build/bin

A seven-joint arm is led from rest to a configuration within 1 s, 100 steps by semi-implicit Euler and by the classical
Runge-Kutta scheme; costs are squares of what is missed and of torques, the Hessian is Gauss-Newton's, the start is a roll-out of the
torques that hold the arm.  Both find the same cost, to 13 digits.  One thread each; seconds are the quickest solve by its
iterations.  Crocoddyl 3.2.1 crashes in residuals of frames; 3.1.0 does not.
"""
import json
import pathlib
import subprocess
import sys
import time

import crocoddyl
import numpy as np
import pinocchio

ROBOT = pathlib.Path(__file__).resolve().parent.parent.parent / 'config/robots/panda.urdf'
START, GOAL = [0, -.5, 0, -2, 0, 1.5, .5], [1, .5, -.5, -1.2, .5, 2, -.5]
ANGLE, RATE, TORQUE, END = 10, .1, 1e-3, 100  # weights, those of ilqr.cpp
N, TIMES = 100, 40


def arm():
    whole = pinocchio.buildModelFromUrdf(str(ROBOT))
    fingers = [whole.getJointId(f'panda_finger_joint{i}') for i in (1, 2)]
    return pinocchio.buildReducedModel(whole, fingers, pinocchio.neutral(whole))


def problem(scheme):
    state = crocoddyl.StateMultibody(arm())
    n = state.nv

    def model(at_end):
        costs = crocoddyl.CostModelSum(state)
        weights = 2 * np.array([ANGLE] * n + [RATE] * n)  # its activations are halves of squares
        missed = crocoddyl.CostModelResidual(state, crocoddyl.ActivationModelWeightedQuad(weights),
                                             crocoddyl.ResidualModelState(state, np.array(GOAL + [0] * n), n))
        costs.addCost('missed', missed, END if at_end else 1)
        if not at_end:
            costs.addCost('torques', crocoddyl.CostModelResidual(state, crocoddyl.ResidualModelControl(state, n)),
                          2 * TORQUE)
        return crocoddyl.DifferentialActionModelFreeFwdDynamics(state, crocoddyl.ActuationModelFull(state), costs)

    def step():
        if scheme == 'euler':
            return crocoddyl.IntegratedActionModelEuler(model(False), 1 / N)
        return crocoddyl.IntegratedActionModelRK(model(False), crocoddyl.RKType.four, 1 / N)

    start = np.array(START + [0] * n)
    return start, crocoddyl.ShootingProblem(start, [step() for _ in range(N)],
                                            crocoddyl.IntegratedActionModelEuler(model(True), 0))


def crocoddyls(scheme):
    start, shooting = problem(scheme)
    best = None
    for _ in range(TIMES):
        solver = crocoddyl.SolverFDDP(shooting)
        solver.th_stop = 1e-12
        controls = shooting.quasiStatic([start] * N)
        states = shooting.rollout(controls)
        begin = time.perf_counter()
        solved = solver.solve(states, controls, 100, False)
        seconds = time.perf_counter() - begin
        if best is None or seconds < best['seconds']:
            best = {'status': 'solved' if solved else 'failed', 'iterations': solver.iter + 1,
                    'cost': solver.cost, 'seconds': seconds}
    return best


def main():
    bench = pathlib.Path(sys.argv[1]) / 'bench_ilqr'
    out = subprocess.run([bench, ROBOT, str(N), str(5 * TIMES)], check=True, capture_output=True, text=True).stdout
    ours = {row['scheme']: row for row in map(json.loads, out.splitlines())}
    print('| scheme | | iterations | cost | an iteration | of Crocoddyl | solve |')
    print('|---|---|--:|--:|--:|--:|--:|')
    for scheme in ('euler', 'rk4'):
        peer = crocoddyls(scheme)
        assert abs(peer['cost'] - ours[scheme]['cost']) < 1e-9 * peer['cost'], (peer, ours[scheme])
        each = {name: row['seconds'] / row['iterations'] for name, row in (('dyntape', ours[scheme]), ('Crocoddyl', peer))}
        for name, row in (('dyntape', ours[scheme]), ('Crocoddyl', peer)):
            print(f"| {scheme} | {name} | {row['iterations']} | {row['cost']:.10f} | {1e6 * each[name]:.0f} us | "
                  f"{each[name] / each['Crocoddyl']:.2f} | {1e3 * row['seconds']:.2f} ms |")


if __name__ == '__main__':
    main()
