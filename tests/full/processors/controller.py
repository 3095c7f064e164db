#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Printed controllers on the host and on an emulated Cortex-M7 and M4F.

    controller.py DYNTAPE SOURCE_DIR WORK_DIR [STEPS]

Of each task: the text compiles without a warning by gcc, clang and arm-none-eabi-gcc; no symbol of malloc or libm is left;
the closed loop ends on the target where it ends on the host, to the bit in double; no random step takes more
instructions than the header states, and the longest more than half as many.
"""
import json
import pathlib
import re
import subprocess
import sys

FLAGS = ['-std=c99', '-O2', '-ffp-contract=off', '-Wall', '-Wextra', '-Wconversion', '-pedantic', '-Werror']
# Of a processor: flags of the compiler, and the emulated board.
M7 = (['-mcpu=cortex-m7', '-mfpu=fpv5-d16', '-mfloat-abi=hard'], 'mps2-an500')
M4 = (['-mcpu=cortex-m4', '-mfpu=fpv4-sp-d16', '-mfloat-abi=hard'], 'mps2-an386')
# Task, scalar, processors, intervals of the closed loop, where a state ends: index, value, distance.
CASES = [('cart_pole_swings_up', 'float', {'m7': M7, 'm4f': M4}, 100, [(0, 0, 0.05), (1, 3.14159265, 0.05)]),
         ('cart_pole_swings_up', 'double', {'m7': M7}, 100, [(0, 0, 0.05), (1, 3.14159265, 0.05)]),
         ('quadrotor_passes_post', 'float', {'m7': M7}, 80, [(0, 3, 0.05), (1, 0.4, 0.05), (2, 1.5, 0.05)]),
         ('ur5_follows_circle', 'float', {'m7': M7}, 100, [])]


def run(command, seconds=400):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=seconds)
    if done.returncode:
        raise RuntimeError(f'{" ".join(map(str, command))}: exit status {done.returncode}\n{done.stdout}{done.stderr}')
    return done.stdout + done.stderr


def numbers(output, name):
    return [int(value) for value in re.findall(rf'^{name} (-?\d+)$', output, re.M)]


class Controller:
    def __init__(self, dyntape, source, work, task, scalar):
        self.folder = work / task / scalar
        self.steps = source / 'tests/full/processors/controller/steps.c'
        self.target = source / 'tests/full/processors/target'
        self.report = json.loads(run([dyntape, 'generate', source / f'config/control/{task}.info', '--controller',
                                      self.folder, '--json', *(['--float'] if scalar == 'float' else [])]))
        self.text = pathlib.Path(self.report['files'][0])
        self.scalar = scalar

    def defines(self, loop, steps):
        r = self.report
        return [f'-DTEXT="{self.text.name}"', f'-DNAME={r["name"]}', f'-DSTATES={r["states"]}', f'-DCONTROLS={r["controls"]}',
                f'-DREAL={self.scalar}', f'-DLOOP={loop}', f'-DSTEPS={steps}', '-DBUDGETS=2', '-I', self.folder, '-I', self.target]

    def objects(self):
        """The text by itself, with every warning an error; bytes of code and constants, and symbols that are missing."""
        sizes = {}
        for name, command in {'gcc': ['gcc'], 'clang': ['clang'], 'm7': ['arm-none-eabi-gcc', *M7[0], '-ffreestanding']}.items():
            made = self.folder / f'{name}.o'
            run([*command, *FLAGS, '-c', self.text, '-o', made])
            tools = 'arm-none-eabi-' if name == 'm7' else ''
            undefined = re.findall(r'\bU (\S+)', run([f'{tools}nm', made]))
            sizes[name] = (sum(map(int, run([f'{tools}size', made]).splitlines()[1].split()[:2])), undefined)
        return sizes

    def on_host(self, loop):
        program = self.folder / 'host'
        run(['gcc', *FLAGS[:3], *self.defines(loop, 0), self.steps, self.target / 'hosted.c', '-o', program])
        return run([program])

    def on_target(self, name, flags, board, loop, steps):
        program = self.folder / name
        run(['arm-none-eabi-gcc', *flags, *FLAGS[:3], '-ffreestanding', '-nostdlib', '-T', self.target / 'cortex_m7.ld',
             *self.defines(loop, steps), self.steps, self.target / 'cortex.c', '-o', program, '-lgcc', '-lc'])
        return run(['qemu-system-arm', '-M', board, '-display', 'none', '-monitor', 'none', '-serial', 'none', '-icount',
                    'shift=0', '-semihosting-config', 'enable=on,target=native', '-kernel', program], 1500)


def main():
    dyntape, source, work = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    steps = int(sys.argv[4]) if len(sys.argv) > 4 else 100
    faults = 0

    def report(good, *words):
        nonlocal faults
        faults += not good
        print(*words, '' if good else '  FAILS', flush=True)

    for task, scalar, processors, loop, goals in CASES:
        controller = Controller(dyntape, source, work, task, scalar)
        r, head = controller.report, f'{task} {scalar}:'
        for name, (size, undefined) in controller.objects().items():
            allowed = {'memcpy', 'memset', 'memmove', '__stack_chk_fail'}
            allowed |= {name for name in undefined if name.startswith('__aeabi_')}
            report(set(undefined) <= allowed, head, f'{name}: {size} bytes of code and constants, undefined {undefined}')
        report(True, head, f'state {r["state_bytes"]} bytes, constants {r["constant_bytes"]}, stack {r["stack_bytes"]}')
        host = numbers(controller.on_host(loop), 'x')
        for index, value, distance in goals:
            report(abs(host[index] / 1e6 - value) <= distance, head, f'host: x[{index}] ends at {host[index] / 1e6}')
        for name, (flags, board) in processors.items():
            output = controller.on_target(name, flags, board, loop, steps)
            x = numbers(output, 'x')
            most = max(abs(a - b) for a, b in zip(x, host)) / 1e6
            report(x == host, head, f'{name}: the closed loop ends {most} from the host\'s')
            for budget, taken in zip(numbers(output, 'budget'), numbers(output, 'most')):
                bound = r['step']['sum'] + budget * r['iteration']['sum']
                report(bound / 2 <= taken <= bound, head, f'{name}: budget {budget}: {taken} instructions at most, bound '
                       f'{bound:.0f}, {taken / bound:.2f} of it')
            report(sum(numbers(output, 'not_finite')) == 0, head, f'{name}: steps that are not finite: {numbers(output, "not_finite")}')
    sys.exit(1 if faults else 0)


if __name__ == '__main__':
    main()
