#!/usr/bin/env bash
# Printed controllers, cross-compiled and run on emulated Cortex-M7 and M4F.
#   controller.sh DYNTAPE SOURCE_DIR
set -euo pipefail
for program in gcc clang arm-none-eabi-gcc qemu-system-arm; do
  command -v $program >/dev/null || { echo "controller.sh: $program is missing; tools/setup --full installs it" >&2; exit 1; }
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 "$2/tests/full/processors/controller.py" "$1" "$2" "$work"
