#!/usr/bin/env bash
# What is recorded of a scene is what a build without the other effects records, for all sets of the cheap effects and
# pairs of the others: each effect is left out of one build in turn.
#   effect_absence.sh SOURCE_DIR BUILD_DIR COMPILER
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
build() {  # OUTPUT [DEFINE]
  # Unoptimised: it is what is recorded that counts.
  "$compiler" -std=c++20 -O0 "${@:2}" -I"$builds/include" -I/usr/include/eigen3 "$source/tests/full/effect_absence.cpp" -o "$1" \
    "$builds"/{interface/libdyntape_interface,codegen/libdyntape_codegen,dynamics/libdyntape_dynamics,autodiff/libdyntape_autodiff}.a \
    $(pkg-config --libs sleef) -lurdfdom_model -ltinyxml2 -ldl -lpthread
}
source=$1 builds=$2 compiler=$3
build "$work/all"
"$work/all" "$source/config/robots/double_pendulum.urdf" >"$work/all.txt"
echo "$(wc -l <"$work/all.txt") sets of effects"
grep -o 'DYNTAPE_WITHOUT_[A-Z_]*' "$source/dynamics/effects/effects.def" | while read -r define; do
  build "$work/without" "-D$define"
  "$work/without" "$source/config/robots/double_pendulum.urdf" >"$work/without.txt"
  # Every line of this build stands in that of all effects.
  if ! sort "$work/without.txt" | comm -23 - <(sort "$work/all.txt") | tee "$work/differ.txt" | { ! grep -q .; }; then
    echo "$define: what is recorded differs" >&2
    head "$work/differ.txt" >&2
    exit 1
  fi
  echo "$define: the same operations in $(wc -l <"$work/without.txt") sets"
done
