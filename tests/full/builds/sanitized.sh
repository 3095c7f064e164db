#!/usr/bin/env bash
# The tests of what has memory to lose under the address and undefined-behaviour sanitizers, or those with threads under the
# thread sanitizer.  By clang, whose sanitized code compiles in two thirds of gcc's time.
#   sanitized.sh address|threads SOURCE_DIR BUILD_DIR      77: there is no clang
set -euo pipefail
what=$1 source=$2 folder=$3/sanitized-$1
command -v clang++ >/dev/null || { echo "sanitized: no clang++"; exit 77; }
case $what in
  # Null, misaligned and wrong objects, a third of the time to compile, mostly show as crashes or to the address sanitizer.
  # fuzz_corpus.sh builds its program in the same folder.
  address)
    flags="-fsanitize=address,undefined,fuzzer-no-link -fno-sanitize=null,alignment,object-size,vptr -fno-sanitize-recover=undefined"
    targets=(autodiff_tests dynamics_tests codegen_tests) selection=(-L '^(autodiff|dynamics|codegen)$')
    ;;
  threads)
    flags=-fsanitize=thread
    # The thread sanitizer knows no threads of forked children, and needs more addresses than a test leaves.
    targets=(autodiff_tests codegen_tests) selection=(-LE full -R '[Tt]hread' -E 'Forks[.]|ForkedChild')
    ;;
esac
CC=clang CXX=clang++ cmake -S "$source" -B "$folder" -G Ninja -DCMAKE_BUILD_TYPE=None -DDYNTAPE_ARCH=native -DDYNTAPE_TESTS=ON \
  -DCMAKE_CXX_COMPILER_LAUNCHER="$source/tools/cached" -DCMAKE_UNITY_BUILD=ON -DCMAKE_UNITY_BUILD_BATCH_SIZE=16 \
  -DCMAKE_CXX_FLAGS="-O1 -g0 $flags" >"$folder.log" 2>&1 || { tail -n 40 "$folder.log"; exit 1; }
ninja -C "$folder" -j "$(nproc)" "${targets[@]}" >"$folder.log" 2>&1 || { tail -n 40 "$folder.log"; exit 1; }
# The loader takes its own lock around what dlopen and dlclose allocate, and the sanitizer cannot see it.
export TSAN_OPTIONS="suppressions=$source/tests/full/builds/thread_sanitizer.supp"
exec ctest --test-dir "$folder" --output-on-failure -j "$(nproc)" "${selection[@]}"
