#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Compiles the CUDA text of robots' functions by NVRTC, which needs no card, and reads registers and spills from its log.

    cuda_text.py BUILD/bin/dyntape ROBOTS            the functions of the test
    cuda_text.py BUILD/bin/dyntape ROBOTS --table    a table of Markdown, for docs/how_to/gpu.md

NVRTC is that of the Python package nvidia-cuda-nvrtc-cu12; where it is not installed the status is 77.  For each architecture an
error or a warning fails, and a spill in the kernels that have had none.
"""
import argparse
import ctypes
import importlib.util
import pathlib
import re
import subprocess
import sys
import tempfile

ARCHITECTURES = ('sm_80', 'sm_90')
# Robot, function, further words of the command; whether a spill is a failure.
CASES = [
    ('ur5', 'rnea', [], True),
    ('ur5', 'rnea', ['--float', '--order', '1'], True),
    ('ur5', 'aba', [], True),
    ('ur5', 'aba', ['--order', '1'], False),
    ('ur5', 'aba', ['--float', '--order', '1'], True),
    ('ur5', 'id-derivatives', [], False),
    ('ur5', 'fd-derivatives', [], False),
    ('panda', 'rnea', [], True),
    ('panda', 'aba', [], True),
    ('panda', 'aba', ['--float'], True),
    ('panda', 'fd-derivatives', [], False),
    ('panda', 'fd-derivatives', ['--float'], False),
    ('solo12', 'fd-derivatives', ['--base', 'floating'], False),
    ('simple_humanoid', 'aba', ['--base', 'floating'], False),
]
INFO = re.compile(r"Compiling entry function '(\w+)'.*?(\d+) bytes stack frame, (\d+) bytes spill stores, (\d+) bytes spill loads"
                  r".*?Used (\d+) registers", re.DOTALL)


def nvrtc():
    """The library, or None."""
    try:
        found = importlib.util.find_spec('nvidia.cuda_nvrtc')
    except ModuleNotFoundError:
        found = None
    for folder in found.submodule_search_locations if found else ():
        for path in sorted((pathlib.Path(folder) / 'lib').glob('libnvrtc.so.*')):
            return ctypes.CDLL(str(path))
    return None


def log_of(library, program):
    size = ctypes.c_size_t()
    library.nvrtcGetProgramLogSize(program, ctypes.byref(size))
    text = ctypes.create_string_buffer(size.value)
    library.nvrtcGetProgramLog(program, text)
    return text.value.decode()


def compile_text(library, text, name, architecture, options=()):
    """What NVRTC says, and the size of the cubin; SystemExit where it refuses the text."""
    words = [f'--gpu-architecture={architecture}', '--fmad=false', '--ptxas-options=-v', *options]
    program = ctypes.c_void_p()
    library.nvrtcCreateProgram(ctypes.byref(program), text.encode(), name.encode(), 0, None, None)
    array = (ctypes.c_char_p * len(words))(*(word.encode() for word in words))
    status = library.nvrtcCompileProgram(program, len(words), array)
    log = log_of(library, program)
    if status != 0:
        sys.exit(f'{name} for {architecture}: NVRTC returns {status}: {log[:2000]}')
    size = ctypes.c_size_t()
    library.nvrtcGetCUBINSize(program, ctypes.byref(size))
    library.nvrtcDestroyProgram(ctypes.byref(program))
    return log, size.value


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('dyntape')
    parser.add_argument('robots', type=pathlib.Path)
    parser.add_argument('--table', action='store_true')
    arguments = parser.parse_args()
    library = nvrtc()
    if library is None:
        print('skipped: the package nvidia-cuda-nvrtc-cu12 is not installed')
        return 77
    failures = compiled = 0
    if arguments.table:
        print('| kernel | operations | numbers | architecture | registers | spilled [bytes] | stack [bytes] |')
        print('|---|--:|---|---|--:|--:|--:|')
    for robot, function, more, is_strict in CASES:
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([arguments.dyntape, 'generate', arguments.robots / f'{robot}.urdf', '--function', function, '--dialect',
                            'cuda', '--output', folder, '--yes', *more], check=True, stdout=subprocess.DEVNULL)
            path = next(pathlib.Path(folder).glob('*.cu'))
            text = path.read_text()
        operations = dict(re.findall(r'^ \*   (\w+): (\d+)\s+operations', text, re.MULTILINE))
        for architecture in ARCHITECTURES:
            log, size = compile_text(library, text, path.name, architecture)
            found = INFO.findall(log)
            compiled += len(found)
            if not found or size == 0 or 'warning' in log:
                print(f'{path.name} for {architecture}: expected kernels without warnings, got a cubin of {size} bytes and: {log}')
                failures += 1
            for kernel, stack, stores, loads, registers in found:
                spilled = int(stores) + int(loads)
                if arguments.table:
                    number = 'float' if '--float' in more else 'double'
                    print(f'| `{kernel}` | {operations.get(kernel, "?")} | {number} | {architecture} | {registers} | {spilled} | {stack} |',
                          flush=True)
                if is_strict and spilled:
                    print(f'{kernel} for {architecture}: expected no spills, got {stores} bytes stored, {loads} loaded')
                    failures += 1
    print(f'{compiled} kernels compiled, {failures} failures')
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
