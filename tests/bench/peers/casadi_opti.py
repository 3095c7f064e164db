#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""One Opti problem of CasADi's, its dynamics by dyntape and by CasADi itself: from nothing to the solution.

    tools/build --python && ninja -C build bench_kernels
    PYTHONPATH=build/python build/python_environment/bin/python tests/bench/peers/casadi_opti.py build/bin

The arm of arm_problem.py in its forward form, trapezoids on 50 intervals, exact Hessians, by CasADi's Ipopt each time:
    dyntape          robot.casadi('aba'), machine code in this process
    CasADi           its own symbols, in its virtual machine
    CasADi, jit      the same with jit, gcc -O1
`made`: until the function is there; `first`, `again`: solves, the first with what CasADi prepares.  Prints a line each.
"""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

import casadi as ca
import numpy as np

import dyntape
from arm_problem import GOAL, LOCKED, N, ROBOT, SPEED, START
from casadi_robot import Robot, aba

JIT = {'jit': True, 'compiler': 'shell', 'jit_options': {'compiler': 'gcc', 'flags': ['-O1', '-march=native']}}


def problem(dynamics, robot, options):
    n, h, opti = robot.nv, 1 / N, ca.Opti()
    Q, V, U = (opti.variable(n, N + 1) for _ in range(3))
    A = dynamics.map(N + 1)(Q, V, U * np.tile(robot.effort_limits[:, None], (1, N + 1)))
    opti.subject_to(ca.vec(Q[:, 1:] - Q[:, :-1] - h / 2 * (V[:, 1:] + V[:, :-1])) == 0)
    opti.subject_to(ca.vec(V[:, 1:] - V[:, :-1] - h / 2 * (A[:, 1:] + A[:, :-1])) == 0)
    opti.subject_to([Q[:, 0] == START, Q[:, N] == GOAL, V[:, 0] == 0, V[:, N] == 0])
    lower, upper = (np.tile(x[:, None], (1, N - 1)) for x in (robot.lower_limits, robot.upper_limits))
    opti.subject_to(opti.bounded(lower, Q[:, 1:-1], upper))
    opti.subject_to(opti.bounded(-SPEED, ca.vec(V[:, 1:-1]), SPEED))
    opti.subject_to(opti.bounded(-1, ca.vec(U), 1))
    weights = np.full(N + 1, h)
    weights[[0, -1]] /= 2
    opti.minimize(ca.dot(ca.sum1(U ** 2).T, weights))
    for k in range(N + 1):
        opti.set_initial(Q[:, k], np.array(START) * (1 - k / N) + np.array(GOAL) * k / N)
        opti.set_initial(V[:, k], np.array(GOAL) - np.array(START))
    opti.solver('ipopt', {'print_time': False, 'ipopt': {'tol': 1e-8, 'print_level': 0, 'sb': 'yes'}, **options})
    return opti


def measure(name, make, robot, options):
    begin = time.perf_counter()
    dynamics = make()
    made = time.perf_counter() - begin
    opti, seconds = problem(dynamics, robot, options), []
    for _ in range(2):
        begin = time.perf_counter()
        solution = opti.solve()
        seconds.append(time.perf_counter() - begin)
    functions = sum(value for key, value in solution.stats().items() if key.startswith('t_wall_nlp'))
    total = made + seconds[0]
    print(f'{name:12} cost {solution.value(opti.f):.9f}  {solution.stats()["iter_count"]} iterations  made {made:7.3f} s  '
          f'first {seconds[0]:7.3f} s  again {seconds[1]:6.3f} s, functions {functions:6.3f} s  in all {total:7.3f} s', flush=True)
    return total


def main():
    model = json.loads(subprocess.run([pathlib.Path(sys.argv[1]).resolve() / 'bench_kernels', ROBOT, '--model', '--lock',
                                       LOCKED.replace(' ', ',')], check=True, capture_output=True, text=True).stdout)
    robot = dyntape.load(str(ROBOT), lock=LOCKED.split())

    def theirs():
        r = Robot(model)
        return ca.Function('aba', [r.q, r.v, r.w], [aba(r, r.w)], {'cse': True})

    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)  # where CasADi leaves files
        ours = measure('dyntape', lambda: robot.casadi('aba'), robot, {})
        own, jit = measure('CasADi', theirs, robot, {}), measure('CasADi, jit', theirs, robot, JIT)
        os.chdir('/')
    print(f'in all, dyntape takes {ours / own:.2f} of CasADi, {ours / jit:.3f} of CasADi with jit')


if __name__ == '__main__':
    main()
