#!/usr/bin/env bash
# Makes one library of what was compiled for several levels of a processor, chosen when the program is loaded.
#   levels.sh FOLDER COMPILER LEVEL...        lowest level first; FOLDER/LEVEL.txt lists its objects
# Writes FOLDER/LEVEL.o and FOLDER/choose.o.
#
# A function of dyntape that all levels have becomes NAME.LEVEL, and NAME jumps to the chosen one's (autodiff/
# processor_level.cpp chooses).  All else of a level stays its own: the linker could otherwise take a template of the standard library that was
# compiled for a later processor, or with a user's flags, for everybody's.  Functions of packs are named by the width of their
# registers and stay what they are.
set -euo pipefail
folder=$1 compiler=$2
shift 2
levels=("$@")
cd "$folder"
rm -f ./*.o ./*.names
linker=$("$compiler" -print-prog-name=ld.bfd)
for level in "${levels[@]}"; do
  "$linker" -r --force-group-allocation -o "$level.o" @"$level.txt"
  if [ "$level" != "${levels[0]}" ] && objdump -h "$level.o" | grep -q '\.init_array'; then
    echo "levels.sh: code for $level runs before main on any processor: a variable of its units is initialised at run time" >&2
    exit 1
  fi
  nm --defined-only --format=posix "$level.o" | awk '$2 ~ /^[TW]$/ && $1 ~ /^_ZNK?7dyntape/ {print $1}' | LC_ALL=C sort >"$level.all"
done
grep -v vectors_of_ "${levels[0]}.all" >common.names
for level in "${levels[@]:1}"; do
  LC_ALL=C comm -12 common.names "$level.all" >next.names
  mv next.names common.names
done
[ -s common.names ] || { echo "levels.sh: the levels have no function in common" >&2; exit 1; }
for level in "${levels[@]}"; do
  { cat common.names; grep -E 'vectors_of_.*4PackI' "$level.all" || true; } >kept.names
  awk -v level="$level" '{print $1, $1 "." level}' common.names >renamed.names
  objcopy --keep-global-symbols=kept.names "$level.o"
  objcopy --redefine-syms=renamed.names "$level.o"
done
{
  echo '.text'
  awk '{printf ".globl %s\n.type %s, @function\n%s: jmp *.Lchosen+%d(%%rip)\n.size %s, .-%s\n", $1, $1, $1, 8 * (NR - 1), $1, $1}' common.names
  echo '.data'
  echo '.balign 8'
  echo '.Lchosen:'
  awk -v level="${levels[0]}" '{print ".quad " $1 "." level}' common.names
  echo '.section .data.rel.ro,"aw",@progbits'
  echo '.balign 8'
  for level in "${levels[@]}"; do
    echo ".Lof_$level:"
    awk -v level="$level" '{print ".quad " $1 "." level}' common.names
  done
  echo '.Llevels:'
  for level in "${levels[@]}"; do echo ".quad .Lof_$level"; done
  # Before what is initialised in C++.
  cat <<END
.section .init_array.00101,"aw",@init_array
.balign 8
.quad .Lchoose
.text
.type .Lchoose, @function
.Lchoose:
lea .Lchosen(%rip), %rdi
lea .Llevels(%rip), %rsi
mov \$$(wc -l <common.names), %edx
jmp dyntape_choose_functions@PLT
.section .note.GNU-stack,"",@progbits
END
} >choose.s
"$compiler" -c -o choose.o choose.s
