#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the text of files into the pages that show them: the fenced block below each `<!-- file: PATH -->` of docs/.

    pages.py            writes the blocks anew
    pages.py --check    exit status 1 if a block differs from its file, or a link of a page leads nowhere in the repository
"""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
BLOCK = re.compile(r'^<!-- file: (\S+) -->\n(?:```\w*( title="[^"\n]*")?\n.*?^```\n)?', re.MULTILINE | re.DOTALL)
LANGUAGES = {'.py': 'python', '.cpp': 'cpp', '.h': 'cpp', '.txt': 'cmake', '.sh': 'bash'}
LINK = re.compile(r'\]\((?![a-z]+:)([^)#\s]+)')
CODE = re.compile(r'^ *```.*?^ *```|`[^`\n]*`', re.MULTILINE | re.DOTALL)
LICENCE = re.compile(r'\A(?:#!.*\n)?(?://|#) SPDX.*\n(?:(?://|#)\n)?\n*')


def block(match):
    path = ROOT / match.group(1)
    head = LANGUAGES.get(path.suffix, '') + (match.group(2) or '')
    return f'{match.group(0).splitlines()[0]}\n```{head}\n{LICENCE.sub("", path.read_text()).rstrip()}\n```\n'


def dead_links():
    for page in (*ROOT.glob('*.md'), *(ROOT / 'docs').rglob('*.md')):
        for target in LINK.findall(CODE.sub('', page.read_text())):
            if not (page.parent / target).exists():
                yield f'{page.relative_to(ROOT)}: no {target}'


def main():
    is_check, old = '--check' in sys.argv, []
    for page in sorted((ROOT / 'docs').rglob('*.md')):
        text = page.read_text()
        new = BLOCK.sub(block, text)
        if new != text:
            old.append(f'{page.relative_to(ROOT)}: a block differs from its file; run tools/pages.py')
            if not is_check:
                page.write_text(new)
    if is_check and (problems := old + sorted(dead_links())):
        sys.exit('\n'.join(problems))


main()
