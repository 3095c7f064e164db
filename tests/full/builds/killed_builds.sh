#!/usr/bin/env bash
# Builds that are killed at any moment, over one cache, and what comes after: the same result, and no bad library.
#   killed_builds.sh DYNTAPE SOURCE_DIR [KILLS]
set -euo pipefail
dyntape=$1 source=$2 kills=${3:-60}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export DYNTAPE_CACHE=$scratch/cache
RANDOM=1
robot=$source/config/robots/ur5.urdf
python3 - "$scratch/states.csv" <<'PY'
import sys
names = [f'{x}{i}' for x in ('q', 'v', 'tau') for i in range(6)]
rows = [','.join(str((k * 7 + i * 3) % 11 / 10 - 0.5) for i in range(18)) for k in range(5)]
open(sys.argv[1], 'w').write('\n'.join([','.join(names)] + rows) + '\n')
PY
build() { "$dyntape" eval "$robot" --function "$1" --route generated --input "$scratch/states.csv" --output "$2"; }

functions=(aba fd-derivatives)
for f in "${functions[@]}"; do build $f "$scratch/$f.csv" >/dev/null 2>&1; done
rm -rf "$DYNTAPE_CACHE"

killed=0 finished=0
for ((k = 0; k < kills; ++k)); do
  f=${functions[k % 2]}
  setsid bash -c "exec \"$dyntape\" eval \"$robot\" --function $f --route generated --input \"$scratch/states.csv\" --output \"$scratch/out.csv\"" >/dev/null 2>&1 &
  job=$!
  sleep "0.$(printf %03d $((RANDOM % 250)))"
  # All of it, the compiler too, as a machine that loses its power does.
  if kill -KILL -- -$job 2>/dev/null; then killed=$((killed + 1)); else finished=$((finished + 1)); fi
  wait $job 2>/dev/null || true
  # What a build left is found sound, or is not found.
  "$dyntape" cache verify >"$scratch/verify" 2>&1 || { echo "after kill $k:"; cat "$scratch/verify"; exit 1; }
  # A library that is there is removed, that the next one builds as well.
  [ $((k % 3)) = 2 ] && "$dyntape" cache clear >/dev/null 2>&1 || true
done
for f in "${functions[@]}"; do
  build $f "$scratch/after.csv" >/dev/null 2>&1
  cmp "$scratch/$f.csv" "$scratch/after.csv"
done
"$dyntape" cache verify >/dev/null
echo "$killed builds killed, $finished were faster: every library sound, the same results"
[ $killed -gt $((kills / 4)) ] || { echo "too few were killed"; exit 1; }
