#!/usr/bin/env bash
# The chain in a folder whose path has spaces: a build of the part that embeds texts, generate, eval, solve with pictures.
#   spaces.sh SOURCE_DIR COMPILER COMMAND
set -euo pipefail
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
root="$scratch/a folder/of the user"
mkdir -p "$root"
git -C "$1" ls-files -z | (cd "$1" && xargs -0 cp --parents -t "$root")
export XDG_CACHE_HOME="$scratch/a cache" TMPDIR="$scratch/a place for drafts"
mkdir -p "$XDG_CACHE_HOME" "$TMPDIR"

# Without optimisation: it is the paths that are tested.
cmake -S "$root" -B "$root/build" -G Ninja -DCMAKE_BUILD_TYPE=None -DCMAKE_CXX_FLAGS=-O0 -DCMAKE_CXX_COMPILER="$2" \
  -DDYNTAPE_TESTS=OFF >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
"$root/tools/build" dyntape_codegen
cp "$3" "$root/a dyntape"
dyntape="$root/a dyntape" arm=$root/config/robots/double_pendulum.urdf
"$dyntape" info "$arm" >/dev/null
"$dyntape" generate "$arm" --function rnea --order 1 --output "$root/generated C"
printf 'q0,q1,v0,v1,a0,a1\n.1,.2,.3,.4,.5,.6\n' >"$root/the states.csv"
"$dyntape" eval "$arm" --function rnea --route generated --input "$root/the states.csv" --output "$root/the results.csv"
[ "$(wc -l <"$root/the results.csv")" = 2 ]
"$dyntape" solve "$root/config/tasks/block_move.info" --output "$root/the motion"
[ -s "$root/the motion/motion.svg" ]
"$dyntape" cache list >/dev/null
