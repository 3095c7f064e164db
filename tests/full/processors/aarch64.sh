#!/usr/bin/env bash
# The algorithms in the registers of an aarch64 (two doubles), compiled here and emulated: the bits of this machine.
#   aarch64.sh PROGRAM SOURCE_DIR BUILD_DIR      PROGRAM: aarch64.cpp for this machine; 77: no cross compiler or emulator
. "$(dirname "$0")/aarch64_common.sh"
program=$1 source=$2 build=$3
needs aarch64-linux-gnu-g++ qemu-aarch64
units=$scratch/units.cpp
{
  for part in inverse_dynamics forward_dynamics derivatives kinematics; do echo "#include <dyntape/dynamics/algorithms/detail/$part.hxx>"; done
  for part in INVERSE_DYNAMICS FORWARD_DYNAMICS DERIVATIVES KINEMATICS; do echo "DYNTAPE_INSTANTIATE_$part(double)"; done
} >"$units"
sources=("$units" "$source/tests/full/processors/aarch64.cpp" "$source"/dynamics/model/{model,checks,tree_shape}.cpp
  "$source"/autodiff/{eigen_layout,own_sines,own_sines_in_lanes}.cpp)
for unit in "${sources[@]}"; do
  aarch64-linux-gnu-g++ -std=c++20 -O2 -Wno-psabi -ffp-contract=off -fno-tree-slp-vectorize -I"$build/include" -isystem /usr/include/eigen3 \
    -c "$unit" -o "$scratch/$(basename "$unit").o" &
  # Two at a time.
  [ "$(jobs -rp | wc -l)" -lt 2 ] || wait -n
done
wait
aarch64-linux-gnu-g++ "$scratch"/*.o -static -o "$scratch/emulated"
"$program" >"$scratch/own.txt"
qemu-aarch64 "$scratch/emulated" >"$scratch/emulated.txt"
[ "$(wc -l <"$scratch/own.txt")" = 24 ]
diff "$scratch/own.txt" "$scratch/emulated.txt" || { echo "$name: other bits"; exit 1; }
since "$(wc -l <"$scratch/own.txt") trees have the same bits"
