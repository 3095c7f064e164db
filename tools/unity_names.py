#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fails where two sources of a library give the same name to something in an anonymous namespace: sources are compiled
many to a unit (tools/build), in which such names are one.  Overloads may share a name.  Or where such a name is that of a type
in a header of the library, in the same namespace, which a unit may include as well.  Or where a file of tests is not in a
namespace that is called as the file is, which keeps its names apart.

    tools/unity_names.py
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
LIBRARIES = ('autodiff', 'dynamics', 'codegen', 'interface', 'tools')
TESTS = ('autodiff', 'dynamics', 'codegen', 'interface', 'tools', 'hard')
ALONE = re.compile(r'/interface/(cppad/|ocs2/[^/]*$)')  # compiled a file at a time
HIDDEN = re.compile(r'^namespace \{$(.*?)^\}  // namespace$', re.M | re.S)
FUNCTION = re.compile(r'^(?:template <[^\n]*>\n)?(?!struct|class|enum|using|return)[A-Za-z_][^\n;={}()]*?[\s*&](\w+)\(([^{};]*?)\)[^;{}]*\{', re.M)
TYPE = re.compile(r'^(?:struct|class|enum class|enum) (\w+)\b[^;\n]*\{', re.M)
VALUE = re.compile(r'^(?:inline )?(?:static )?const(?:expr)? [^\n;({]*?\b(\w+)(?:\[[^\]]*\])?(?: =|\{)', re.M)
USING = re.compile(r'^using (\w+) = (.*?);', re.M | re.S)
NAMESPACE = re.compile(r'^namespace ([\w:]+) \{', re.M)
DECLARED = re.compile(r'^using ((?:\w+::)+(\w+));', re.M)


def types_of(parameters):
    """'const A& a, int n = 2' -> 'const A&, int'."""
    depth, parts, part = 0, [], ''
    for c in parameters + ',':
        depth += (c in '<([') - (c in '>)]')
        if c == ',' and depth == 0:
            parts.append(part)
            part = ''
        else:
            part += c
    names_off = lambda p: re.sub(r'(?<=[\s&*>])\w+$', '', p.split(' = ')[0].strip()).strip()
    return ', '.join(' '.join(names_off(p).split()) for p in parts)


def names_in(text):
    for block in HIDDEN.findall(text):
        for name, parameters in FUNCTION.findall(block):
            yield f'{name}({types_of(parameters)})', None
        for pattern in (TYPE, VALUE):
            yield from ((name, None) for name in pattern.findall(block))
        yield from USING.findall(block)
        yield from ((name, whole) for whole, name in DECLARED.findall(block))


def types_of_headers(library):
    """By namespace and name, the header that declares the type."""
    types = {}
    for path in sorted((ROOT / library).rglob('*.h')):
        text = path.read_text()
        parts = NAMESPACE.split(text)
        for namespace, part in zip(parts[1::2], parts[2::2]):
            types.update({(namespace, name): path.relative_to(ROOT).as_posix() for name in TYPE.findall(part)})
    return types


def main():
    problems = []
    for library in LIBRARIES:
        seen, declared = {}, types_of_headers(library)
        for path in sorted((ROOT / library).rglob('*.cpp')):
            where, text = path.relative_to(ROOT).as_posix(), path.read_text()
            for namespace in NAMESPACE.findall(text):
                for name in {name for block in HIDDEN.findall(text) for name in TYPE.findall(block)}:
                    if (namespace, name) in declared:
                        problems.append(f'{where}: {name} is a type of {declared[namespace, name]} as well')
            for name, meaning in set(names_in(text)):
                before, other = seen.setdefault(name, (meaning, where))
                if other != where and (meaning is None or meaning != before):  # one alias of one type is no other
                    problems.append(f'{where}: {name} is in {other} as well')
    for path in sorted(path for folder in TESTS for path in (ROOT / 'tests' / folder).rglob('*_test.cpp')):
        if ALONE.search(path.as_posix()):
            continue
        if not re.search(rf'^namespace (\w+::)*{path.stem} {{$', path.read_text(), re.M):
            problems.append(f'{path.relative_to(ROOT).as_posix()}: is not in a namespace {path.stem}')
    for problem in problems:
        print(problem)
    print(f'{len(problems)} names would meet in a unit' if problems else
          'names in anonymous namespaces are unique')
    return 1 if problems else 0


sys.exit(main())
