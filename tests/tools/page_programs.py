#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Compiles the C++ of README.md and docs/ against the headers that are installed, and nothing else.

    page_programs.py BUILD_DIR COMPILER

A block with `int main(` is a program.  Of the other blocks of a page, statements become functions and classes stay as they are;
page_context.h declares the variables that they use.  Exit status 1: a block does not compile; the compiler names page and line.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import page_blocks

ROOT = page_blocks.ROOT
TOP = re.compile(r'^(?:#include.*|namespace \w+ = .*|using namespace .*)\n?', re.MULTILINE)


def units(page):
    """Programs of the page, and one unit of all its other blocks."""
    head, body = [], []
    for block, line in ((block.text, block.line) for block in page_blocks.blocks(page) if block.language == 'cpp'):
        where = f'#line {line} "{page.relative_to(ROOT)}"\n'
        if 'int main(' in block:
            yield where + block
            continue
        head += TOP.findall(block)
        block = TOP.sub('\n', block)
        is_class = re.match(r'\s*(?:class|struct|template)\b', block)
        body.append(where + (block if is_class else f'void block_{line}() {{\n{where}{block}\n}}\n'))
    if body:
        is_cppad = any('cppad' in line for line in head)
        own = 'extern CppAD::ADFun<double> f;\n' if is_cppad else f'#include "{ROOT}/tests/tools/page_context.h"\n'
        yield '\n'.join(head) + '\n' + own + '\n'.join(body)


def main():
    build, compiler = pathlib.Path(sys.argv[1]), sys.argv[2]
    with tempfile.TemporaryDirectory() as folder:
        include = pathlib.Path(folder, 'include')
        headers = subprocess.run([sys.executable, ROOT / 'tools/public_headers.py'], check=True, capture_output=True, text=True)
        for header in headers.stdout.split():
            place = include / 'dyntape' / header
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / header, place)
        bad = count = 0
        for page in page_blocks.pages():
            for unit in units(page):
                count += 1
                bad += subprocess.run([compiler, '-std=c++20', '-fsyntax-only', '-w', f'-I{include}', f'-I{build}/cppad_drop_in',
                                       '-isystem', '/usr/include/eigen3', '-x', 'c++', '-'], input=unit, text=True).returncode != 0
    print(f'{count} programs of pages, {bad} do not compile')
    sys.exit(bad > 0 or count < 10)


main()
