#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Lets CasADi generate a robot's functions, and compiles what it printed, for bench_kernels --generated.

    bench_kernels robot.urdf --model >robot.json
    casadi_peer.py robot.json --output DIR --functions rnea,aba,crba,minverse,id-derivatives,fd-derivatives,id-hessian

DIR/<function>.json describes each library: operations, seconds, flags.  What is there already, made of the same robot
by the same versions, stays.
"""
import argparse
import json
import pathlib
import time

import casadi as ca

import peer_library
from casadi_robot import FUNCTIONS, function_of, operations


def produce(model, key, folder, compiler, limit):
    name = '.'.join(part for part in key if part)
    recursions = pathlib.Path(__file__).with_name('casadi_robot.py').read_text()
    made_of = peer_library.made_of(compiler, json.dumps(model), recursions, ca.__version__)
    if peer_library.is_made(folder / name, made_of, limit):
        return
    start = time.perf_counter()
    f = function_of(model, key)
    generator = ca.CodeGenerator('function.c', {'with_header': False})
    generator.add(f)
    source = folder / f'{name}.c'
    source.write_text(generator.dump())
    about = {'made_of': made_of, 'route': 'CasADi' + (f', {key[1]}' if key[1] else ''), 'symbol': f.name(),
             'operations': operations(f), 'generated_s': time.perf_counter() - start}
    peer_library.make(folder / name, [source], about, compiler, limit)


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
