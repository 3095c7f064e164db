#!/usr/bin/env bash
# Installs the build into a scratch prefix, builds the README's program and programs of several parts against it and runs
# them; what cannot be mixed must be refused.
#   install_test.sh SOURCE_DIR BUILD_DIR COMPILER
set -euo pipefail
source=$1 build=$2 compiler=$3
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
robots=$scratch/prefix/share/dyntape/robots

cmake --install "$build" --prefix "$scratch/prefix" >/dev/null
cmake -S "$source/tests/tools/consumer" -B "$scratch/build" -G Ninja -DCMAKE_PREFIX_PATH="$scratch/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" -DPROGRAM="$source/examples/cpp/first.cpp" >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
cmake --build "$scratch/build" >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
"$scratch/build/consumer" "$robots/panda.urdf"
"$scratch/prefix/bin/dyntape" info "$robots/panda.urdf" --json >/dev/null

# All that examples include is installed; two of them are built below.
grep -ho '#include <dyntape/[^>]*' "$scratch"/prefix/share/dyntape/examples/cpp/*.cpp | sed 's/.*<//' | sort -u | while read -r header; do
  [ -f "$scratch/prefix/include/$header" ] || { echo "an example includes $header, which is not installed"; exit 1; }
done

# The examples as they are installed, from a folder that is not the repository.
cd "$scratch"
cmake -S "$scratch/prefix/share/dyntape/examples/cpp" -B "$scratch/examples" -G Ninja -DCMAKE_PREFIX_PATH="$scratch/prefix" \
  -DCMAKE_CXX_COMPILER="$compiler" >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
cmake --build "$scratch/examples" --target first custom_cost >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
"$scratch/examples/first" "$robots/panda.urdf"
"$scratch/examples/custom_cost" "$robots/ur5.urdf" >/dev/null 2>"$scratch/said"
[ ! -s "$scratch/said" ] || { cat "$scratch/said"; echo "an example that is as it should be has something to say"; exit 1; }

# The template of a project, copied; and its other way, dyntape's sources built along, as far as CMake goes.
cp -r "$scratch/prefix/share/dyntape/examples/template" "$scratch/my_robot"
cmake -S "$scratch/my_robot" -B "$scratch/my_robot/build" -G Ninja -DCMAKE_PREFIX_PATH="$scratch/prefix" -DCMAKE_CXX_COMPILER="$compiler" \
  >"$scratch/log" 2>&1 && cmake --build "$scratch/my_robot/build" >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }
"$scratch/my_robot/build/my_robot" "$robots/ur5.urdf"
cmake -S "$scratch/my_robot" -B "$scratch/my_robot/along" -G Ninja -DDYNTAPE_SOURCE="$source" -DCMAKE_CXX_COMPILER="$compiler" \
  >"$scratch/log" 2>&1 && ninja -C "$scratch/my_robot/along" -t query my_robot >"$scratch/log" 2>&1 || { cat "$scratch/log"; exit 1; }

for program in "$scratch"/build/mixed/mixed_*[0-9] "$scratch/build/mixed/mixed_packs"; do
  "$program" "$robots/ur5.urdf" || { echo "$(basename "$program") fails"; exit 1; }
done
refused() { # target, the sentence
  if cmake --build "$scratch/build" --target "$1" >"$scratch/log" 2>&1; then echo "$1 was linked"; exit 1; fi
  grep -q "$2" "$scratch/log" || { cat "$scratch/log"; exit 1; }
}
refused refused_flags 'link dyntape::dyntape_native'
# Only where dyntape was built for a processor with wider registers than a plain build's.
if grep -q -- -U__AVX__ "$scratch"/prefix/lib*/cmake/dyntape/dyntapeTargets.cmake "$scratch"/prefix/lib*/*/cmake/dyntape/dyntapeTargets.cmake 2>/dev/null; then
  refused refused_packs 'vectors_of_16_bytes_unless_linked_to_dyntape_native'
fi
refused refused_allocator 'dyntape_is_compiled_with_Eigen_on_malloc_but_this_unit'
