#!/usr/bin/env bash
# dyntape on an emulated aarch64: its machine code against its interpreter, and the bits of robots' dynamics against this machine's.
#   aarch64_bits.sh SAME_BITS SOURCE_DIR BUILD_DIR      SAME_BITS: same_bits.cpp for this machine; 77: no compiler, emulator or arm64 packages
. "$(dirname "$0")/aarch64_common.sh"
program=$1 source=$2
cross_build "$source" "$3" same_bits encoder_tests

emulated "$cross/bin/encoder_tests" --gtest_brief=1 >"$scratch/log" 2>&1 || { tail -n 40 "$scratch/log"; exit 1; }
grep -q PASSED "$scratch/log" && ! grep -q SKIPPED "$scratch/log" || { cat "$scratch/log"; exit 1; }
since "$(tests_of PASSED "$scratch/log") tests of machine code pass"

# Hessians are of recordings, whose order is that in which a compiler evaluates arguments; gcc's differs between the two processors.
robots=("$source"/config/robots/*.urdf)
"$program" --compiled 4 "${robots[@]}" | grep -v ' Hessians,' >"$scratch/own.txt" &
emulated "$cross/bin/same_bits" --compiled 4 --hessians 7 "${robots[@]}" >"$scratch/with_hessians.txt"
wait $!
grep -v ' Hessians,' "$scratch/with_hessians.txt" >"$scratch/emulated.txt"
# Plain derivatives of constrained dynamics are products of matrices by Eigen, which adds in the order of the processor.
by_eigen=',(constrained|impulse)-[a-z-]*,(double|float),'
"$program" --all "$source/config/robots/ur5.urdf" | grep -vE "$by_eigen" >>"$scratch/own.txt"
emulated "$cross/bin/same_bits" --all "$source/config/robots/ur5.urdf" | grep -vE "$by_eigen" >>"$scratch/emulated.txt"
lines=$(grep -cE ',[0-9a-f]{16}$' "$scratch/own.txt")
[ "$lines" -gt 900 ] || { echo "$name: $lines lines"; exit 1; }
diff "$scratch/own.txt" "$scratch/emulated.txt" || { echo "$name: other bits"; exit 1; }
since "$lines results of ${#robots[@]} robots have the same bits"
hessians() { sed -n "s/$1 Hessians,//p" "$scratch/with_hessians.txt"; }
[ "$(hessians interpreted | wc -l)" -gt 30 ] && diff <(hessians interpreted) <(hessians 'machine code') || { echo "$name: other Hessians"; exit 1; }
