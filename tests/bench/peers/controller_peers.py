#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A step of model predictive control by dyntape's printed text, by its `Mpc`, and by acados, in one run.

    python3 -m venv build/acados && build/acados/bin/pip install casadi numpy ACADOS/interfaces/acados_template
    ninja -C build dyntape bench_kernels
    ACADOS_SOURCE_DIR=ACADOS build/acados/bin/python tests/bench/peers/controller_peers.py build/bin

ACADOS is acados' folder, built and installed there (it needs its own t_renderer in bin/).  The task is config/control/ur5_follows_circle.info:
20 intervals of 20 ms, semi-implicit Euler, squares of the tool's distance, of velocities and of efforts, limits of positions, velocities
and efforts.  acados solves the same program, written in CasADi's symbols (casadi_robot.py), by SQP_RTI with Gauss-Newton's Hessian and
HPIPM; limits of states are hard there and soft in the text.  All solvers plan from the states of the text's closed loop, one iteration a
step; one thread; gcc -O3 -march=native.  Prints the median and the longest step in milliseconds, and the largest difference of first controls in
fractions of the effort limits.
"""
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

import casadi as ca
import numpy as np

from casadi_robot import Robot, aba

ROOT = pathlib.Path(__file__).resolve().parents[3]
TASK = ROOT / 'config/control/ur5_follows_circle.info'
ROBOT = ROOT / 'config/robots/ur5.urdf'
NAME, N, H, STEPS = 'ur5_follows_circle', 20, 0.02, 300
START = [0, -1.2, 1.6, -0.4, 1.57, 0]
EFFORT = np.array([150, 150, 150, 28, 28, 28.])
POSITION = np.array([2 * np.pi, 2 * np.pi, np.pi] + [2 * np.pi] * 3)
VELOCITY = np.array([3.15] * 3 + [3.2] * 3)
TOOL = [0, 0.0823, 0]  # in the last body
DRIVER = '''
#include <stdio.h>
#include <time.h>
#include "%(name)s.c"
static %(name)s_state s;
static double now(void) { struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t); return t.tv_sec + 1e-9 * t.tv_nsec; }
int main(void) {
  double x[12], u[6], z[18], next[DT_VALUE_Y], t = 0;
  %(name)s_init(&s);
  for (int i = 0; i < 12; ++i) x[i] = dt_guess[0][i];
  for (int k = 0; k < %(steps)d; ++k, t += %(h)g) {
    for (int j = 0; j <= DT_N; ++j) {
      const double a = 2 * 3.14159265358979 / 3 * (t + j * %(h)g);
      s.p[j][0] = t + j * %(h)g, s.p[j][1] = dt_parameters[0][1];
      s.p[j][2] = 0.1 + (dt_parameters[0][2] - 0.1) * __builtin_cos(a) - (dt_parameters[0][3] - 0.4) * __builtin_sin(a);
      s.p[j][3] = 0.4 + (dt_parameters[0][2] - 0.1) * __builtin_sin(a) + (dt_parameters[0][3] - 0.4) * __builtin_cos(a);
    }
    const double begin = now();
    %(name)s_step(&s, x, t, k == 0 ? 50 : 1);
    %(name)s_control(&s, t, x, u);
    printf("%%.9g", now() - begin);
    for (int i = 0; i < 12; ++i) printf(" %%.17g", x[i]);
    for (int i = 0; i < 6; ++i) printf(" %%.17g", u[i]);
    for (int j = 0; j <= DT_N; ++j) for (int i = 1; i < 4; ++i) printf(" %%.17g", s.p[j][i]);
    printf("\\n");
    for (int i = 0; i < 12; ++i) z[i] = x[i];
    for (int i = 0; i < 6; ++i) z[12 + i] = u[i];
    dt_stage_value(z, s.p[0], next);
    for (int i = 0; i < 12; ++i) x[i] = next[i];
    if (k == 100) x[6] += 0.5, x[9] -= 0.5;
  }
  return 0;
}
'''


def printed(programs, folder):
    """Seconds, states, first controls and targets of each step of a closed loop."""
    subprocess.run([programs / 'dyntape', 'generate', TASK, '--controller', folder], check=True, stdout=subprocess.DEVNULL)
    (folder / 'main.c').write_text(DRIVER % {'name': NAME, 'steps': STEPS, 'h': H})
    subprocess.run(['gcc', '-O3', '-march=native', '-ffp-contract=off', '-std=gnu99', 'main.c', '-o', 'main', '-lm'], cwd=folder, check=True)
    rows = np.array([[float(word) for word in line.split()] for line in
                     subprocess.run([folder / 'main'], check=True, capture_output=True, text=True).stdout.splitlines()])
    return rows[:, 0], rows[:, 1:13], rows[:, 13:19], rows[:, 19:].reshape(STEPS, N + 1, 3)


def tool_of(robot):
    """The tool's position in the base's frame."""
    at, R = ca.SX(3, 1), ca.SX.eye(3)
    chain, i = [], len(robot) - 1
    while i >= 0:
        chain.append(i)
        i = robot.parent(i)
    for i in reversed(chain):
        at, R = at + R @ robot.p[i], R @ robot.R[i]
    return at + R @ ca.DM(TOOL)


def acados(model, folder):
    from acados_template import AcadosModel, AcadosOcp, AcadosOcpSolver
    robot = Robot(model)
    u, p = ca.SX.sym('u', 6), ca.SX.sym('p', 3)
    v = robot.v + H * aba(robot, u * EFFORT)
    ocp = AcadosOcp()
    m = AcadosModel()
    m.name, m.x, m.u, m.p = 'ur5', ca.vertcat(robot.q, robot.v), u, p
    m.disc_dyn_expr = ca.vertcat(robot.q + H * v, v)
    m.cost_y_expr = ca.vertcat(tool_of(robot) - p, robot.v, u)
    ocp.model = m
    ocp.cost.cost_type, ocp.cost.cost_type_e = 'NONLINEAR_LS', 'LINEAR_LS'
    ocp.cost.W, ocp.cost.yref = 2 * np.diag([1000.] * 3 + [0.1] * 6 + [0.01] * 6), np.zeros(15)
    ocp.cost.Vx_e, ocp.cost.W_e, ocp.cost.yref_e = np.zeros((1, 12)), np.zeros((1, 1)), np.zeros(1)
    ocp.constraints.idxbu, ocp.constraints.lbu, ocp.constraints.ubu = np.arange(6), -np.ones(6), np.ones(6)
    limits = np.concatenate([POSITION, VELOCITY])
    for end in ('', '_e'):
        setattr(ocp.constraints, 'idxbx' + end, np.arange(12))
        setattr(ocp.constraints, 'lbx' + end, -limits), setattr(ocp.constraints, 'ubx' + end, limits)
    ocp.constraints.x0, ocp.parameter_values = np.array(START + [0.] * 6), np.zeros(3)
    o = ocp.solver_options
    o.N_horizon, o.tf = N, N * H
    o.integrator_type, o.hessian_approx, o.nlp_solver_type = 'DISCRETE', 'GAUSS_NEWTON', 'SQP_RTI'
    o.qp_solver = 'PARTIAL_CONDENSING_HPIPM'
    ocp.code_gen_options.ext_fun_compile_flags = '-O3 -march=native'
    ocp.code_gen_options.code_export_directory = str(folder / 'acados')
    os.chdir(folder)
    return AcadosOcpSolver(ocp, verbose=False)


def by_acados(solver, states, targets):
    seconds, controls = [], []
    for k in range(N):
        solver.set(k, 'x', np.array(START + [0.] * 6)), solver.set(k, 'u', np.zeros(6))
    solver.set(N, 'x', np.array(START + [0.] * 6))
    for k, x in enumerate(states):
        for j in range(N + 1):
            solver.set(j, 'p', targets[k, j])
        if k > 0:  # the plan moves by an interval, as the text's does
            for j in range(N):
                solver.set(j, 'x', solver.get(j + 1, 'x'))
                solver.set(j, 'u', solver.get(min(j + 1, N - 1), 'u'))
        solver.set(0, 'lbx', x), solver.set(0, 'ubx', x)
        for _ in range(50 if k == 0 else 1):
            solver.solve()
        seconds.append(float(solver.get_stats('time_tot')))
        controls.append(solver.get(0, 'u'))
    return np.array(seconds), np.array(controls)


def by_mpc(programs, folder):
    done = subprocess.run([programs / 'dyntape', 'mpc', TASK, '--output', folder / 'mpc', '--json'], check=True, capture_output=True, text=True)
    return json.loads(done.stdout)


def main():
    programs = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = pathlib.Path(name).resolve()
        model = json.loads(subprocess.run([programs / 'bench_kernels', ROBOT, '--model'], check=True, capture_output=True, text=True).stdout)
        rows = []
        ours, states, controls, targets = printed(programs, folder)
        solver = acados(model, folder)
        for again in range(3):
            if again:
                ours = np.minimum(ours, printed(programs, folder)[0])
            theirs, their_controls = by_acados(solver, states, targets)
            best = theirs if again == 0 else np.minimum(best, theirs)
        report = by_mpc(programs, folder)
        rows = [('printed text', ours), ('acados, SQP_RTI, HPIPM', best)]
        for name, seconds in rows:
            print(f'{name:24} median {1e3 * statistics.median(seconds[1:]):8.3f} ms, longest {1e3 * max(seconds[1:]):8.3f} ms')
        print(f'{"dyntape mpc":24} median {report["step_ms"]["median"]:8.3f} ms, longest {report["step_ms"]["longest"]:8.3f} ms')
        print('largest difference of first controls, from the tenth step on:', np.abs(controls - their_controls)[10:].max())
    os.chdir(ROOT)


if __name__ == '__main__':
    main()
