#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fails where the tree goes against docs/architecture.md: an include against an arrow, somebody else's detail/, a
cycle of units, a header without include guard, a file that is too long or a room that is too full.

    tools/layers.py            check the tree
    tools/layers.py --rooms    print the rooms: files, lines
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Room: the rooms that it may include besides itself and autodiff/'s leaves.
AUTODIFF = ['autodiff/graph', 'autodiff/derive', 'autodiff/scalars', 'autodiff/evaluate', 'autodiff/record']
DYNAMICS = ['dynamics/algebra', 'dynamics/model', 'dynamics/algorithms', 'dynamics/effects', 'dynamics/contact']
CODEGEN = ['codegen/options', 'codegen/system', 'codegen/passes', 'codegen/schedule', 'codegen/print', 'codegen/store', 'codegen/build',
                   'codegen/run', 'codegen/machine', 'codegen/device']
GENERATE = ['codegen', 'codegen/options']  # to ask for compiled functions
# Optimal control without robots, from what is solved to how.
PROBLEM, NLP, RICCATI, IPOPT, DISCRETIZE, SOLVE, BATCH, SENSITIVITY, MPC, PRINTED = (
    f'interface/control/{name}'
    for name in ('problem', 'nlp', 'riccati', 'ipopt', 'discretize', 'solve', 'batch', 'sensitivity', 'mpc', 'printed'))
CONTROL = [PROBLEM, NLP, RICCATI, IPOPT, DISCRETIZE, SOLVE, BATCH, MPC]
SYSTEM = ['interface/system', 'interface/system/steps', 'interface/system/rigid']
IO = 'interface/io'
ROOMS = {
    'autodiff': [],
    'autodiff/graph': [],
    'autodiff/derive': ['autodiff/graph'],
    'autodiff/scalars': ['autodiff/graph'],
    'autodiff/evaluate': ['autodiff/graph', 'autodiff/scalars'],
    'autodiff/record': ['autodiff/graph', 'autodiff/evaluate'],
    'autodiff/matrices': ['autodiff/graph', 'autodiff/derive', 'autodiff/record'],  # what record/ declares in detail/
    'dynamics/algebra': [],
    'dynamics/model': ['dynamics/algebra'],
    'dynamics/algorithms': ['dynamics/algebra', 'dynamics/model'],
    'dynamics/effects': DYNAMICS[:3],
    'dynamics/contact': DYNAMICS[:4],
    'dynamics/simulation': ['dynamics/algebra', 'dynamics/model'],
    'dynamics/urdf': ['dynamics/algebra', 'dynamics/model'],
    'dynamics': DYNAMICS,
    'codegen/options': ['autodiff/graph', 'autodiff/derive', 'autodiff/scalars', 'codegen/system'],
    'codegen/system': [],
    'codegen/passes': ['autodiff/graph'],
    'codegen/schedule': ['autodiff/graph', 'autodiff/scalars'],
    'codegen/print': ['autodiff/graph', 'codegen/options', 'codegen/system', 'codegen/schedule'],
    'codegen/store': ['codegen/system', 'codegen/print'],
    'codegen/device': ['autodiff/graph', 'codegen/system', 'codegen/options', 'codegen/schedule', 'codegen/print', 'codegen/store'],
    'codegen/build': ['codegen/system', 'codegen/options', 'codegen/print', 'codegen/store'],
    'codegen/run': ['autodiff/scalars', 'codegen/store'],
    'codegen/machine': ['autodiff', *AUTODIFF, 'codegen/options', 'codegen/system', 'codegen/store', 'codegen/run'],
    'codegen': [*AUTODIFF, *CODEGEN],
    IO: ['codegen/system'],
    'interface/robot/tables': [*AUTODIFF, *DYNAMICS, 'interface/robot'],
    'interface/robot/packs': [*AUTODIFF, *DYNAMICS, 'interface/robot', 'interface/robot/tables'],
    'interface/robot': [*AUTODIFF, *DYNAMICS, *GENERATE, 'codegen/system'],
    'interface/ocs2': [*AUTODIFF, 'codegen', 'codegen/options', 'codegen/run', IO, 'interface/robot',
                       'interface/ocs2/classes'],  # ocs2.h, which includes all
    'interface/ocs2/classes': [*AUTODIFF, *DYNAMICS, 'codegen', 'codegen/options', 'codegen/run', IO, 'interface/robot', 'interface/ocs2'],
    'interface/cppad': [*AUTODIFF, *GENERATE, *(f'interface/cppad/{name}' for name in ('bases', 'nodes', 'utilities', 'cg', 'graph'))],
    'interface/cppad/bases': [*AUTODIFF, 'interface/cppad', 'interface/cppad/nodes'],
    'interface/cppad/nodes': [*AUTODIFF, 'interface/cppad'],
    'interface/cppad/utilities': ['interface/cppad'],
    # Statements and C of users are printed and compiled there, without a pipeline.
    'interface/cppad/cg': [*AUTODIFF, *GENERATE, 'codegen/system', 'codegen/build', 'codegen/print', 'codegen/run', 'codegen/schedule',
                           'interface/cppad', 'interface/cppad/nodes'],
    'interface/cppad/graph': [*AUTODIFF, 'interface/cppad', 'interface/cppad/bases', 'interface/cppad/nodes'],
    'interface/cppad/drop_in': ['interface/cppad', *(f'interface/cppad/{name}' for name in ('cg', 'nodes', 'utilities'))],
    'interface/report/plot': ['codegen/system', IO],
    'interface/report/joints': [*DYNAMICS, 'interface/report/plot'],
    'interface/report/player': [*DYNAMICS, 'dynamics/urdf', IO],
    'interface/system': [*AUTODIFF, *DYNAMICS, 'dynamics/simulation', *GENERATE, IO, 'interface/robot'],
    'interface/system/steps': [*AUTODIFF, 'dynamics/algebra', 'dynamics/model', 'dynamics/simulation', *GENERATE, IO, 'interface/system'],
    'interface/system/rigid': [*AUTODIFF, *DYNAMICS, *GENERATE, IO, 'interface/robot', *SYSTEM],
    PROBLEM: [*AUTODIFF, IO],
    NLP: ['autodiff/graph', IO],
    RICCATI: ['autodiff/graph', IO, NLP],
    IPOPT: ['autodiff/graph', IO, NLP, RICCATI],
    DISCRETIZE: [*AUTODIFF, 'codegen', 'codegen/options', IO, PROBLEM, NLP, RICCATI],
    SOLVE: [*AUTODIFF, 'codegen', 'codegen/options', IO, PROBLEM, NLP, RICCATI, IPOPT, DISCRETIZE],
    BATCH: [*AUTODIFF, 'codegen', 'codegen/options', 'codegen/run', IO, PROBLEM, NLP, RICCATI, DISCRETIZE, SOLVE],
    SENSITIVITY: [*AUTODIFF, 'codegen', 'codegen/options', IO, PROBLEM, NLP, RICCATI, DISCRETIZE],
    PRINTED: [*AUTODIFF, 'codegen', 'codegen/options', 'codegen/print', 'codegen/build', IO, PROBLEM, NLP, DISCRETIZE],
    MPC: ['codegen', IO, PROBLEM, NLP, RICCATI, DISCRETIZE, SOLVE, PRINTED],
    'interface/motion': [*AUTODIFF, *DYNAMICS, IO, 'interface/robot', PROBLEM],
    'interface/files/info': [IO],
    'interface/files': ['dynamics/model', IO, 'interface/files/info'],
    'interface/files/scene': [*AUTODIFF, *DYNAMICS, 'dynamics/urdf', *GENERATE, IO, 'interface/robot', *SYSTEM, 'interface/files',
                              'interface/files/info'],
    'interface/files/sweep': [*AUTODIFF, *DYNAMICS, *GENERATE, IO, 'interface/robot', *SYSTEM, 'interface/files',
                              'interface/files/info', 'interface/files/scene'],
    'interface/files/task': ['dynamics/model', 'dynamics/urdf', IO, 'interface/robot', *CONTROL, 'interface/motion', 'interface/motion/tied', 'interface/report/player',
                             'interface/files', 'interface/files/info', 'interface/files/scene'],
    'interface/run/simulate': [*AUTODIFF, *DYNAMICS, *GENERATE, IO, 'interface/robot', *SYSTEM, 'interface/files', 'interface/files/scene'],
    'interface/run/rollout': [*AUTODIFF, *DYNAMICS, *GENERATE, 'codegen/run', IO, 'interface/robot', *SYSTEM, 'interface/motion', 'interface/files/scene'],
    'interface/run/sweep': [*AUTODIFF, *DYNAMICS, *GENERATE, 'codegen/run', 'codegen/system', IO, 'interface/robot', *SYSTEM,
                            'interface/files/scene', 'interface/files/sweep', 'interface/run/simulate'],
    'interface/run/solve': ['dynamics/model', 'dynamics/urdf', IO, 'interface/robot', *CONTROL, 'interface/motion', 'interface/motion/tied',
                            'interface/report/plot', 'interface/report/joints', 'interface/report/player', 'interface/files/scene', 'interface/files/task', 'interface/run/simulate'],
    'interface/run/mpc': [*DYNAMICS, IO, 'interface/robot', *SYSTEM, *CONTROL, 'interface/motion', 'interface/motion/tied', 'interface/report/plot',
                          'interface/report/player', 'interface/files', 'interface/files/info', 'interface/files/scene', 'interface/files/task',
                          'interface/run/simulate', 'interface/run/solve'],
    'interface/report': [*DYNAMICS, IO, 'interface/robot', 'interface/report/plot', 'interface/report/joints', 'interface/report/player', 'interface/files/scene',
                         'interface/files/sweep', 'interface/run/simulate', 'interface/run/sweep'],
    'interface/identification': [*AUTODIFF, *DYNAMICS, IO, NLP, IPOPT, 'interface/report/plot'],
    'interface': [],
    'tools/dyntape': ['autodiff', 'dynamics', 'codegen', 'interface'],
    'tools/dyntape/generate': ['autodiff', 'dynamics', 'codegen', 'interface', 'tools/dyntape'],
    'tools/mpi': ['dynamics', 'codegen', 'interface', 'tools/dyntape'],
    'tests': ['autodiff', 'dynamics', 'codegen', 'interface', 'tools'],
}
ROOMS['interface/motion/tied'] = [*ROOMS['interface/motion'], 'interface/control/discretize']  # of robots with mimic joints
ROOMS['interface/python'] = [room for room in ROOMS if room != 'tests']  # bindings of everything, which nobody includes
ROOMS['interface/python/bridges'] = ROOMS['interface/python']  # other tools, in their terms
ROOMS['interface/python/robots'] = ROOMS['interface/python']  # methods of a robot
ROOMS['interface/python/problems'] = ROOMS['interface/python']  # parts of a problem
ROOMS['interface/python/rollouts'] = ROOMS['interface/python']  # many motions of a scene
LEAVES = {'autodiff/error.h', 'autodiff/suggest.h', 'autodiff/text_file.h', 'autodiff/processor.h', 'autodiff/eigen_layout.h', 'autodiff/factorisations.h',
          'autodiff/own_sines.h', 'autodiff/scalars/sines.h', 'autodiff/scalars/sines_in_lanes.h'}
TABLE_READERS = {'autodiff/graph/op.h', 'autodiff/derive/expr.h', 'autodiff/record/scalar.h', 'autodiff/scalars/jet.h',
                 'autodiff/record/record.cpp', 'autodiff/evaluate/interpret_lanes.cpp', 'autodiff/scalars/portable.h',
                 'autodiff/scalars/pack.h', 'autodiff/scalars/pack_functions.cpp', 'interface/python/recorded_values.cpp', 'autodiff/evaluate/series.h', 'interface/cppad/ad.h',
                 'interface/cppad/bases/any_base.h', 'interface/cppad/bases/instantiate.hxx', 'interface/cppad/bases/recorded.hxx'}
UNGUARDED = ('autodiff/scalars/sines', 'interface/cppad/bases/instantiate', 'tests/golden/')  # included several times; printed
MOST_LINES = 500
MOST_FILES = 24  # side by side
SCRATCH = ('__pycache__', '.pytest_cache')  # not in the tree
WIDE = {'interface/python': 32, 'dynamics/algorithms': 38, 'dynamics/effects': 30, 'tools/dyntape': 32}  # a subject, a part, an effect, a command: two files each
# Cycles of units by definition, each with its reason.
CYCLES = {
    ('autodiff/graph/callee', 'autodiff/graph/function', 'autodiff/graph/graph'): 'a graph calls functions, and they are graphs',
    ('interface/files/sweep/sweep', 'interface/files/sweep/value_keys'): 'reading a sweep reads values of that type',
    ('interface/files/task/task', 'interface/files/task/task_phases'): 'a task is built of its phases, which are tasks',
    ('interface/identification/excitation', 'interface/identification/excitation_problem'): 'a solve makes its problem from its options',
    tuple(f'interface/report/plot/{name}' for name in ('picture', 'picture_layout', 'series_looks')): 'a plot is drawn by its layout and looks',
}
SOURCES = ('.h', '.hxx', '.cpp', '.def')
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')


def is_below(path, room):
    return path == room or path.startswith(room + '/') or path.startswith(room + '.')


def room_of(path):
    return max((room for room in ROOMS if is_below(path, room)), key=len, default=None)


DEFINED = re.compile(r'^[A-Za-z][\w:<>,&*\s]*?[\s&*](?:(\w+)::)?~?(\w+)\(', re.M)
DECLARED = re.compile(r'^\s*(?:class|struct)\s+(\w+)|\b([a-z]\w*)\(', re.M)


def stem_of(path):
    return re.sub(r'\.(h|hxx|cpp|def)$', '', path.replace('/detail/', '/'))


def units_of(texts):
    """Each file's unit: its header's.  A .cpp without a header of its name belongs to that one whose functions it defines."""
    headers = {stem_of(path) for path in texts if path.endswith('.h')}
    units = {path: stem_of(path) for path in texts}
    for path, text in texts.items():
        if not path.endswith('.cpp') or stem_of(path) in headers:
            continue
        defined = {name for pair in DEFINED.findall(text) for name in pair if name}
        shared = {}
        for line in text.splitlines():
            match = INCLUDE.match(line)
            target = match and match.group(1).removeprefix('dyntape/')
            if target in texts and target.endswith('.h') and room_of(target) == room_of(path):
                declared = {name for pair in DECLARED.findall(texts[target]) for name in pair if name}
                shared[target] = len(declared & defined)
        if shared and max(shared.values()) > 0:
            units[path] = stem_of(max(shared, key=shared.get))
    return units


def is_hidden(path, target):
    """Whether `target` stands in the detail/ of a part of the house that `path` is not in."""
    owner, found, _ = target.partition('/detail/')
    return found and not path.startswith(owner.split('/')[0] + '/') and not path.startswith('tests/')


def cycles(graph):
    """Strongly connected components of more than one unit (Tarjan)."""
    index, low, stack, found = {}, {}, [], []

    def visit(node):
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in graph.get(node, ()):
            if other not in index:
                visit(other)
            if other in stack:
                low[node] = min(low[node], low[other])
        if low[node] == index[node]:
            at = stack.index(node)
            if len(stack) - at > 1:
                found.append(sorted(stack[at:]))
            del stack[at:]

    for node in sorted(graph):
        if node not in index:
            visit(node)
    return found


def complaints_of(path, lines, unit_of, units):
    room = room_of(path)
    if path.endswith('.h') and not path.startswith(UNGUARDED) and not any(line.startswith(('#pragma once', '#ifndef')) for line in lines):
        yield f'{path}: no #pragma once'
    for number, line in enumerate(lines, 1):
        match = INCLUDE.match(line)
        if not match:
            continue
        target = match.group(1).removeprefix('dyntape/')
        where = f'{path}:{number}'
        if target.endswith('ops.def') and path not in TABLE_READERS and not path.startswith('tests/'):
            yield f'{where}: reads the operator table; only {", ".join(sorted(TABLE_READERS))} may'
        if not match.group(1).startswith('dyntape/') or target in LEAVES:
            continue
        if unit_of.get(target, target) != unit_of[path] and not path.startswith(('tests/', 'tools/')):
            units.setdefault(unit_of[path], set()).add(unit_of.get(target, target))
        if is_hidden(path, target):
            yield f'{where}: {target} belongs to {target.split("/detail/")[0]} alone'
        to = room_of(target)
        allowed = [room, *ROOMS[room]]
        if to in allowed or (room.startswith(('tools', 'tests')) and any(is_below(target, a) for a in allowed)):
            continue
        yield f'{where}: {room} may not include {target}'


def main():
    problems, units = [], {}
    files, lines_of = {room: 0 for room in ROOMS}, {room: 0 for room in ROOMS}
    texts = {path: file.read_text() for file in sorted(ROOT.rglob('*')) if file.suffix in SOURCES
             and room_of(path := file.relative_to(ROOT).as_posix()) is not None}
    unit_of = units_of(texts)
    for path, text in texts.items():
        room, lines = room_of(path), text.splitlines()
        files[room] += 1
        lines_of[room] += len(lines)
        if len(lines) > MOST_LINES:
            problems.append(f'{path}: {len(lines)} lines, the limit is {MOST_LINES}')
        problems += complaints_of(path, lines, unit_of, units)
    for room in ROOMS:
        if '--rooms' in sys.argv:
            print(f'{room:28} {files[room]:3} files, {lines_of[room]:5} lines')
        if room != 'tests' and files[room] > WIDE.get(room, MOST_FILES):
            problems.append(f'{room}: {files[room]} files side by side, the limit is {WIDE.get(room, MOST_FILES)}')
    for folder in [path for path in sorted((ROOT / 'tests').rglob('*')) if path.is_dir() and path.name not in SCRATCH]:
        count = sum(path.is_file() for path in folder.iterdir())
        if count > MOST_FILES:
            problems.append(f'{folder.relative_to(ROOT).as_posix()}: {count} files side by side, the limit is {MOST_FILES}')
    problems += [f'cycle of units: {", ".join(cycle)}' for cycle in cycles(units) if tuple(cycle) not in CYCLES]
    for problem in problems:
        print(problem)
    print(f'{len(problems)} problems of layering and size' if problems else 'layers and sizes hold')
    return 1 if problems else 0


sys.exit(main())
