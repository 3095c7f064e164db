#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""By hand: instructions of one evaluation of robots' functions on aarch64 and x86-64-v3, counted by qemu: the table of docs/platforms.md.

    ninja -C build evaluations && cmake --preset aarch64 -DDYNTAPE_TESTS=ON && ninja -C build/aarch64 evaluations
    build/peers/bin/python tests/full/processors/instructions.py build      build/peers: tests/bench/run makes it

dyntape by each route through the library, and the C that it prints (text) alone; Pinocchio as its users compile it (-O3 -DNDEBUG), and the C that CasADi
prints (-O3), for -mcpu=cortex-a76 and -march=x86-64-v3; `--processors x86-64-v2` has registers of two doubles, as aarch64.  Of Pinocchio's conventions
and CasADi's variants the one with fewer instructions counts.  Routes through the library are left out where build/aarch64 has no evaluations.
"""
import argparse
import json
import os
import pathlib
import re
import subprocess
import sys

import casadi as ca

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / 'tests/bench/peers'))
from casadi_robot import FUNCTIONS as CASADI, function_of  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
STATES = 64  # that many are evaluated together in lanes
FUNCTIONS = ['rnea', 'aba', 'crba', 'id-derivatives', 'fd-derivatives']
ROBOTS = {'ur5': '', 'simple_humanoid': ':floating'}
ROUTES = ['double', 'packs', 'machine-code', 'compiled', 'machine-code+lanes', 'compiled+lanes']
PINOCCHIO = ['-std=c++20', '-O3', '-DNDEBUG', '-w', '-Wno-psabi', '-DBOOST_MPL_LIMIT_LIST_SIZE=30', '-DBOOST_MPL_LIMIT_VECTOR_SIZE=30',
             '-DBOOST_MPL_CFG_NO_PREPROCESSED_HEADERS', '-DBOOST_FUSION_INVOKE_MAX_ARITY=12']


class Processor:
    """Compilers, emulator and dyntape's program for one processor; peers are compiled into `folder`."""

    def __init__(self, name, build, folder):
        self.name, self.folder = name, folder / name
        self.folder.mkdir(parents=True, exist_ok=True)
        sysroot = build / 'aarch64/sysroot'
        if name == 'aarch64':
            self.flags, self.prefix, self.root = ['-mcpu=cortex-a76'], 'aarch64-linux-gnu-', sysroot
            self.emulator, self.evaluations = [ROOT / 'tools/aarch64_run'], build / 'aarch64/bin/evaluations'
            self.own, self.lanes = [f'--sysroot={sysroot}'], 2
            self.level = ['-O1', '-mpc-relative-literal-loads', '-fpeephole2', '-fipa-ra']  # as codegen/build compiles
        else:
            self.flags, self.prefix, self.root, self.own = ['-march=' + name], '', pathlib.Path('/'), []
            self.lanes = {'x86-64-v2': 2, 'x86-64-v3': 4}[name]
            self.level = ['-O1', '-fira-algorithm=priority']
            self.emulator, self.evaluations = ['qemu-x86_64', '-cpu', 'max'], build / 'bin/evaluations'
        self.include = build / 'include'
        # dyntape's compiler knows no processor of its own.
        compiler = self.folder / 'cc'
        compiler.write_text(f'#!/bin/bash\nexec {self.prefix}gcc "${{@/#-m*=native/{self.flags[0]}}}"\n')
        compiler.chmod(0o755)
        self.environment = os.environ | {'DYNTAPE_CC': str(compiler), 'DYNTAPE_CACHE': str(self.folder / 'cache'), 'DYNTAPE_PROCESSOR': '',
                                         'DYNTAPE_THREADS': '1'}

    def compile(self, compiler, *words):
        subprocess.run([self.prefix + compiler, *self.own, *self.flags, *map(str, words)], check=True)

    def instructions(self, program, *words):
        """Of one evaluation; None: the program failed."""
        # qemu reads its options from the environment too.
        ran = subprocess.run([*self.emulator, program, *words, str(STATES)], capture_output=True, text=True,
                             env=self.environment | {'QEMU_PLUGIN': f'file={self.folder.parent}/count.so'})
        marks = [int(number) for number in re.findall(r'^instructions (\d+)', ran.stderr, re.M)]
        return round((marks[1] - marks[0]) / STATES) if ran.returncode == 0 else None

    def text(self, printed, lanes):
        """A program of the C that dyntape printed: Printed."""
        program = self.folder / f'text.{printed.name}.{lanes}'
        run = f'{printed.name}_value' + (f'_x{lanes}' if lanes > 1 else '')
        self.compile('gcc', *self.level, *printed.flags, f'-DDYNTAPE_LANES={lanes}', '-c', printed.source, '-o', f'{program}.o')
        self.compile('gcc', '-O1', f'-DRUN={run}', f'-DLANES={lanes}', *printed.sizes, f'-I{self.include}', HERE / 'text_evaluations.c', f'{program}.o',
                     '-o', program, '-lm')
        return program

    def pinocchio(self):
        program, include = self.folder / 'pinocchio', next(pathlib.Path(sys.prefix).glob('lib/python*/site-packages/cmeel.prefix/include'))
        if not program.exists():
            self.compile('g++', *PINOCCHIO, '-isystem', include, '-isystem', self.root / 'usr/include/eigen3',
                         HERE / 'pinocchio_evaluations.cpp', '-o', program)
        return program

    def casadi(self, model, key):
        program = self.folder / '.'.join(['casadi', model['name'], *key])
        source = program.with_name(program.name + '.c')
        generator = ca.CodeGenerator('function.c', {'with_header': False})
        generator.add(function_of(model, key))
        text = generator.dump()
        if not program.exists() or source.read_text() != text:
            source.write_text(text)
            self.compile('gcc', '-O3', '-w', source, HERE / 'casadi_evaluations.c', '-o', program, '-lm')
        return program


class Printed:
    """The C of a robot's function, and how it is compiled but for the processor's flags."""

    def __init__(self, evaluations, urdf, function, folder):
        cache = folder / 'printed' / f'{pathlib.Path(urdf).stem}-{function}'
        subprocess.run([evaluations, urdf, function, 'compiled', '1'], check=True, env=os.environ | {'DYNTAPE_CACHE': str(cache)})
        manifest, = cache.glob('*/manifest.json')
        about, self.source = json.loads(manifest.read_text()), manifest.with_name('source.c')
        text = self.source.read_text()
        self.name = about['name']
        self.flags = [flag for flag in re.search(r'^flags (.*)$', about['key_text'], re.M)[1].split() if flag != '-march=native']
        outputs, work = (re.search(pattern, text)[1] for pattern in (r'\*   y +(\d+) values', r'\{0u, 1u, (\d+)u,'))
        self.sizes = [f'-DINPUTS={re.search(r"x +([0-9]+) variables", text)[1]}', f'-DOUTPUTS={outputs}', f'-DWORK={work}']


def counts(processor, urdf, model, file, function, printed):
    """Instructions by route, without those that do not exist."""
    all = {route: processor.instructions(processor.evaluations, urdf, function, route) for route in ROUTES if processor.evaluations.exists()}
    for column, lanes in ('text', 1), ('text+lanes', processor.lanes):
        all[column] = processor.instructions(processor.text(printed, lanes))
    least = lambda numbers: min((n for n in numbers if n is not None), default=None)
    all['Pinocchio'] = least(processor.instructions(processor.pinocchio(), file, name) for name in (function, function + '@world'))
    all['CasADi'] = least(processor.instructions(processor.casadi(model, key)) for key in CASADI if key[0] == function)
    return all


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('build', type=pathlib.Path)
    parser.add_argument('--robots', default=','.join(ROBOTS))
    parser.add_argument('--functions', default=','.join(FUNCTIONS))
    parser.add_argument('--processors', default='aarch64,x86-64-v3')
    options = parser.parse_args()
    build = options.build.resolve()
    folder = build / 'instructions'
    processors = [Processor(name, build, folder) for name in options.processors.split(',')]
    subprocess.run(['gcc', '-O1', '-shared', '-fPIC', HERE / 'instructions.c', '-o', folder / 'count.so'], check=True)
    columns = [*ROUTES, 'text', 'text+lanes', 'Pinocchio', 'CasADi']
    print('| robot, function | processor |', ' | '.join(columns), '|')
    print('|---|---|' + '--:|' * len(columns))
    for robot in options.robots.split(','):
        urdf, file = f'{ROOT}/config/robots/{robot}.urdf{ROBOTS[robot]}', folder / f'{robot}.json'
        file.write_bytes(subprocess.run([build / 'bin/evaluations', urdf, '--model'], check=True, capture_output=True).stdout)
        model = json.loads(file.read_text())
        for function in options.functions.split(','):
            printed = Printed(build / 'bin/evaluations', urdf, function, folder)
            for processor in processors:
                row = counts(processor, urdf, model, file, function, printed)
                print(f'| {robot}, `{function}` | {processor.name} |', ' | '.join(str(row.get(column) or '-') for column in columns), '|', flush=True)


if __name__ == '__main__':
    main()
