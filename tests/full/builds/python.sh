#!/usr/bin/env bash
# The Python package of this build, as it lies in the tree with its module: its tests, and a part of them again with Python's debug allocator.
#   python.sh SOURCE_DIR BUILD_DIR      77: no Python with headers, nowhere to get packages from, or a build without the package
set -euo pipefail
tests=$1/tests/python build=$2 python=$2/python_environment/bin/python
"$1/tools/python_environment" "$build/python_environment"
compgen -G "$build/python/dyntape/_dyntape.*.so" >/dev/null \
  || { echo "python: this build is without the package, which tools/build --python makes"; exit 77; }
export PYTHONPATH=$build/python DYNTAPE_CACHE=$build/test_cache
cd "$build"
pytest=(-m pytest -q -p no:cacheprovider -o faulthandler_timeout=240)  # what hangs says where, before it is ended from outside
"$python" "${pytest[@]}" "$tests"
PYTHONMALLOC=debug "$python" -X dev -W error::ResourceWarning "${pytest[@]}" "$tests/test_functions.py" "$tests/test_robot.py"
