#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Optimal control by dyntape, Crocoddyl, mim-solvers, aligator, CasADi with Ipopt and CasADi with FATROP, in one run.

    python3 -m venv build/control_peers
    build/control_peers/bin/pip install crocoddyl==3.2.1 libpinocchio==4.0.0 pin==4.0.0 mim-solvers==0.3.0 libaligator==0.19.1 casadi
    ninja -C build bench_ilqr bench_kernels
    build/control_peers/bin/python tests/bench/peers/control_peers.py build/bin [table.csv]

The arm and the quadruped of ilqr.cpp, and a cart-pole that swings up with its force within 12 N: 100 steps, the same costs, a start at
the torques that hold the robot.  peers/control.cpp is compiled against the peers' headers first, which takes a minute.  CasADi solves
them by multiple shooting, its functions interpreted, with exact Hessians.  One thread each; seconds are processor time
of the quickest solve.
Costs are those that each solver states.  A peer that is not there, crashes or fails is a row that says so.  Pinocchio 4.1.0 does not fit
the wheel of Crocoddyl 3.2.1, which then finds costs of 1e24 or crashes.
"""
import csv
import importlib.metadata
import json
import os
import pathlib
import subprocess
import sys
import time

os.environ['OMP_NUM_THREADS'] = '1'
HERE = pathlib.Path(__file__).resolve().parent
ROBOTS = HERE.parents[2] / 'config/robots'
PROBLEMS = [('arm', 'panda', 'euler'), ('arm', 'panda', 'rk4'), ('quadruped', 'solo12', 'euler'),
            ('cart-pole', 'cart_pole', 'euler'), ('cart-pole', 'cart_pole', 'rk4')]
PACKAGES = {'crocoddyl': 'crocoddyl', 'mim-solvers': 'mim-solvers', 'aligator': 'libaligator', 'casadi': 'casadi'}
N, TIMES, LIMIT = 100, 5, 60  # steps; solves, fewer where one is slow; seconds for all solves of a row
# gcc 12 refuses static_assert(false) in templates of Pinocchio's that nobody uses; the rest are what its variants of joints need.
FLAGS = ['-std=c++20', '-O3', '-DNDEBUG', '-w', '-Dstatic_assert(...)=', '-DBOOST_MPL_LIMIT_LIST_SIZE=30', '-DBOOST_MPL_LIMIT_VECTOR_SIZE=30',
         '-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS', '-DBOOST_FUSION_INVOKE_MAX_ARITY=12', '-DPINOCCHIO_ENABLE_TEMPLATE_INSTANTIATION',
         '-DPINOCCHIO_WITH_URDFDOM', '-DALIGATOR_ENABLE_TEMPLATE_INSTANTIATION', '-DALIGATOR_PINOCCHIO_V3', '-DALIGATOR_WITH_PINOCCHIO']
LIBRARIES = ['aligator_croc_compat', 'aligator', 'mim_solvers', 'crocoddyl', 'pinocchio_parsers', 'pinocchio_collision',
             'pinocchio_default', 'fmt', 'mimalloc', 'boost_filesystem', 'boost_serialization', 'boost_container']


def version(peer):
    try:
        return importlib.metadata.version(PACKAGES[peer])
    except importlib.metadata.PackageNotFoundError:
        return None


def peer_program():
    """peers/control.cpp compiled; None where a peer is not installed or it does not compile."""
    prefix = next(pathlib.Path(sys.prefix).glob('lib/python*/site-packages/cmeel.prefix'), None)
    if prefix is None or not all(map(version, ('crocoddyl', 'mim-solvers', 'aligator'))):
        return None
    source, program = HERE / 'control.cpp', prefix / 'control_peer'
    if not program.exists() or program.stat().st_mtime < source.stat().st_mtime:
        command = ['g++', *FLAGS, '-isystem', prefix / 'include', '-isystem', prefix / 'include/pinocchio/deprecated', '-isystem',
                   '/usr/include/eigen3', source, '-o', program, f'-L{prefix}/lib', f'-Wl,-rpath,{prefix}/lib',
                   f'-Wl,-rpath-link,{prefix}/lib', *(f'-l{name}' for name in LIBRARIES)]
        if subprocess.run(command, stderr=subprocess.DEVNULL).returncode != 0:
            return None
    return program


def run(command):
    """The JSON objects that a program prints, or a row that says why there is none."""
    try:
        done = subprocess.run(list(map(str, command)), capture_output=True, text=True, timeout=LIMIT)
    except subprocess.TimeoutExpired:
        return [{'status': f'not within {LIMIT} s'}]
    except OSError:
        return [{'status': 'not built'}]
    if done.returncode != 0:
        return [{'status': 'crashed' if done.returncode < 0 else 'failed'}]
    return [json.loads(line) for line in done.stdout.splitlines()]


def cart_pole(_):
    """Rate of the state, and (running cost, end cost), start, guess and limit of the control."""
    import casadi as ca
    M, m, length, g = 1, .3, .5, 9.81
    x, u = ca.SX.sym('x', 4), ca.SX.sym('u')
    s, c, w = ca.sin(x[1]), ca.cos(x[1]), x[3]
    a = (u + m * length * s * w ** 2 + m * g * s * c) / (M + m * s ** 2)
    missed = x - ca.DM([1, ca.pi, 0, 0])
    return {'x': x, 'u': u, 'v': x[2:], 'a': ca.vertcat(a, -(g * s + c * a) / length), 'duration': 2, 'cost': u ** 2,
            'end': ca.dot(ca.DM([1e4, 1e4, 1e3, 1e3]), missed ** 2), 'start': [0] * 4, 'guess': [0], 'limit': 12}


def arm(programs):
    """The arm of ilqr.cpp, by the articulated-body algorithm of casadi_robot.py."""
    import casadi as ca
    from casadi_robot import Robot, aba, rnea
    command = [programs / 'bench_kernels', ROBOTS / 'panda.urdf', '--model', '--lock', 'panda_finger_joint1,panda_finger_joint2']
    robot = Robot(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))
    u, x, start = ca.SX.sym('u', 7), ca.vertcat(robot.q, robot.v), [0, -.5, 0, -2, 0, 1.5, .5] + [0] * 7
    missed = x - ca.DM([1, .5, -.5, -1.2, .5, 2, -.5] + [0] * 7)
    misses = ca.dot(ca.DM([10] * 7 + [.1] * 7), missed ** 2)
    hold = ca.Function('hold', [robot.q, robot.v], [rnea(robot, ca.DM.zeros(7))])(start[:7], start[7:])
    return {'x': x, 'u': u, 'v': robot.v, 'a': aba(robot, u), 'duration': 1, 'cost': misses + 1e-3 * ca.dot(u, u), 'end': 100 * misses,
            'start': start, 'guess': hold.full().ravel().tolist(), 'limit': float('inf')}


def series(x, *terms):
    return sum(c * x ** k for k, c in enumerate(terms))


def moved_base(q, d):
    """Position and quaternion of a base after a motion d in its axes, exact to rounding for turns below 0.5 rad."""
    import casadi as ca
    s, u, w, turn = ca.dot(d[3:], d[3:]), q[3:6], q[6], ca.skew(d[3:])
    way = d[:3] + series(s, 1 / 2, -1 / 24, 1 / 720, -1 / 40320) * turn @ d[:3] + series(s, 1 / 6, -1 / 120, 1 / 5040, -1 / 362880) * turn @ turn @ d[:3]
    half, c = series(s, 1 / 2, -1 / 48, 1 / 3840, -1 / 645120) * d[3:], series(s, 1, -1 / 8, 1 / 384, -1 / 46080, 1 / 10321920)
    return ca.vertcat(q[:3] + way + 2 * w * ca.cross(u, way) + 2 * ca.cross(u, ca.cross(u, way)),
                      w * half + c * u + ca.cross(u, half), w * c - ca.dot(u, half))


def missed_base(goal, q):
    """The motion that leads from a base at `goal`, which is not turned, to q; turns below 0.5 rad."""
    import casadi as ca
    s = ca.dot(q[3:6], q[3:6])
    turn = 2 * series(s, 1, 1 / 6, 3 / 40, 5 / 112, 35 / 1152, 63 / 2816, 231 / 13312, 143 / 10240) * q[3:6]
    t, W, way = ca.dot(turn, turn), ca.skew(turn), q[:3] - goal[:3]
    return ca.vertcat(way - W @ way / 2 + series(t, 1 / 12, 1 / 720, 1 / 30240, 1 / 1209600) * W @ W @ way, turn)


def quadruped(programs):
    """The quadruped of ilqr.cpp, whose feet are held by the equations of motion and of the feet at once."""
    import casadi as ca
    import numpy
    import pinocchio
    from casadi_robot import Robot, columns, crba, cross_motion, rnea
    command = [programs / 'bench_kernels', ROBOTS / 'solo12.urdf', '--model', '--base', 'floating']
    robot = Robot(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))
    model = pinocchio.buildModelFromUrdf(str(ROBOTS / 'solo12.urdf'), pinocchio.JointModelFreeFlyer())
    u, x, q, v = ca.SX.sym('u', 12), ca.vertcat(robot.q, robot.v), robot.q, robot.v
    # Motions of the bodies in the trunk's axes: by each rate, and accelerations at none.
    R, p, J, speed, bias = [], [], [], [], []
    for i in range(len(robot)):
        k, S = robot.parent(i), robot.S[i]
        R.append(R[k] @ robot.R[i] if k >= 0 else ca.SX.eye(3))
        p.append(p[k] + R[k] @ robot.p[i] if k >= 0 else ca.SX(3, 1))
        own = columns(lambda s: ca.vertcat(R[i] @ s[:3] + ca.cross(p[i], R[i] @ s[3:]), R[i] @ s[3:]), S)
        J.append(ca.SX(J[k]) if k >= 0 else ca.SX(6, 18))
        J[i][:, robot.cols[i]] = own
        rate = own @ v[robot.cols[i]]
        speed.append(speed[k] + rate if k >= 0 else rate)
        bias.append(bias[k] + cross_motion(speed[i], rate) if k >= 0 else ca.SX(6, 1))
    rows, held = [], []
    for leg in ('FL', 'FR', 'HL', 'HR'):
        frame = model.frames[model.getFrameId(f'{leg}_FOOT')]
        i = frame.parentJoint - 1
        at = p[i] + R[i] @ ca.DM(frame.placement.translation)
        rows.append(J[i][:3, :] - ca.skew(at) @ J[i][3:, :])
        moves = speed[i][:3] + ca.cross(speed[i][3:], at)
        held.append(bias[i][:3] + ca.cross(bias[i][3:], at) + ca.cross(speed[i][3:], moves))
    J, held, M = ca.vertcat(*rows), ca.vertcat(*held), crba(robot)
    D, L, perm = ca.ldl(M)
    weight = ca.substitute(rnea(robot, ca.SX(18, 1)), robot.step, ca.DM.zeros(6))
    free = ca.vertcat(ca.SX(6, 1), u) - weight
    by_force = ca.ldl_solve(J.T, D, L, perm)
    force = ca.ldl_solve(-held - J @ ca.ldl_solve(free, D, L, perm), *ca.ldl(J @ by_force))
    start = [0, 0, .24, 0, 0, 0, 1] + [0, .8, -1.6] * 2 + [0, -.8, 1.6] * 2
    goal = ca.DM([.02, 0, .2] + start[3:])
    missed = ca.vertcat(missed_base(goal, q), q[7:] - goal[7:], v)
    misses = ca.dot(ca.DM([10] * 18 + [.1] * 18), missed ** 2)
    # Torques that hold it at rest, least with the forces of the feet.
    at_rest = ca.Function('at_rest', [q, v], [weight, J])(start, [0] * 18)
    weight, J0 = (part.full() for part in at_rest)
    forces = numpy.linalg.lstsq(J0[:, :6].T, weight[:6, 0], rcond=None)[0]
    hold = weight[6:, 0] - J0[:, 6:].T @ forces
    return {'x': x, 'u': u, 'v': v, 'a': ca.ldl_solve(free, D, L, perm) + by_force @ force, 'duration': 1,
            'cost': misses + 1e-3 * ca.dot(u, u), 'end': 100 * misses, 'start': start + [0] * 18, 'guess': hold.tolist(),
            'limit': float('inf'), 'move': lambda q, d: ca.vertcat(moved_base(q, d[:6]), q[7:] + d[6:])}


def shooting_program(of, scheme):
    """min sum h cost + end, stage by stage, and its bounds."""
    import casadi as ca
    x, u, h, n = of['x'], of['u'], of['duration'] / N, of['x'].numel()
    rate = ca.Function('rate', [x, u], [ca.vertcat(of['v'], of['a'])])
    cost, end = ca.Function('cost', [x, u], [of['cost']]), ca.Function('end', [x], [of['end']])
    if scheme == 'euler':
        v = of['v'] + h * of['a']
        after, running = ca.vertcat(of.get('move', lambda q, d: q + d)(x[:n - v.numel()], h * v), v), h * of['cost']
    else:  # of the integral of the cost as well
        a = rate(x, u)
        b = rate(x + h / 2 * a, u)
        c = rate(x + h / 2 * b, u)
        after = x + h / 6 * (a + 2 * b + 2 * c + rate(x + h * c, u))
        running = h / 6 * (of['cost'] + 2 * cost(x + h / 2 * a, u) + 2 * cost(x + h / 2 * b, u) + cost(x + h * c, u))
    step = ca.Function('step', [x, u], [after, running])
    X, U = [ca.MX.sym(f'x{k}', n) for k in range(N + 1)], [ca.MX.sym(f'u{k}', u.numel()) for k in range(N)]
    variables = [z for k in range(N) for z in (X[k], U[k])] + [X[N]]
    # FATROP wants rows by stages: the start's belong to the first stage, after its link.
    steps = [step(X[k], U[k]) for k in range(N)]
    rows = [X[k + 1] - steps[k][0] for k in range(N)]
    rows.insert(1, X[0] - ca.DM(of['start']))
    total = sum(running for _, running in steps) + end(X[N])
    most = ([float('inf')] * n + [of['limit']] * u.numel()) * N + [float('inf')] * n
    program = {'x': ca.vertcat(*variables), 'f': total, 'g': ca.vertcat(*rows)}
    return program, dict(x0=(of['start'] + of['guess']) * N + of['start'], lbx=[-z for z in most], ubx=most, lbg=0, ubg=0)


def casadi_solve(solver, problem, scheme, programs):
    import casadi as ca
    makers = {'arm': arm, 'cart-pole': cart_pole, 'quadruped': quadruped}
    program, bounds = shooting_program(makers[problem](pathlib.Path(programs)), scheme)
    options = {'print_time': False, 'expand': problem != 'quadruped', **({'ipopt.print_level': 0, 'ipopt.sb': 'yes', 'ipopt.tol': 1e-8} if solver == 'ipopt' else
               {'structure_detection': 'auto', 'equality': [True] * program['g'].numel(), 'fatrop.print_level': 0})}
    make = ca.nlpsol('solver', solver, program, options)
    best = None
    for _ in range(TIMES):
        if best and best['seconds'] > LIMIT / 10:
            break
        begin = time.thread_time()
        result = make(**bounds)
        seconds = time.thread_time() - begin
        if best is None or seconds < best['seconds']:
            stats = make.stats()
            best = {'status': 'solved' if stats['success'] else 'not solved', 'iterations': stats['iter_count'],
                    'cost': float(result['f']), 'seconds': seconds}
    return best


def rows_of(problem, robot, scheme, bench, program):
    urdf = ROBOTS / f'{robot}.urdf'
    for row in run([bench / 'bench_ilqr', problem, urdf, N, TIMES]):
        if row.get('scheme', scheme) == scheme:
            yield f"dyntape, {'stages' if row.get('solver') else 'DDP'}", row
    for peer in ('crocoddyl', 'mim-solvers', 'aligator'):
        if peer == 'aligator' and problem == 'cart-pole' and scheme == 'rk4':
            yield peer, {'status': 'no Runge-Kutta steps with limits'}
        else:
            yield peer, run([program, peer, problem, urdf, scheme, N, TIMES])[0] if program else {'status': 'not installed'}
    for solver in 'ipopt', 'fatrop':
        yield f'CasADi, {solver}', run([sys.executable, __file__, '--casadi', solver, problem, scheme, bench])[0] if version('casadi') \
            else {'status': 'not installed'}


def main():
    if sys.argv[1] == '--casadi':
        print(json.dumps(casadi_solve(*sys.argv[2:6])))
        return
    program, table = peer_program(), []
    print('; '.join(f'{peer} {version(peer) or "not installed"}' for peer in PACKAGES), '; load', round(os.getloadavg()[0], 2))
    print('| problem | steps | solver | status | iterations | cost | ms an iteration | ms |\n|---|---|---|---|--:|--:|--:|--:|')
    for problem, robot, scheme in PROBLEMS:
        for solver, row in rows_of(problem, robot, scheme, pathlib.Path(sys.argv[1]), program):
            line = [problem, scheme, solver, row['status']]
            if 'seconds' in row:
                ms = 1e3 * row['seconds']
                line += [row['iterations'], f"{row['cost']:.9f}", f"{ms / max(1, row['iterations']):.3f}", f'{ms:.2f}']
            table.append(line + [''] * (8 - len(line)))
            print('| ' + ' | '.join(map(str, table[-1])) + ' |', flush=True)
    if len(sys.argv) > 2:
        with open(sys.argv[2], 'w', newline='') as file:
            csv.writer(file).writerows(table)


if __name__ == '__main__':
    main()
