# SPDX-License-Identifier: BSD-3-Clause
"""The page of benchmarks: pictures and tables, all of it from the table that tests/bench/run has measured.

    make(pathlib.Path('docs/studies/benchmarks.csv'), pathlib.Path('docs'))
"""
import os
import pathlib
import shutil
import subprocess
import tempfile

from pictures import pictures
from table import ARMS, CASADI, FUNCTIONS, GENERATED, KEPT, LEVELS, PEAK, PLAIN, ROBOTS, Table, of_level


TAPE = 'dyntape tape'


def ratio(a, b):
    return a / b if a is not None and b else None


# --- What to reach ------------------------------------------------------------------------------------------


def targets(t):
    """Rows: what, the limit in words, and for each robot (figure, limit, remark)."""
    def each(figure, limit, remark=''):
        return [(figure(r), limit(r) if callable(limit) else limit, remark) for r in t.robots]

    def against(function, ours, theirs, limit, column='us', of_theirs=None):
        return each(lambda r: ratio(t.get(r, function, ours, column), t.get(r, function, theirs, of_theirs or column)),
                    limit)

    def for_size(arm, large):
        return lambda r: arm if r in ARMS else large

    def of_worst(figures, limit):
        cells = []
        for r in t.robots:
            known = [(value, name) for value, name in figures(r) if value is not None]
            value, name = max(known, default=(None, ''))
            cells.append((value, limit, name))
        return cells

    def plain(ours):
        return lambda r: ((ratio(t.get(r, f, ours), t.get(r, f, 'Pinocchio')), f) for f in (*FUNCTIONS, *PLAIN))

    def packing(r):
        for f in ('id-derivatives', 'fd-derivatives'):
            for route in ('lanes', 'lanes, fast'):
                yield ratio(t.get(r, f, route), t.get(r, f, f'{route}, kept')), f

    def tape(quantity, ours):
        def least(r, routes):
            return min((float(row['us']) for row in t.tapes if row['robot'] == r
                        and any(row['route'] == f'{route}: {quantity}' for route in routes)), default=None)
        return lambda r: ratio(least(r, [ours]), least(r, ['CppAD tape', 'CppAD tape, optimised']))

    fd = 'fd-derivatives'
    return [
        ('RNEA, generated', '0.8 of CasADi', against('rnea', GENERATED, CASADI, 0.8)),
        ('ABA, generated', '0.8 of CasADi', against('aba', GENERATED, CASADI, 0.8)),
        ('dID, generated', '0.6 of CasADi', against('id-derivatives', GENERATED, CASADI, 0.6)),
        ('dFD, generated', '0.6 of CasADi', against(fd, GENERATED, CASADI, 0.6)),
        ('dID, generated', '1 of Pinocchio', against('id-derivatives', GENERATED, 'Pinocchio', 1)),
        ('dFD, generated', '1 of Pinocchio', against(fd, GENERATED, 'Pinocchio', 1)),
        ('dID in lanes', '1/25 of Pinocchio, large robots 1/15',
         against('id-derivatives', KEPT, 'Pinocchio', for_size(1 / 25, 1 / 15))),
        ('dFD in lanes', '1/30 of Pinocchio, large robots 1/12',
         against(fd, KEPT, 'Pinocchio', for_size(1 / 30, 1 / 12))),
        ('lanes with packing, worst of dID and dFD', '1.4 of the kernel alone', of_worst(packing, 1.4)),
        ('plain double, worst of all functions', '0.7 of Pinocchio', of_worst(plain('plain double'), 0.7)),
        ('packs, worst of all functions', '1/5 of Pinocchio', of_worst(plain('packs'), 1 / 5)),
        ('runtime tape, sparse Jacobian of RNEA at a point', '1/5 of CppAD', each(tape('jacobian', TAPE), 1 / 5)),
        ('the same, points side by side', '1/5 of CppAD', each(tape('jacobian', f'{TAPE}, 8 lanes'), 1 / 5)),
        ('runtime tape, recording RNEA', '1/2 of CppAD', each(tape('record', TAPE), 1 / 2)),
        ('weighted Hessian of RNEA, generated', '0.5 of CasADi', against('id-hessian', GENERATED, CASADI, 0.5)),
        ('dFD from the robot to a loaded kernel', "1/10 of gcc on CasADi's C",
         against(fd, 'generated', CASADI, 0.1, 'made_s', 'compile_s')),
        ('dFD from the robot to a loaded kernel', '1 s, large robots 5 s',
         each(lambda r: t.get(r, fd, 'generated', 'made_s'), for_size(1, 5), 's')),
        ('dFD from the robot to a first result', '20 ms, large robots 150 ms',
         each(lambda r: t.get(r, fd, 'interpreted', 'first_ms'), for_size(20, 150), 'ms')),
        ('dFD out of the cache', '3 ms', each(lambda r: t.get(r, fd, 'generated', 'load_ms'), 3, 'ms')),
    ]


def number(value, digits=3):
    """With so many significant digits, and none that are not."""
    if value is None:
        return ''
    text = f'{value:.{digits}g}'
    return f'{float(text):.0f}' if 'e' in text and abs(value) >= 1 else text


def cells_of(figures):
    cells = []
    for value, limit, remark in figures:
        unit = f' {remark}' if remark in ('s', 'ms') else ''
        name = f' ({remark})' if remark and not unit else ''
        digits = 3 if value and abs(value / limit - 1) < 0.05 else 2  # enough to tell it from its limit
        mark = '✓' if value is not None and value <= limit else '✗'
        cells.append('–' if value is None else f'{number(value, digits)}{unit}{name} {mark}')
    return cells


def markdown(head, rows, right=1):
    """A table whose columns from `right` on stand to the right."""
    sides = '|'.join('---' if i < right else '--:' for i in range(len(head)))
    line = lambda cells: '| ' + ' | '.join(cells) + ' |'
    return '\n'.join([line(head), f'|{sides}|', *map(line, rows)])


# --- The page -----------------------------------------------------------------------------------------------


def routes_table(t, robot):
    lines = []
    for function in [*t.functions, *PLAIN]:
        for k, row in enumerate(t.routes(robot, function)):
            value = lambda name, digits=3: number(float(row[name]), digits) if row[name] else ''
            lines.append([f'**{function}**' if k == 0 else '', row['route'], value('us'),
                          value('ratio_to_pinocchio', 2),
                          f'{int(row["operations"]):,}'.replace(',', ' ') if row['operations'] else '',
                          value('percent_of_peak', 2), value('compile_s', 2),
                          f'{int(row["text_bytes"]) / 1000:.0f}' if row['text_bytes'] else '',
                          f'{float(row["error"]):.1e}' if row['error'] else ''])
    return markdown(['function', 'route', 'us', 'to Pinocchio', 'operations', '% of peak', 'compiling s', 'code kB',
                     'error'], lines, 2)


def levels_tables(t):
    """Plain double and packs by the code of each level of the processor, in ratios to Pinocchio compiled for it; empty: one level."""
    own = t.about.get('level')
    lower = [level for level in reversed(LEVELS) if any(row['route'] == of_level('plain double', level) for row in t.rows)]
    if not lower:
        return []
    parts = ['## Each processor', LEVELS_TEXT.format(own=own), '![microseconds a state](studies/benchmarks_levels.svg)']
    for route in ('plain double', 'packs'):
        lines = [[f'**{function}**' if k == 0 else '', level,
                  *(number(ratio(t.get(r, function, route if level == own else of_level(route, level)),
                                 t.get(r, function, 'Pinocchio')), 2) for r in t.robots)]
                 for function in t.functions for k, level in enumerate([own, *lower])
                 if any(t.get(r, function, 'Pinocchio') for r in t.robots)]
        parts += [f'{route.capitalize()}:', markdown(['function', 'code for', *(ROBOTS[r] for r in t.robots)], lines, 2)]
    return parts


LEVELS_TEXT = '''The library has code for three levels of x86-64 and takes the highest that the processor has, here {own}; each was measured on this
machine. Ratios of times to Pinocchio, compiled for this machine; smaller is better.'''

INTRODUCTION = '''Every route to the functions that optimal control is made of, beside Pinocchio and CasADi: one process, in turn, the
quickest of a hundred batches. Made by `tests/bench/run` from `docs/studies/benchmarks.csv`; nothing here is typed.'''

TO_REACH = '''Ratios of times, smaller is better; ✓ met, ✗ not met, – not measured: {met} of {figures} are met. "Generated" and "in
lanes" are the quicker of the profiles strict and fast. CasADi stands for the generated peers: CppADCodeGen is not
measured here.'''

ROUTES = '''Times of one state.

- **packs**: the plain code in eight lanes, nothing compiled; **several**: the interpreter with several states at once.
- **lanes**: generated kernels of several states, which come and go one after the other; **kept**: for states that are kept
  in lanes. The code of lanes includes the kernel of a single state.
- **CasADi**: its Jacobian of the recursion; **analytic**: the derivative recursion of Carpentier and Mansard, printed by
  CasADi.
- **error**: the largest against 113 bits. **% of peak**: of separate multiplications and additions in the widest registers,
  {peak} operations in a nanosecond on this core.'''


def text_of(t):
    rows = targets(t)
    figures = [figure for _, _, line in rows for figure in line if figure[0] is not None]
    met = sum(value <= limit for value, limit, _ in figures)
    peak = max((float(row['gops']) for row in t.rows if row['route'] == PEAK and row['gops']), default=None)
    parts = ['# Benchmarks', INTRODUCTION,
             '![microseconds a state](studies/benchmarks_time.svg)',
             '![seconds from the robot to a loaded kernel](studies/benchmarks_made.svg)',
             '![percentage of the arithmetic peak](studies/benchmarks_peak.svg)',
             '## What to reach', TO_REACH.format(met=met, figures=len(figures)),
             markdown(['what', 'at most', *(ROBOTS[robot] for robot in t.robots)],
                      [[what, limit, *cells_of(line)] for what, limit, line in rows], 2),
             *levels_tables(t), '## Every route', ROUTES.format(peak=number(peak))]
    for robot in t.robots:
        parts += [f'### {ROBOTS[robot]}', routes_table(t, robot)]
    name = lambda row: ROBOTS.get(row['robot'], row['robot'])
    if t.tapes:
        parts += ['## The runtime tape', markdown(['robot', 'function', 'what', 'us'], [
            [name(row), row['function'], row['route'], number(float(row['us']))] for row in t.tapes], 3)]
    absent = [[name(row), row['function'], row['route'] + ':', row['note']] for row in t.rows if not row['us']]
    if absent:
        parts += ['## What is absent', '\n'.join('- ' + ' '.join(filter(None, words)) for words in absent)]
    parts += ['## What it was measured with', markdown(['', ''], [[key, value] for key, value in t.about.items()], 2)]
    return '\n\n'.join(part.strip() for part in parts) + '\n'


def write_atomically(path, text):
    with tempfile.NamedTemporaryFile('w', dir=path.parent, delete=False) as file:
        file.write(text)
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


def make(table, folder):
    """Writes folder/benchmarks.md and folder/studies/*.svg; returns their paths."""
    t = Table(table)
    if not t.robots:
        raise SystemExit(f'tests/bench/run: {table} has no figures; the page stays as it is')
    made = [folder / 'benchmarks.md']
    write_atomically(made[0], text_of(t))
    if not shutil.which('gnuplot'):
        raise SystemExit('tests/bench/run: gnuplot is missing; tools/setup installs it')
    for name, script in pictures(t).items():
        drawn = subprocess.run(['gnuplot'], input=script, capture_output=True, text=True)
        if drawn.returncode != 0:
            raise SystemExit(f'tests/bench/run: gnuplot fails\n{drawn.stderr}')
        made.append(folder / 'studies' / f'{name}.svg')
        write_atomically(made[-1], drawn.stdout)
    return made
