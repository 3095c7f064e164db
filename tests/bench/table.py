# SPDX-License-Identifier: BSD-3-Clause
"""The table of benchmarks that tests/bench/run measures: a row a robot, function and route."""
import csv

COLUMNS = ['robot', 'function', 'route', 'us', 'us_median', 'ratio_to_pinocchio', 'operations', 'gops',
           'percent_of_peak', 'compile_s', 'made_s', 'first_ms', 'load_ms', 'text_bytes', 'error', 'note']
PEAK = 'multiply and add'
ROBOTS = {'ur5': 'UR5', 'panda': 'Panda', 'solo12': 'Solo12', 'simple_humanoid': 'humanoid'}
PLAIN = ('id-second-derivatives',)  # never generated here
FUNCTIONS = {'rnea': 'RNEA', 'aba': 'ABA', 'crba': 'CRBA', 'minverse': 'M^{-1}', 'id-derivatives': 'dID',
             'fd-derivatives': 'dFD', 'id-hessian': 'Hessian'}
LEVELS = ['x86-64-v2', 'x86-64-v3', 'x86-64-v4']  # of the processor; routes have the highest where none is named


def of_level(route, level):
    return f'{route}, {level}'


def level_of(route):
    """The level that a route names, or ''."""
    return next((level for level in LEVELS if route.endswith(f', {level}')), '')


class Table:
    """Figures by robot, function and route; what is not there is None."""

    def __init__(self, path):
        lines = path.read_text().splitlines()
        self.about = dict(line[2:].split(': ', 1) for line in lines if line.startswith('# '))
        self.rows = list(csv.DictReader(line for line in lines if not line.startswith('#')))
        self.by_key = {(row['robot'], row['function'], row['route']): row for row in self.rows}
        self.robots = [robot for robot in ROBOTS if any(row['robot'] == robot and row['us'] for row in self.rows)]
        self.tapes = [row for row in self.rows if ': ' in row['route'] and row['us']]
        self.functions = [f for f in FUNCTIONS if any(row['function'] == f for row in self.rows)]

    def get(self, robot, function, routes, column='us'):
        """Of several routes the quickest one's."""
        found = [row for route in ([routes] if isinstance(routes, str) else routes)
                 if (row := self.by_key.get((robot, function, route))) and row['us'] and row[column]]
        return float(min(found, key=lambda row: float(row['us']))[column]) if found else None

    def routes(self, robot, function):
        return [row for row in self.rows if row['robot'] == robot and row['function'] == function and row['us']
                and row not in self.tapes and not level_of(row['route'])]


# By default and with libm's sines; in tables from before the default had sines of its own, with libm's and portable ones.
GENERATED = ('generated', 'generated, libm', 'generated, portable')
KEPT = 'lanes, kept'
CASADI = ('CasADi', 'CasADi, analytic')
CPPADCODEGEN = ('CppADCodeGen', 'CppADCodeGen, analytic')
