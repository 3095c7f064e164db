# SPDX-License-Identifier: BSD-3-Clause
"""Sentences for calls with wrong arguments, made of a function's own signature."""

from __future__ import annotations

import ast
import difflib
import re
from collections.abc import Mapping, Sequence
from types import FunctionType
from typing import Any


def _signature(function: Any) -> ast.FunctionDef:
    text = re.sub(r"\\\d+", "None", function.__nb_signature__[0][0])
    node = ast.parse(text.splitlines()[-1] + ": ...").body[0]
    assert isinstance(node, ast.FunctionDef)
    return node


def _fits(value: Any, annotation: str) -> bool:
    """False where the value is certainly not what the annotation asks for."""
    words = set(re.findall(r"[\w.]+", annotation.rsplit(".", 1)[-1] if "[" not in annotation else annotation))
    if value is None:
        return "None" in words or "Any" in words
    if isinstance(value, (str, bytes)):
        return bool(words & {"str", "Any", "PathLike", "object"})
    if isinstance(value, int) and not isinstance(value, bool) and not 0 <= value < 2**63 and "int" in words:
        return False  # sizes and counts refuse such integers
    if "Callable" in words:
        return callable(value) or len(words & {"Any", "ArrayLike", "None"}) > 0 and "|" in annotation
    if words == {"int"} or words == {"int", "None"}:
        return isinstance(value, int) or hasattr(value, "__index__")
    if words == {"float"} or words == {"float", "None"}:
        return hasattr(value, "__float__") and not (isinstance(value, int) and abs(value) >= 2**1024)
    if words == {"str"} or words == {"str", "None"}:
        return isinstance(value, str)
    return not ("Sequence" in words and not hasattr(value, "__len__"))


def _shown(value: Any) -> str:
    """repr, of long integers and texts the beginning."""
    most, shown = 60, 20
    if isinstance(value, int) and abs(value) >= 10**most:
        digits = int(abs(value).bit_length() * 0.30102999566398120)  # or one more
        digits += abs(value) >= 10**digits
        return f"{'-' if value < 0 else ''}{abs(value) // 10 ** (digits - shown)}... ({digits} digits)"
    text = repr(value)
    return f"{text[:shown]}... ({len(value)} characters)" if isinstance(value, str) and len(text) > 2 * most else text


def _expected(annotation: str, value: Any) -> str:
    plain = annotation.replace("collections.abc.", "").replace("dyntape._dyntape.", "").replace("numpy.typing.", "")
    if isinstance(value, int) and "float" in plain:
        return f"{plain}, below 1.8e308"
    if isinstance(value, int) and not isinstance(value, bool):
        return f"{plain}, not negative" if value < 0 else f"{plain}, below 2**63"
    return "an array of numbers" if plain == "ArrayLike" else plain


def of_arguments(function: Any, args: Sequence[Any], kwargs: Mapping[str, Any]) -> str:
    """What is wrong with a call that fits no signature of the function."""
    node = _signature(function)
    positional, named = node.args.args, node.args.kwonlyargs
    owner = function.__qualname__.rpartition(".")[0]
    name = owner if node.name == "__init__" else function.__qualname__
    if positional and positional[0].arg == "self":
        if not args or all(t.__name__ != owner for t in type(args[0]).__mro__):
            return f"{name}: expected a {owner} before the arguments, got {type(args[0]).__name__ if args else 'nothing'}"
        positional, args = positional[1:], args[1:]
    known = {a.arg: ast.unparse(a.annotation) if a.annotation else "Any" for a in positional + named}
    shape = f"{name}({', '.join([a.arg for a in positional] + (['*'] if named else []) + [a.arg for a in named])})"
    if len(args) > len(positional) and not node.args.vararg:
        return f"{name}: got {len(args)} arguments without names, expected at most {len(positional)}: {shape}"
    for word in kwargs:
        if word not in known and not node.args.kwarg:
            near = difflib.get_close_matches(word, known, 1)
            return f'{name} has no argument "{word}"; ' + (f'did you mean "{near[0]}"?' if near else f"expected {shape}")
    given = {a.arg: value for a, value in zip(positional, args, strict=False)}
    for word in kwargs:
        if word in given:
            return f'{name}: "{word}" is given twice, by its place and by its name'
    given.update(kwargs)
    required = [a.arg for a in positional[: len(positional) - len(node.args.defaults)]]
    required += [a.arg for a, default in zip(named, node.args.kw_defaults, strict=True) if default is None]
    missing = [word for word in required if word not in given]
    if missing:
        return f"{name} needs {' and '.join(missing)}: {shape}"
    for word, value in given.items():
        if isinstance(value, FunctionType) and "Function" in re.findall(r"\w+", known.get(word, "")):
            return f"{name}: {word}: got a Python function; expected a recorded one, dyntape.record(f, nx, n_parameters)"
        if word in known and not _fits(value, known[word]):
            what = _shown(value) if value is None or isinstance(value, (int, float, str)) else type(value).__name__
            return f"{name}: {word} is {what}; expected {_expected(known[word], value)}"
    for word, value in given.items():
        if word in known and isinstance(value, int) and not isinstance(value, bool) and value >= 2**31 and "int" in known[word]:
            return f"{name}: {word} is {_shown(value)}; expected {_expected(known[word], None)}, below 2**31"
    types = ", ".join(f"{word}: {type(value).__name__}" for word, value in given.items())
    wanted = ", ".join(f"{word}: {_expected(known.get(word, 'Any'), None)}" for word in given)
    return f"{name}: got {types}; expected {wanted}"


# What the field and other libraries call things, by class.
_NAMES_HERE = {
    "Robot": {
        "forward_dynamics": "aba",
        "fd": "aba",
        "acceleration": "aba",
        "inverse_dynamics": "rnea",
        "id": "rnea",
        "inertia": "crba",
        "inertia_matrix": "crba",
        "mass_matrix": "crba",
        "M": "crba",
        "inverse_mass_matrix": "minverse",
        "inverse_inertia": "minverse",
        "bias": "nonlinear_effects",
        "bias_force": "nonlinear_effects",
        "coriolis": "nonlinear_effects",
        "gravity_vector": "gravity",
        "generalized_gravity": "gravity",
        "kinetic_energy": "energy",
        "potential_energy": "energy",
        "fk": "frame_placement",
        "forward_kinematics": "frame_placement",
        "frame_pose": "frame_placement",
        "pose": "frame_placement",
        "jacobian": "frame_jacobian",
        "inverse_kinematics": "problem(...).inverse_kinematics",
        "ik": "problem(...).inverse_kinematics",
        "center_of_mass": "com",
        "centre_of_mass": "com",
        "contact_dynamics": "constrained_dynamics",
        "regressor": "torque_regressor",
        "names": "joints",
        "neutral_configuration": "neutral",
        "random_configuration": "random",
    },
    "MpcStep": {"plan": "t, x and u", "motion": "t, x and u", "tau": "u"},
    "Solution": {"tau": "u", "motion": "t, x and u"},
    "Problem": {"bounds": "state_bounds and control_bounds", "end": "goal", "target": "goal", "x0": "start"},
}


def _no_attribute(owner: Any, name: str) -> AttributeError:
    kind = type(owner)
    text = f"{kind.__name__} has no {name!r}"
    if not name.startswith("_"):
        known = [word for word in dir(kind) if not word.startswith("_")]
        here = next((words[name] for base in kind.__mro__ if name in (words := _NAMES_HERE.get(base.__name__, {}))), None)
        near = difflib.get_close_matches(name, known, 1)
        if here:
            text += f"; it is called {here} here"
        elif near:
            text += f"; did you mean {near[0]!r}?"
        elif values := [word for word in known if not callable(getattr(kind, word))]:
            text += f"; it has {', '.join(values)}"
    return AttributeError(text, name=name, obj=owner)


def _missing_attribute(owner: Any, name: str) -> Any:
    if hasattr(type(owner), name):  # a property that raised an AttributeError, which Python has dropped
        return object.__getattribute__(owner, name)
    raise _no_attribute(owner, name)


def _set_attribute(owner: Any, name: str, value: Any) -> None:
    try:
        object.__setattr__(owner, name, value)
    except AttributeError:
        if hasattr(type(owner), name):
            raise
        raise _no_attribute(owner, name) from None


def explain_missing_attributes(kind: type) -> None:
    """Errors of unknown attributes, read or set, name the nearest, or what it is called here."""
    kind.__getattr__ = _missing_attribute  # type: ignore[attr-defined]
    kind.__setattr__ = _set_attribute  # type: ignore[assignment,method-assign]
