#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Prints what a build took: the whole, and the slowest units; or what a unit's time went into.

    build_times.py .ninja_log LINES_BEFORE START     tools/build --times runs it
    build_times.py --why BUILD_DIR UNIT              compiles the first unit whose name ends in UNIT with clang, and prints which
                                                     templates it instantiates, how often, for how long, and for whom
"""
import collections
import json
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time

SHOWN = 12
TEMPLATES = 30


def trace_of(build, unit):
    """The events of clang's -ftime-trace of one unit of compile_commands.json."""
    commands = json.loads((build / 'compile_commands.json').read_text())
    found = next((c for c in commands if c['file'].endswith(unit)), None)
    if not found:
        sys.exit(f'build_times: no unit of {build} ends in {unit}; compile_commands.json lists them')
    words = shlex.split(found['command'])
    words = words[next(i for i, word in enumerate(words) if word.endswith(('c++', 'g++'))) + 1:words.index('-o')]
    words = [w for w in words if not w.startswith(('-W', '-fno-gnu-unique')) and w != '-fno-tree-slp-vectorize']
    while '-MF' in words:
        at = words.index('-MF')
        del words[at - 3:at + 2]
    with tempfile.TemporaryDirectory() as folder:
        for at, word in enumerate(words):  # gcc's precompiled header lies beside the header, where clang would take it
            if word.endswith('cmake_pch.hxx'):
                words[at] = shutil.copy(word, folder)
        quadmath = subprocess.run(['gcc', '-print-file-name=include'], stdout=subprocess.PIPE, text=True, check=True).stdout.strip()
        subprocess.run(['clang++', *words, '-idirafter', quadmath, '-w', '-ftime-trace', '-c', found['file'], '-o', f'{folder}/unit.o'],
                       cwd=found['directory'], check=True)
        return json.loads(pathlib.Path(folder, 'unit.json').read_text())['traceEvents']


def why(build, unit):
    events = [e for e in trace_of(pathlib.Path(build).resolve(), unit) if e.get('ph') == 'X']
    totals = {e['name'][6:]: e['dur'] / 1e6 for e in events if e['name'].startswith('Total ')}
    print(', '.join(f'{name} {totals.get(name, 0):.1f} s' for name in
                    ('ExecuteCompiler', 'Frontend', 'Source', 'InstantiateClass', 'InstantiateFunction', 'Optimizer', 'CodeGenPasses')))
    spans = sorted((e for e in events if not e['name'].startswith('Total ')), key=lambda e: (e['ts'], -e['dur']))
    own, count, users, open_spans = collections.Counter(), collections.Counter(), collections.defaultdict(collections.Counter), []
    for e in spans:
        while open_spans and open_spans[-1][0] <= e['ts']:
            open_spans.pop()
        detail = e.get('args', {}).get('detail', '')
        key = re.sub('<.*', '', detail) if e['name'].startswith('Instantiate') else None
        if open_spans and open_spans[-1][1]:
            own[open_spans[-1][1]] -= e['dur'] / 1e6
        if key:
            own[key] += e['dur'] / 1e6
            count[key] += 1
            user = next((d for _, _, d in reversed(open_spans) if d.startswith('dyntape::')), '')
            users[key][re.sub('<.*', '', user)] += 1
        open_spans.append((e['ts'] + e['dur'], key, detail))
    for key, seconds in own.most_common(TEMPLATES):
        whom = ', '.join(f'{user} {n}' for user, n in users[key].most_common(4) if user)
        print(f'{seconds:7.2f} s {count[key]:5d}  {key}' + (f'   ({whom})' if whom else ''))


def times(log, lines_before, start):
    whole = time.time() - start
    with open(log) as file:
        lines = file.read().splitlines()
    # A log that was rewritten is shorter than before; then all of its lines are new.
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
    if sys.argv[1] == '--why':
        why(*sys.argv[2:4])
    else:
        times(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
