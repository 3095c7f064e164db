# SPDX-License-Identifier: BSD-3-Clause
"""All bridges: types, and examples in docstrings, of those whose library is here."""

import doctest
import importlib
import pathlib
import subprocess
import sys

import dyntape
import numpy as np
import pytest

FOLDER = pathlib.Path(dyntape.__file__).parent / "bridges"
BRIDGES = sorted(path.stem for path in FOLDER.glob("*.py") if path.stem != "__init__")


def bridge(name):
    try:
        return importlib.import_module(f"dyntape.bridges.{name}")
    except ImportError as missing:
        pytest.skip(str(missing))


def documented(module):
    yield module.__doc__
    for value in vars(module).values():
        if getattr(value, "__module__", None) == module.__name__:
            yield value.__doc__
            yield from (getattr(member, "__doc__", None) for member in vars(value).values() if isinstance(value, type))


@pytest.mark.parametrize("name", BRIDGES)
def test_examples_in_docstrings(name, panda):
    module = bridge(name)
    q = panda.random(4, seed=6)
    names = {"dyntape": dyntape, "np": np, "robot": panda, "q": q, "v": q + 1, "tau": 2 * q, **vars(module)}
    for library, short in ("jax", "dj"), ("torch", "dt"), ("crocoddyl", "dc"):
        if name == library:
            names[short] = module
    for text in filter(None, documented(module)):
        test = doctest.DocTestParser().get_doctest(text, names, name, None, None)
        output = []
        result = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(test, out=output.append)
        assert result.failed == 0, "".join(output)


@pytest.mark.parametrize("name", BRIDGES)
def test_types(name):
    bridge(name)
    mypy = [sys.executable, "-m", "mypy", "--strict", "--no-incremental", "--follow-imports=silent", "-m", f"dyntape.bridges.{name}"]
    run = subprocess.run(mypy, capture_output=True, text=True)
    if "No module named mypy" in run.stderr:
        pytest.skip("mypy is not installed")
    assert run.returncode == 0, run.stdout
