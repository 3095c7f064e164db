#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The page of benchmarks says what its table says.

    page_test.py SOURCE_DIR
"""
import importlib.machinery
import importlib.util
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(sys.argv.pop())
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / 'tests' / 'bench'))
import page  # noqa: E402
from pictures import pictures  # noqa: E402
from table import PEAK, Table  # noqa: E402

loader = importlib.machinery.SourceFileLoader('run', str(ROOT / 'tests' / 'bench' / 'run'))
run = importlib.util.module_from_spec(importlib.util.spec_from_loader('run', loader))
loader.exec_module(run)


def generated_flags():
    text = (ROOT / 'tests' / 'bench' / 'peers' / 'peer_library.py').read_text()
    return re.findall(r"'([^']+)'", re.search(r'^FLAGS = .*', text, re.M)[0])


def row(route, us, **more):
    return {'robot': 'ur5', 'function': 'id-derivatives', 'route': route, 'us': us, **more}


class Page(unittest.TestCase):
    def of(self, rows):
        with tempfile.TemporaryDirectory() as folder:
            table = pathlib.Path(folder) / 'benchmarks.csv'
            run.write(table, {'processor': 'a, b'}, run.complete(rows))
            return page.text_of(Table(table)), Table(table)

    def line(self, text, start):
        return next(line for line in text.splitlines() if line.startswith(start))

    def test_is_that_of_the_table(self):
        table = Table(ROOT / 'docs' / 'studies' / 'benchmarks.csv')
        self.assertEqual((ROOT / 'docs' / 'benchmarks.md').read_text(), page.text_of(table),
                         'tests/bench/run --page makes it again')

    def test_is_linked(self):
        self.assertIn('(docs/benchmarks.md)', (ROOT / 'README.md').read_text())
        for name in pictures(Table(ROOT / 'docs' / 'studies' / 'benchmarks.csv')):
            self.assertTrue((ROOT / 'docs' / 'studies' / f'{name}.svg').is_file(), name)

    def test_the_quicker_sines_and_the_quicker_variant_count(self):
        text, _ = self.of([row('CasADi', '2'), row('CasADi, analytic', '1'), row('CppADCodeGen', '4'), row('generated', '0.9'),
                           row('generated, libm', '0.5')])
        self.assertIn('| **id-derivatives** | CasADi | 0.5 |', text)
        self.assertIn('|  | CppADCodeGen | 0.12 |', text)
        self.assertIn("takes this part of a peer's time: 0.5 (id-derivatives, UR5) to 0.5 (id-derivatives, UR5) of CasADi", text)

    def test_what_is_not_measured_is_not_compared(self):
        text, _ = self.of([row('generated', '0.9'), row('CasADi', '', note='absent: no wheel')])
        self.assertNotIn('| CasADi |', text)
        self.assertIn('absent: no wheel', text)

    def test_ratios_and_rates(self):
        peak = {'robot': 'ur5', 'function': '', 'route': PEAK, 'us': '0.5', 'operations': '20000'}
        _, table = self.of([row('Pinocchio', '4'), row('generated', '0.5', operations='4000'), peak])
        generated = table.by_key['ur5', 'id-derivatives', 'generated']
        self.assertEqual([float(generated[name]) for name in ('ratio_to_pinocchio', 'gops', 'percent_of_peak')],
                         [0.125, 8, 20])

    def test_levels_of_the_processor_stand_side_by_side(self):
        rows = [row('Pinocchio', '2'), row('plain double', '1'), row('packs', '0.2'), row('plain double, x86-64-v3', '1.5'),
                row('Pinocchio, x86-64-v3', '3')]  # of the process that the row before is of
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / 'benchmarks.csv'
            run.write(path, {'level': 'x86-64-v4'}, run.complete(rows))
            text, drawn = page.text_of(Table(path)), pictures(Table(path))
        after = text[text.index('Plain double:'):]
        self.assertIn('| **id-derivatives** | x86-64-v4 | 0.5 |', after)
        self.assertIn('|  | x86-64-v3 | 0.5 |', after)
        self.assertIn('code for x86-64-v3', drawn['benchmarks_levels'])
        self.assertNotIn('Each processor', self.of(rows[:2])[0])

    def test_peers_are_named_with_the_flags_of_their_users(self):
        self.assertEqual(generated_flags()[:3], ['-O3', '-march=native', '-DNDEBUG'])
        header = (ROOT / 'tests' / 'bench' / 'command' / 'peer.h').read_text()
        self.assertIn('kPeerFlags[] = "-O3 -march=native -DNDEBUG"', header)

    def test_an_interrupted_run_loses_no_rows(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            ended = self.run_with(folder, 'panda')
            self.assertNotEqual(ended.returncode, 0)
            kept = (folder / 'out/studies/benchmarks.part.csv').read_text()
            self.assertEqual([kept.count('ur5,rnea,generated,1'), kept.count('panda,rnea,generated,1')], [1, 1], kept)
            ended = self.run_with(folder, 'nothing', '--resume')
            self.assertEqual(ended.returncode, 0, ended.stderr)
            table = (folder / 'out/studies/benchmarks.csv').read_text()
            self.assertEqual([table.count('ur5,rnea,generated,1'), table.count('panda,rnea,generated,1')], [1, 1], table)
            self.assertEqual((folder / 'calls').read_text().split(), ['ur5', 'panda', 'panda'])
            self.assertFalse((folder / 'out/studies/benchmarks.part.csv').exists())

    def run_with(self, folder, interrupted, *options):
        """A run with a program that interrupts it in the middle of one robot."""
        program = folder / 'program'
        program.write_text(f'''#!/bin/sh
[ "$1" = --about ] && {{ echo '{{"level": "x86-64-v2", "Pinocchio": "flags"}}'; exit; }}
robot=$(basename "$1" .urdf)
echo $robot >>{folder}/calls
echo robot,function,route,us,operations
echo $robot,rnea,generated,1,10
[ $robot = {interrupted} ] && {{ sleep 1; kill -INT $PPID; sleep 5; exit 1; }}
echo $robot,,"{PEAK}",1,10
''')
        program.chmod(0o755)
        return subprocess.run([ROOT / 'tests/bench/run', '--robots', 'ur5,panda', '--functions', 'rnea', '--program', program,
                               '--peers', folder / 'none', '--build', folder / 'build', '--output', folder / 'out', *options],
                              capture_output=True, text=True)

    def test_pictures_are_drawn(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / 'studies').mkdir()
            for path in page.make(ROOT / 'docs' / 'studies' / 'benchmarks.csv', folder)[1:]:
                self.assertTrue(path.read_text().rstrip().endswith('</svg>'), path)


if __name__ == '__main__':
    unittest.main()
