#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Lets CasADi generate a robot's functions, and compiles what it printed, for bench_kernels --casadi.

    bench_kernels robot.urdf --model >robot.json
    casadi_peer.py robot.json --output DIR --functions rnea,aba,crba,minverse,id-derivatives,fd-derivatives,id-hessian

DIR/<function>.json describes each library: operations, seconds, flags.  What is there already, made of the same robot
by the same versions, stays.
"""
import argparse
import hashlib
import json
import pathlib
import subprocess
import time

import casadi as ca

from casadi_robot import FUNCTIONS, function_of, operations

FLAGS = ['-O3', '-march=native', '-DNDEBUG', '-fPIC', '-shared', '-w']


def produce(model, key, folder, compiler, limit):
    name = '.'.join(part for part in key if part)
    version = subprocess.run([compiler, '--version'], capture_output=True, text=True).stdout.splitlines()[0]
    recursions = pathlib.Path(__file__).with_name('casadi_robot.py').read_text()
    made_of = hashlib.sha256('\n'.join([json.dumps(model), recursions, ca.__version__, version, *FLAGS]).encode())
    report = folder / f'{name}.json'
    if report.exists():
        known = json.loads(report.read_text())
        if known['made_of'] == made_of.hexdigest() and ('absent' not in known or known['limit'] >= limit):
            return
    start = time.perf_counter()
    f = function_of(model, key)
    generator = ca.CodeGenerator('function.c', {'with_header': False})
    generator.add(f)
    source, library = folder / f'{name}.c', folder / f'{name}.so'
    source.write_text(generator.dump())
    generated = time.perf_counter()
    about = {'made_of': made_of.hexdigest(), 'route': 'CasADi' + (f', {key[1]}' if key[1] else ''), 'symbol': f.name(),
             'library': str(library.resolve()), 'operations': operations(f),
             'flags': ' '.join([compiler, *FLAGS[:3]]), 'limit': limit}
    try:
        subprocess.run([compiler, *FLAGS, str(source), '-o', str(library), '-lm'], check=True, timeout=limit)
    except subprocess.TimeoutExpired:
        about['absent'] = f'its {about["operations"]} operations do not compile within {limit} s'
    end = time.perf_counter()
    about |= {'compile_s': end - generated, 'made_s': end - start}
    report.write_text(json.dumps(about, indent=1) + '\n')


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('model', type=pathlib.Path)
    parser.add_argument('--output', type=pathlib.Path, required=True, metavar='DIR')
    parser.add_argument('--functions', default='rnea')
    parser.add_argument('--compiler', default='gcc')
    parser.add_argument('--limit', type=float, default=600, help='of one compilation [s] (default: 600)')
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    model = json.loads(options.model.read_text())
    for key in FUNCTIONS:
        if key[0] in options.functions.split(','):
            produce(model, key, options.output, options.compiler, options.limit)


if __name__ == '__main__':
    main()
