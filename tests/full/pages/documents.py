#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs what README.md and docs/ show, block by block, each page in a folder of its own, in which config/ and examples/ are.

    documents.py BUILD [PAGE ...]

python    is run, one namespace a page
console   lines that begin with $ are run and end with 0, or, if the block's title is "What it says", with another status; lines below a command
          are in what it prints; "..." is anything
info      below `<!-- within: FILE -->`: in place of the like blocks of that file, it is a sound file
A block with another title is saved under it.  tests/tools/page_blocks.py says what is a block, and that there is no other kind.
Exit status 1, with page and line, at the first block of a page that fails.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / 'tests/tools'))
import page_blocks  # noqa: E402

FAILS = 'What it says'


def run_console(text, is_failure):
    for part in re.split(r'^\$ ', text, flags=re.MULTILINE)[1:]:
        command, *expected = re.sub(r'\\\n', '', part.rstrip()).splitlines()
        done = subprocess.run(['bash', '-c', command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        said = ' '.join(done.stdout.split())
        if (done.returncode != 0) != is_failure:
            raise SystemExit(f'"{command}" ended with {done.returncode}:\n{done.stdout}')
        for line in expected:
            if line != '...' and ' '.join(line.split()) not in said:
                raise SystemExit(f'"{command}" does not say "{line}", but:\n{done.stdout}')


def entries(text):
    """The blocks and values of a file's top level, by name."""
    found, depth, name, begin = {}, 0, None, 0
    text = re.sub(r';.*', '', text)
    for token in re.finditer(r'"[^"]*"|[{}\n]|[^\s{}"]+', text):
        if depth == 0 and name is None and token.group(0) not in '{}\n':
            name, begin = token.group(0), token.start()
        depth += (token.group(0) == '{') - (token.group(0) == '}')
        is_end = token.group(0) == '}' or (token.group(0) == '\n' and not re.match(r'\s*\{', text[token.end():]))
        if depth == 0 and name is not None and is_end:
            found[name] = text[begin:token.end()].rstrip()
            name = None
    return found


def check_within(block):
    """The file `block.target` with the block's entries in place of its own."""
    folder = pathlib.Path('within')
    (folder / 'blocks').mkdir(parents=True, exist_ok=True)
    for name in 'robots', 'scenes', 'tasks', 'sweeps', 'control':
        if not (folder / name).exists():
            (folder / name).symlink_to(ROOT / 'config' / name)
    file = folder / 'blocks' / f'line_{block.line}.info'
    file.write_text('\n'.join((entries((ROOT / block.target).read_text()) | entries(block.text)).values()) + '\n')
    run_console(f'$ dyntape check-config {file}', False)


def prepare(text):
    """What pages ask readers to have installed."""
    if '$HOME/dyntape' in text:
        subprocess.run(['cmake', '--install', os.environ['DYNTAPE_BUILD'], '--prefix', str(pathlib.Path.home() / 'dyntape')], check=True,
                       stdout=subprocess.DEVNULL)


def run_page(page):
    """In a process of its own, in an empty folder."""
    names = {'__name__': '__main__'}
    prepare(page.read_text())
    for block in page_blocks.blocks(page):
        try:
            if block.note == 'not run':
                continue
            if block.language == 'console':
                run_console(block.text, block.title == FAILS)
            elif block.title:
                pathlib.Path(block.title).write_text(block.text)
            elif block.note == 'within':
                check_within(block)
            elif block.language == 'python':
                exec(compile('\n' * (block.line - 1) + block.text, str(page), 'exec'), names)
        except BaseException as problem:
            print(f'{block.page}:{block.line}: {type(problem).__name__}: {problem}', flush=True)
            return 1
    return 0


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    if '--page' in sys.argv:
        return run_page(pathlib.Path(sys.argv[3]))
    pages = [page for page in page_blocks.pages() if str(page.relative_to(ROOT)) not in page_blocks.TESTED_ELSEWHERE]
    wanted = [page for page in pages if len(sys.argv) == 2 or page.stem in sys.argv[2:]]
    failed = 0
    for page in wanted:
        count = sum(block.note == 'within' or block.language in ('python', 'console') for block in page_blocks.blocks(page))
        if not count:
            continue
        with tempfile.TemporaryDirectory() as folder:
            environment = {**os.environ, 'PATH': f'{build / "bin"}:{pathlib.Path(sys.executable).parent}:{os.environ["PATH"]}', 'HOME': folder,
                           'PYTHONPATH': str(build / 'python'), 'DYNTAPE_BUILD': str(build), 'DYNTAPE_CACHE': str(build / 'test_cache')}
            for name in 'config', 'examples':
                (pathlib.Path(folder) / name).symlink_to(ROOT / name)
            done = subprocess.run([sys.executable, __file__, build, '--page', page], cwd=folder, env=environment, stdout=subprocess.PIPE,
                                  stderr=subprocess.STDOUT, text=True)
        print(f'{page.relative_to(ROOT)}: {count} blocks ' + ('run' if done.returncode == 0 else 'FAIL\n' + done.stdout), flush=True)
        failed += done.returncode != 0
    return 1 if failed else 0


if __name__ == '__main__':
    sys.exit(main() if len(sys.argv) > 1 else __doc__)
