#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Functions of CasADi's taken over by dyntape.bridges.casadi.function, beside CasADi's own C compiled by gcc.

    tools/build --python && ninja -C build bench_kernels
    DYNTAPE_THREADS=1 PYTHONPATH=build/python build/python_environment/bin/python tests/bench/peers/casadi_from.py build/bin

Values, and values with Jacobians, of the Panda's forward dynamics in CasADi's symbols (casadi_robot.py) and of random expressions, over 4096 states on
one thread:
    dyntape          compiled, a state at a time
    lanes            compiled, several states at a time
    gcc -O2, -O3     what CasADi's generate() writes, -march=native, called in a loop of C; the upper halves of vector registers are
                     cleared before, or whoever has left something there makes all of libm slow
Microseconds a state, the least of 9 runs; both give non-zeros.  Prints a line each, and the geometric means of the quotients.
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
from arm_problem import LOCKED, ROBOT
from casadi_robot import Robot, aba
from dyntape.bridges import casadi as bridge

STATES, RUNS = 4096, 9
LOOP = """
#include <time.h>
double seconds(void) { struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t); return t.tv_sec + 1e-9 * t.tv_nsec; }
double run(const double* x, double* y, long n, long n_x, long n_y) {
  long long iw[F_SZ_IW + 1];
  static double w[F_SZ_W + 1], value[F_N_VALUE];
  __asm__ volatile("vzeroupper");
  double begin = seconds();
  for (long i = 0; i < n; ++i) {
    const double* arg[F_SZ_ARG + 1] = {x + i * n_x};
    double* res[F_SZ_RES + 1] = {F_N_OUT == 1 ? y + i * n_y : value, y + i * n_y};
    f(arg, res, iw, w, 0);
  }
  return seconds() - begin;
}
"""


def random_expression(rng, n_x=8, operations=400):
    """Mostly sums and products, a function now and then; all values within -1 and 1, none of them tiny."""
    x = ca.SX.sym('x', n_x)
    values = [x[i] for i in range(n_x)]
    for k in range(operations):
        a, b = (values[rng.integers(max(0, len(values) - 40), len(values))] for _ in range(2))
        kind = rng.random()
        if kind < 0.45:
            share = rng.uniform(0.2, 0.8)
            values.append(share * a + (1 - share) * b)
        elif kind < 0.9:
            values.append(a * (rng.uniform(0.5, 0.7) + 0.3 * b))
        else:
            values.append([ca.sin, ca.cos, lambda a: ca.sqrt(1 - 0.5 * a * a), lambda a: 1 / (1 + a * a)][k % 4](a))
    return ca.Function('f', [x], [ca.tanh(ca.vertcat(*values[-6:]))])


def least(run):
    run()
    return min(run() for _ in range(RUNS))


def compiled_by_gcc(F, level, X, folder):
    """Seconds, and the last output (states, non-zeros)."""
    import ctypes
    F = ca.Function('f', F.sx_in(), F.call(F.sx_in()), {'cse': True}) if F.is_a('SXFunction') else F
    os.chdir(folder)
    F.generate('f.c')
    sizes = {'SZ_ARG': F.sz_arg(), 'SZ_RES': F.sz_res(), 'SZ_IW': F.sz_iw(), 'SZ_W': F.sz_w(), 'N_OUT': F.n_out(), 'N_VALUE': F.nnz_out(0)}
    pathlib.Path('loop.c').write_text(''.join(f'#define F_{key} {n}\n' for key, n in sizes.items()) + '#include "f.c"\n' + LOOP)
    library = f'./f{level}_{time.monotonic_ns()}.so'
    subprocess.run(['gcc', level, '-march=native', '-shared', '-fPIC', 'loop.c', '-o', library, '-lm'], check=True)
    run = ctypes.CDLL(library).run
    run.restype = ctypes.c_double
    Y = np.zeros((len(X), F.nnz_out(F.n_out() - 1)))
    pointer = lambda array: array.ctypes.data_as(ctypes.c_void_p)
    size = lambda n: ctypes.c_long(n)
    return least(lambda: run(pointer(X), pointer(Y), size(len(X)), size(X.shape[1]), size(Y.shape[1]))), Y


def by_dyntape(call, X):
    def run():
        begin = time.perf_counter()
        call(X)
        return time.perf_counter() - begin
    return least(run)


def measure(name, F, X, folder):
    """A line for values and one for Jacobians; their times."""
    x, rows = F.sx_in()[0], []
    both = ca.Function('j', [x], [F(x), ca.jacobian(F(x), x)])
    plain, lanes = bridge.function(F).compile(order=1), bridge.function(F).compile(order=1, lanes=True)
    for what, G in ('value', F), ('Jacobian', both):
        calls = [(lambda f: f if what == 'value' else f.jacobian_values)(f) for f in (plain, lanes)]
        ours = [by_dyntape(call, X) for call in calls]
        theirs, Y = zip(*(compiled_by_gcc(G, level, X, folder) for level in ('-O2', '-O3')))
        got = np.asarray(calls[0](X)).reshape(len(X), -1)
        pattern = G.sparsity_out(G.n_out() - 1)
        order = np.lexsort((pattern.get_col(), pattern.row()))  # ours are row by row
        if got.shape == Y[0].shape:  # where both find the same entries to be no zeros
            assert np.allclose(got, Y[0][:, order], rtol=1e-9, atol=1e-11 * np.abs(Y[0]).max()), name
        times = [1e6 * t / len(X) for t in (*ours, *theirs)]
        rows.append(times)
        print(f'{name:14} {what:8}  dyntape {times[0]:7.3f}  lanes {times[1]:7.3f}  gcc -O2 {times[2]:7.3f}  -O3 {times[3]:7.3f} us', flush=True)
    return rows


def main():
    model = json.loads(subprocess.run([pathlib.Path(sys.argv[1]).resolve() / 'bench_kernels', ROBOT, '--model', '--lock',
                                       LOCKED.replace(' ', ',')], check=True, capture_output=True, text=True).stdout)
    r, rng, rows = Robot(model), np.random.default_rng(3), []
    z = ca.SX.sym('z', 21)
    arm = ca.Function('aba', [r.q, r.v, r.w], [aba(r, r.w)])
    functions = {'Panda, aba': ca.Function('f', [z], [arm(*ca.vertsplit(z, 7))])}
    functions.update({f'random {k}': random_expression(rng) for k in range(6)})
    with tempfile.TemporaryDirectory() as folder:
        for name, F in functions.items():
            rows += measure(name, F, np.ascontiguousarray(rng.uniform(-1, 1, (STATES, F.numel_in(0)))), folder)
        os.chdir('/')
    t = np.array(rows)
    mean = lambda a, b: np.exp(np.mean(np.log(t[:, a] / t[:, b])))
    print(f'of gcc -O2: {mean(0, 2):.2f} a state at a time, {mean(1, 2):.2f} in lanes; of gcc -O3: {mean(0, 3):.2f}, {mean(1, 3):.2f}')


if __name__ == '__main__':
    main()
