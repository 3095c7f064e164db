#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes docs/hard_cases.md and docs/capabilities.md: which test holds which hard case and which capability.

    tools/hard_cases.py            writes the pages
    tools/hard_cases.py --check    exit status 1, with the difference, where a page is not current

A case stands in the comment above its test in tests/hard/, several one after the other, each from its ids to its end:

    // H34, X04 | naive: what plain code does | holds: what must hold | routes: by which ways
    TEST(...)

What tests of other folders hold stands in tests/hard/elsewhere.txt, and what does not hold in tests/hard/limits.txt; what
dyntape can do, in tests/capabilities.txt.  Every test that is named must exist.
"""
import argparse
import difflib
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
TESTS = ROOT / 'tests'
HARD = TESTS / 'hard'
MACRO = re.compile(r'^(?:TEST|TEST_F|TEST_P|TYPED_TEST)\(\s*(\w+),\s*(\w+)\)', re.MULTILINE)
IDS = r'[A-Z]?\d+(?:, [A-Z]?\d+)*'
FIELDS = ('naive', 'holds', 'routes')


def fail(text):
    sys.exit(f'hard_cases.py: {text}')


def tests_of(folder):
    """Names of the tests of a folder: Suite.Name, and those that CMake adds by name."""
    names = set()
    for path in (TESTS / folder).rglob('*.cpp'):
        names.update('.'.join(match) for match in MACRO.findall(path.read_text()))
    for lists in (TESTS / folder).rglob('CMakeLists.txt'):
        names.update(re.findall(r'add_test\(NAME (\w+)', lists.read_text()))
    return names


KNOWN = {folder.name: tests_of(folder.name) for folder in TESTS.iterdir() if folder.is_dir()}


def check_tests(names, where):
    """Names as `folder Suite.Name`."""
    for name in names:
        folder, _, test = name.partition(' ')
        if test not in KNOWN.get(folder, ()):
            near = difflib.get_close_matches(test, KNOWN.get(folder, ()), 1)
            fail(f'{where}: no test "{name}"' + (f'; did you mean "{folder} {near[0]}"?' if near else ''))


def tests_of(fields, where):
    tests = [name.strip() for line in fields.get('tests', []) for name in line.split(',')]
    check_tests(tests, where)
    return tests


def order_of(identifier):
    """H1, H2, ... before 1, 2, ... before X1, ..."""
    letter, number = re.fullmatch(r'([A-Z]?)(\d+)', identifier).groups()
    return ({'H': 0, '': 1}.get(letter, 2), letter, int(number))


class Case:
    def __init__(self, ids, text, tests, where):
        self.ids = ids.split(', ')
        self.tests = tests
        match = re.fullmatch(r'naive: (.+?) \| holds: (.+?) \| routes: (.+?)', text)
        if not match:
            fail(f'{where}: expected "{ids} | naive: ... | holds: ... | routes: ...", got "{text}"')
        self.naive, self.holds, self.routes = match.groups()

    def take_routes(self, before):
        """"the same" is that of the case before it."""
        if self.routes == 'the same':
            self.routes = before.routes
        return self


def cases_above(path):
    """(cases, tests without one) of a file: comments right above its tests."""
    cases, bare, comment = [], [], []
    for line in path.read_text().splitlines():
        if line.startswith('//'):
            comment.append(line[2:].strip())
            continue
        match = MACRO.match(line)
        if match:
            name = 'hard ' + '.'.join(match.groups())
            texts = re.split(rf'(?:^|(?<=[^,]) )(?=(?:{IDS}) \| naive: )', ' '.join(comment))
            found = [text for text in texts if re.match(rf'(?:{IDS}) \| ', text)]
            for text in found:
                ids, _, rest = text.partition(' | ')
                case = Case(ids, rest.strip(), [name], f'{path.name}, {name}')
                cases.append(case.take_routes(cases[-1]) if cases else case)
            if not found:
                bare.append(name)
        comment = []
    return cases, bare


def records(path):
    """Blocks of a file between empty lines: (first line, {key: values})."""
    for block in re.split(r'\n\s*\n', path.read_text()):
        lines = [line for line in block.splitlines() if line.strip() and not line.startswith('#')]
        if not lines:
            continue
        fields = {}
        for line in lines[1:]:
            key, found, value = line.partition(': ')
            if not found:
                fail(f'{path.name}: expected "key: value", got "{line}"')
            fields.setdefault(key.strip(), []).append(value.strip())
        yield lines[0].strip(), fields


def cases_elsewhere():
    path = HARD / 'elsewhere.txt'
    for ids, fields in records(path):
        missing = [key for key in (*FIELDS, 'tests') if key not in fields]
        if missing:
            fail(f'{path.name}, {ids}: no {missing[0]}')
        tests = tests_of(fields, f'{path.name}, {ids}')
        yield Case(ids, ' | '.join(f'{key}: {fields[key][0]}' for key in FIELDS), tests, path.name)


def cell(text):
    return text.replace('|', '\\|')


def tests_cell(names):
    return '<br>'.join(f'`{name}`' for name in names)


def hard_cases():
    cases = list(cases_elsewhere())
    for path in sorted(HARD.glob('*.cpp')):
        found, bare = cases_above(path)
        if bare:
            fail(f'{path.name}: {bare[0]} has no case above it')
        cases += found
    cases.sort(key=lambda case: order_of(case.ids[0]))
    limits = [(ids, fields['limit'][0]) for ids, fields in records(HARD / 'limits.txt')]
    rows = ''.join(f'| {", ".join(case.ids)} | {cell(case.naive)} | {cell(case.holds)} | {cell(case.routes)} | {tests_cell(case.tests)} |\n'
                   for case in cases)
    bounds = ''.join(f'| {ids} | {cell(limit)} |\n' for ids, limit in limits)
    known = {identifier for case in cases for identifier in case.ids} | {i for ids, _ in limits for i in ids.split(', ')}
    return f'''# Hard cases

Made by `tools/hard_cases.py` from the comments above the tests. `ctest -L hard` runs all of them.

Ids: H.. rigid bodies, integration and optimisation; numbers without a letter differentiation and code generation; X.. neighbours
of both. Names are of a folder of `tests/` and a test; of tests with parameters each instance is a point of the case. Routes:
*all* means the template in double, the interpreter point by point and in lanes, C at -O0 and at -O3 and in lanes (these
bit for bit), portable functions and libm's, the function as a callee, forward and reverse mode and one over the other, against 113
bits (`tests/hard/every_route.h`).

{len(known)} ids in {len(cases)} rows.

| case | what plain code does | what holds | routes | tests |
|---|---|---|---|---|
{rows}
## Limits

What does not hold, or makes no sense here, and why.

| case | limit |
|---|---|
{bounds}'''


def capabilities():
    path = TESTS / 'capabilities.txt'
    rows = []
    for head, fields in records(path):
        match = re.fullmatch(r'(S\d+) (.+)', head)
        if not match:
            fail(f'{path.name}: expected "S01 what it is", got "{head}"')
        tests = tests_of(fields, f'{path.name}, {match[1]}')
        if not tests:
            fail(f'{path.name}: {match[1]} has no test')
        rows.append(f'| {match[1]} | {cell(match[2])} | {tests_cell(tests)} |\n')
    return f'''# Capabilities

Made by `tools/hard_cases.py` from `tests/capabilities.txt`: what dyntape can do, and the tests that hold it to that. Names are of a
folder of `tests/` and a test, as `ctest -N` lists them.

| | what | tests |
|---|---|---|
{''.join(rows)}'''


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--check', action='store_true', help='compare, write nothing')
    options = parser.parse_args()
    current = True
    for name, text in {'hard_cases.md': hard_cases(), 'capabilities.md': capabilities()}.items():
        path = ROOT / 'docs' / name
        old = path.read_text() if path.exists() else ''
        if old == text:
            continue
        current = False
        if options.check:
            sys.stdout.writelines(difflib.unified_diff(old.splitlines(True), text.splitlines(True), name, name + ' as it should be'))
        else:
            path.write_text(text)
    if options.check and not current:
        sys.exit('docs/ is not current; tools/hard_cases.py writes it')


if __name__ == '__main__':
    main()
