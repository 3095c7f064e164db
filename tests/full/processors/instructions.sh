#!/usr/bin/env bash
# By hand: instructions of an evaluation of robots' functions, by route, counted by qemu: of N more evaluations, divided by N.
#   instructions.sh EVALUATIONS ROBOT.urdf EMULATOR...     EVALUATIONS: evaluations.cpp for the emulated processor
#   instructions.sh build/aarch64/bin/evaluations config/robots/ur5.urdf tools/aarch64_run
#   instructions.sh build/bin/evaluations config/robots/ur5.urdf qemu-x86_64 -cpu max
# For routes that compile, DYNTAPE_CC is a compiler for the emulated processor.
set -euo pipefail
program=$1 robot=$2
shift 2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
gcc -O1 -shared -fPIC "$(dirname "$0")/instructions.c" -o "$scratch/count.so"
export DYNTAPE_CACHE=$scratch/cache
# qemu reads its options from the environment too.
counted() { QEMU_PLUGIN=file=$scratch/count.so DYNTAPE_PROCESSOR= "$@" 2>&1 | sed -n 's/^instructions //p'; }
few=640 many=6400
for function in rnea aba crba id-derivatives fd-derivatives; do
  for route in double packs interpreter machine-code machine-code+lanes compiled compiled+lanes; do
    "$@" "$program" "$robot" $function $route 64 >"$scratch/log" 2>&1 || { echo "$function $route: $(tail -n 1 "$scratch/log")"; continue; }
    less=$(counted "$@" "$program" "$robot" $function $route $few)
    more=$(counted "$@" "$program" "$robot" $function $route $many)
    echo "$function $route $(((more - less) / (many - few)))"
  done
done
