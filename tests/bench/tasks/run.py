#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Six tasks from Python by dyntape, Pinocchio + CasADi, Crocoddyl and MuJoCo: lines, time to the first result, run time.

    tools/build --python
    python3 -m venv build/tasks && build/tasks/bin/pip install casadi mujoco numpy scipy crocoddyl==3.1.0 libpinocchio==3.8.0 cmeel-urdfdom==4.0.1 cmeel-tinyxml2==10.0.0
    PYTHONPATH=build/python build/tasks/bin/python tests/bench/tasks/run.py [TASK ...]

Panda without its fingers, 7 joints.  The tasks, one function each in *_tasks.py:
    torques       inverse dynamics of 100 000 states
    derivatives   of forward dynamics by q, 10 000 states
    own_cost      the exact Hessian of a cost of one's own, hand's place and gravity's torques, at 1000 states
    reach         an optimal motion: squares of what is missed and of torques, 100 steps of Runge-Kutta
    simulate      1024 robots, 100 steps of semi-implicit Euler
    slopes        of the last state of such a motion by its 700 torques

Lines: of the function, imports included, blank ones and comments not; `+`: of the robot in CasADi's symbols.  First: from the start of the
interpreter to the first result, imports, loading and compilation included.  Again: the quickest of the runs after it.  Results are
compared with dyntape's: within 1e-9, differences within 1e-4.  Prints one table.
"""
import importlib
import inspect
import io
import json
import pathlib
import subprocess
import sys
import tempfile
import time
import tokenize

import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
TASKS = {'torques': 1e-9, 'derivatives': 1e-9, 'own_cost': 1e-9, 'reach': 1e-7, 'simulate': 1e-9, 'slopes': 1e-9}
BY_DIFFERENCES = {('mujoco', 'derivatives'), ('mujoco', 'own_cost'), ('mujoco', 'slopes')}
LIBRARIES = {'dyntape': 'dyntape', 'pinocchio_casadi': 'Pinocchio + CasADi', 'crocoddyl': 'Crocoddyl', 'mujoco': 'MuJoCo'}
SYMBOLS = {'own_cost': ['rnea'], 'reach': ['aba'], 'slopes': ['aba']}  # of casadi_robot.py, that the task takes besides the robot


def lines(*parts):
    """Lines on which there is more than a comment or a docstring."""
    found = set()
    for k, part in enumerate(parts):
        for token in tokenize.generate_tokens(io.StringIO(inspect.getsource(part)).readline):
            is_text = token.type == tokenize.STRING and token.line.lstrip().startswith('"""')
            if not is_text and token.type not in (tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER):
                found |= {(k, row) for row in range(token.start[0], token.end[0] + 1)}
    return len(found)


def lines_of(library, module, task):
    own = lines(getattr(module, task)) - 1  # without `def`
    if library != 'pinocchio_casadi' or task not in SYMBOLS:
        return own, 0
    robot = importlib.import_module('casadi_robot')
    shared = [robot.Robot, robot.cross_motion, robot.cross_force, robot.columns, robot.symmetric, module.casadi_model]
    return own, lines(*shared, *(getattr(robot, name) for name in SYMBOLS[task]))


def child(library, task, began, file):
    module = importlib.import_module(f'{library}_tasks')
    run = getattr(module, task)()
    result = np.asarray(run())
    first, again, spent = time.time() - float(began), [], 0
    while len(again) < 2 or (spent < 3 and len(again) < 20):
        begin = time.perf_counter()
        run()
        again.append(time.perf_counter() - begin)
        spent += again[-1]
    np.save(file, result)
    own, symbols = lines_of(library, module, task)
    print(json.dumps({'first': first, 'again': min(again), 'lines': own, 'symbols': symbols}))


def measure(library, task, folder):
    if f'def {task}(' not in (HERE / f'{library}_tasks.py').read_text():
        return None
    file = folder / f'{library}_{task}.npy'
    done = subprocess.run([sys.executable, __file__, '--child', library, task, str(time.time()), file], text=True, capture_output=True)
    if done.returncode != 0:
        raise SystemExit(f'run.py: {task} by {LIBRARIES[library]} failed:\n{done.stderr}')
    row = json.loads(done.stdout.splitlines()[-1])
    own, theirs = (np.load(folder / f'{name}_{task}.npy') for name in ('dyntape', library))
    bound = 1e-4 if (library, task) in BY_DIFFERENCES else TASKS[task]
    row['apart'] = float(np.abs(theirs - own).max() / np.abs(own).max())
    if own.shape != theirs.shape or not row['apart'] < bound:
        raise SystemExit(f'run.py: {task}: {LIBRARIES[library]} differs from dyntape by {row["apart"]:.1e} of the largest entry; expected less than {bound:.0e}')
    return row


def seconds(value):
    return f'{value:.1f} s' if value >= 1 else f'{value * 1e3:.3g} ms'


def main():
    chosen = sys.argv[1:] or list(TASKS)
    for task in chosen:
        if task not in TASKS:
            raise SystemExit(f'run.py: there is no task "{task}"; choose of {", ".join(TASKS)}')
    print('| task | by | lines | first | again | of dyntape | apart |')
    print('|---|---|--:|--:|--:|--:|--:|')
    with tempfile.TemporaryDirectory() as folder:
        for task in chosen:
            rows = {library: measure(library, task, pathlib.Path(folder)) for library in LIBRARIES}
            for library, row in rows.items():
                if row is None:
                    print(f'| {task} | {LIBRARIES[library]} | not there | | | | |', flush=True)
                    continue
                more = f' + {row["symbols"]}' if row['symbols'] else ''
                print(f'| {task} | {LIBRARIES[library]} | {row["lines"]}{more} | {seconds(row["first"])} | {seconds(row["again"])} | '
                      f'{row["again"] / rows["dyntape"]["again"]:.1f} | {row["apart"]:.0e} |', flush=True)


if __name__ == '__main__':
    sys.path[:0] = [str(HERE), str(HERE.parent / 'peers')]
    child(*sys.argv[2:]) if sys.argv[1:2] == ['--child'] else main()
