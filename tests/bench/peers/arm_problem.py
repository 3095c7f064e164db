#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The same trajectory optimisation by dyntape, by Ipopt and from stage to stage, and by CasADi with its own Ipopt, in one run.

    python3 -m venv build/casadi && build/casadi/bin/pip install casadi numpy
    ninja -C build bench_solves bench_kernels
    build/casadi/bin/python tests/bench/peers/arm_problem.py build/bin inverse forward

A seven-joint arm goes from rest to rest in 1 s within its limits with the least integral of its squared torques, each a fraction of
its limit; trapezoids on 50 intervals; optimum 0.132088.  Both forms: forward (the dynamics in the defects) and inverse (accelerations
are variables).  CasADi: the same variables, rows, start and tolerance, exact Hessians; one function of a point mapped over all (written out
for 51 points it compiles a hundred times longer and runs slower), compiled by gcc -O3; torque rows scaled by their limits, which
saves it a third of its iterations.  Prints one table; seconds are the quickest solve of each.
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

from casadi_robot import Robot, aba, rnea

ROOT = pathlib.Path(__file__).resolve().parents[3]
ROBOT = ROOT / 'config/robots/panda.urdf'
LOCKED = 'panda_finger_joint1 panda_finger_joint2'
START, GOAL = [0, -.5, 0, -2, 0, 1.5, .5], [1, .5, -.5, -1.2, .5, 2, -.5]
N, SPEED, TIMES = 50, 2.5, 10
TASK = '''robot {{ urdf {robot}
  lock "{locked}" }}
effects {{ gravity on }}
horizon {{ duration 1
  intervals {n} }}
transcription {{ scheme trapezoid
  dynamics {form}
  controls fraction
  hessian exact }}
start {{ q "{start}" }}
goal {{ q "{goal}" }}
guess {{ positions line
  velocities slope }}
bounds {{ velocities {speed}
  positions robot
  efforts robot }}
costs {{ effort 1 }}
evaluation {{ lanes native }}
'''


def task(form):
    return TASK.format(robot=ROBOT, locked=LOCKED, n=N, form=form, speed=SPEED, start=' '.join(map(str, START)),
                       goal=' '.join(map(str, GOAL)))


def dyntape(programs, form, folder):
    file = folder / f'{form}.info'
    file.write_text(task(form))
    return json.loads(subprocess.run([programs / 'bench_solves', file, str(TIMES)], check=True, capture_output=True,
                                     text=True).stdout)


def casadi_program(model, limits, form):
    """x, f, g and the bounds of all, stage by stage; the start.  One function of a point, mapped over all."""
    n, h = 7, 1 / N
    robot = Robot(model)
    q, v, a, u = robot.q, robot.v, ca.SX.sym('a', n), ca.SX.sym('u', n)
    effort, lower, upper = (np.array(limits[key]) for key in ('effort', 'lower', 'upper'))
    is_inverse = form == 'inverse'
    z = ca.vertcat(q, v, a, u) if is_inverse else ca.vertcat(q, v, u)
    dynamics = rnea(robot, a) / effort - u if is_inverse else aba(robot, u * effort)
    Z = ca.MX.sym('z', z.shape[0], N + 1)
    of_points = ca.Function('point', [z], [dynamics]).map(N + 1)(Z)
    Q, V, U = Z[:n, :], Z[n:2 * n, :], Z[-n:, :]
    A = Z[2 * n:3 * n, :] if is_inverse else of_points
    G = [ca.vec(ca.vertcat(Q[:, 1:] - Q[:, :-1] - h / 2 * (V[:, 1:] + V[:, :-1]),
                           V[:, 1:] - V[:, :-1] - h / 2 * (A[:, 1:] + A[:, :-1])))]
    if is_inverse:
        G.append(ca.vec(of_points))
    weights = np.full(N + 1, h)
    weights[[0, -1]] /= 2
    free = [np.inf] * n if is_inverse else []
    low, high, start = [], [], []
    for k in range(N + 1):
        end = {0: START, N: GOAL}.get(k)
        low += [*(end or lower), *([0] * n if end else [-SPEED] * n), *(-np.array(free)), *[-1] * n]
        high += [*(end or upper), *([0] * n if end else [SPEED] * n), *free, *[1] * n]
        start += [*(np.array(START) * (1 - k / N) + np.array(GOAL) * k / N),
                  *([0] * n if end else np.array(GOAL) - np.array(START)), *([0] * len(free)), *[0] * n]
    cost = ca.dot(ca.sum1(U ** 2).T, weights)
    return {'x': ca.vec(Z), 'f': cost, 'g': ca.vertcat(*G)}, dict(lbx=low, ubx=high, lbg=0, ubg=0, x0=start)


def casadi(model, limits, form, folder):
    begin = time.perf_counter()
    program, bounds = casadi_program(model, limits, form)
    options = {'ipopt.tol': 1e-8, 'ipopt.print_level': 0, 'ipopt.sb': 'yes', 'print_time': False}
    solver = ca.nlpsol('solver', 'ipopt', program, options)
    os.chdir(folder)  # where CasADi writes what it generates
    source = pathlib.Path(solver.generate_dependencies(f'{form}.c', {}))
    library = folder / f'{form}.so'
    subprocess.run(['gcc', '-O3', '-march=native', '-fPIC', '-shared', '-w', source, '-o', library], check=True)
    compiled = ca.nlpsol('solver', 'ipopt', str(library), options)
    ready = time.perf_counter() - begin
    best = None
    for _ in range(TIMES):
        begin = time.perf_counter()
        result = compiled(**bounds)
        seconds = time.perf_counter() - begin
        stats = compiled.stats()
        if best is None or seconds < best['seconds']:
            functions = sum(value for key, value in stats.items() if key.startswith('t_wall_nlp'))
            best = {'status': stats['return_status'], 'cost': float(result['f']), 'iterations': stats['iter_count'],
                    'seconds': seconds, 'functions_s': functions}
    return ready, best


def main():
    programs = pathlib.Path(sys.argv[1]).resolve()
    model = json.loads(subprocess.run([programs / 'bench_kernels', ROBOT, '--model', '--lock', LOCKED.replace(' ', ',')],
                                      check=True, capture_output=True, text=True).stdout)
    limits = {key: [float(value) for value in values] for key, values in limits_of(ROBOT).items()}
    rows = []
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = pathlib.Path(name).resolve()
        for form in sys.argv[2:] or ['inverse', 'forward']:
            ours = dyntape(programs, form, folder)
            ready, theirs = casadi(model, limits, form, folder)
            again = dyntape(programs, form, folder)  # after it as well, so that both see what else the machine does
            for solver in ('ipopt', 'stages'):
                best = min(ours[solver], again[solver], key=lambda row: row['seconds'])
                rows.append((form, f'dyntape, {solver}', ours['ready_s'], best))
            rows.append((form, 'CasADi, its Ipopt, compiled', ready, theirs))
    os.chdir(ROOT)
    print(f'{"form":8} {"solver":28} {"ready [s]":>10} {"status":>16} {"cost":>12} {"iterations":>10} {"solve [ms]":>10} '
          f'{"functions":>10} {"of CasADi":>10}')
    for form, solver, ready, row in rows:
        peer = next(r['seconds'] for f, s, _, r in rows if f == form and s.startswith('CasADi'))
        print(f'{form:8} {solver:28} {ready:10.3f} {row["status"]:>16} {row["cost"]:12.9f} {row["iterations"]:10d} '
              f'{row["seconds"] * 1e3:10.2f} {row["functions_s"] / row["seconds"]:10.0%} {row["seconds"] / peer:10.3f}')


def limits_of(urdf):
    import xml.etree.ElementTree as tree
    joints = [joint for joint in tree.parse(urdf).getroot().iter('joint') if joint.get('type') == 'revolute']
    return {key: [joint.find('limit').get(key) for joint in joints] for key in ('effort', 'lower', 'upper')}


if __name__ == '__main__':
    main()
