#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Puts the sources of the site together: docs/, pages made of the sources, files that pages link to.

    assemble.py BUILD DESTINATION [--gallery]      pages of notebooks are those in BUILD/notebooks (notebooks.py)
"""
import pathlib
import posixpath
import re
import shutil
import sys

import cpp_reference
import equations
import gallery
import notebooks
import python_reference

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = {'CHANGELOG.md': 'changelog.md', 'CONTRIBUTING.md': 'contributing.md', 'SECURITY.md': 'security.md'}  # beside docs/
KATEX = pathlib.Path('/usr/share/javascript/katex')  # of the package libjs-katex
LINK = re.compile(r'(\]\()([^)#\s]+)((?:#[^)\s]*)?\))')


class Links:
    """Links of pages, as the site has them; what is neither a page nor a file of the repository is collected in `dead`."""

    def __init__(self, destination):
        self.destination, self.dead, self.pages = destination, [], set()

    def of(self, source, page):
        """Text of a page that stands at `source` in the repository and at `page` in the site."""
        def moved(match):
            target = match.group(2)
            if re.match(r'[a-z]+:', target):
                return match.group(0)
            path = posixpath.normpath(posixpath.join(posixpath.dirname(source), target))
            return match.group(1) + self.target(path, page) + match.group(3)
        return LINK.sub(moved, (ROOT / source).read_text())

    def target(self, path, page):
        if path.startswith('docs/'):
            place = path[len('docs/'):]
        elif path in PAGES:
            place = PAGES[path]
        else:
            place = 'files/' + path
            if not (ROOT / path).is_file():
                self.dead.append(f'{page}: {path}')
                return path
            copy(ROOT / path, self.destination / place)
            if path.endswith('.md') and path not in self.pages:  # a page of the site as well
                self.pages.add(path)
                (self.destination / place).write_text(self.of(path, place))
        return posixpath.relpath(place, posixpath.dirname(page) or '.')


def copy(source, destination):
    destination.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(source, destination)


def add_notebooks(pages, destination):
    shutil.copytree(pages, destination)
    rows = [f'| [{notebooks.title(path)}]({path.stem}.md) | [`{path.name}`](../../files/examples/notebooks/{path.name}) |'
            for path in sorted(notebooks.FOLDER.glob('*.ipynb'))]
    text = ['# Notebooks', '', 'Worked through, with their results. Download one and run it in a folder in which `config/` is.', '',
            '| notebook | file |', '|---|---|', *rows]
    (destination / 'index.md').write_text('\n'.join(text) + '\n')
    for path in notebooks.FOLDER.glob('*.ipynb'):
        copy(path, destination.parents[1] / 'files/examples/notebooks' / path.name)


def main():
    build, destination = (pathlib.Path(word).resolve() for word in sys.argv[1:3])
    shutil.rmtree(destination, ignore_errors=True)
    links = Links(destination)
    pages = {path.relative_to(ROOT).as_posix(): path.relative_to(ROOT / 'docs').as_posix() for path in (ROOT / 'docs').rglob('*')
             if path.is_file()} | PAGES
    for source, page in pages.items():
        if page.endswith('.md'):
            (destination / page).parent.mkdir(parents=True, exist_ok=True)
            (destination / page).write_text(links.of(source, page))
        else:
            copy(ROOT / source, destination / page)
    (destination / 'reference/cpp.md').write_text(cpp_reference.page())
    (destination / 'reference/python.md').write_text(python_reference.page(build / 'python' / 'dyntape'))
    (destination / 'gallery.md').write_text(gallery.page(build, destination, '--gallery' in sys.argv))
    add_notebooks(build / 'notebooks', destination / 'tutorials/notebooks')
    math = destination / 'math.md'
    math.write_text(equations.typeset(math.read_text()))
    for path in (KATEX / 'katex.min.css', KATEX / 'katex.min.js', *(KATEX / 'fonts').glob('*.woff2')):
        copy(path, destination / 'katex' / path.relative_to(KATEX))
    for name in ('wide.css', 'iframe-worker.js'):
        copy(pathlib.Path(__file__).parent / name, destination / name)
    if links.dead:
        sys.exit('tools/site: links to what is not there:\n  ' + '\n  '.join(links.dead))


main()
