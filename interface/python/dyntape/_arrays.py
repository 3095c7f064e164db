# SPDX-License-Identifier: BSD-3-Clause
"""Arrays of recorded values that numpy computes with: comparisons give conditions, decisions become selections."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from . import _dyntape as _d

# Comparisons keep what the entries answer; numpy would ask each for a bool, which leaves a guard.
_COMPARISONS = {np.less, np.less_equal, np.greater, np.greater_equal, np.equal, np.not_equal}

# Of objects numpy would decide these by comparisons, or ask the first argument alone, which may be a number.
_FUNCTIONS: dict[np.ufunc, tuple[Any, int]] = {
    np.maximum: (_d.maximum, 2),
    np.minimum: (_d.minimum, 2),
    np.fmax: (_d.maximum, 2),
    np.fmin: (_d.minimum, 2),
    np.sign: (_d.sign, 1),
    np.floor: (_d.floor, 1),
    np.ceil: (_d.ceil, 1),
    np.trunc: (_d.trunc, 1),
    np.arctan2: (_d.arctan2, 2),
    np.hypot: (_d.hypot, 2),
    np.copysign: (_d.copysign, 2),
    np.fmod: (_d.fmod, 2),
    np.power: (_d.power, 2),
    np.logical_and: (lambda a, b: a & b, 2),
    np.logical_or: (lambda a, b: a | b, 2),
    np.logical_xor: (lambda a, b: a ^ b, 2),
    np.logical_not: (lambda a: a ^ True, 1),
    np.fabs: (abs, 1),
    np.deg2rad: (lambda a: a * (np.pi / 180), 1),
    np.radians: (lambda a: a * (np.pi / 180), 1),
    np.rad2deg: (lambda a: a * (180 / np.pi), 1),
    np.degrees: (lambda a: a * (180 / np.pi), 1),
}
_OWN = {ufunc: np.frompyfunc(function, arguments, 1) for ufunc, (function, arguments) in _FUNCTIONS.items()}
_NOT_SUPPORTED = re.compile("not supported for the input types|does not support argument|no callable|Cannot cast")
_LINALG = np.linalg
_OF_PIVOTS = {_LINALG.solve, _LINALG.inv, _LINALG.lstsq, _LINALG.pinv, _LINALG.det, _LINALG.eigh, _LINALG.svd, _LINALG.qr}
# What to write in place of functions that cannot be recorded.
_ENTRIES = "np.minimum and np.maximum of the entries"
_INSTEAD = {
    "np.linalg.det": "np.prod(np.diag(np.linalg.cholesky(a))) ** 2 of a symmetric positive definite a, else the sum of products",
    "np.linalg.eigvalsh": "the roots of the characteristic polynomial of a small matrix",
    "np.median": "np.mean, or " + _ENTRIES,
    "np.sort": _ENTRIES,
    "np.partition": _ENTRIES,
    "np.argmax": "np.where of comparisons",
    "np.argmin": "np.where of comparisons",
    "np.interp": "np.where or dyntape.where for the cases between the points of the table",
    "np.round": "np.floor(x + 0.5)",
    "rint": "np.floor(x + 0.5)",
    "divmod": "np.mod and np.floor_divide",
    "cbrt": "np.sign(x) * abs(x) ** (1 / 3)",
}
_ANYTHING = (
    "arithmetic, numpy's elementary functions, sums and products, and np.where or dyntape.where for cases, as between the points of a table"
)


def _select_one(condition: Any, a: Any, b: Any) -> Any:
    """A recorded value is a condition as a number is: unless it is zero."""
    return _d.select(condition != 0 if isinstance(condition, _d.AD) else condition, a, b)


_SELECT = np.frompyfunc(_select_one, 3, 1)


def _plain(value: Any) -> Any:
    if isinstance(value, RecordedArray):
        return value.view(np.ndarray)
    if isinstance(value, (_d.AD, _d.Condition)):
        entry = np.empty((), dtype=object)
        entry[()] = value
        return entry
    return value


def _has_numbers(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.dtype == object and any(not isinstance(v, (_d.AD, _d.Condition)) for v in value.flat)


def _taped(value: Any) -> Any:
    if isinstance(value, np.ndarray) and value.dtype == object:
        return value[()] if value.ndim == 0 else value.view(RecordedArray)
    return value


def _all_taped(result: Any) -> Any:
    return type(result)(map(_taped, result)) if type(result) in (tuple, list) else _taped(result)


def _array_ufunc(self: Any, ufunc: np.ufunc, method: str, *inputs: Any, **options: Any) -> Any:
    if ufunc in _COMPARISONS and method == "__call__":
        options["dtype"] = object
    if ufunc.__name__ == "clip" and method == "__call__" and len(inputs) == 3:
        return np.minimum(np.maximum(inputs[0], inputs[1]), inputs[2])
    masked = options.get("where", True)
    if isinstance(masked, (RecordedArray, _d.Condition)) or (method != "__call__" and masked is not True):
        raise _d.RecordingError(
            f"{ufunc.__name__} with where= cannot be recorded; expected np.where(condition, x, 0) of a condition, x[mask] of a mask of bools"
        )
    if "out" in options:
        options["out"] = tuple(_plain(out) for out in options["out"])
    plain = [_plain(value) for value in inputs]
    function = _OWN.get(ufunc, ufunc)
    if function is ufunc and method == "__call__" and any(map(_has_numbers, plain)):
        function = np.frompyfunc(ufunc, ufunc.nin, ufunc.nout)  # numpy asks each entry for a method, which numbers lack
    try:
        with np.errstate(all="ignore"):  # of values at the recording point, where a NaN is no error
            result = getattr(function, method)(*plain, **options)
    except TypeError as error:
        if ufunc in _OWN or not _NOT_SUPPORTED.search(str(error)):
            raise
        raise _cannot_be_recorded(ufunc.__name__) from error
    return _all_taped(result)


def _array_function(self: Any, func: Any, types: Any, args: Any, kwargs: Any) -> Any:
    if func is np.where and len(args) == 3:
        return where(*args)
    if func is np.select:
        return _select(*args, **kwargs)
    if func is np.clip and not isinstance(args[0], RecordedArray):  # numpy would clip an array without the ufunc above
        return _clip(*args, **kwargs)
    if func is np.sinc:
        return _sinc(*args)
    if func is np.linalg.cholesky and len(args) == 1:
        return _d.cholesky(*args)
    if func in _OF_PIVOTS:
        raise _of_pivots(f"np.linalg.{func.__name__}")
    try:
        return _all_taped(func._implementation(*args, **kwargs))
    except (TypeError, _d.RecordingError) as error:
        if not isinstance(error, _d.RecordingError) and not _NOT_SUPPORTED.search(str(error)):
            raise
        if any(map(callable, args)) or "where=" in str(error):  # what is wrong is named already
            raise
        raise _cannot_be_recorded(f"{func.__module__}.{func.__name__}".replace("numpy", "np", 1)) from error


def _cannot_be_recorded(name: str) -> Exception:
    return _d.RecordingError(f"{name} cannot be recorded: it needs numbers; expected {_INSTEAD.get(name, _ANYTHING)}")


def _of_pivots(name: str) -> Exception:
    instead = _INSTEAD.get(name, "dyntape.symmetric_solve(a, b), or np.linalg.cholesky")
    return _d.ArgumentError(f"{name} of recorded values would decide by pivots; expected {instead}")


def explained(error: BaseException) -> Exception | None:
    """What an error of numpy in a function that is recorded means; None: it is another's error."""
    better: Exception | None = None
    ufunc = getattr(error, "ufunc", None)
    if isinstance(error, IndexError) and "arrays used as indices" in str(error):
        better = _d.RecordingError(
            "an index needs integers: which entries a recorded condition takes would depend on values; expected np.where(condition, a, b)"
        )
    elif isinstance(error, TypeError) and (method := re.search(r"of type (?:int|float) which has no callable (\w+) method", str(error))):
        better = _d.RecordingError(
            f"np.{method[1]} of an array of recorded values and numbers: numpy asks numbers for what they lack; "
            "expected dyntape.array([...]) in place of np.array([...])"
        )
    elif isinstance(error, TypeError) and isinstance(ufunc, np.ufunc):  # of nested lists, which ask nobody
        name = ufunc.__name__.rstrip("1")  # solve1 is np.linalg.solve of a vector
        linear = name in {function.__name__ for function in _OF_PIVOTS}
        better = _of_pivots(f"np.linalg.{name}") if linear else _cannot_be_recorded(ufunc.__name__)
    if better is not None:
        better.__cause__ = error
    return better


def _select(condlist: Any, choicelist: Any, default: Any = 0) -> Any:
    chosen = default
    for condition, choice in reversed(list(zip(condlist, choicelist, strict=True))):
        chosen = where(condition, choice, chosen)
    return chosen


def _sinc(x: Any) -> Any:
    """sin(y) / y of y = pi x, near 0 its series: numpy's own has no second derivative at 0."""
    y = np.pi * x
    small, z = abs(y) < 1e-2, y * y
    return where(small, 1 - z / 6 * (1 - z / 20 * (1 - z / 42)), np.sin(y) / where(small, 1.0, y))


def _clip(a: Any, a_min: Any = None, a_max: Any = None) -> Any:
    low = a if a_min is None else np.maximum(a, a_min)
    return low if a_max is None else np.minimum(low, a_max)


class RecordedArray(np.ndarray):
    """An array of recorded values, as functions get them while they are recorded.

    numpy computes with it as with floats.  Comparisons give arrays of conditions, for `np.where` or `dyntape.where`;
    `np.maximum`, `np.minimum`, `np.clip` and `np.sign` leave no guard.
    """

    __array_ufunc__ = _array_ufunc
    __array_function__ = _array_function


for _type in (_d.AD, _d.Condition):  # numpy asks single values as it asks arrays
    setattr(_type, "__array_ufunc__", _array_ufunc)
    setattr(_type, "__array_function__", _array_function)


def array(entries: Any) -> Any:
    """An array of recorded values and numbers, with which all of numpy's elementary functions compute.

    entries: a list, or a list of lists.  Without recorded values the result is `np.array(entries)`.  numpy's own `np.array` of recorded
    values has operators, and only those functions that every entry has.

    >>> f = dyntape.record(lambda x: np.exp(dyntape.array([x[0], 2.0])), 1)
    >>> f([0.0])
    array([1.       , 7.3890561])
    """
    values = np.array(entries, dtype=object)
    recorded = any(isinstance(value, (_d.AD, _d.Condition)) for value in values.flat)
    return values.view(RecordedArray) if recorded else np.array(entries)


def where(condition: Any, a: Any, b: Any) -> Any:
    """a where the condition holds, b elsewhere; both are recorded, and what is not taken contributes nothing to derivatives.

    condition: a comparison of recorded values, or an array of these, or bools.  Arguments broadcast as numpy's do.

    >>> f = dyntape.record(lambda x: dyntape.where(x < 0, -x, x), 1)
    >>> f([-2.0])
    array([2.])
    """
    values = (_plain(value) for value in (condition, a, b))
    return _taped(np.asarray(_SELECT(*values), dtype=object))


def norm(x: Any, smoothing: float) -> Any:
    """sqrt(x . x + smoothing^2) of all entries of x: a length with derivatives of all orders, also at x = 0.

    smoothing > 0, in the unit of x.  The result is too long by smoothing at x = 0, by smoothing^2 / (2 |x|) far from it.

    >>> f = dyntape.record(lambda x: dyntape.norm(x, 1e-3), 2)
    >>> f.jacobian([0.0, 0.0])
    array([0., 0.])
    """
    _check_smoothing(smoothing, "norm")
    entries = np.asanyarray(x)
    return np.sqrt(np.sum(entries * entries) + smoothing * smoothing)


def safe_divide(a: Any, b: Any, smoothing: float) -> Any:
    """a b / (b^2 + smoothing^2): a quotient with derivatives of all orders, also at b = 0, where it is 0.

    smoothing > 0, in the unit of b.  Far from b = 0 it is a / b within a part (smoothing / b)^2.

    >>> f = dyntape.record(lambda x: dyntape.safe_divide(x[0], x[1], 1e-3), 2)
    >>> f([1.0, 0.0])
    array(0.)
    """
    _check_smoothing(smoothing, "safe_divide")
    over, under = (value if isinstance(value, _d.AD) else np.asanyarray(value)[()] for value in (a, b))
    length = np.hypot(under, smoothing)
    return over * (under / length) / length


def _check_smoothing(smoothing: float, function: str) -> None:
    if not 0 < smoothing < np.inf:
        raise _d.ArgumentError(f"{function}: smoothing: got {smoothing}, expected a number greater than 0")
