#!/usr/bin/env bash
# By hand: instructions of an evaluation of robots' functions, by route, counted by qemu: of N more evaluations, divided by N.
#   instructions.sh QEMU EVALUATIONS ROBOT.urdf [OPTION_OF_QEMU ...]
#   tests/full/instructions.sh qemu-aarch64 build/aarch64/bin/evaluations config/robots/ur5.urdf -L build/aarch64/sysroot
#   tests/full/instructions.sh qemu-x86_64 build/bin/evaluations config/robots/ur5.urdf -cpu max
# For routes that compile, DYNTAPE_CC is a compiler for the emulated processor.
set -euo pipefail
emulator=$1 program=$2 robot=$3
shift 3
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
gcc -O1 -shared -fPIC "$(dirname "$0")/instructions.c" -o "$scratch/count.so"
export DYNTAPE_CACHE=$scratch/cache
counted() { "$emulator" -plugin "$scratch/count.so" "$@" 2>&1 | sed -n 's/^instructions //p'; }
few=640 many=6400
for function in rnea aba crba id-derivatives fd-derivatives; do
  for route in double packs interpreter machine-code machine-code+lanes compiled compiled+lanes; do
    "$emulator" "$@" "$program" "$robot" $function $route 64 >"$scratch/log" 2>&1 || { echo "$function $route: $(tail -n 1 "$scratch/log")"; continue; }
    less=$(counted "$@" "$program" "$robot" $function $route $few)
    more=$(counted "$@" "$program" "$robot" $function $route $many)
    echo "$function $route $(((more - less) / (many - few)))"
  done
done
