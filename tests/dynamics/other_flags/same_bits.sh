#!/usr/bin/env bash
# Two programs print the same.
#   same_bits.sh PROGRAM OTHER_PROGRAM ARGUMENT...
set -euo pipefail
one=$1 other=$2
shift 2
a=$("$one" "$@") b=$("$other" "$@")
[ -n "$a" ] && [ "$a" = "$b" ] || { echo "$one prints $a, $other prints $b"; exit 1; }
