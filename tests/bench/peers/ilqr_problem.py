#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What an iteration of iLQR takes, by dyntape and by Crocoddyl, in one run.

    python3 -m venv build/crocoddyl
    build/crocoddyl/bin/pip install crocoddyl==3.1.0 libpinocchio==3.8.0 cmeel-urdfdom==4.0.1 cmeel-tinyxml2==10.0.0
    ninja -C build bench_ilqr
    build/crocoddyl/bin/python tests/bench/peers/ilqr_problem.py build/bin

An arm of seven joints is led to a configuration within 1 s, and a quadruped on four feet, held by constraints of its dynamics, to another pose
of its trunk: 100 steps by semi-implicit Euler, the arm by the classical Runge-Kutta scheme as well.  Costs are squares of what is missed
and of torques, the Hessian is Gauss-Newton's, the start a roll-out of the torques that hold the robot.  Both find the same cost.
One thread each; seconds are processor time of the quickest solve by its iterations.  Crocoddyl 3.2.1 crashes in residuals of frames; 3.1.0 does not.
"""
import json
import pathlib
import subprocess
import sys
import time

import crocoddyl
import numpy as np
import pinocchio

ROBOTS = pathlib.Path(__file__).resolve().parents[3] / 'config/robots'
ANGLE, RATE, TORQUE, END = 10, .1, 1e-3, 100  # weights, those of ilqr.cpp
N, TIMES = 100, 40


class Arm:
    file = ROBOTS / 'panda.urdf'
    schemes = 'euler', 'rk4'

    def __init__(self):
        whole = pinocchio.buildModelFromUrdf(str(self.file))
        fingers = [whole.getJointId(f'panda_finger_joint{i}') for i in (1, 2)]
        self.state = crocoddyl.StateMultibody(pinocchio.buildReducedModel(whole, fingers, pinocchio.neutral(whole)))
        self.actuation = crocoddyl.ActuationModelFull(self.state)
        self.start = np.array([0, -.5, 0, -2, 0, 1.5, .5] + [0] * 7)
        self.goal = np.array([1, .5, -.5, -1.2, .5, 2, -.5] + [0] * 7)

    def dynamics(self, costs):
        return crocoddyl.DifferentialActionModelFreeFwdDynamics(self.state, self.actuation, costs)


class Quadruped:
    file = ROBOTS / 'solo12.urdf'
    schemes = 'euler',

    def __init__(self):
        self.model = pinocchio.buildModelFromUrdf(str(self.file), pinocchio.JointModelFreeFlyer())
        self.state = crocoddyl.StateMultibody(self.model)
        self.actuation = crocoddyl.ActuationModelFloatingBase(self.state)
        q = np.array([0, 0, .24, 0, 0, 0, 1] + [0, .8, -1.6] * 2 + [0, -.8, 1.6] * 2)
        self.start = np.concatenate([q, np.zeros(18)])
        self.goal = self.start.copy()
        self.goal[0] += .02
        self.goal[2] -= .04
        data = self.model.createData()
        pinocchio.framesForwardKinematics(self.model, data, q)
        feet = [self.model.getFrameId(f'{leg}_FOOT') for leg in ('FL', 'FR', 'HL', 'HR')]
        self.feet = [(foot, data.oMf[foot].translation.copy()) for foot in feet]

    def dynamics(self, costs):
        contacts = crocoddyl.ContactModelMultiple(self.state, self.actuation.nu)
        for foot, place in self.feet:
            contacts.addContact(str(foot), crocoddyl.ContactModel3D(self.state, foot, place, pinocchio.LOCAL,
                                                                    self.actuation.nu, np.array([100., 20.])))
        return crocoddyl.DifferentialActionModelContactFwdDynamics(self.state, self.actuation, contacts, costs, 0., True)


def shooting(robot, scheme):
    state, n_u = robot.state, robot.actuation.nu

    def model(at_end):
        costs = crocoddyl.CostModelSum(state, n_u)
        weights = 2 * np.array([ANGLE] * state.nv + [RATE] * state.nv)  # its activations are halves of squares
        missed = crocoddyl.CostModelResidual(state, crocoddyl.ActivationModelWeightedQuad(weights),
                                             crocoddyl.ResidualModelState(state, robot.goal, n_u))
        costs.addCost('missed', missed, END if at_end else 1)
        if not at_end:
            costs.addCost('torques', crocoddyl.CostModelResidual(state, crocoddyl.ResidualModelControl(state, n_u)), 2 * TORQUE)
        return robot.dynamics(costs)

    def step():
        if scheme == 'euler':
            return crocoddyl.IntegratedActionModelEuler(model(False), 1 / N)
        return crocoddyl.IntegratedActionModelRK(model(False), crocoddyl.RKType.four, 1 / N)

    return crocoddyl.ShootingProblem(robot.start, [step() for _ in range(N)],
                                     crocoddyl.IntegratedActionModelEuler(model(True), 0))


def crocoddyls(robot, scheme):
    problem = shooting(robot, scheme)
    best = None
    for _ in range(TIMES):
        solver = crocoddyl.SolverFDDP(problem)
        solver.th_stop = 1e-12
        controls = problem.quasiStatic([robot.start] * N)
        states = problem.rollout(controls)
        begin = time.thread_time()
        solver.solve(states, controls, 100, False)
        seconds = time.thread_time() - begin
        if best is None or seconds < best['seconds']:
            best = {'iterations': solver.iter + 1, 'cost': solver.cost, 'seconds': seconds}
    return best


def main():
    bench = pathlib.Path(sys.argv[1]) / 'bench_ilqr'
    print('| | steps | | iterations | cost | an iteration | of Crocoddyl | solve |')
    print('|---|---|---|--:|--:|--:|--:|--:|')
    for robot in Arm(), Quadruped():
        name = type(robot).__name__.lower()
        out = subprocess.run([bench, name, robot.file, str(N), str(5 * TIMES)], check=True, capture_output=True, text=True)
        ours = {row['scheme']: row for row in map(json.loads, out.stdout.splitlines())}
        for scheme in robot.schemes:
            rows = {'dyntape': ours[scheme], 'Crocoddyl': crocoddyls(robot, scheme)}
            assert abs(rows['dyntape']['cost'] / rows['Crocoddyl']['cost'] - 1) < 1e-8, rows
            each = {who: row['seconds'] / row['iterations'] for who, row in rows.items()}
            for who, row in rows.items():
                print(f"| {name} | {scheme} | {who} | {row['iterations']} | {row['cost']:.9f} | {1e6 * each[who]:.0f} us | "
                      f"{each[who] / each['Crocoddyl']:.2f} | {1e3 * row['seconds']:.2f} ms |")


if __name__ == '__main__':
    main()
