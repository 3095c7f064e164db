#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Lets CppADCodeGen generate a robot's functions, and compiles what it printed, for bench_kernels --generated.

    bench_kernels robot.urdf --model >robot.json
    cppadcodegen_peer.py robot.json --program build/bin/bench_cppadcodegen --output DIR --functions rnea,id-derivatives

DIR/<function>.cppadcodegen.json describes each library.
"""
import argparse
import json
import pathlib
import subprocess

import peer_library


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('model', type=pathlib.Path)
    parser.add_argument('--program', type=pathlib.Path, required=True, help='bench_cppadcodegen')
    parser.add_argument('--output', type=pathlib.Path, required=True, metavar='DIR')
    parser.add_argument('--functions', default='rnea')
    parser.add_argument('--compiler', default='gcc')
    parser.add_argument('--limit', type=float, default=600, help='of one compilation [s] (default: 600)')
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    printed = subprocess.run([options.program, options.model, '--output', options.output, '--functions',
                              options.functions], check=True, stdout=subprocess.PIPE, text=True).stdout
    for about in json.loads(printed):
        path = options.output / about['name']
        if 'absent' in about:
            path.with_name(path.name + '.json').write_text(json.dumps(about, indent=1) + '\n')
            continue
        sources = sorted(pathlib.Path(about['sources']).glob('function_*.c'))
        of = peer_library.made_of(options.compiler, *(source.read_text() for source in sources))
        if not peer_library.is_made(path, of, options.limit):
            peer_library.make(path, sources, about | {'made_of': of}, options.compiler, options.limit)


if __name__ == '__main__':
    main()
