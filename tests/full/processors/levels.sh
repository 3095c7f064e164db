#!/usr/bin/env bash
# The same bits for every level of the processor, and under an emulator of a processor without AVX; what is no level, and a
# processor below the lowest, end in one sentence.
#   levels.sh PROGRAM ROBOTS_FOLDER LIBRARY_HAS_LEVELS
set -euo pipefail
program=$1 robots=$2 has_levels=$3
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
fails() { echo "levels: $*"; exit 1; }
refused() { # the sentence, then the command
  local sentence=$1 status=0
  shift
  "$@" >"$scratch/out" 2>"$scratch/said" || status=$?
  [ $status = 2 ] && [ ! -s "$scratch/out" ] || fails "$* ends with $status"
  [ "$(grep -c "$sentence" "$scratch/said")" = 1 ] || fails "$(cat "$scratch/said")"
}

"$program" "$robots"/*.urdf >"$scratch/own"
[ "$(wc -l <"$scratch/own")" -gt 500 ] || fails "$(wc -l <"$scratch/own") lines"
[ "$has_levels" = 1 ] || { echo "levels: built for one processor"; exit 77; }

own=$("$program" 2>&1 | sed 's/.*x86-64-v//')
for level in 2 3 4; do
  if [ $level -gt "$own" ]; then
    refused "and this processor is x86-64-v$own" env DYNTAPE_PROCESSOR=x86-64-v$level "$program"
    continue
  fi
  DYNTAPE_PROCESSOR=x86-64-v$level "$program" "$robots"/*.urdf >"$scratch/$level"
  diff "$scratch/own" "$scratch/$level" >"$scratch/diff" || fails "x86-64-v$level has other bits: $(head -n 5 "$scratch/diff")"
done
refused 'expected x86-64-v2, x86-64-v3 or x86-64-v4' env DYNTAPE_PROCESSOR=v3 "$program"

emulator=$(command -v qemu-x86_64 || true)
[ -n "$emulator" ] || { echo "levels: no qemu-x86_64 (qemu-user)"; exit 77; }
# The C library's sines are another code where the processor fuses; what is emulated has none of that.
GLIBC_TUNABLES=glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2 "$program" --small "$robots"/{ur5,solo12}.urdf >"$scratch/own"
"$emulator" -cpu Nehalem "$program" --small "$robots"/{ur5,solo12}.urdf >"$scratch/emulated" 2>"$scratch/said"
grep -q '^levels: x86-64-v2$' "$scratch/said" || fails "$(cat "$scratch/said")"
diff "$scratch/own" "$scratch/emulated" >"$scratch/diff" || fails "Nehalem has other bits: $(head -n 5 "$scratch/diff")"
refused 'this processor is below x86-64-v2' "$emulator" -cpu core2duo "$program"
echo "levels: $(wc -l <"$scratch/own") lines"
