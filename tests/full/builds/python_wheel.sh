#!/usr/bin/env bash
# The Python package from a wheel that pip makes of this tree and the libraries of the build, in an environment of its own: its tests.
#   python_wheel.sh SOURCE_DIR BUILD_DIR      77: no Python with headers, or nowhere to get packages from
set -euo pipefail
source=$1 work=$2/python_package
mkdir -p "$work"
"$source/tools/python_environment" "$work/venv" 'scikit-build-core>=0.10' ninja
bin=$work/venv/bin
command -v ccache >/dev/null && export CMAKE_CXX_COMPILER_LAUNCHER="$source/tools/cached"
export CC=${CC:-cc} CXX=${CXX:-c++}  # as tools/build calls them: its objects are as good
rm -f "$work"/*.whl
"$bin/pip" wheel -q --disable-pip-version-check --no-build-isolation --no-deps -C build-dir="$work/build" -C cmake.define.DYNTAPE_WERROR=ON \
  -C cmake.define.DYNTAPE_LIBRARIES="$2" -w "$work" "$source"
"$bin/pip" install -q --disable-pip-version-check --force-reinstall --no-deps "$work"/dyntape-*.whl
cd "$work"
"$bin/python" -m pytest -q -p no:cacheprovider "$source/tests/python"
