#!/usr/bin/env bash
# Bridges of the Python package, and what docs/bridges.md shows of them, with the libraries that they bridge to.
#   bridges.sh SOURCE_DIR BUILD_DIR      77: nowhere to get packages from, or a build without the Python package
set -euo pipefail
tests=$1/tests/python build=$2 environment=$2/bridges_environment
compgen -G "$build/python/dyntape/_dyntape.*.so" >/dev/null \
  || { echo "bridges: this build is without the Python package, which tools/build --python makes"; exit 77; }
"$1/tools/python_environment" "$environment" jax mujoco pin crocoddyl example-robot-data rerun-sdk
export PYTHONPATH=$build/python DYNTAPE_CACHE=$build/test_cache
"$environment/bin/python" "$1/tools/website/notebooks.py" "$build/notebooks_of_bridges" batches_on_jax | grep -q 'run$'
cd "$build"
"$environment/bin/python" -m pytest -q -p no:cacheprovider -o faulthandler_timeout=240 -rs "$tests"/bridges/test_{crocoddyl,jax,mujoco,pinocchio,scipy}.py "$tests"/test_{descriptions,quadratic,tensors,viewers,workers}.py
