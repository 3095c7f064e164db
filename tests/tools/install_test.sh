#!/usr/bin/env bash
# Installs the build into a scratch prefix, builds the README's program against it and runs it.
#   install_test.sh SOURCE_DIR BUILD_DIR COMPILER
set -euo pipefail
source=$1 build=$2 compiler=$3
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

cmake --install "$build" --prefix "$scratch/prefix" >/dev/null
cmake -S "$source/tests/tools/consumer" -B "$scratch/build" -G Ninja -DCMAKE_PREFIX_PATH="$scratch/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" -DPROGRAM="$source/tests/examples/first.cpp" >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
cmake --build "$scratch/build" >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
"$scratch/build/consumer" "$scratch/prefix/share/dyntape/robots/panda.urdf"
"$scratch/prefix/bin/dyntape" info "$scratch/prefix/share/dyntape/robots/panda.urdf" --json >/dev/null
