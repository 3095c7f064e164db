#!/usr/bin/env bash
# Embedded text cross-compiled and run: aarch64 under qemu, and a bare Cortex-M7.
#   embedded.sh DYNTAPE SOURCE_DIR
set -euo pipefail
for program in aarch64-linux-gnu-gcc qemu-aarch64 arm-none-eabi-gcc qemu-system-arm; do
  command -v $program >/dev/null || { echo "embedded.sh: $program is missing; tools/setup --full installs it" >&2; exit 1; }
done
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 "$2/tests/full/processors/embedded.py" "$1" "$2" "$work"
