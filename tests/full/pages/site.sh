#!/usr/bin/env bash
# The site: what its pages show runs, it is built without a warning, and a browser opens its pages.
#   site.sh SOURCE_DIR BUILD_DIR      77: nowhere to get packages from, or a build without the Python package
set -euo pipefail
source=$1 build=$2 python=$2/python_environment/bin/python
compgen -G "$build/python/dyntape/_dyntape.*.so" >/dev/null \
  || { echo "site: this build is without the Python package, which tools/build --python makes"; exit 77; }
"$source/tools/python_environment" "$build/python_environment"
"$python" "$source/tests/full/pages/documents.py" "$build"
DYNTAPE_BUILD=$build "$source/tools/site" --as-built
"$python" "$source/tests/full/pages/site_pages.py" "$build/site"
