#!/usr/bin/env bash
# A suite of tests, cross-compiled and run on an emulated aarch64 by two processes.
#   aarch64_suite.sh SUITE SOURCE_DIR BUILD_DIR      SUITE: autodiff or codegen; 77: no compiler, emulator or arm64 packages
# aarch64_suite.txt lists the tests that cannot run there, with reasons; tests that skip themselves print theirs.
. "$(dirname "$0")/aarch64_common.sh"
suite=$1 source=$2
name+=" $suite"
cross_build "$source" "$3" "${suite}_tests"

left_out=$(sed -n "s/^$suite \([^ ]*\): .*/\1/p" "$source/tests/full/processors/aarch64_suite.txt" | paste -sd :)
for shard in 0 1; do
  GTEST_TOTAL_SHARDS=2 GTEST_SHARD_INDEX=$shard emulated "$cross/bin/${suite}_tests" --gtest_filter="-$left_out" >"$scratch/log.$shard" 2>&1 &
  processes[shard]=$!
done
failed=0
for shard in 0 1; do
  wait "${processes[shard]}" && grep -q '^\[  PASSED  \]' "$scratch/log.$shard" || { failed=1; grep -A 12 ': Failure$' "$scratch/log.$shard"; tail -n 12 "$scratch/log.$shard"; }
done
grep -hA1 ': Skipped$' "$scratch"/log.? | grep -v ': Skipped$\|^--$' | sort | uniq -c || true
since "$(tests_of PASSED "$scratch"/log.?) tests pass, $(tests_of SKIPPED "$scratch"/log.?) skip themselves"
exit $failed
