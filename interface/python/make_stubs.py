#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the typed stub of the extension module: nanobind's stubgen, and what it does not know.

    make_stubs.py FOLDER OUTPUT      FOLDER: where the package `dyntape` with its module stands
"""

import importlib
import pathlib
import re
import sys

from nanobind.stubgen import StubGen

HEADER = '''from collections.abc import Callable, Mapping, Sequence
import os
import types
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._bodies import Shape
from ._pictures import Pictures

Array = NDArray[np.float64]
IntArray = NDArray[np.intp]

Progress = Callable[[str], object] | bool | None

__version__: str
'''


def is_result(value):
    return isinstance(value, type) and issubclass(value, tuple) and hasattr(value, "n_sequence_fields")


def named_tuple(name, value):
    lines = [f"class {name}(NamedTuple):", f'    """{value.__doc__}"""', ""]
    lines += [f"    {field}: Array" for field in value.__match_args__]
    return "\n".join(lines) + "\n"


def main():
    folder, output = sys.argv[1:]
    sys.path.insert(0, folder)
    module = importlib.import_module("dyntape._dyntape")
    results = {name: value for name, value in vars(module).items() if is_result(value)}
    for name in results:  # stubgen takes them for classes like others
        delattr(module, name)
    for value in vars(module).values():
        if isinstance(value, type):  # errors, and classes to which the package gives its own name
            value.__module__ = module.__name__
    generator = StubGen(module, quiet=True)
    generator.put(module)
    text = re.sub(r"^from .* import \((.|\n)*?\)\n|^(from|import) .*\n", "", generator.get(), flags=re.M)
    text = re.sub(r"^    __array_ufunc__.*\n", "", text, flags=re.M)
    text = re.sub(r"os\.PathLike(?!\[)", "os.PathLike[str]", text)
    parts = [HEADER, *(named_tuple(name, value) for name, value in sorted(results.items())), text.strip()]
    pathlib.Path(output).write_text("\n\n".join(parts) + "\n")


main()
