#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Prints where the minutes of a run of tools/test went.

    minutes.py JUNIT_FILE SET_UP BUILD TESTS        seconds of each part
"""
import collections
import sys
import xml.etree.ElementTree

SHOWN, LONG = 15, 20  # tests that are shown; seconds from which an ordinary one is


def main():
    set_up, build, tests = map(float, sys.argv[2:5])
    seconds = collections.Counter()
    for case in xml.etree.ElementTree.parse(sys.argv[1]).iter('testcase'):
        seconds[case.get('name')] += float(case.get('time') or 0)
    print(f'\nMinutes: set-up {set_up / 60:.1f}, build {build / 60:.1f}, tests {tests / 60:.1f}; '
          f'all tests one after the other {sum(seconds.values()) / 60:.1f}, of which')
    for name, took in seconds.most_common(SHOWN):
        if took >= LONG:
            print(f'{took / 60:8.1f}  {name}')


if __name__ == '__main__':
    main()
