#!/usr/bin/env bash
# dyntape on an emulated aarch64: its machine code against its interpreter, and the bits of robots' dynamics against this machine's.
#   aarch64_bits.sh SAME_BITS SOURCE_DIR BUILD_DIR      SAME_BITS: same_bits.cpp for this machine; 77: no compiler, emulator or arm64 packages
set -euo pipefail
program=$1 source=$2 build=$3/aarch64
skip() { echo "aarch64_bits: $1"; exit 77; }
for tool in aarch64-linux-gnu-g++ qemu-aarch64 mmdebstrap; do
  command -v $tool >/dev/null || skip "$tool is missing; tools/setup --aarch64 installs it"
done
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
since() { echo "aarch64_bits: $1 in $((SECONDS - start)) s"; start=$SECONDS; }
quietly() { "$@" >"$scratch/log" 2>&1 || { tail -n 60 "$scratch/log" >&2; exit 1; }; }
start=$SECONDS
"$source/tools/setup" --aarch64 >"$scratch/log" 2>&1 || skip "the arm64 packages are out of reach: $(tail -n 1 "$scratch/log")"
since "arm64 packages"

quietly cmake --preset aarch64 -S "$source" -B "$build" -DDYNTAPE_WERROR=ON -DDYNTAPE_TESTS=ON -DCMAKE_CXX_COMPILER_LAUNCHER="$source/tools/cached"
quietly ninja -C "$build" -j 2 same_bits encoder_tests
since "cross-compiled"

# A compiler of this machine makes the libraries that the emulated program loads; it knows no processor of its own.
cat >"$scratch/cc" <<'SCRIPT'
#!/bin/bash
exec aarch64-linux-gnu-gcc "${@/#-mcpu=native/-mcpu=cortex-a76}"
SCRIPT
chmod +x "$scratch/cc"
export DYNTAPE_CACHE=$scratch/cache
emulated() { PATH=$scratch:$PATH "$source/tools/aarch64_run" "$@"; }

emulated "$build/bin/encoder_tests" --gtest_brief=1 >"$scratch/log" 2>&1 || { tail -n 40 "$scratch/log"; exit 1; }
grep -q PASSED "$scratch/log" && ! grep -q SKIPPED "$scratch/log" || { cat "$scratch/log"; exit 1; }
since "$(sed -n 's/.*PASSED. *\([0-9]*\) tests.*/\1/p' "$scratch/log") tests of machine code pass"

# Hessians are of recordings, whose order is that in which a compiler evaluates arguments; gcc's differs between the two processors.
robots=("$source"/config/robots/*.urdf)
"$program" --compiled 4 "${robots[@]}" | grep -v ' Hessians,' >"$scratch/own.txt" &
emulated "$build/bin/same_bits" --compiled 4 --hessians 7 "${robots[@]}" >"$scratch/with_hessians.txt"
wait $!
grep -v ' Hessians,' "$scratch/with_hessians.txt" >"$scratch/emulated.txt"
# Plain derivatives of constrained dynamics are products of matrices by Eigen, which adds in the order of the processor.
by_eigen=',(constrained|impulse)-[a-z-]*,(double|float),'
"$program" --all "$source/config/robots/ur5.urdf" | grep -vE "$by_eigen" >>"$scratch/own.txt"
emulated "$build/bin/same_bits" --all "$source/config/robots/ur5.urdf" | grep -vE "$by_eigen" >>"$scratch/emulated.txt"
lines=$(grep -cE ',[0-9a-f]{16}$' "$scratch/own.txt")
[ "$lines" -gt 900 ] || { echo "aarch64_bits: $lines lines"; exit 1; }
diff "$scratch/own.txt" "$scratch/emulated.txt" || { echo "aarch64_bits: other bits"; exit 1; }
since "$lines results of ${#robots[@]} robots have the same bits"
hessians() { sed -n "s/$1 Hessians,//p" "$scratch/with_hessians.txt"; }
[ "$(hessians interpreted | wc -l)" -gt 30 ] && diff <(hessians interpreted) <(hessians 'machine code') || { echo "aarch64_bits: other Hessians"; exit 1; }
