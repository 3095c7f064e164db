#!/usr/bin/env python3
"""Vectors of the algorithms stay in registers.

    vectors_in_registers.py BUILD_DIR

gcc 12 keeps a vector that is wider than a register in memory, and stores and reads it between any two operations: of vectors of 64
bytes with AVX2 crba had 87 moves to and from the stack for 106 operations.  Now it has 2 for 53.
"""
import pathlib
import re
import subprocess
import sys

BUILD = pathlib.Path(sys.argv[1])
LONG, MOST = 40, 0.3  # operations on vectors of a function that is looked at; moves to or from the stack for each of them
OPERATION = re.compile(r'^v?(add|sub|mul|div|sqrt|fn?m\w+)p[ds]\s')
STACK = re.compile(r'^v?mov\S*\s.*\(%r[bs]p[,)]')


def functions(path):
    """Names, with the operations on vectors of more than 16 bytes and the moves of such to or from the stack."""
    text = subprocess.run(['objdump', '-d', '-C', '--no-show-raw-insn', path], stdout=subprocess.PIPE, text=True, check=True).stdout
    name, operations, moves = '', 0, 0
    for line in text.splitlines() + ['0 <>:']:
        if start := re.match(r'^[0-9a-f]+ <(.*)>:$', line):
            if operations:
                yield name, operations, moves
            name, operations, moves = start[1], 0, 0
        elif re.search('%[yz]mm', line):
            instruction = line.split('\t')[-1]
            operations += bool(OPERATION.match(instruction))
            moves += bool(STACK.match(instruction))


objects = [path for path in BUILD.glob('dynamics/**/instantiate/*_double.cpp.o') if 'dyntape_dynamics' in str(path)]
found = [(moves / operations, operations, name) for path in objects for name, operations, moves in functions(path)
         if operations >= LONG]
if not objects:
    sys.exit('vectors_in_registers: no object of the algorithms')
if not found:
    print('vectors_in_registers: this processor has no registers of more than 16 bytes')
    sys.exit(77)
worst = max(found)
print(f'vectors_in_registers: {len(found)} functions of {len(objects)} objects, at worst {worst[0]:.2f} moves for each of {worst[1]} operations: {worst[2][:90]}')
sys.exit(worst[0] > MOST)
