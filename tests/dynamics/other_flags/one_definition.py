#!/usr/bin/env python3
"""No object but those of the library defines an algorithm of dynamics/ in a built-in float.

    one_definition.py BUILD_DIR SOURCE_DIR

What another unit emits, compiled with flags of its own, the linker may take for the whole program: other bits, another speed.
"""
import pathlib
import re
import subprocess
import sys

# Templates that the files with the algorithms' definitions begin at the start of a line; those that are inlined always are
# never emitted, and those that are constant count entries.
TEMPLATE = re.compile(r'^template <[^\n]*>\n((?:(?!\n\n)[^({;])*?)\b(\w+)\(', re.M)
DEFINED = re.compile(r'dyntape::dynamics::(?:detail::)?(\w+)<(?:double|float)[,>]')
# The program that leaves effects out on purpose; the library; builds of other tests.
EXCEPT = re.compile(r'/effect_absence|/dyntape_dynamics|/dyntape_precisions|/levels_of_|/sanitized-|/fuzzing/')


def algorithms(source):
    names = set()
    for path in (source / 'dynamics').rglob('*.hxx'):
        names |= {name for before, name in TEMPLATE.findall(path.read_text()) if name.islower() and not re.search('DYNTAPE_INLINE|constexpr', before)}
    return names


def emitted(path):
    text = subprocess.run(['nm', '-C', '--defined-only', path], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout
    for line in text.splitlines():
        parts = line.split(' ', 2)
        if len(parts) == 3 and parts[1] in 'TW':
            for name in DEFINED.findall(parts[2].split('(')[0]):
                yield name, parts[2]


def main():
    build, source = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    names = algorithms(source)
    own = {name for path in build.glob('dynamics/**/*.o') for name, _ in emitted(path)}
    if not {'crba', 'aba', 'rnea', 'fd_derivatives'} <= names & own:
        sys.exit(f'one_definition: the test is blind: {len(names)} names in the sources, {len(own)} in the library')
    objects = [path for path in build.rglob('*.o') if not EXCEPT.search(str(path))]
    wrong = [f'{path.relative_to(build)}: {symbol}' for path in objects for name, symbol in emitted(path) if name in names]
    if wrong:
        sys.exit('one_definition: defined outside of the library:\n  ' + '\n  '.join(wrong[:20]))
    print(f'one_definition: {len(names)} algorithms, {len(objects)} objects')


main()
