#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the text of files into the pages that show them: the fenced block below each `<!-- file: PATH -->` of docs/.

    included_files.py            writes the blocks anew
    included_files.py --check    exit status 1 if a block differs from its file
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BLOCK = re.compile(r'^<!-- file: (\S+) -->\n(?:```\w*\n.*?^```\n)?', re.MULTILINE | re.DOTALL)
LANGUAGES = {'.py': 'python', '.cpp': 'cpp', '.h': 'cpp', '.txt': 'cmake', '.sh': 'bash'}
LICENCE = re.compile(r'\A(?:#!.*\n)?(?://|#) SPDX.*\n(?:(?://|#)\n)?\n*')


def block(match):
    path = ROOT / match.group(1)
    return f'{match.group(0).splitlines()[0]}\n```{LANGUAGES.get(path.suffix, "")}\n{LICENCE.sub("", path.read_text()).rstrip()}\n```\n'


def main():
    old = []
    for page in sorted((ROOT / 'docs').rglob('*.md')):
        text = page.read_text()
        new = BLOCK.sub(block, text)
        if new != text:
            old.append(page.relative_to(ROOT).as_posix())
            if '--check' not in sys.argv:
                page.write_text(new)
    if old and '--check' in sys.argv:
        sys.exit(f'blocks differ from the files that they show in {", ".join(old)}: run tools/included_files.py')


main()
