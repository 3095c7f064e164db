# SPDX-License-Identifier: BSD-3-Clause
"""A function and its derivatives as one chain, which is how libraries with derivatives of their own take them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import ArgumentError, Function, Robot, record


class Exact:
    """A function of one or several vectors; their entries, one after another, are x, by which it is derived.

    sizes: entries of each argument, by name.  shape: of one value.  n: entries of x.
    """

    def __init__(self, what: Robot | Function, function: str | None, options: dict[str, Any]) -> None:
        if isinstance(what, Robot):
            self._f, self.sizes = _of_robot(what, function, options)
        else:
            if function is not None or options:
                raise ArgumentError("a recorded function is complete; expected neither a name nor options beside it")
            self._f, self.sizes = _of_recorded(what)
        self.name, self.shape, self.n = self._f.name, self._f.shape, self._f.n_x
        self._weights = np.eye(self._f.n_y)

    def level(self, order: int, x: Any) -> NDArray[np.float64]:
        """Derivatives of one order: x (..., n), result (..., n_y * n**order), of which x counts quickest.

        The next order is the Jacobian of this one.  order: 0, 1 or 2.

        >>> exact = Exact(dyntape.record(lambda x: x * x, 2), None, {})
        >>> exact.level(1, [1.0, 2.0])
        array([2., 0., 0., 4.])
        """
        x = np.asarray(x, dtype=np.float64)
        if order == 0:
            y = self._f(x)
        elif order == 1:
            y = self._f.jacobian(x)
        else:
            y = self._f.hessian(x[..., None, :], weights=self._weights)
        return np.reshape(y, (*x.shape[:-1], self.size(order)))

    def size(self, order: int) -> int:
        """Entries of one result of `level`."""
        return len(self._weights) * int(self.n**order)

    def check(self, shapes: tuple[tuple[int, ...], ...]) -> None:
        """Raises ArgumentError unless these are shapes of its arguments, each (..., entries)."""
        if len(shapes) != len(self.sizes):
            raise ArgumentError(f"{self.name}: expected {', '.join(self.sizes)}, got {len(shapes)} arguments")
        for (name, entries), shape in zip(self.sizes.items(), shapes):
            if not shape or shape[-1] != entries:
                raise ArgumentError(f"{self.name}: expected {name} of shape (..., {entries}), got {shape}")


THIRD_ORDER = "{}: dyntape has derivatives of first and second order; expected no third one"


def _of_robot(robot: Robot, function: str | None, options: dict[str, Any]) -> tuple[Function, dict[str, int]]:
    if function is None:
        raise ArgumentError('expected the name of a function of the robot, as in function(robot, "aba")')
    sizes = robot.inputs(function)
    ends = np.cumsum(list(sizes.values()))

    def value(x: Any) -> Any:
        result = getattr(robot, function)(*np.split(x, ends[:-1]), **options)
        if isinstance(result, tuple):
            raise ArgumentError(f"{function} has several results; expected a dyntape.record of the one that is needed")
        return result

    # A configuration, as quaternions of length 0 are none.
    at = [*robot.neutral(), *np.zeros(ends[-1] - robot.nq)]
    return record(value, len(at), name=function, x0=at), sizes


def _of_recorded(f: Function) -> tuple[Function, dict[str, int]]:
    if f.n_p == 0:
        return f, {"x": f.n_x}
    n = f.n_x
    return record(lambda z: f(z[:n], z[n:]), n + f.n_p, name=f.name), {"x": n, "p": f.n_p}
