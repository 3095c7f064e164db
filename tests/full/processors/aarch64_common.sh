# Sourced by aarch64*.sh: how dyntape is compiled for aarch64 on another processor, and run there by qemu.
#   skip REASON, needs PROGRAM..., since WHAT, quietly COMMAND...    $scratch: a folder that is removed at the end
#   tests_of PASSED LOG...                                           how many tests the logs of gtest count as passed
#   cross_build SOURCE_DIR BUILD_DIR TARGET...                       into BUILD_DIR/aarch64, which is $cross afterwards
#   emulated PROGRAM ...                                             a program of $cross, whose compilers are those for aarch64
set -euo pipefail
name=$(basename "$0" .sh)
start=$SECONDS
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
skip() { echo "$name: $1"; exit 77; }
needs() {
  local program
  for program; do command -v "$program" >/dev/null || skip "$program is missing; tools/setup --aarch64 installs it"; done
}
since() { echo "$name: $1 in $((SECONDS - start)) s"; start=$SECONDS; }
quietly() { "$@" >"$scratch/log" 2>&1 || { tail -n 60 "$scratch/log" >&2; exit 1; }; }
tests_of() { local kind=$1; shift; sed -n "s/^\[ *$kind *\] \([0-9]*\) test.*/\1/p" "$@" | awk '{ n += $1 } END { print n + 0 }'; }

cross_build() {
  local source=$1 compiler
  cross=$2/aarch64
  shift 2
  needs aarch64-linux-gnu-g++ qemu-aarch64 mmdebstrap
  "$source/tools/setup" --aarch64 >"$scratch/log" 2>&1 || skip "the arm64 packages are out of reach: $(tail -n 1 "$scratch/log")"
  since "arm64 packages"
  quietly cmake --preset aarch64 -S "$source" -B "$cross" -DDYNTAPE_WERROR=ON -DDYNTAPE_TESTS=ON -DCMAKE_CXX_COMPILER_LAUNCHER="$source/tools/cached"
  quietly ninja -C "$cross" -j 2 "$@"
  since "cross-compiled"

  # Compilers of this machine make the libraries that an emulated program loads.
  mkdir "$scratch/compilers"
  chmod 755 "$scratch"  # for tests as another user
  for compiler in cc:gcc gcc:gcc g++:g++; do
    cross_compiler "${compiler%:*}" "aarch64-linux-gnu-${compiler#*:}" "\"--sysroot=$cross/sysroot\""
  done
  for compiler in clang clang++; do
    ! command -v $compiler >/dev/null || cross_compiler $compiler "$(command -v $compiler)" "\"--target=aarch64-linux-gnu\", \"--sysroot=$cross/sysroot\""
  done
  export DYNTAPE_CACHE=$scratch/cache DYNTAPE_TEST_EMULATOR=$source/tools/aarch64_run
}
# NAME COMPILER WORDS: the compiler NAME of emulated programs.
cross_compiler() {
  gcc -O1 -DCOMPILER="\"$2\"" -DWORDS="$3" "$(dirname "$0")/cross_compiler.c" -o "$scratch/compilers/$1"
}
emulated() { PATH=$scratch/compilers:$PATH "$DYNTAPE_TEST_EMULATOR" "$@"; }
