#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every URDF below some folders: what Pinocchio reads, `dyntape info` reads with the same nq and nv.

    public_robots.py DYNTAPE FOLDER ...

Prints a line for each file that one of the two refuses.  A file that dyntape refuses and Pinocchio reads must stand in REFUSED, with the
reason, and must be read with the option named there.  Exit status 1: a file is read otherwise, or REFUSED has one that is read.
Needs the Python package pin.
"""
import json
import pathlib
import subprocess
import sys

import pinocchio

# Of example-robot-data 6.0.0: a principal moment of inertia is negative.
IMPOSSIBLE_INERTIA = ('has an inertia that no body has', ['--inertia', 'warn'])
REFUSED = {name: IMPOSSIBLE_INERTIA
           for name in ('romeo_laas_small.urdf', 'tiago.urdf', 'tiago_dual.urdf', 'tiago_no_hand.urdf')}


def sizes_of_pinocchio(path):
    """(nq, nv), or what Pinocchio says against the file."""
    try:
        model = pinocchio.buildModelFromUrdf(str(path))
        return model.nq, model.nv
    except Exception as error:  # whatever its binding throws
        return str(error).strip().replace(str(path), path.name)


def sizes_of_dyntape(dyntape, path, options=()):
    """(nq, nv), or what dyntape says against the file."""
    run = subprocess.run([dyntape, 'info', str(path), '--json', *options], capture_output=True, text=True)
    if run.returncode != 0:
        return run.stderr.strip().replace(str(path), path.name).removeprefix('dyntape: ')
    robot = json.loads(run.stdout)
    return robot['nq'], robot['nv']


def fault_of(dyntape, path):
    """Empty where both agree, or where it is known why they do not."""
    theirs, ours = sizes_of_pinocchio(path), sizes_of_dyntape(dyntape, path)
    known = REFUSED.get(path.name)
    if isinstance(theirs, str):
        print(f'Pinocchio: {theirs}\n  dyntape: {ours}')
        return ''
    if ours == theirs:
        return f'{path.name} is read and stands in REFUSED' if known else ''
    if isinstance(ours, tuple):
        return f'{path.name}: nq, nv are {ours}, and Pinocchio\'s are {theirs}'
    print(f'dyntape: {ours}')
    if not known:
        return f'{path.name} is refused, and Pinocchio reads it'
    reason, options = known
    if reason not in ours:
        return f'{path.name} is refused for another reason than "{reason}"'
    after = sizes_of_dyntape(dyntape, path, options)
    return '' if after == theirs else f'{path.name} with {" ".join(options)}: {after}, and Pinocchio\'s are {theirs}'


def main():
    dyntape, *folders = sys.argv[1:]
    files = sorted(path for folder in folders for path in pathlib.Path(folder).rglob('*.urdf'))
    if not files:
        sys.exit(f'public_robots.py: no URDF below {" ".join(folders)}')
    faults = [fault for fault in (fault_of(dyntape, path) for path in files) if fault]
    print(*faults, sep='\n')
    print(f'{len(files)} files, {len(REFUSED)} refused for a reason that is known, {len(faults)} faults')
    sys.exit(1 if faults else 0)


if __name__ == '__main__':
    main()
