#!/usr/bin/env bash
# The ordinary tests of codegen, interface and tools where PATH has no C compiler: what is recorded runs as machine code.
#   without_compiler.sh SOURCE_DIR BUILD_DIR
set -euo pipefail
source=$1 build=$2
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for program in /usr/bin/* /bin/*; do
  case ${program##*/} in
    cc | c89* | c99* | c++* | cpp* | gcc* | g++* | clang* | tcc | *-gcc* | *-g++* | *-cpp*) ;;
    *) ln -sf "$program" "$folder" ;;
  esac
done
passed_over=$(grep -v '^#' "$source/tests/full/builds/without_compiler.txt" | sed 's/[.]/[.]/; s/^/^/' | paste -sd '|')
# A folder of its own: another ctest may be at work in that of the build.
echo "subdirs(\"$build\")" >"$folder/CTestTestfile.cmake"
export PATH=$folder DYNTAPE_CACHE=$folder/cache
unset DYNTAPE_CC
! command -v cc gcc clang
ctest --test-dir "$folder" --output-on-failure -j "$(nproc)" -L '^(codegen|interface|tools)$' -LE full -E "$passed_over"
