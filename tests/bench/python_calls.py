#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a call from Python costs beyond the kernel that it runs, and 1e5 states at once.

    DYNTAPE_THREADS=1 python3 tests/bench/python_calls.py       beside the same kernels on one core
    python3 tests/bench/python_calls.py                         on all

The kernel's time is that of a state in a batch by the same route, "analytic", whose states are read one after the other.  Both
are the least of many short rounds by turns, which others on the machine disturb least.
"""
import time

import dyntape
import numpy as np

COUNT = 100_000
FUNCTIONS = {
    'rnea': 'qvv', 'crba': 'q', 'id_derivatives': 'qvv', 'constrained_derivatives': 'qvv', 'frame_placement': 'q',
    'frame_acceleration_derivatives': 'qvv',
}  # fmt: skip


def seconds(work, count):
    begin = time.perf_counter()
    work()
    return (time.perf_counter() - begin) / count


def main():
    robot = dyntape.load(dyntape.config_folder() / 'robots/panda.urdf', lock=['panda_finger_joint1', 'panda_finger_joint2'])
    q, v = robot.random(COUNT), np.random.default_rng(1).normal(size=(COUNT, robot.nv))
    for name, inputs in FUNCTIONS.items():
        method, arguments = getattr(robot, name), [q if x == 'q' else v for x in inputs]
        one, some = [x[0].copy() for x in arguments], [x[:1000] for x in arguments]

        def calls():
            for _ in range(300):
                method(*one)

        call = kernel = np.inf
        for _ in range(300):
            call = min(call, seconds(calls, 300))
            kernel = min(kernel, seconds(lambda: method(*some, route='analytic'), 1000))
        batch = min(seconds(lambda: method(*arguments), 1) for _ in range(10))
        print(f'{name:30} a call {call * 1e6:7.3f} us, {(call - kernel) * 1e6:6.3f} us beyond the kernel, 1e5 states {batch * 1e3:7.1f} ms')


main()
