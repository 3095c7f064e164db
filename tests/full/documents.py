#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs what the README and the pages of docs/start, docs/tutorials and docs/how_to show, block by block, each page in a folder of its own.

    documents.py BUILD [PAGE ...]

```python          run, one namespace a page, in a folder in which config/ and examples/ are
```xxx title="F"    saved as F in that folder
```console          lines that begin with $ are run, and have to end with 0; where the block's title is "What it says", with another status; lines
                    below a command have to be in what it prints
Blocks of no language are for reading.  Exit status 1, with page and line, at the first block of a page that fails.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
FENCE = re.compile(r'^```(\w*)(?: title="([^"]*)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)
FAILS = 'What it says'


def pages():
    folders = (ROOT / 'docs' / name for name in ('start', 'tutorials', 'how_to'))
    return [ROOT / 'README.md', *sorted(path for folder in folders for path in folder.glob('*.md'))]


def run_console(text, is_failure):
    for part in re.split(r'^\$ ', text, flags=re.MULTILINE)[1:]:
        command, *expected = part.rstrip().splitlines()
        done = subprocess.run(['bash', '-c', command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        said = ' '.join(done.stdout.split())
        if (done.returncode != 0) != is_failure:
            raise SystemExit(f'"{command}" ended with {done.returncode}:\n{done.stdout}')
        for line in expected:
            if ' '.join(line.split()) not in said:
                raise SystemExit(f'"{command}" does not say "{line}", but:\n{done.stdout}')


def run_page(page):
    """In a process of its own, in an empty folder."""
    text, names = page.read_text(), {'__name__': '__main__'}
    for match in FENCE.finditer(text):
        language, title, block = match.groups()
        line = text.count('\n', 0, match.start()) + 2
        try:
            if language == 'console':
                run_console(block, title == FAILS)
            elif title:
                pathlib.Path(title).write_text(block)
            elif language == 'python':
                exec(compile('\n' * (line - 1) + block, str(page), 'exec'), names)
        except BaseException as problem:
            print(f'{page.relative_to(ROOT)}:{line}: {type(problem).__name__}: {problem}', flush=True)
            return 1
    return 0


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    if '--page' in sys.argv:
        return run_page(pathlib.Path(sys.argv[3]))
    wanted = [page for page in pages() if len(sys.argv) == 2 or page.stem in sys.argv[2:]]
    environment = {**os.environ, 'PATH': f'{build / "bin"}:{os.environ["PATH"]}', 'PYTHONPATH': str(build / 'python'),
                   'DYNTAPE_CACHE': str(build / 'test_cache')}
    failed = 0
    for page in wanted:
        with tempfile.TemporaryDirectory() as folder:
            for name in 'config', 'examples':
                (pathlib.Path(folder) / name).symlink_to(ROOT / name)
            done = subprocess.run([sys.executable, __file__, build, '--page', page], cwd=folder, env=environment, stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, text=True)
        blocks = sum(match.group(1) in ('python', 'console') for match in FENCE.finditer(page.read_text()))
        print(f'{page.relative_to(ROOT)}: {blocks} blocks ' + ('run' if done.returncode == 0 else 'FAIL\n' + done.stdout), flush=True)
        failed += done.returncode != 0
    return 1 if failed else 0


if __name__ == '__main__':
    sys.exit(main() if len(sys.argv) > 1 else __doc__)
