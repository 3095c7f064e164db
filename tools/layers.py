#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fails where the tree goes against docs/architecture.md: an include against an arrow, somebody else's detail/, a
cycle of units, a file or a room that has outgrown its budget.

    tools/layers.py            check the tree
    tools/layers.py --rooms    print the rooms: files, lines, budgets
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Room: the rooms that it may include besides itself and autodiff/'s leaves; most files; most lines.
# A budget is raised only together with a reason, in the same commit.  Those of interface/ leave room for verdicts that
# look between points and tell of every element that a file has.
AUTODIFF = ['autodiff/graph', 'autodiff/derive', 'autodiff/scalars', 'autodiff/evaluate', 'autodiff/record']
DYNAMICS = ['dynamics/algebra', 'dynamics/model', 'dynamics/algorithms', 'dynamics/effects', 'dynamics/contact']
ASKED = ['codegen/options', 'codegen/flags', 'codegen/lane_widths']  # what is asked for: below all of codegen/
CODEGEN = ASKED + ['codegen/system', 'codegen/passes', 'codegen/schedule', 'codegen/print', 'codegen/store', 'codegen/build',
                   'codegen/run']
ROOMS = {
    'autodiff': ([], 11, 640),
    'autodiff/graph': ([], 15, 2200),
    'autodiff/derive': (['autodiff/graph'], 15, 1900),
    'autodiff/scalars': (['autodiff/graph'], 9, 1000),
    'autodiff/evaluate': (['autodiff/graph', 'autodiff/scalars'], 10, 1000),
    'autodiff/record': (['autodiff/graph', 'autodiff/evaluate'], 7, 900),
    'dynamics/algebra': ([], 12, 1500),
    'dynamics/model': (['dynamics/algebra'], 17, 1450),
    'dynamics/algorithms': (['dynamics/algebra', 'dynamics/model'], 38, 5250),  # a header and its definitions a part
    'dynamics/effects': (DYNAMICS[:3], 30, 2700),  # fourteen effects, a file each, that describe themselves
    'dynamics/contact': (DYNAMICS[:4], 14, 1600),  # and the laws of contacts that push, impacts
    'dynamics/simulation': (['dynamics/algebra', 'dynamics/model'], 4, 400),  # what a state is, steps, the least action
    'dynamics/urdf': (['dynamics/algebra', 'dynamics/model'], 21, 2300),  # shapes and meshes: what a robot looks like; what nothing reads
    'dynamics': (DYNAMICS, 2, 100),
    'codegen/options': (['autodiff/graph', 'autodiff/derive', 'autodiff/scalars'], 3, 150),
    'codegen/flags': (['autodiff/graph', 'codegen/system'], 3, 250),
    'codegen/lane_widths': (['codegen/options'], 3, 100),
    'codegen/system': ([], 10, 850),
    'codegen/passes': (['autodiff/graph', *ASKED], 12, 1250),
    'codegen/schedule': (['autodiff/graph'], 6, 650),
    'codegen/print': (['autodiff/graph', *ASKED, 'codegen/system', 'codegen/schedule'], 20, 2300),
    'codegen/store': (['codegen/system', 'codegen/print'], 9, 950),
    'codegen/build': (['codegen/system', *ASKED, 'codegen/print', 'codegen/store'], 11, 1100),
    'codegen/run': (['autodiff/scalars', 'codegen/store'], 7, 400),
    'codegen': ([*AUTODIFF, *CODEGEN], 15, 1350),
    'interface/io': (['codegen/system'], 31, 3050),  # settings, tables, pictures, lines that live on a terminal
    'interface/robot': ([*AUTODIFF, *DYNAMICS, 'codegen', 'codegen/options', 'codegen/system'], 28, 3000),
    'interface/ocs2': ([*AUTODIFF, 'codegen', *ASKED, 'codegen/run', 'interface/io', 'interface/robot'], 9, 1250),
    'interface/solvers': (['autodiff/graph', 'interface/io'], 42, 4750),  # Ipopt; our own from stage to stage: chains, barrier,
    # restoration; Riccati's recursion; closed motions, whose ends are tied
    'interface/scene': ([*AUTODIFF, *DYNAMICS, 'dynamics/urdf', 'codegen', 'codegen/options', 'interface/io', 'interface/robot',
                         'interface/simulation', 'interface/player'], 59, 5600),  # keys, motion, energies, doubts, costs, results;
    # loops, and steps with rigid contacts; balances of each mechanism, servos, how accurate a motion is
    'interface/ocp': ([*AUTODIFF, *DYNAMICS, 'interface/io', 'interface/robot', 'interface/scene'], 38, 4700),
    # penalties of soft terms,
    # ready terms: places of frames, bodies that keep clear; inverse kinematics for guesses; parameters; the duration as a
    # state; configurations with orientations; what drives a robot: joints, thrusters, contacts; a robot as one mass on its feet; phases; steps
    # of a gait
    'interface/transcription': ([*AUTODIFF, 'codegen', *ASKED, 'interface/io', 'interface/ocp', 'interface/solvers'], 35, 5100),
    # values that change between solves; families of schemes
    'interface/mpc': (['codegen', 'interface/io', 'interface/ocp', 'interface/solvers', 'interface/transcription'], 7, 850),  # plans with gains, feedback in loops
    'interface/sensitivity': ([*AUTODIFF, 'codegen', *ASKED, 'interface/io', 'interface/ocp', 'interface/solvers',
                               'interface/transcription'], 10, 1900),  # slopes of solutions, motions, roll-outs, quadratic programs
    'interface/simulation': ([*AUTODIFF, 'dynamics/algebra', 'dynamics/model', 'dynamics/simulation', 'codegen',
                              'codegen/options', 'interface/io'], 26, 3000),  # systems, schemes on the tape, Newton, Jacobians, CVODES, events
    'interface/sweep': ([*AUTODIFF, *DYNAMICS, 'codegen', 'codegen/options', 'codegen/run', 'codegen/system', 'interface/io',
                         'interface/robot', 'interface/scene', 'interface/simulation'], 25, 3050),  # keys, lanes, chunks, peers, results
    'interface/identification': ([*AUTODIFF, *DYNAMICS, 'interface/io', 'interface/solvers'], 16, 1250),
    'interface/player': ([*DYNAMICS, 'dynamics/urdf', 'interface/io'], 10, 800),
    'interface/task': (['dynamics/model', 'dynamics/urdf', 'interface/io', 'interface/scene', 'interface/ocp', 'interface/player',
                        'interface/solvers', 'interface/transcription', 'interface/mpc'], 47, 6200),  # keys, places, thrusters, bases,
    # limits, verdict, refinement, results; ready terms by name, waypoints, a motion to follow; phases; closed motions; as a controller, with feedback;
    # by differential dynamic programming; robots as one mass: keys, loop, pictures
    'interface': ([], 2, 50),
    'tools/dyntape': (['autodiff', 'dynamics', 'codegen', 'interface'], 32, 3250),  # simulate, sweep, mpc
    'tools/mpi': (['dynamics', 'codegen', 'interface', 'tools/dyntape'], 1, 250),
    'tests': (['autodiff', 'dynamics', 'codegen', 'interface', 'tools'], None, None),
}
LEAVES = {'autodiff/error.h', 'autodiff/suggest.h', 'autodiff/text_file.h', 'autodiff/processor.h', 'autodiff/eigen_layout.h'}
TABLE_READERS = {'autodiff/graph/op.h', 'autodiff/derive/expr.h', 'autodiff/record/scalar.h', 'autodiff/scalars/jet.h',
                 'autodiff/record/record.cpp', 'autodiff/evaluate/interpret_lanes.cpp', 'autodiff/scalars/portable.h',
                 'autodiff/scalars/pack.h', 'autodiff/scalars/pack_functions.cpp'}
MOST_LINES = 500
SOURCES = ('.h', '.hxx', '.cpp', '.def')
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]')


def is_below(path, room):
    return path == room or path.startswith(room + '/') or path.startswith(room + '.')


def room_of(path):
    return max((room for room in ROOMS if is_below(path, room)), key=len, default=None)


def unit_of(path):
    return re.sub(r'\.(h|hxx|cpp|def)$', '', path.replace('/detail/', '/'))


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


def complaints_of(path, lines, units):
    room = room_of(path)
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
        if unit_of(target) != unit_of(path) and not path.startswith(('tests/', 'tools/')):
            units.setdefault(unit_of(path), set()).add(unit_of(target))
        if is_hidden(path, target):
            yield f'{where}: {target} belongs to {target.split("/detail/")[0]} alone'
        to = room_of(target)
        allowed = [room, *ROOMS[room][0]]
        if to in allowed or (room.startswith(('tools', 'tests')) and any(is_below(target, a) for a in allowed)):
            continue
        yield f'{where}: {room} may not include {target}'


def main():
    problems, units = [], {}
    files, lines_of = {room: 0 for room in ROOMS}, {room: 0 for room in ROOMS}
    for file in sorted(ROOT.rglob('*')):
        path = file.relative_to(ROOT).as_posix()
        room = room_of(path)
        if file.suffix not in SOURCES or room is None:
            continue
        lines = file.read_text().splitlines()
        files[room] += 1
        lines_of[room] += len(lines)
        if len(lines) > MOST_LINES:
            problems.append(f'{path}: {len(lines)} lines, the limit is {MOST_LINES}')
        problems += complaints_of(path, lines, units)
    for room, (_, most_files, most_lines) in ROOMS.items():
        if '--rooms' in sys.argv:
            print(f'{room:28} {files[room]:3} files of {most_files}, {lines_of[room]:5} lines of {most_lines}')
        if most_files and files[room] > most_files:
            problems.append(f'{room}: {files[room]} files, the budget is {most_files}')
        if most_lines and lines_of[room] > most_lines:
            problems.append(f'{room}: {lines_of[room]} lines, the budget is {most_lines}')
    problems += ['cycle of units: ' + ', '.join(cycle) for cycle in cycles(units)]
    for problem in problems:
        print(problem)
    print(f'{len(problems)} problems of layering and size' if problems else 'layers and sizes hold')
    return 1 if problems else 0


sys.exit(main())
