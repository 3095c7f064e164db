#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Embedded text on the host, on aarch64 and on a Cortex-M7, both emulated: the same states, the same bits.

    embedded.py DYNTAPE SOURCE_DIR WORK_DIR

Panda's rnea with Jacobian and its fd-derivatives at 20 states.  With sines of its own the results are the host's bit
for bit; with libm, whose sin and cos differ, to rounding; in float within a tolerance of the double results.
On the Cortex-M7 the stack is measured by painting it, and has to be what the banner states.
Last, the usual text on aarch64: its kernel of two lanes against the one of a single state.
"""
import json
import pathlib
import random
import re
import struct
import subprocess
import sys

STATES = 20
M7 = ['arm-none-eabi-gcc', '-mcpu=cortex-m7', '-mfpu=fpv5-d16', '-mfloat-abi=hard', '-O2']
VARIANTS = {'libm': ['--functions', 'libm'], 'sines': [], 'float': ['--float']}
# Largest difference over largest entry.  libm: other last bits of sin and cos, seen 4e-16 and 2e-15; in float seen
# 3e-7 and 9e-7.
TOLERANCE = {'libm': {'rnea': 4e-15, 'fd-derivatives': 2e-14}, 'float': {'rnea': 3e-6, 'fd-derivatives': 1e-5}}


def run(command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=150, **options)
    if done.returncode:
        raise RuntimeError(f'{" ".join(map(str, command))}: exit status {done.returncode}\n{done.stdout}{done.stderr}')
    return done.stdout + done.stderr


def write_states(path, n):
    """Numbers that are floats as well; joints 1 and 2 have turned often in some states."""
    rng = random.Random(7)
    turns = {1: 1e3, 2: 1e9}
    rows = [[rng.uniform(-1, 1) * (turns.get(i, 1) if state % 5 == 4 else 1) for i in range(n)]
            for state in range(STATES)]
    rows = [struct.unpack(f'{n}f', struct.pack(f'{n}f', *row)) for row in rows]
    text = ',\n  '.join('{' + ', '.join(value.hex() for value in row) + '}' for row in rows)
    path.write_text(f'#define N_STATES {STATES}\nstatic const double states[{STATES}][{n}] = {{\n  {text}}};\n')


def numbers(output):
    bits = re.findall(r'^[0-9a-f]{16}$', output, re.M)
    return [struct.unpack('>d', bytes.fromhex(word))[0] for word in bits], bits


def difference(found, expected):
    assert len(found) == len(expected) > 0
    return max(abs(a - b) for a, b in zip(found, expected)) / max(abs(b) for b in expected)


def banner_flags(text):
    """What the banner says to compile with."""
    return re.search(r'compile with +(.*?)and never', text, re.S)[1].replace('*', '').split()


class Case:
    def __init__(self, dyntape, source, work, function, order, variant):
        self.function, self.variant = function, variant
        self.folder = work / function / variant
        self.folder.mkdir(parents=True, exist_ok=True)
        self.harness = source / 'tests/full/processors/embedded/harness.c'
        self.target = source / 'tests/full/processors/target'
        self.report = json.loads(
            run([dyntape, 'generate', source / 'config/robots/panda.urdf', '--lock',
                 'panda_finger_joint1,panda_finger_joint2', '--function', function, '--order', order, '--output',
                 self.folder, '--embedded', '--cross', ' '.join(M7), '--json', *VARIANTS[variant]]))
        entry = self.report['functions'][-1]
        header = pathlib.Path(self.report['files'][1]).read_text()
        sizes = re.search(entry['name'] + r'\(const (\w+) x\[(\d+)\], \w+ y\[(\d+)\](?:, \w+ jacobian\[(\d+)\])?',
                          header)
        self.stack = entry['stack_bytes']
        write_states(self.folder / 'states.h', int(sizes[2]))
        name = pathlib.Path(self.report['files'][1]).name
        self.defines = [f'-DHEADER="{name}"', f'-DFUNCTION={entry["name"]}', f'-DREAL={sizes[1]}',
                        f'-DN_X={sizes[2]}', f'-DN_Y={sizes[3]}', f'-DN_JACOBIAN={sizes[4] or 0}']

    def compile(self, compiler, target, more):
        """The text with the flags of its banner, warnings being errors."""
        text = pathlib.Path(self.report['files'][0])
        flags = banner_flags(text.read_text())
        program = self.folder / pathlib.Path(compiler[0]).name
        run([*compiler, *flags, '-std=c99', '-Wall', '-Wextra', '-Werror', '-I', self.folder, '-I', self.target,
             *self.defines, self.harness, self.target / target, text, '-o', program, *more])
        return program

    def results(self):
        """By target: what the program printed."""
        host = self.compile(['gcc', '-O2'], 'hosted.c', ['-lm'])
        arm64 = self.compile(['aarch64-linux-gnu-gcc', '-O2'], 'hosted.c', ['-lm'])
        # With sin and cos of its own the text needs nothing of the C library at all.
        libraries = ['-lm', '-lc', '-lgcc', '-lnosys'] if self.variant == 'libm' else ['-lgcc']
        m7 = self.compile(M7 + ['-ffreestanding', '-nostdlib', '-T', self.target / 'cortex_m7.ld'], 'cortex.c',
                          libraries)
        return {'host': run([host]), 'aarch64': run(['qemu-aarch64', '-L', '/usr/aarch64-linux-gnu', arm64]),
                'cortex-m7': run(['qemu-system-arm', '-M', 'mps2-an500', '-display', 'none', '-monitor', 'none',
                                  '-serial', 'none', '-semihosting-config', 'enable=on,target=native', '-kernel', m7])}


def lanes_on_arm64(dyntape, source, work, function):
    """What the program says that compares the kernels of one and of two lanes."""
    folder = work / 'lanes' / function
    folder.mkdir(parents=True)
    run([dyntape, 'generate', source / 'config/robots/panda.urdf', '--function', function, '--output', folder])
    text = next(folder.glob('*.c'))
    flags = banner_flags(text.read_text())
    descriptor = re.search(r'dyntape_[0-9a-f]{32}', text.read_text())[0]
    compiler = ['aarch64-linux-gnu-gcc', '-O2', '-std=c99', '-Wall', '-Wextra', '-Werror', *flags]
    objects = []
    for name, define in (('one', '-DDYNTAPE_X2'), ('two', '-DDYNTAPE_LANES=2')):
        objects.append(folder / f'{name}.o')
        run([*compiler, define, '-c', text, '-o', objects[-1]])
    program = folder / 'lanes'
    run([*compiler, '-I', folder, f'-DHEADER="{text.stem}.h"', f'-DDESCRIPTOR={descriptor}',
         source / 'tests/full/processors/embedded/lanes.c', *objects, '-o', program, '-lm'])
    return run(['qemu-aarch64', '-L', '/usr/aarch64-linux-gnu', program]).strip()


def main():
    dyntape, source, work = sys.argv[1], pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
    faults = 0

    def report(good, *words):
        nonlocal faults
        faults += not good
        print(*words, '' if good else '  FAILS', flush=True)

    for function, order in (('rnea', 1), ('fd-derivatives', 0)):
        double = None
        for variant in VARIANTS:
            case = Case(dyntape, source, work, function, order, variant)
            outputs = case.results()
            host, host_bits = numbers(outputs['host'])
            for target in ('aarch64', 'cortex-m7'):
                found, bits = numbers(outputs[target])
                head = f'{function} {variant} {target}: {len(found)} numbers,'
                if variant == 'libm':
                    error = difference(found, host)
                    report(error <= TOLERANCE['libm'][function], head, f'differ from the host by {error:.1e}')
                else:
                    report(bits == host_bits and bits, head, "the host's bits")
            if variant == 'libm':
                double = host
            elif variant == 'sines':
                error = difference(host, double)
                report(error <= TOLERANCE['libm'][function], f"{function} sines host: differs from libm's by {error:.1e}")
            else:
                error = difference(host, double)
                report(error <= TOLERANCE['float'][function], f'{function} float: differs from double by {error:.1e}')
            stack = int(re.search(r'^stack (\d+)$', outputs['cortex-m7'], re.M)[1])
            # On top comes what the harness takes, and libm.
            room = 800 if variant == 'libm' else 100
            report(case.stack * 0.9 <= stack <= case.stack + room,
                   f'{function} {variant} cortex-m7: stack {stack} bytes, stated {case.stack}')
    for function in ('rnea', 'fd-derivatives'):
        said = lanes_on_arm64(dyntape, source, work, function)
        report(said.startswith('0 of '), f'{function} two lanes on aarch64: {said}')
    sys.exit(1 if faults else 0)


if __name__ == '__main__':
    main()
