#!/usr/bin/env bash
# The Python package from a wheel of this tree, in an environment of its own: its tests, and again a part of them with Python's debug allocator.
#   python.sh SOURCE_DIR BUILD_DIR      77: no Python with headers, or nowhere to get packages from
set -euo pipefail
source=$1 work=$2/python_package
python3 -c 'import sysconfig, os, sys; sys.exit(not os.path.exists(sysconfig.get_path("include") + "/Python.h"))' \
  || { echo "python: no headers of Python"; exit 77; }
mkdir -p "$work"
python3 -m venv "$work/venv"
bin=$work/venv/bin
"$bin/pip" install -q --disable-pip-version-check 'nanobind>=2.4' 'scikit-build-core>=0.10' ninja numpy scipy pytest mypy \
  || { echo "python: its packages are out of reach"; exit 77; }
export CCACHE_BASEDIR=$source CCACHE_SLOPPINESS=pch_defines,time_macros
command -v ccache >/dev/null && export CMAKE_CXX_COMPILER_LAUNCHER=ccache
rm -f "$work"/*.whl
"$bin/pip" wheel -q --disable-pip-version-check --no-build-isolation --no-deps -C build-dir="$work/build" -w "$work" "$source"
"$bin/pip" install -q --disable-pip-version-check --force-reinstall --no-deps "$work"/dyntape-*.whl
cd "$work"
"$bin/python" -m pytest -q -p no:cacheprovider "$source/tests/python"
PYTHONMALLOC=debug "$bin/python" -X dev -W error::ResourceWarning -m pytest -q -p no:cacheprovider "$source/tests/python/test_functions.py" "$source/tests/python/test_robot.py"
