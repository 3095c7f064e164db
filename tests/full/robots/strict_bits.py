#!/usr/bin/env python3
"""A table of hashes of what evaluations give: robot, function, route, hash.

    strict_bits.py build/bin/dyntape config/robots > now.csv
    strict_bits.py build/bin/dyntape config/robots --against before.csv     # prints what differs, exit 1 if anything does

Two builds on one machine whose tables agree give the same bits.  (libm differs between machines, so no table is kept.)
What takes minutes is left out: second derivatives of large robots, and most of their functions on the tape and generated.
"""
import argparse
import csv
import hashlib
import json
import os
import random
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

ROUTES = ('analytic', 'tape', 'generated')
FLOATING = {'g1', 'simple_humanoid', 'solo12', 'talos'}
STATES = 3
# Of large robots only these are recorded and compiled.
CORE = {'rnea', 'aba', 'crba', 'id-derivatives', 'fd-derivatives', 'minverse'}
LARGE, LARGE_TO_DIFFERENTIATE = 12, 20  # degrees of freedom


def functions(dyntape):
    """Names and states ('q v a') from the table below `eval --help`."""
    lines = subprocess.run([dyntape, 'eval', '--help'], capture_output=True, text=True, check=True).stdout.splitlines()
    first = next(i for i, line in enumerate(lines) if line.split()[:2] == ['function', 'state'])
    at = lines[first].index('state'), lines[first].index('what')
    rows = [(line[:at[0]].strip(), line[at[0]:at[1]].split()) for line in lines[first + 1:]]
    return [(name, state) for name, state in rows if name and state and set(state) <= {'q', 'v', 'a', 'tau', 'mu'}]


def sizes(dyntape, path, base):
    text = subprocess.run([dyntape, 'info', path, '--base', base, '--json'], capture_output=True, text=True, check=True)
    info = json.loads(text.stdout)
    return info['nq'], info['nv']


def write_states(path, state, nq, nv):
    numbers = random.Random(7)
    columns = [f'{part}{k}' for part in state for k in range(nq if part == 'q' else nv)]
    with open(path, 'w') as file:
        print(*columns, sep=',', file=file)
        for _ in range(STATES):
            print(*(repr(numbers.uniform(-1, 1)) for _ in columns), sep=',', file=file)


def is_quick(function, route, nv):
    if 'second' in function:
        return nv <= LARGE and (route != 'generated' or nv <= 7)
    if route == 'analytic' or nv <= LARGE:
        return True
    return function in CORE and (route == 'generated' or nv <= LARGE_TO_DIFFERENTIATE or 'derivatives' not in function)


def hash_of(dyntape, folder, path, base, function, state, route, size):
    name = os.path.splitext(os.path.basename(path))[0]
    states, result = (os.path.join(folder, f'{name}_{function}_{route}_{end}.csv') for end in ('in', 'out'))
    write_states(states, state, *size)
    run = subprocess.run([dyntape, 'eval', path, '--base', base, '--function', function, '--route', route, '--input', states,
                          '--output', result], capture_output=True, text=True)
    if run.returncode:
        return 'refused'
    with open(result, 'rb') as file:
        return hashlib.sha256(file.read()).hexdigest()[:16]


def rows_of(dyntape, folder_of_robots, jobs):
    """(robot, function, route), hash: one after the other."""
    known = functions(dyntape)
    pending = []
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(jobs) as pool:
        for file in sorted(os.listdir(folder_of_robots)):
            robot, extension = os.path.splitext(file)
            if extension != '.urdf':
                continue
            path, base = os.path.join(folder_of_robots, file), 'floating' if robot in FLOATING else 'fixed'
            size = sizes(dyntape, path, base)
            pending += [((robot, function, route),
                         pool.submit(hash_of, dyntape, folder, path, base, function, state, route, size))
                        for function, state in known for route in ROUTES if is_quick(function, route, size[1])]
        for key, future in pending:
            yield key, future.result()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('dyntape')
    parser.add_argument('robots')
    parser.add_argument('--against', metavar='TABLE.csv')
    parser.add_argument('--jobs', type=int, default=2)
    options = parser.parse_args()
    rows = rows_of(options.dyntape, options.robots, options.jobs)
    if not options.against:
        print('robot,function,route,hash')
        for key, digest in rows:
            print(*key, digest, sep=',', flush=True)
        return 0
    with open(options.against) as file:
        before = {tuple(row[:3]): row[3] for row in csv.reader(file)}
    count, changed = 0, 0
    for key, digest in rows:
        count += 1
        if before.get(key) != digest:
            changed += 1
            print(*key, 'differs' if key in before else 'is new')
    print(f'{changed} of {count} differ')
    return 1 if changed else 0


if __name__ == '__main__':
    sys.exit(main())
