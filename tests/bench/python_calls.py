#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a call from Python costs beyond the kernel that it runs, and 1e5 states at once.

    DYNTAPE_THREADS=1 python3 tests/bench/python_calls.py       beside the same kernels on one core
    python3 tests/bench/python_calls.py                         on all

The kernel's time is that of a state in a batch by the same route, "analytic", whose states are read one after the other.
"""
import time

import dyntape
import numpy as np

COUNT = 100_000


def quickest(work, count, rounds=30):
    least = np.inf
    for _ in range(rounds):
        begin = time.perf_counter()
        work()
        least = min(least, time.perf_counter() - begin)
    return least / count


def main():
    robot = dyntape.load(dyntape.config_folder() / 'robots/panda.urdf', lock=['panda_finger_joint1', 'panda_finger_joint2'])
    q, v = robot.random(COUNT), np.random.default_rng(1).normal(size=(COUNT, robot.nv))
    for name, arguments in {'rnea': (q, v, v), 'crba': (q,), 'id_derivatives': (q, v, v)}.items():
        method, one = getattr(robot, name), [x[0].copy() for x in arguments]
        some = [x[:1000] for x in arguments]

        def calls():
            for _ in range(10_000):
                method(*one)

        call = quickest(calls, 10_000)
        kernel = quickest(lambda: method(*some, route='analytic'), 1000, 200)
        batch = quickest(lambda: method(*arguments), 1, 10)
        print(f'{name:16} a call {call * 1e6:7.3f} us, a state in a batch by the same route {kernel * 1e6:7.3f} us, 1e5 states {batch * 1e3:7.1f} ms')


main()
