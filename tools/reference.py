#!/usr/bin/env python3
"""Writes docs/reference/: what every command prints as its help, the keys of task, scene and sweep files, the environment.

    tools/reference.py build/bin/dyntape              writes the pages
    tools/reference.py build/bin/dyntape --check      exit status 1, with the difference, where a page is not current

The pages come from the program and from the sources alone; only what each variable of the environment means stands here.
"""
import argparse
import difflib
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = ROOT / 'docs' / 'reference'
WIDTH = '80'
SOURCES = ('autodiff', 'codegen', 'dynamics', 'interface', 'tools', 'tests/bench')
SCRIPTS = ('tools', 'tests/tools', 'tests/bench', 'tests/full')

ENVIRONMENT = {
    'ROS_PACKAGE_PATH': 'Folders in which meshes of `package://NAME/...` are looked for, after those above the robot\'s file.',
    'COLUMNS': 'Columns that `--help` fills, 60 to 160; anything else counts as 80.',
    'DYNTAPE_BUILD': 'Where `tools/build`, `tools/demo`, `tools/test` and `tools/check` build, in place of `build/`.',
    'DYNTAPE_CACHE': 'The folder of compiled libraries, in place of `$XDG_CACHE_HOME/dyntape`.',
    'DYNTAPE_CACHE_LIMIT': 'Most bytes that the cache may hold, as in 500M or 2G (default: 2G).',
    'DYNTAPE_CC': 'The C compiler, a name or a path, in place of the first of `cc`, `gcc` and `clang`.',
    'DYNTAPE_DUMP': 'A folder into which each stage of the pipeline writes what it made: graphs, schedules, C, the '
                    "compiler's command, machine code with its disassembly.",
    'DYNTAPE_MACHINE_CODE': '`off`: no machine code is made in the process; functions are interpreted until they are compiled.  Bits stay the same.',
    'DYNTAPE_OPENCL': 'The loader of OpenCL, a name or a path, in place of `libOpenCL.so.1`.',
    'DYNTAPE_PERF_MAP': 'Anything: `/tmp/perf-PID.map` names the machine code made in the process, for `perf report`.',
    'DYNTAPE_PROCESSOR': '`x86-64-v2`, `x86-64-v3` or `x86-64-v4`: the code that runs, in place of the highest that the processor has '
                         '(`dyntape doctor` says which).  Bits stay the same.',
    'DYNTAPE_SYSROOT': 'The folder of arm64 libraries that `tools/aarch64_run` runs programs with, in place of `build/aarch64/sysroot`.',
    'DYNTAPE_THREADS': 'Threads that evaluate and compile, 1 to 1024, in place of what the hardware has.',
    'HOME': 'The cache is in `$HOME/.cache/dyntape` where neither DYNTAPE_CACHE nor XDG_CACHE_HOME is set.  The '
            'compiler gets it.',
    'OMPI_COMM_WORLD_SIZE': 'Set by `mpirun` of OpenMPI: above 1, `dyntape sweep` becomes `dyntape-mpi`.',
    'PMI_SIZE': 'Likewise of MPICH.',
    'PATH': 'Where compilers are looked for.  The compiler gets it.',
    'PINOCCHIO_PREFIX': 'Where `dyntape bench --peer` finds Pinocchio.',
    'TERM': '`dumb`: progress is not drawn.',
    'TMPDIR': 'The folder for temporary files, in place of `/tmp`, if it belongs to the user or is sticky.',
    'XDG_CACHE_HOME': 'An absolute path: the cache is in `$XDG_CACHE_HOME/dyntape`.',
}


def output_of(*words):
    run = subprocess.run(words, capture_output=True, text=True, check=True, env={**os.environ, 'COLUMNS': WIDTH})
    return run.stdout


def commands_of(text):
    """Names below 'Subcommands:' in a help."""
    lines = text.split('\nSubcommands:\n')[1:]
    return re.findall(r'^  (\S+)', lines[0], re.MULTILINE) if lines else []


def helps(dyntape, words=()):
    """(words, help) of a command and of those below it."""
    text = output_of(dyntape, *words, '--help')
    yield words, text
    for name in commands_of(text):
        yield from helps(dyntape, (*words, name))


def generated(title, text):
    return f'# {title}\n\nMade by `tools/reference.py`.\n\n{text}'


def commands(dyntape):
    parts = [f"## {' '.join(('dyntape', *words))}\n\n```text\n{text.strip()}\n```\n" for words, text in helps(dyntape)]
    return generated('Commands', '\n'.join(parts))


def keys(title, option):
    def page(dyntape):
        text = output_of(dyntape, 'check-config', option)
        return generated(title, f'What `dyntape check-config {option}` prints.\n\n```text\n{text.strip()}\n```\n')
    return page


def sources():
    for folder in SOURCES:
        for path in sorted((ROOT / folder).rglob('*')):
            if path.suffix in ('.cpp', '.h', '.hxx'):
                yield path


def scripts():
    for folder in SCRIPTS:
        for path in sorted((ROOT / folder).iterdir()):
            if path.is_file() and path.suffix in ('', '.sh') and path.read_bytes().startswith(b'#!'):
                yield path


def read_names():
    """Variables of the environment: of the code, and DYNTAPE_ ones of the scripts."""
    names = set()
    for path in sources():
        names.update(re.findall(r'\b(?:getenv|environment_variable)\("([A-Z_]+)"\)', path.read_text()))
    for path in scripts():
        names.update(re.findall(r'\$\{(DYNTAPE_[A-Z_]+)[:}]', path.read_text(errors='replace')))
    return names


def environment(_):
    names = read_names()
    for name in sorted(names ^ set(ENVIRONMENT)):
        where = 'is read but not described in' if name in names else 'is read nowhere, but described in'
        raise SystemExit(f'reference.py: {name} {where} tools/reference.py')
    rows = [f'| `{name}` | {ENVIRONMENT[name]} |\n' for name in sorted(names)]
    return generated('Environment', 'Every variable that the code and its scripts read.\n\n| | |\n|---|---|\n' + ''.join(rows))


def check(path, text):
    old = path.read_text() if path.exists() else ''
    if old == text:
        return True
    name = str(path.relative_to(ROOT))
    sys.stdout.writelines(difflib.unified_diff(old.splitlines(True), text.splitlines(True), name, name + ' as it should be'))
    return False


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('dyntape', help='the built command')
    parser.add_argument('--check', action='store_true', help='compare, write nothing')
    options = parser.parse_args()
    dyntape = os.path.abspath(options.dyntape)
    pages = {'commands.md': commands, 'task_keys.md': keys('Keys of task files', '--keys'),
             'centroidal_keys.md': keys('Keys of files about a robot as one mass', '--centroidal-keys'),
             'scene_keys.md': keys('Keys of scene files', '--scene-keys'),
             'sweep_keys.md': keys('Keys of sweep files', '--sweep-keys'), 'environment.md': environment}
    texts = {PAGES / name: make(dyntape) for name, make in pages.items()}
    if options.check:
        if not all([check(path, text) for path, text in texts.items()]):
            sys.exit('docs/reference/ is not current; tools/reference.py build/bin/dyntape writes it')
        return
    PAGES.mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        path.write_text(text)


if __name__ == '__main__':
    main()
