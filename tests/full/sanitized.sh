#!/usr/bin/env bash
# The tests again with the address and undefined-behaviour sanitizers, and those with threads under the thread
# sanitizer.
#   sanitized.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source=$1 build=$2
run() { # name, flags, targets, ctest selection
  local folder=$build/$1
  cmake -S "$source" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=None -DDYNTAPE_ARCH=native -DDYNTAPE_TESTS=ON -DCMAKE_CXX_COMPILER_LAUNCHER="$source/tools/cached" \
    -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=16 \
    -DCMAKE_CXX_FLAGS="-O1 $2" >"$folder.log" 2>&1 || { tail -n 40 "$folder.log"; exit 1; }
  ninja -C "$folder" -j "$(nproc)" $3 >"$folder.log" 2>&1 || { tail -n 40 "$folder.log"; exit 1; }
  ctest --test-dir "$folder" --output-on-failure -j "$(nproc)" $4
}
# Null, misaligned and wrong objects, a third of the time to compile, mostly show as crashes or to the address sanitizer.
run sanitized-address "-fsanitize=address,undefined -fno-sanitize=null,alignment,object-size,vptr -fno-sanitize-recover=undefined" \
  "autodiff_tests dynamics_tests codegen_tests" "-L ^(autodiff|dynamics|codegen)$"
# The loader takes its own lock around what dlopen and dlclose allocate, and the sanitizer cannot see it.
export TSAN_OPTIONS="suppressions=$source/tests/full/thread_sanitizer.supp"
run sanitized-thread "-fsanitize=thread" "autodiff_tests codegen_tests" "-R [Tt]hread"
