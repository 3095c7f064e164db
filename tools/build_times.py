#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Prints what a build took: the whole, and the slowest units.  tools/build --times runs it.

    build_times.py .ninja_log LINES_BEFORE START
"""
import sys
import time

SHOWN = 12


def main():
    log, lines_before, start = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    whole = time.time() - start
    with open(log) as file:
        lines = file.read().splitlines()
    # A log that was rewritten is shorter than before; then all that is in it is told.
    new = lines[lines_before:] if len(lines) > lines_before else lines[1:] if len(lines) < lines_before else []
    seconds = {}
    for line in new:
        if line.startswith('#'):
            continue
        begin, end, _, output, _ = line.split('\t')
        seconds[output] = (int(end) - int(begin)) / 1000
    print(f'{whole:6.0f} s  from the first unit to the last, {len(seconds)} steps')
    print(f'{sum(seconds.values()):6.0f} s  of all steps together; the slowest:')
    for output, took in sorted(seconds.items(), key=lambda item: -item[1])[:SHOWN]:
        print(f'{took:6.1f} s  {output}')


if __name__ == '__main__':
    main()
