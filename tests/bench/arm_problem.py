#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The same trajectory optimisation by dyntape, by Ipopt and from stage to stage, and by CasADi with its own Ipopt, in one run.

    python3 -m venv build/casadi && build/casadi/bin/pip install casadi numpy
    ninja -C build bench_solves bench_kernels
    build/casadi/bin/python tests/bench/arm_problem.py build/bin inverse forward

A seven-joint arm goes from rest to rest in 1 s within its limits with the least integral of its squared torques, each a fraction of
its limit; trapezoids on 50 intervals; optimum 0.132088.  Both forms: forward (the dynamics in the defects) and inverse (accelerations
are variables).  CasADi: the same variables, rows, start and tolerance, exact Hessians, functions compiled by gcc -O1, which is as fast on straight lines; torque rows
scaled by their limits, which saves it a third of its iterations.  What CasADi prints of the forward form is 5 million lines, which gcc
needs long for.  Prints one table; seconds are the quickest solve of each.
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

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
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
    """x, f, g and the bounds of all, stage by stage; the start."""
    n, h = 7, 1 / N
    robot = Robot(model)
    q, v, u = robot.q, robot.v, ca.SX.sym('u', n)
    effort, lower, upper = (np.array(limits[key]) for key in ('effort', 'lower', 'upper'))
    if form == 'forward':
        rate = ca.Function('rate', [q, v, u], [aba(robot, u * effort)])
    else:
        a = ca.SX.sym('a', n)
        missing = ca.Function('missing', [q, v, a, u], [rnea(robot, a) / effort - u])
    X, G, low, high, glow, ghigh, start, cost = [], [], [], [], [], [], [], 0
    before = None
    for k in range(N + 1):
        Q, V, U = (ca.SX.sym(f'{name}{k}', n) for name in 'qvu')
        A = ca.SX.sym(f'a{k}', n) if form == 'inverse' else rate(Q, V, U)
        end = {0: START, N: GOAL}.get(k)
        X += [Q, V] + ([A] if form == 'inverse' else []) + [U]
        low += [*(end or lower), *([0] * n if end else [-SPEED] * n), *([-np.inf] * n if form == 'inverse' else []), *[-1] * n]
        high += [*(end or upper), *([0] * n if end else [SPEED] * n), *([np.inf] * n if form == 'inverse' else []), *[1] * n]
        share = k / N
        start += [*(np.array(START) * (1 - share) + np.array(GOAL) * share),
                  *([0] * n if end else np.array(GOAL) - np.array(START)), *([0] * n if form == 'inverse' else []), *[0] * n]
        if before:
            q0, v0, a0 = before
            G += [Q - q0 - h / 2 * (v0 + V), V - v0 - h / 2 * (a0 + A)]
        if form == 'inverse':
            G.append(missing(Q, V, A, U))
        cost += (h / 2 if k in (0, N) else h) * ca.sumsqr(U)
        before = Q, V, A
    g = ca.vertcat(*G)
    return {'x': ca.vertcat(*X), 'f': cost, 'g': g}, dict(lbx=low, ubx=high, lbg=0, ubg=0, x0=start)


def casadi(model, limits, form, folder):
    begin = time.perf_counter()
    program, bounds = casadi_program(model, limits, form)
    solver = ca.nlpsol('solver', 'ipopt', program, {'ipopt.tol': 1e-8, 'ipopt.print_level': 0, 'print_time': False})
    os.chdir(folder)  # where CasADi writes what it generates
    source = pathlib.Path(solver.generate_dependencies(f'{form}.c', {}))
    library = folder / f'{form}.so'
    subprocess.run(['gcc', '-O1', '-march=native', '-fPIC', '-shared', '-w', source, '-o', library], check=True)
    compiled = ca.nlpsol('solver', 'ipopt', str(library), {'ipopt.tol': 1e-8, 'ipopt.print_level': 0, 'print_time': False})
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
        for form in sys.argv[2:] or ['inverse']:
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
