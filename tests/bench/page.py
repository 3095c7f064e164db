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
from table import CASADI, CPPADCODEGEN, FUNCTIONS, GENERATED, KEPT, LEVELS, PEAK, PLAIN, ROBOTS, Table, of_level


def ratio(a, b):
    return a / b if a is not None and b else None


# --- What to take away --------------------------------------------------------------------------------------


def span(ratios):
    """'0.17 (rnea, UR5) to 0.9 (aba, Panda)' of ratios by function and robot; none: ''."""
    if not ratios:
        return ''
    name = lambda key: f'{number(ratios[key], 2)} ({key[0]}, {ROBOTS[key[1]]})'
    return f'{name(min(ratios, key=ratios.get))} to {name(max(ratios, key=ratios.get))}'


def ratios_to(t, ours, theirs, functions):
    """By function and robot, where both are measured; to the Pinocchio of the same process."""
    def of(r, f):
        if theirs == 'Pinocchio':
            return t.get(r, f, ours, 'ratio_to_pinocchio')
        return ratio(t.get(r, f, ours), t.get(r, f, theirs))
    found = {(f, r): of(r, f) for f in functions for r in t.robots}
    return {key: value for key, value in found.items() if value is not None}


def take_away(t):
    """A sentence each about plain code, generated code and many states: ratios that the tables below hold."""
    every = [*t.functions, *PLAIN]
    own = t.about.get('level')
    levels = [(own, 'plain double'), *((level, of_level('plain double', level)) for level in reversed(LEVELS) if level != own)]
    plain = [(level, span(ratios_to(t, route, 'Pinocchio', t.functions))) for level, route in levels]
    plain = [f'{text} with code for {level}' if level else text for level, text in plain if text]
    generated = [f'{text} of {name}' for name, theirs in (('CasADi', CASADI), ('CppADCodeGen', CPPADCODEGEN), ('Pinocchio', 'Pinocchio'))
                 if (text := span(ratios_to(t, GENERATED, theirs, t.functions)))]
    many = [f'{name} {text}' for name, route, of in (('packs', 'packs', every), ('generated lanes', KEPT, t.functions))
            if (text := span(ratios_to(t, route, 'Pinocchio', of)))]
    made = [x for r in t.robots for f in t.functions if (x := t.get(r, f, 'generated', 'made_s')) is not None]
    waits = f' and is there after {number(min(made), 2)} to {number(max(made), 2)} s' if made else ''
    lines = [('Without a compiler, plain double takes this part of Pinocchio\'s time:', plain),
             (f'Generated C{waits}, and takes this part of a peer\'s time:'.replace('C and', 'C').replace('s, and', 's and'), generated),
             ('Of many states, one takes this part of Pinocchio\'s time:', many)]
    return '\n'.join(f'- {start} {"; ".join(parts)}.' for start, parts in lines if parts)


def compared(t):
    """Generated C against each generated peer, and what a user waits for."""
    lines = []
    for f in t.functions:
        for name, theirs in (('CasADi', CASADI), ('CppADCodeGen', CPPADCODEGEN)):
            cells = [number(ratio(t.get(r, f, GENERATED), t.get(r, f, theirs)), 2) for r in t.robots]
            if any(cells):
                lines.append([f'**{f}**' if not lines or lines[-1][-1] != f else '', name, *cells, f])
    return markdown(['function', 'time to', *(ROBOTS[r] for r in t.robots)], [line[:-1] for line in lines], 2)


def number(value, digits=3):
    """With so many significant digits, and none that are not."""
    if value is None:
        return ''
    text = f'{value:.{digits}g}'
    return f'{float(text):.0f}' if 'e' in text and abs(value) >= 1 else text


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
                  *(number(t.get(r, function, route if level == own else of_level(route, level), 'ratio_to_pinocchio'), 2)
                    for r in t.robots)]
                 for function in t.functions for k, level in enumerate([own, *lower])
                 if any(t.get(r, function, 'Pinocchio') for r in t.robots)]
        parts += [f'{route.capitalize()}:', markdown(['function', 'code for', *(ROBOTS[r] for r in t.robots)], lines, 2)]
    return parts


LEVELS_TEXT = '''The library has code for three levels of x86-64 and takes the highest that the processor has, here {own}; each was measured on this
machine, in a process with Pinocchio, which is compiled for this machine. Ratios of times to it; smaller is better.'''

GENERATED_TEXT = '''Ratios of times: ours, the quicker of sines of its own and of libm's, to the quicker of what a peer prints.'''
BEFORE_OWN_SINES = '''Measured before sines of its own were the default: **generated** has libm's here, **generated, portable** what is the default now.'''

INTRODUCTION = '''Every route to the functions that optimal control is made of, beside Pinocchio, CasADi and CppADCodeGen: one process a robot, in
turn, the quickest of a hundred batches, so smaller is better everywhere. Made by `tests/bench/run` from `docs/studies/benchmarks.csv`; nothing here is typed.'''

ROUTES = '''Times of one state.

- **packs**: the plain code in eight lanes, nothing compiled; **several**: the interpreter with several states at once.
- **lanes**: generated kernels of several states, which are copied in and out one after the other; **kept**: for states that are kept
  in lanes. The code of lanes includes the kernel of a single state.
- **CasADi**, **CppADCodeGen**: derivatives by their own differentiation of the recursion; **analytic**: the derivative recursion of
  Carpentier and Mansard, printed by them. CppADCodeGen records Pinocchio's templates and differentiates by coordinates: for robots
  whose base floats only the analytic ones are the same function.
- **error**: the largest against 113 bits. **% of peak**: of separate multiplications and additions in the widest registers,
  {peak} operations in a nanosecond on this core.'''


def text_of(t):
    peak = max((float(row['gops']) for row in t.rows if row['route'] == PEAK and row['gops']), default=None)
    parts = ['# Benchmarks', INTRODUCTION, '## What to take away', take_away(t), *levels_tables(t),
             '## Generated code', GENERATED_TEXT, '![microseconds a state](studies/benchmarks_time.svg)', compared(t),
             '![seconds from the robot to a loaded kernel](studies/benchmarks_made.svg)',
             '![percentage of the arithmetic peak](studies/benchmarks_peak.svg)',
             '## Every route', ROUTES.format(peak=number(peak))]
    if any(row['route'] == 'generated, portable' for row in t.rows):
        parts.append(BEFORE_OWN_SINES)
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
