# SPDX-License-Identifier: BSD-3-Clause
"""The page of benchmarks: pictures and tables, all of it from the table that tests/bench/run has measured.

    make(pathlib.Path('docs/studies/benchmarks.csv'), pathlib.Path('docs'))
"""
import csv
import os
import pathlib
import shutil
import subprocess
import tempfile

COLUMNS = ['robot', 'function', 'route', 'us', 'us_median', 'ratio_to_pinocchio', 'operations', 'gops', 'percent_of_peak',
           'compile_s', 'made_s', 'first_ms', 'load_ms', 'text_bytes', 'error', 'note']
PEAK = 'multiply and add'
ROBOTS = {'ur5': 'UR5', 'panda': 'Panda', 'solo12': 'Solo12', 'simple_humanoid': 'humanoid'}
FUNCTIONS = {'rnea': 'RNEA', 'aba': 'ABA', 'crba': 'CRBA', 'minverse': 'M^{-1}', 'id-derivatives': 'dID',
             'fd-derivatives': 'dFD', 'id-hessian': 'Hessian'}
ARMS = ('ur5', 'panda')


class Table:
    """Figures by robot, function and route; what is not there is None."""

    def __init__(self, path):
        lines = path.read_text().splitlines()
        self.about = dict(line[2:].split(': ', 1) for line in lines if line.startswith('# '))
        self.rows = list(csv.DictReader(line for line in lines if not line.startswith('#')))
        self.by_key = {(row['robot'], row['function'], row['route']): row for row in self.rows}
        self.robots = [robot for robot in ROBOTS if any(row['robot'] == robot and row['us'] for row in self.rows)]
        self.functions = [f for f in FUNCTIONS if any(row['function'] == f for row in self.rows)]

    def get(self, robot, function, routes, column='us'):
        """The least of several routes."""
        found = [float(row[column]) for route in ([routes] if isinstance(routes, str) else routes)
                 if (row := self.by_key.get((robot, function, route))) and row[column]]
        return min(found, default=None)

    def routes(self, robot, function):
        return [row for row in self.rows if row['robot'] == robot and row['function'] == function and row['us']]


GENERATED = ('generated', 'generated, fast')
KEPT = ('lanes, kept', 'lanes, fast, kept')
CASADI = ('CasADi', 'CasADi, analytic')


def ratio(a, b):
    return a / b if a is not None and b else None


def worst(pairs):
    """The largest of named figures, with its name."""
    known = [(value, name) for value, name in pairs if value is not None]
    return max(known, default=(None, ''))


# --- What to reach ------------------------------------------------------------------------------------------


def targets(t):
    """Rows: what, limit in words, then for each robot (figure, limit, remark)."""
    def against(function, ours, theirs, limit, column='us'):
        return [(ratio(t.get(r, function, ours, column), t.get(r, function, theirs, column)), limit(r), '')
                for r in t.robots]

    def batched(function, arm, large):
        return against(function, KEPT, 'Pinocchio', lambda r: 1 / arm if r in ARMS else 1 / large)

    def over_functions(ours, limit):
        names = [*FUNCTIONS, 'id-second-derivatives']
        return [(*worst((ratio(t.get(r, f, ours), t.get(r, f, 'Pinocchio')), f) for f in names), r) for r in t.robots], limit

    def all_functions(ours, limit):
        cells, _ = over_functions(ours, limit)
        return [(value, limit, name) for value, name, _ in cells]

    def packing(r):
        pairs = [('lanes', 'lanes, kept'), ('lanes, fast', 'lanes, fast, kept')]
        return worst((ratio(*(t.get(r, f, route) for route in pair)), f'{f}') for f in
                     ('id-derivatives', 'fd-derivatives') for pair in pairs)

    def tape(quantity):
        def of(r, side):
            found = [float(row['us']) for row in t.rows if row['robot'] == r and row['us'] and ': ' in row['route']
                     and row['route'].split(': ')[1] == quantity
                     and row['route'].startswith('CppAD') == (side == 'CppAD')]
            return min(found, default=None)
        return [ratio(of(r, 'ours'), of(r, 'CppAD')) for r in t.robots]

    some = lambda f: [(*f(r),) for r in t.robots]
    seconds = lambda function, limit: [(t.get(r, function, 'generated', 'made_s'), limit(r), 's') for r in t.robots]
    arm_or = lambda arm, large: lambda r: arm if r in ARMS else large
    return [
        ('RNEA, generated', '0.8 of CasADi', against('rnea', GENERATED, CASADI, lambda r: 0.8)),
        ('ABA, generated', '0.8 of CasADi', against('aba', GENERATED, CASADI, lambda r: 0.8)),
        ('dID, generated', '0.6 of CasADi', against('id-derivatives', GENERATED, CASADI, lambda r: 0.6)),
        ('dFD, generated', '0.6 of CasADi', against('fd-derivatives', GENERATED, CASADI, lambda r: 0.6)),
        ('dID, generated', '1 of Pinocchio', against('id-derivatives', GENERATED, 'Pinocchio', lambda r: 1)),
        ('dFD, generated', '1 of Pinocchio', against('fd-derivatives', GENERATED, 'Pinocchio', lambda r: 1)),
        ('dID in lanes', '1/25 of Pinocchio, large robots 1/15', batched('id-derivatives', 25, 15)),
        ('dFD in lanes', '1/30 of Pinocchio, large robots 1/12', batched('fd-derivatives', 30, 12)),
        ('lanes with packing, dID and dFD', '1.4 of the kernel alone',
         [(value, 1.4, name) for value, name in some(packing)]),
        ('plain double, worst of all functions', '0.7 of Pinocchio', all_functions('plain double', 0.7)),
        ('packs, worst of all functions', '1/5 of Pinocchio', all_functions('packs', 0.2)),
        ('runtime tape: sparse Jacobian', '1/5 of CppAD', [(x, 0.2, '') for x in tape('sparse Jacobian')]),
        ('runtime tape: recording', '1/2 of CppAD', [(x, 0.5, '') for x in tape('recording')]),
        ('weighted Hessian, generated', '0.5 of CasADi', against('id-hessian', GENERATED, CASADI, lambda r: 0.5)),
        ('dFD, recorded to loaded', '1/10 of CasADi',
         against('fd-derivatives', 'generated', CASADI, lambda r: 0.1, 'made_s')),
        ('dFD, recorded to loaded', '1 s, large robots 5 s', seconds('fd-derivatives', arm_or(1, 5))),
        ('dFD, first result', '20 ms, large robots 150 ms',
         [(t.get(r, 'fd-derivatives', 'interpreted', 'first_ms'), arm_or(20, 150)(r), 'ms') for r in t.robots]),
        ('dFD, out of the cache', '3 ms',
         [(t.get(r, 'fd-derivatives', 'generated', 'load_ms'), 3, 'ms') for r in t.robots]),
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
        cells.append('–' if value is None else f'{number(value, 2)}{unit}{name} {"✓" if value <= limit else "✗"}')
    return cells


def markdown(head, rows, right=1):
    """A table whose columns from `right` on stand to the right."""
    lines = ['| ' + ' | '.join(head) + ' |', '|' + '|'.join('---' if i < right else '--:' for i in range(len(head))) + '|']
    return '\n'.join(lines + ['| ' + ' | '.join(row) + ' |' for row in rows])


# --- The page -----------------------------------------------------------------------------------------------


def routes_table(t, robot):
    lines = []
    for function in [*t.functions, 'id-second-derivatives']:
        for k, row in enumerate(t.routes(robot, function)):
            value = lambda name, digits=3: number(float(row[name]), digits) if row[name] else ''
            lines.append([f'**{function}**' if k == 0 else '', row['route'], value('us'), value('ratio_to_pinocchio', 2),
                          f'{int(row["operations"]):,}'.replace(',', ' ') if row['operations'] else '',
                          value('percent_of_peak', 2), value('compile_s', 2),
                          f'{int(row["text_bytes"]) / 1000:.0f}' if row['text_bytes'] else '',
                          f'{float(row["error"]):.1e}' if row['error'] else ''])
    return markdown(['function', 'route', 'us', 'to Pinocchio', 'operations', '% of peak', 'compiling s', 'code kB',
                     'error'], lines, 2)


def text_of(t):
    names = [ROBOTS[robot] for robot in t.robots]
    rows = targets(t)
    figures = [figure for _, _, line in rows for figure in line if figure[0] is not None]
    met = sum(value <= limit for value, limit, _ in figures)
    peaks = [float(row['gops']) for row in t.rows if row['route'] == PEAK and row['gops']]
    absent = [f'{ROBOTS.get(row["robot"], row["robot"])} {row["function"]} {row["route"]}: {row["note"]}'.strip()
              for row in t.rows if not row['us']]
    tapes = [row for row in t.rows if ': ' in row['route'] and row['us']]
    parts = ['# Benchmarks', f'''Every route to the functions that optimal control is made of, beside Pinocchio and CasADi: one process, in turn, the
quickest of a hundred batches. Made by `tests/bench/run` from `docs/studies/benchmarks.csv`; nothing here is typed.''',
             '![microseconds a state](studies/benchmarks_time.svg)',
             '![seconds from the robot to a loaded kernel](studies/benchmarks_made.svg)',
             '![percentage of the arithmetic peak](studies/benchmarks_peak.svg)',
             '## What to reach', f'''Ratios of times, smaller is better; ✓ met, ✗ not met, – not measured: {met} of {len(figures)} are met. "Generated"
and "in lanes" are the quicker of the profiles strict and fast.''',
             markdown(['what', 'at most', *names], [[what, limit, *cells_of(line)] for what, limit, line in rows], 2),
             '## Every route', '''Times of one state. "packs": the plain code in eight lanes, nothing compiled; "several": the interpreter with several
states at once; "lanes": generated kernels of several states, from and to states one after the other; "kept": the same
for states that are kept in lanes. Code of "lanes" includes the kernel of a single state. CasADi's derivatives of inverse
dynamics are its Jacobian of the recursion, and "analytic" the derivative recursion of Carpentier and Mansard printed by
CasADi. Errors are the largest against 113 bits. ''' + (f'''The peak is that of separate multiplications and additions in the widest
registers: {number(max(peaks), 3)} operations in a nanosecond on this core.''' if peaks else '')]
    for robot in t.robots:
        parts += [f'### {ROBOTS[robot]}', routes_table(t, robot)]
    if tapes:
        parts += ['## The runtime tape', markdown(['robot', 'function', 'what', 'us'], [
            [ROBOTS.get(row['robot'], row['robot']), row['function'], row['route'], number(float(row['us']))]
            for row in tapes], 3)]
    if absent:
        parts += ['## What is absent', '\n'.join(f'- {line}' for line in absent)]
    parts += ['## What it was measured with', markdown(['', ''], [[key, value] for key, value in t.about.items()], 2)]
    return '\n\n'.join(part.strip() for part in parts) + '\n'


# --- Pictures -----------------------------------------------------------------------------------------------

BARS = [('Pinocchio', 'Pinocchio', '#999999'), ('CasADi', CASADI, '#e69f00'), ('plain double', 'plain double', '#56b4e9'),
        ('packs', 'packs', '#0072b2'), ('generated', GENERATED, '#009e73'), ('lanes', KEPT, '#d55e00')]
STYLE = '''set terminal svg size {width},{height} font "DejaVu Sans,11" background "white"
set style data histograms
set style histogram clustered gap 1.5
set style fill solid border lc rgb "white"
set boxwidth 0.92
set grid ytics lc rgb "#dddddd"
set tics nomirror scale 0.5
set border 3 lc rgb "#555555"
set datafile missing "-"
'''


def panels(t, bars, column, functions, y_label, logarithmic, scale=1):
    """A panel a robot, a cluster a function, a bar a route."""
    rows = (len(t.robots) + 1) // 2
    script = STYLE.format(width=1000, height=60 + 270 * rows)
    script += f'set multiplot layout {rows},2 margins 0.07,0.985,{0.09 / rows:.3f},{1 - 0.17 / rows:.3f} spacing 0.06,{0.24 / rows:.3f}\n'
    for k, robot in enumerate(t.robots):
        values = [[t.get(robot, f, routes, column) for _, routes, _ in bars] for f in functions]
        known = [x * scale for line in values for x in line if x]
        if not known:
            continue
        low, high = min(known) / 1.6, max(known) * 1.6
        script += '$data << EOD\n' + ''.join(
            f'"{FUNCTIONS[f]}" ' + ' '.join('-' if x is None else f'{x * scale:.6g}' for x in line) + '\n'
            for f, line in zip(functions, values)) + 'EOD\n'
        script += f'set title "{ROBOTS[robot]}" font ",13"\nset ylabel "{y_label if k % 2 == 0 else ""}"\n'
        script += f'set logscale y\nset yrange [{low:.4g}:{high:.4g}]\nset format y "%g"\n' if logarithmic else \
            f'set yrange [0:{max(known) * 1.1:.4g}]\n'
        script += ('set key at screen 0.5,0.995 center top horizontal samplen 1.2 width 1\n' if k == 0 else 'unset key\n')
        script += 'plot ' + ', '.join(
            f'$data using {i + 2}:xtic(1) title "{name}" lc rgb "{color}"' for i, (name, _, color) in enumerate(bars)) + '\n'
    return script + 'unset multiplot\n'


def pictures(t):
    generated = [f for f in t.functions]
    bars = {name: (name, routes, color) for name, routes, color in BARS}
    made = [('CasADi', CASADI, '#e69f00'), ('generated', 'generated', '#009e73'), ('with lanes', 'lanes', '#d55e00')]
    return {
        'benchmarks_time': panels(t, BARS, 'us', generated, 'us a state', True),
        'benchmarks_made': panels(t, made, 'made_s', generated, 's from the robot to a loaded kernel', True),
        'benchmarks_peak': panels(t, [bars['CasADi'], bars['generated'], bars['lanes']], 'percent_of_peak', generated,
                                  '% of peak', False),
    }


def write_atomically(path, text):
    with tempfile.NamedTemporaryFile('w', dir=path.parent, delete=False) as file:
        file.write(text)
    os.chmod(file.name, 0o644)
    os.replace(file.name, path)


def make(table, folder):
    """Writes folder/benchmarks.md and folder/studies/*.svg; returns their paths."""
    t = Table(table)
    made = [folder / 'benchmarks.md']
    write_atomically(made[0], text_of(t))
    if not shutil.which('gnuplot'):
        raise SystemExit('tests/bench/run: gnuplot is missing; tools/setup installs it')
    for name, script in pictures(t).items():
        drawn = subprocess.run(['gnuplot'], input=script, stdout=subprocess.PIPE, text=True, check=True).stdout
        made.append(folder / 'studies' / f'{name}.svg')
        write_atomically(made[-1], drawn)
    return made
