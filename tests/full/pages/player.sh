#!/usr/bin/env bash
# Pages that play motions, of `solve` and of made-up ones, played by chromium (player.py).
#   player.sh DYNTAPE PLAYER_PAGES SOURCE_DIR
set -euo pipefail
dyntape=$1 player_pages=$2 source=$3
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

"$player_pages" "$source/config/robots" "$scratch"
"$dyntape" solve "$source/config/tasks/arm_reaching.info" --output "$scratch/arm" >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
mv "$scratch/arm/motion.html" "$scratch/arm.html"
"$source/tests/full/pages/player.py" "$scratch"/*.html
