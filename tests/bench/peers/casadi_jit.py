#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""CasADi's own just-in-time compilation of a robot's function: one line of JSON a level of optimization.

    casadi_jit.py robot.json fd-derivatives -O1,-O3        {"flags": "-O1", "made_s": 1.2, "evaluate_s": 1e-6}

made_s is from the expressions to the first result; what it takes to write the expressions down is not in it.  Run it in a folder of
its own: CasADi leaves files where it runs.
"""
import json
import pathlib
import sys
import time

import casadi as ca
import numpy as np

from casadi_robot import FUNCTIONS, function_of


def measure(f, flags):
    arguments = f.sx_in()
    states = [np.random.default_rng(1).standard_normal(f.numel_in(i)) for i in range(f.n_in())]
    results = [np.zeros(f.nnz_out(i)) for i in range(f.n_out())]
    start = time.perf_counter()
    made = ca.Function('jit', arguments, f.call(arguments),
                       {'jit': True, 'compiler': 'shell', 'jit_options': {'compiler': 'gcc', 'flags': [flags, '-march=native']}})
    buffer, evaluate = made.buffer()
    for i, x in enumerate(states):
        buffer.set_arg(i, memoryview(x))
    for i, y in enumerate(results):
        buffer.set_res(i, memoryview(y))
    evaluate()
    made_s = time.perf_counter() - start
    times = []
    for _ in range(31):
        start = time.perf_counter()
        for _ in range(200):
            evaluate()
        times.append((time.perf_counter() - start) / 200)
    return {'flags': flags, 'made_s': made_s, 'evaluate_s': sorted(times)[15]}


def main():
    model, function, levels = json.loads(pathlib.Path(sys.argv[1]).read_text()), sys.argv[2], sys.argv[3].split(',')
    key = [key for key in FUNCTIONS if key[0] == function][-1]
    f = function_of(model, key)
    for flags in levels:
        print(json.dumps(measure(f, flags)), flush=True)


if __name__ == '__main__':
    main()
