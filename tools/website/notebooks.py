#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs the notebooks of examples/notebooks cell by cell, and makes a page of each: text, code, what it prints, its pictures.

    notebooks.py OUTPUT [NAME ...]      with the interpreter and PYTHONPATH of a build; by default all

Exit status 1 with notebook and cell: a cell fails, or a notebook draws no picture.  A notebook whose libraries are not installed gets its page without
results.
"""
import contextlib
import importlib.util
import io
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / 'examples/notebooks'


def cells(path):
    """(kind, text) of the cells."""
    return [(cell['cell_type'], ''.join(cell['source'])) for cell in json.loads(path.read_text())['cells']]


def title(path):
    return cells(path)[0][1].splitlines()[0].removeprefix('# ')


def missing(path):
    """Libraries that the notebook imports and that are not here."""
    code = '\n'.join(text for kind, text in cells(path) if kind == 'code')
    return [name for name in re.findall(r'^import (\w+)', code, re.MULTILINE) if importlib.util.find_spec(name) is None]


def run(path, pictures):
    """The page of a notebook, whose pictures are written beside it."""
    import matplotlib
    matplotlib.use('Agg')
    import matplotlib.pyplot as plt
    names, parts, drawn = {'__name__': '__main__'}, [], 0
    for number, (kind, text) in enumerate(cells(path)):
        if kind == 'markdown':
            parts.append(text)
            continue
        said = io.StringIO()
        try:
            with contextlib.redirect_stdout(said):
                exec(compile(text, f'{path.name}, cell {number}', 'exec'), names)
        except BaseException as problem:
            sys.exit(f'{path.relative_to(ROOT)}, cell {number}: {type(problem).__name__}: {problem}')
        parts.append(f'```python\n{text}\n```')
        if said.getvalue():
            parts.append(f'```text\n{said.getvalue().rstrip()}\n```')
        for figure in map(plt.figure, plt.get_fignums()):
            drawn += 1
            name = f'{path.stem}_{drawn}.svg'
            figure.savefig(pictures / name, bbox_inches='tight')
            parts.append(f'![{title(path)}]({name})')
        plt.close('all')
    if drawn == 0:
        sys.exit(f'{path.relative_to(ROOT)}: it draws no picture')
    return parts


def unrun(path, without):
    code = [text if kind == 'markdown' else f'```python\n{text}\n```' for kind, text in cells(path)]
    return [code[0], f'Made without {" and ".join(without)}: results are not shown.', *code[1:]]


def page(path, output):
    """In a process of its own, in a folder in which config/ is."""
    without = missing(path)
    parts = unrun(path, without) if without else run(path, output)
    (output / f'{path.stem}.md').write_text('\n\n'.join(parts) + '\n')
    print(f'{path.relative_to(ROOT)}: ' + (f'without {", ".join(without)}' if without else 'run'), flush=True)


def main():
    output = pathlib.Path(sys.argv[1]).resolve()
    if sys.argv[2:3] == ['--one']:
        return page(pathlib.Path(sys.argv[3]), output)
    output.mkdir(parents=True, exist_ok=True)
    wanted = [path for path in sorted(FOLDER.glob('*.ipynb')) if len(sys.argv) == 2 or path.stem in sys.argv[2:]]
    failed = 0
    for path in wanted:
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / 'config').symlink_to(ROOT / 'config')
            failed += subprocess.run([sys.executable, __file__, output, '--one', path], cwd=folder,
                                     env={**os.environ, 'SOURCE_DATE_EPOCH': '0'}).returncode != 0
    return failed > 0 or not wanted


if __name__ == '__main__':
    sys.exit(main() if len(sys.argv) > 1 else __doc__)
