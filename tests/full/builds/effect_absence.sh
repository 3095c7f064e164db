#!/usr/bin/env bash
# What is recorded of a scene is what a build without the other effects records, for all sets of the effects at joints and
# pairs of the others: each effect is left out of one build in turn.
#   effect_absence.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --build "$2" --target effect_absences >"$work/log" 2>&1 || { tail -n 40 "$work/log" >&2; exit 1; }
robot=$1/config/robots/double_pendulum.urdf
"$2/bin/effect_absence" "$robot" | sort >"$work/all.txt"
echo "$(wc -l <"$work/all.txt") sets of effects"
for program in "$2"/bin/effect_absence_without_*; do
  "$program" "$robot" | sort >"$work/without.txt"
  # Every line of this build stands in that of all effects, and it has no other.
  comm -23 "$work/without.txt" "$work/all.txt" >"$work/differ.txt"
  if [ -s "$work/differ.txt" ] || [ ! -s "$work/without.txt" ]; then
    echo "$(basename "$program"): what is recorded differs from a build with all effects" >&2
    head "$work/differ.txt" >&2
    exit 1
  fi
  echo "$(basename "$program"): the same operations in $(wc -l <"$work/without.txt") sets"
done
