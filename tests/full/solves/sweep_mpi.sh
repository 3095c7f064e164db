#!/usr/bin/env bash
# A sweep by 1, 2 and 7 processes of mpirun has the bytes of one without; one whose ranks are killed is resumed to the same.
#   sweep_mpi.sh DYNTAPE SOURCE_DIR
set -euo pipefail
dyntape=$1 source=$2
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
command -v mpirun >/dev/null && [ -x "$(dirname "$dyntape")/dyntape-mpi" ] || { echo "no MPI here"; exit 77; }
mpirun=(mpirun --allow-run-as-root --oversubscribe)

sed "s#^scene .*#scene \"$source/config/scenes/quadruped_explicit.info\"#; s/samples 1024/samples 300/" "$source/tests/bench/quadruped_sweep.info" >"$scratch/sweep.info"
"$dyntape" sweep "$scratch/sweep.info" --output "$scratch/alone" >/dev/null 2>"$scratch/log"
for ranks in 1 2 7; do
  "${mpirun[@]}" -n $ranks "$dyntape" sweep "$scratch/sweep.info" --output "$scratch/$ranks" >"$scratch/out" 2>"$scratch/log"
  cmp "$scratch/alone/sweep.csv" "$scratch/$ranks/sweep.csv"
  [ "$(grep -c 'computed in' "$scratch/out")" = 1 ] || { echo "more than rank 0 prints"; cat "$scratch/out"; exit 1; }
  echo "$ranks ranks: the same bytes"
done

computed() { (find "$1/chunks" -type f 2>/dev/null || true) | wc -l; }  # before there is a folder: 0

# Rank 0, then another one.
for victim in 1 3; do
  folder=$scratch/killed$victim kills=0
  while [ ! -f "$folder/report.json" ]; do
    "${mpirun[@]}" -n 4 "$dyntape" sweep "$scratch/sweep.info" --output "$folder" >/dev/null 2>"$scratch/log" &
    job=$!
    # Something has been computed since, however fast the machine is.
    before=$(computed "$folder")
    while kill -0 $job 2>/dev/null && [ "$(computed "$folder")" -le "$before" ]; do sleep 0.01; done
    rank=$(pgrep -P $job | sed -n ${victim}p) || rank=  # none, where all have ended
    if [ -n "$rank" ] && [ $kills -lt 3 ]; then
      if kill -KILL "$rank" 2>/dev/null; then
        kills=$((kills + 1))
        if wait $job; then
          echo "a killed rank was no failure"
          exit 1
        fi
      else
        wait $job  # it had come to its end
      fi
    else
      wait $job || { cat "$scratch/log"; exit 1; }
    fi
  done
  [ $kills -gt 0 ] || { echo "nothing was killed"; exit 1; }
  cmp "$scratch/alone/sweep.csv" "$folder/sweep.csv"
  echo "killed $kills times: the same bytes"
done

# What is wrong is said once.
if "${mpirun[@]}" -n 3 "$dyntape" sweep "$scratch/none.info" --output "$scratch/none" >/dev/null 2>"$scratch/log"; then
  echo "a file that is not there was no failure"
  exit 1
fi
[ "$(grep -c 'none.info: cannot open' "$scratch/log")" = 1 ] || { cat "$scratch/log"; exit 1; }
