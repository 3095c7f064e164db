#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Whether all that pages of the site show or link to is there, and what a browser makes of some of them.

    site_pages.py SITE
"""
import html.parser
import pathlib
import shutil
import subprocess
import sys
import tempfile
import urllib.parse

SEEN = {'index.html': 'Exact derivatives', 'start/python.html': 'Install', 'tutorials/own_cost.html': 'record', 'tutorials/notebooks/obstacles.html': 'obstacles_1.svg', 'gallery.html': 'Motions',
        'reference/cpp.html': 'record.h', 'reference/python.html': 'rollout_gradient', 'studies/index.html': 'Studies'}


class Targets(html.parser.HTMLParser):
    """What a page links to or shows, and what it fetches without being asked."""

    def __init__(self):
        super().__init__()
        self.found, self.fetched = [], []

    def handle_starttag(self, tag, attributes):
        targets = [value for name, value in attributes if name in ('href', 'src') and value]
        self.found += targets
        self.fetched += [] if tag == 'a' else targets


def missing(site):
    for page in sorted(site.rglob('*.html')):
        if page.name == 'motion.html':
            continue
        parser = Targets()
        parser.feed(page.read_text())
        for target in parser.found:
            link = urllib.parse.urlsplit(target)
            if link.scheme or link.netloc or not link.path:
                if link.netloc and target in parser.fetched:
                    yield f'{page.relative_to(site)}: fetches {target}'
            elif not (page.parent / urllib.parse.unquote(link.path)).exists():
                yield f'{page.relative_to(site)}: {target} is not there'


def shown(address, folder):
    """The page as the browser has it after its scripts have run."""
    return subprocess.run(['chromium', '--headless', '--no-sandbox', '--disable-gpu', f'--user-data-dir={folder}', '--virtual-time-budget=10000',
                           '--dump-dom', f'file://{address}'], capture_output=True, text=True, timeout=120).stdout


def seen(site, page, text, folder):
    if text not in shown(site / page, folder):
        yield f'{page}: the browser does not show "{text}"'


def unset(site, folder):
    """Equations that stay text, or that KaTeX refuses."""
    page = shown(site / 'math.html', folder)
    cells, typeset, refused = page.count('data-tex='), page.count('<span class="katex">'), page.count('katex-error')
    if cells < 300 or typeset != cells or refused:
        yield f'math.html: {typeset} of {cells} equations are typeset, {refused} are refused'


def found(site, folder):
    """A search that is opened from the disk."""
    page = shown(f'{site}/tutorials/index.html?q=quaternion', folder)
    if 'md-search-result__item' not in page or '<mark' not in page:
        yield 'tutorials/index.html: a search for "quaternion" finds nothing'


def main():
    site = pathlib.Path(sys.argv[1]).resolve()
    problems = list(missing(site))
    if shutil.which('chromium'):
        with tempfile.TemporaryDirectory() as folder:
            for page, text in SEEN.items():
                problems += seen(site, page, text, folder)
            problems += unset(site, folder)
            problems += found(site, folder)
    print(*problems, sep='\n')
    print(f'{len(list(site.rglob("*.html")))} pages, {len(problems)} problems')
    return 1 if problems else 0


sys.exit(main())
