#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Puts the licences of the libraries in a wheel beside its own, as Debian keeps them, with a list of which library is of which package.

    tools/bundled_licences.py UNPACKED_WHEEL MODULE [ROOT]      MODULE: the extension as it was linked, before its libraries came along
                                                                ROOT: of arm64 packages (tools/setup --aarch64), where MODULE is for aarch64
"""
import os
import pathlib
import shutil
import subprocess
import sys


ROOT = pathlib.Path(sys.argv[3] if len(sys.argv) > 3 else '/').resolve()


def linked(module):
    """Paths of the libraries that the loader finds for it."""
    command, loader = ['ldd', module], {}
    if ROOT != pathlib.Path('/'):
        command = [pathlib.Path(__file__).with_name('aarch64_run'), module]
        loader = {'DYNTAPE_SYSROOT': str(ROOT), 'DYNTAPE_QEMU': '-E LD_TRACE_LOADED_OBJECTS=1'}
    lines = subprocess.run(command, capture_output=True, text=True, check=True, env=os.environ | loader).stdout.splitlines()
    return [pathlib.Path(line.split()[2]) for line in lines if '=> /' in line]


def package_of(library):
    """Debian's package; libraries of merged folders are known by either name."""
    real = str(library.resolve())
    for path in (real, real.removeprefix('/usr'), str(library)):
        found = subprocess.run(['dpkg', '--admindir', ROOT / 'var/lib/dpkg', '-S', path], capture_output=True, text=True)
        if found.returncode == 0:
            return found.stdout.split(':')[0]
    sys.exit(f'bundled_licences: no package has {library}')


def main():
    wheel, module = pathlib.Path(sys.argv[1]), sys.argv[2]
    inside = [path.name for path in (wheel / 'dyntape.libs').iterdir()]
    folder = next(wheel.glob('dyntape-*.dist-info')) / 'licenses' / 'bundled'
    folder.mkdir(parents=True, exist_ok=True)
    lines = []
    for library in linked(module):
        # Of what is inside a hash stands before the first dot: libipopt-1a2b3c4d.so.1.10.4.
        stems = {library.name.split('.')[0], library.resolve().name.split('.')[0]}
        if not any(name.startswith(f'{stem}-') for stem in stems for name in inside):
            continue
        package = package_of(library)
        shutil.copyfile(ROOT / 'usr/share/doc' / package / 'copyright', folder / f'{package}.txt')
        lines.append(f'{library.resolve().name}: {package}')
    if len(lines) < len(inside):
        sys.exit(f'bundled_licences: {len(inside)} libraries are inside, and the packages of {len(lines)} are known')
    (folder / 'LIBRARIES.txt').write_text('\n'.join(sorted(lines)) + '\n')


main()
