#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fails where an include goes against the arrows of docs/architecture.md, or a file has outgrown its room.

    tools/layers.py            check the tree
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# folder -> the folders it may include besides itself; the longest matching prefix of a path decides.
MAY_INCLUDE = {
    'autodiff': [],
    'dynamics': [],
    'codegen': ['autodiff'],
    'interface/io': [],
    'interface/function': ['autodiff', 'dynamics', 'codegen', 'interface/io'],
    'interface/identification': ['autodiff', 'dynamics', 'interface/io', 'interface/function', 'interface/solvers'],
    'interface/ocp': ['autodiff', 'dynamics', 'codegen', 'interface/io', 'interface/function', 'interface/solvers'],
    'interface/solvers': ['autodiff', 'interface/io'],
    'tools': ['autodiff', 'dynamics', 'codegen', 'interface'],
    'tests': ['autodiff', 'dynamics', 'codegen', 'interface', 'tools'],
}
EVERYBODY_MAY_INCLUDE = {'autodiff/error.h', 'autodiff/suggest.h', 'autodiff/text_file.h', 'autodiff/processor.h', 'autodiff/eigen_layout.h'}  # leaves
TABLE_READERS = {'autodiff/graph/op.h', 'autodiff/derive/expr.h', 'autodiff/record/scalar.h', 'autodiff/scalars/jet.h', 'autodiff/record/record.cpp', 'autodiff/evaluate/interpret_lanes.cpp', 'codegen/print/print_c.cpp'}
MOST_LINES = 500
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')


def room(path):
    matches = [folder for folder in MAY_INCLUDE if path == folder or path.startswith(folder + '/')]
    return max(matches, key=len, default=None)


def main():
    problems = []
    for file in sorted(ROOT.rglob('*')):
        path = file.relative_to(ROOT).as_posix()
        if file.suffix not in ('.h', '.hxx', '.cpp', '.def') or room(path) is None:
            continue
        lines = file.read_text().splitlines()
        if len(lines) > MOST_LINES:
            problems.append(f'{path}: {len(lines)} lines, the limit is {MOST_LINES}')
        allowed = [room(path), *MAY_INCLUDE[room(path)]]
        for number, line in enumerate(lines, 1):
            match = INCLUDE.match(line)
            if not match:
                continue
            target = match.group(1).removeprefix('dyntape/')
            if target.endswith('ops.def') and path not in TABLE_READERS and not path.startswith('tests/'):
                problems.append(f'{path}:{number}: reads the operator table; only {", ".join(sorted(TABLE_READERS))} may')
            if target in EVERYBODY_MAY_INCLUDE or not match.group(1).startswith('dyntape/'):
                continue
            if not any(target.startswith(folder + '/') for folder in allowed):
                problems.append(f'{path}:{number}: {room(path)} may not include {target}')
    for problem in problems:
        print(problem)
    print(f'{len(problems)} problems of layering and size' if problems else 'layers and sizes hold')
    return 1 if problems else 0


sys.exit(main())
