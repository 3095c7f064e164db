#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The code blocks of README.md and docs/, each of which is tried, or says why not.

    page_blocks.py        exit status 1, with page and line: a block that nothing tries
    page_blocks.py --list the reasons that are given

cpp       compiled by page_programs.py
python    run by documents.py, on one page (TESTED_ELSEWHERE) by tests of their own
console   lines that begin with $ are run by documents.py
info      a file: with a title saved and used by the page's commands; below `<!-- within: FILE -->` put in place of the like blocks of that file, and
          checked; both by documents.py
c, xml    with a title: saved by documents.py and used by the page's commands
cmake     a file, below `<!-- file: FILE -->`; tools/pages.py holds it equal, tests/tools/install_test.sh builds with it
diff      lines that are not added stand in the sources
text      for reading: no commands, no keys
A block below `<!-- not run: REASON -->` is not tried.  There are fewer than five.
"""
import collections
import pathlib
import re
import subprocess
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parents[2]
FENCE = re.compile(r'(?:^ *<!-- (file|within|not run): ([^\n]*) -->\n)?^( *)```(\w*)(?: title="([^"\n]*)")?\n(.*?)^ *```$', re.MULTILINE | re.DOTALL)
TESTED_ELSEWHERE = {'docs/bridges.md': 'tests/python'}
COMMAND = re.compile(r'^(?:\$ |dyntape |pip |python3? |cmake |apt |tools/)', re.MULTILINE)
KEYS = re.compile(r'^\s*\w+ *\{.*\}\s*(?:;.*)?$|^\s*\w+ *\{\s*$', re.MULTILINE)
Block = collections.namedtuple('Block', 'page line language title text note target')


def pages():
    return [ROOT / 'README.md', *sorted((ROOT / 'docs').rglob('*.md'))]


def blocks(page):
    """Blocks of a page in order; `note` is file, within, not run or None, `target` what it names."""
    text = page.read_text()
    for match in FENCE.finditer(text):
        note, target, _, language, title, code = match.groups()
        line = text.count('\n', 0, match.start(6)) + 1
        yield Block(page.relative_to(ROOT).as_posix(), line, language, title, textwrap.dedent(code), note, target)


def sources():
    names = subprocess.run(['git', 'ls-files', 'autodiff', 'dynamics', 'codegen', 'interface', 'tools'], cwd=ROOT, check=True, capture_output=True, text=True)
    return '\n'.join((ROOT / name).read_text(errors='replace') for name in names.stdout.split())


def faults_of_diff(block, text):
    for number, line in enumerate(block.text.splitlines()):
        kept = line[1:].strip()
        if line.startswith(' ') and kept and not kept.startswith('...') and kept not in text and not re.fullmatch(r'[\w./]+', kept):
            yield f'{block.page}:{block.line + number}: the sources have no "{kept}"'


def fault(block):
    """What keeps the block from being tried, or None."""
    tried = {'cpp': True, 'python': True, 'console': re.search(r'^\$ ', block.text, re.MULTILINE), 'diff': True, 'cmake': block.note == 'file',
             'info': block.title or block.note == 'within', 'c': block.title, 'xml': block.title, 'text': True}
    if block.note == 'not run' or block.page.startswith('docs/reference/'):
        return None
    if block.language not in tried:
        return f'"{block.language}" is not a language of pages; expected one of {", ".join(tried)}'
    if not tried[block.language]:
        return f'nothing tries this block of {block.language}'
    if block.language == 'text' and (COMMAND.search(block.text) or KEYS.search(block.text)):
        return 'text for reading has commands or keys; expected console or info'
    return None


def main():
    found = [block for page in pages() for block in blocks(page)]
    reasons = [f'{block.page}:{block.line}: {block.target}' for block in found if block.note == 'not run']
    if '--list' in sys.argv:
        print(*reasons, sep='\n')
        return 0
    faults, text = [], sources()
    for block in found:
        if said := fault(block):
            faults.append(f'{block.page}:{block.line}: {said}')
        if block.language == 'diff':
            faults += faults_of_diff(block, text)
    for page, folder in TESTED_ELSEWHERE.items():
        tests = '\n'.join(path.read_text() for path in (ROOT / folder).rglob('*.py'))
        for title, section in re.findall(r'^## (.*)\n((?:(?!^## ).*\n?)*)', (ROOT / page).read_text(), re.MULTILINE):
            if '```python' in section and f'page_section("{title}")' not in tests:
                faults.append(f'{page}: no test in {folder} runs the section "{title}"')
    if len(reasons) >= 5:
        faults.append('five or more blocks are not tried:\n  ' + '\n  '.join(reasons))
    fences = sum(len(re.findall(r'^ *```', page.read_text(), re.MULTILINE)) for page in pages())
    if fences != 2 * len(found):
        faults.append(f'{fences} fences, but {len(found)} blocks are read')
    print(*faults, sep='\n')
    print(f'{len(found)} blocks, {len(reasons)} with a reason not to be tried, {len(faults)} faults')
    return bool(faults)


if __name__ == '__main__':
    sys.exit(main())
