#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Prints the headers to install, one a line: those of public_headers.txt and what they include, to the end."""
import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
INCLUDE = re.compile(r'^\s*#\s*include\s*<dyntape/([^>]+)>', re.MULTILINE)


def main():
    listed = (ROOT / 'tools' / 'public_headers.txt').read_text().splitlines()
    pending = [line for line in listed if line and not line.startswith('#')]
    found = set()
    while pending:
        path = pending.pop()
        if path in found:
            continue
        if not (ROOT / path).is_file():
            sys.exit(f'public_headers.py: there is no {path}, which public_headers.txt or a public header names')
        found.add(path)
        pending += INCLUDE.findall((ROOT / path).read_text())
    print(*sorted(found), sep='\n')


main()
