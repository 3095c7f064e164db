# SPDX-License-Identifier: BSD-3-Clause
"""What gnuplot is told to draw the benchmarks: bars of every route, a panel a robot."""
from table import CASADI, CPPADCODEGEN, FUNCTIONS, GENERATED, KEPT, LEVELS, ROBOTS, of_level

BARS = [('Pinocchio', 'Pinocchio', '#999999'), ('CasADi', CASADI, '#e69f00'),
        ('CppADCodeGen', CPPADCODEGEN, '#f0e442'), ('plain double', 'plain double', '#56b4e9'), ('packs', 'packs', '#0072b2'),
        ('generated', GENERATED, '#009e73'), ('lanes', KEPT, '#d55e00')]
STYLE = '''set terminal svg size {width},{height} font "DejaVu Sans,11" background "white"
set style data histograms
set style histogram clustered gap 1.5
set style fill solid border lc rgb "white"
set boxwidth 0.92
set grid ytics lc rgb "#dddddd"
set tics nomirror scale 0.5
set border 3 lc rgb "#555555"
unset key
set datafile missing "-"
'''


WIDTH, SAMPLE, LETTER, ROW = 1000, 24, 7.2, 18  # px: of the picture, of a sample and of a letter in the legend, of its rows


def legend(bars, height):
    """Samples and names above all panels, in rows that end before the picture does: what gnuplot is told, and the pixels that they take."""
    rows, x = [[]], 0
    for name, _, color in bars:
        need = SAMPLE + LETTER * len(name) + 28
        if rows[-1] and x + need > WIDTH - 40:
            rows, x = [*rows, []], 0
        rows[-1].append((x, name, color))
        x += need
    script, number = '', 0
    for k, row in enumerate(row for row in rows if row):
        end = row[-1][0] + SAMPLE + LETTER * len(row[-1][1])
        y = 1 - (16 + ROW * k) / height
        for x, name, color in row:
            number += 1
            left = (WIDTH - end) / 2 + x
            script += f'set object {number} rectangle from screen {left / WIDTH:.4f},{y - 5 / height:.4f} to screen {(left + SAMPLE) / WIDTH:.4f},' \
                      f'{y + 5 / height:.4f} fc rgb "{color}" fs solid border lc rgb "white"\n'
            script += f'set label {number} "{name}" at screen {(left + SAMPLE + 6) / WIDTH:.4f},{y:.4f} left noenhanced\n'
    return script, ROW * len(rows)


def panels(t, bars, column, functions, y_label, logarithmic):
    """A panel a robot, a cluster a function, a bar a route."""
    bars = [bar for bar in bars if any(t.get(r, f, bar[1], column) for r in t.robots for f in functions)]
    rows = (len(t.robots) + 1) // 2
    height = 70 + 270 * rows
    height += legend(bars, height)[1]
    keys, taken = legend(bars, height)
    script = STYLE.format(width=WIDTH, height=height)
    below, above, between = (f'{x / height:.3f}' for x in (30, height - 52 - taken, 70))
    script += f'set multiplot layout {rows},2 margins 0.07,0.985,{below},{above} spacing 0.06,{between}\n'
    for k, robot in enumerate(t.robots):
        values = [[t.get(robot, f, routes, column) for _, routes, _ in bars] for f in functions]
        known = [x for line in values for x in line if x]
        if not known:
            continue
        low, high = min(known) / 1.6, max(known) * 1.6
        script += '$data << EOD\n' + ''.join(
            f'"{FUNCTIONS[f]}" ' + ' '.join('-' if x is None else f'{x:.6g}' for x in line) + '\n'
            for f, line in zip(functions, values)) + 'EOD\n'
        script += f'set title "{ROBOTS[robot]}" font ",13"\nset ylabel "{y_label if k % 2 == 0 else ""}"\n'
        script += f'set logscale y {2 if high / low < 100 else 10}\nset yrange [{low:.4g}:{high:.4g}]\nset format y "%g"\n' if logarithmic else \
            f'set yrange [0:{max(known) * 1.1:.4g}]\n'
        script += keys
        keys = 'unset object\nunset label\n'
        script += 'plot ' + ', '.join(f'$data using {i + 2}:xtic(1) lc rgb "{color}"' for i, (_, _, color) in enumerate(bars)) + '\n'
    return script + 'unset multiplot\n'


def pictures(t):
    bars = {name: (name, routes, color) for name, routes, color in BARS}
    made = [('CasADi', CASADI, '#e69f00'), ('CppADCodeGen', CPPADCODEGEN, '#f0e442'), ('generated', 'generated', '#009e73'), ('with lanes', 'lanes', '#d55e00')]
    lower = [(f'code for {level}', of_level('plain double', level), color)
             for level, color in zip(reversed(LEVELS[:-1]), ('#0072b2', '#cc79a7'))]
    of_levels = {'benchmarks_levels': panels(t, [bars['Pinocchio'], (f'code for {t.about.get("level")}', 'plain double', '#56b4e9'), *lower], 'us', t.functions,
                                             'us a state', True)}
    return {
        **(of_levels if any(row['route'] == lower[0][1] for row in t.rows) else {}),
        'benchmarks_time': panels(t, BARS, 'us', t.functions, 'us a state', True),
        'benchmarks_made': panels(t, made, 'made_s', t.functions, 's from the robot to a loaded kernel', True),
        'benchmarks_peak': panels(t, [bars['CasADi'], bars['generated'], bars['lanes']], 'percent_of_peak', t.functions,
                                  '% of peak', False),
    }
