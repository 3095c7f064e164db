# SPDX-License-Identifier: BSD-3-Clause
"""The page of the C++ API: every public header, what it teaches first and what it declares."""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
ROOMS = {'autodiff': 'Recording and deriving', 'codegen': 'Generating, compiling, running', 'dynamics': 'Dynamics of robots',
         'interface': 'Systems, control, results'}


def parts(text):
    """The comment with which a header begins, as prose, and what it declares."""
    lines = text.splitlines()
    body = [line for line in lines if not line.startswith(('// SPDX', '#pragma once'))]
    prose = []
    while body and (body[0].startswith('//') or not body[0].strip()):
        line = body.pop(0)
        if line.startswith('//'):
            prose.append(line[3:] if line.startswith('// ') else line[2:])
        elif prose:
            break
    code = [line for line in body if not re.match(r'#\s*include', line)]
    return prose, re.sub(r'\n{3,}', '\n\n', '\n'.join(code)).strip()


def prose_text(lines):
    """Indented lines are code."""
    out, block = [], []
    for line in [*lines, '']:
        if line.startswith('  ') or (block and not line.strip()):
            block.append(line)
            continue
        if block:
            out += ['', '```cpp', *(x[2:] for x in block), '```', '']
            block = []
        out.append(line.replace('<', '&lt;'))
    return '\n'.join(out).strip()


def page():
    headers = [line for line in (ROOT / 'tools/public_headers.txt').read_text().splitlines() if line and not line.startswith('#')]
    out = ['# C++', '', 'The headers that programs include, as they stand in the sources; what these include is installed with them.',
           'Include them as `<dyntape/PATH>`; [programs](../programs.md) shows how to build.', '']
    for part, title in ROOMS.items():
        out += [f'## {title}', '']
        for path in sorted(header for header in headers if header.startswith(part + '/')):
            prose, code = parts((ROOT / path).read_text())
            out += [f'### `{path}`', '', prose_text(prose), '', '```cpp', code, '```', '']
    return '\n'.join(out) + '\n'
