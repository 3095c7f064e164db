#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Committed pictures of studies and benchmarks can be read: no text leaves them, no two numbers of an axis run into each other.

    pictures_test.py SOURCE_DIR
"""
import html
import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(sys.argv.pop())
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / 'tests' / 'bench'))
from pictures import BARS, pictures  # noqa: E402
from table import ROBOTS, Table  # noqa: E402

PICTURES = sorted([*(ROOT / 'docs' / 'studies').glob('*.svg'), ROOT / 'docs' / 'sweep.svg'])
TEXT = re.compile(r'<g transform="translate\(([-\d.]+),([-\d.]+)\)( rotate\([-\d.]+\))?"[^>]*font-size="([\d.]+)"[^>]*text-anchor="(\w+)">\s*'
                  r'<text>(.*?)</text>', re.S)
LETTER = 0.56  # mean width of a letter, as a part of the font's size


class Text:
    def __init__(self, match):
        x, self.y, turned, size, anchor, inner = match
        self.y, self.is_turned, self.size = float(self.y), bool(turned), float(size)
        self.text = html.unescape(re.sub(r'<[^>]*>', '', inner))
        width = LETTER * self.size * len(self.text)
        self.left = float(x) - {'start': 0, 'middle': width / 2, 'end': width}[anchor]
        self.right = self.left + width


def texts(svg):
    return [Text(match) for match in TEXT.findall(svg)]


def size(svg):
    return [float(x) for x in re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', svg).groups()]


def numbers_that_meet(svg):
    """Neighbours in one line of which one begins before the other ends."""
    found = []
    lines = {}
    for text in texts(svg):
        if not text.is_turned and re.fullmatch(r'[-−]?[\d.]+(e[-+]\d+)?', text.text):
            lines.setdefault(round(text.y), []).append(text)
    for line in lines.values():
        line.sort(key=lambda t: t.left)
        found += [(a.text, b.text) for a, b in zip(line, line[1:]) if b.left < a.right]
    return found


class Pictures(unittest.TestCase):
    def test_there_are_some(self):
        self.assertGreater(len(PICTURES), 25)

    def test_texts_stay_inside(self):
        for path in PICTURES:
            svg = path.read_text()
            width, height = size(svg)
            self.assertGreater(len(texts(svg)), 5, path.name)
            for text in texts(svg):
                if not text.is_turned:
                    self.assertTrue(-1 <= text.left and text.right <= width + 1 and 0 < text.y < height, f'{path.name}: {text.text}')

    def test_numbers_along_an_axis_keep_apart(self):
        for path in PICTURES:
            self.assertEqual(numbers_that_meet(path.read_text()), [], path.name)

    def test_names_of_bars_stand_above_all_panels(self):
        table = Table(ROOT / 'docs' / 'studies' / 'benchmarks.csv')
        for name in pictures(table):
            svg = (ROOT / 'docs' / 'studies' / f'{name}.svg').read_text()
            top = min(t.y for t in texts(svg) if t.text in ROBOTS.values())
            for text in texts(svg):
                if text.text in [bar[0] for bar in BARS]:
                    self.assertLess(text.y, top - text.size, f'{name}: {text.text}')


if __name__ == '__main__':
    unittest.main()
