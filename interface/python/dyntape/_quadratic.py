# SPDX-License-Identifier: BSD-3-Clause
"""Quadratic programs as layers, in batches."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._dyntape import ArgumentError, QuadraticLayers

Array = NDArray[np.float64]


class QuadraticGradients(NamedTuple):
    """Gradients by the data of a quadratic program, each of the shape (...) + that of its part."""

    Q: Array
    q: Array
    A: Array
    b: Array
    G: Array
    h: Array


class QuadraticPoint(NamedTuple):
    """x (..., n) and the multipliers of A x = b, nu (...), and of G x <= h, multipliers (...)."""

    x: Array
    nu: Array
    multipliers: Array


class QuadraticLayer:
    """Minimises 1/2 x.Q x + q.x subject to A x = b and G x <= h, and derives the solution by all of its numbers.

    Q (..., n, n) symmetric, positive semidefinite; q (..., n); A (..., equalities, n), b; G (..., inequalities, n), h, whose entries
    may be infinite; None: no such rows.  Leading axes are batch axes and broadcast.  Programs are solved in all threads.

    outcome: "solved", "infeasible", "unbounded" or "unknown", each with a proof: x, nu, multipliers that fulfil the first-order
    conditions, or certificate: nu and multipliers >= 0 whose sum of rows is 0 <= -1, or a direction x along which the cost falls
    without end.
    status: "good" where the solution is differentiable; "weakly active": the rows weak are active with multiplier zero, and the
    solution has a derivative to either side; "dependent rows": derivatives are those of an independent part of the active rows;
    "no strict minimum", "not a solution": derivatives are NaN.
    With batch axes outcome, status and why are arrays of text.

    Raises ArgumentError for sizes that do not fit, numbers that are not finite, Q that is not symmetric or not positive
    semidefinite.

    >>> layer = dyntape.QuadraticLayer(np.eye(2), [[-1.0, 0.0], [-3.0, 0.0]], G=[[1.0, 0.0]], h=[2.0])
    >>> layer.x.tolist(), layer.status.tolist()
    ([[1.0, 0.0], [2.0, 0.0]], ['good', 'good'])
    >>> (layer.backward(layer.x).q + 0.0).tolist()
    [[-1.0, 0.0], [0.0, 0.0]]
    """

    def __init__(
        self,
        Q: ArrayLike,
        q: ArrayLike,
        A: ArrayLike | None = None,
        b: ArrayLike | None = None,
        G: ArrayLike | None = None,
        h: ArrayLike | None = None,
    ) -> None:
        cost = np.asarray(q, dtype=np.float64)
        n = cost.shape[-1] if cost.ndim else 0
        if (A is None) != (b is None) or (G is None) != (h is None):
            raise ArgumentError("quadratic program: expected A with b and G with h, got one without the other")
        none = np.zeros((0, n)), np.zeros(0)
        given = (Q, cost, *(none if A is None else (A, b)), *(none if G is None else (G, h)))
        parts = [_doubles(name, part, axes) for (name, axes), part in zip(_AXES.items(), given)]
        try:
            self._batch = np.broadcast_shapes(*(part.shape[: part.ndim - axes] for part, axes in zip(parts, _AXES.values())))
        except ValueError:
            shapes = ", ".join(f"{name} {part.shape}" for name, part in zip(_AXES, parts))
            raise ArgumentError(f"quadratic program: batch axes do not broadcast: {shapes}") from None
        self._shapes = [part.shape[part.ndim - axes :] for part, axes in zip(parts, _AXES.values())]
        self._layers = QuadraticLayers(*(self._flat(i, part) for i, part in enumerate(parts)))
        self.x, self.nu, self.multipliers = self._point(self._layers.solution())
        self.certificate = self._point(self._layers.certificate())
        self.outcome, self.status, self.why = map(self._texts, (self._layers.outcomes(), self._layers.statuses(), self._layers.reasons()))
        weak = np.zeros((len(self._layers.weak()), self._shapes[5][0]), dtype=bool)
        for row, held in zip(weak, self._layers.weak()):
            row[held] = True
        self.weak = weak.reshape(*self._batch, -1) if weak.size else np.zeros((*self._batch, self._shapes[5][0]), dtype=bool)

    @property
    def good(self) -> Any:
        """Where the solution is differentiable: bool, with batch axes an array."""
        good = np.asarray(self.status) == "good"
        return good if self._batch else bool(good)

    def forward(self, **changes: ArrayLike) -> QuadraticPoint:
        """The derivative of the solution along changes of Q, q, A, b, G, h; those left out are zero.

        Where rows are weakly active it is that to the side of the changes, exact.

        >>> dyntape.QuadraticLayer([[1.0]], [-1.0], G=[[1.0]], h=[1.0]).forward(q=[1.0]).x.tolist()
        [-1.0]
        """
        unknown = set(changes) - set(_AXES)
        if unknown:
            raise ArgumentError(f"forward: a program has no {sorted(unknown)[0]!r}; expected Q, q, A, b, G or h")
        parts = [_doubles(name, changes.get(name, np.zeros(shape)), len(shape)) for name, shape in zip(_AXES, self._shapes)]
        return self._point(self._layers.forward(*(self._flat(i, part) for i, part in enumerate(parts))))

    def backward(self, slope: ArrayLike, weak: str = "open") -> QuadraticGradients:
        """Gradients of a function of x by the data of the program.

        slope: (..., n) the gradient by x.  weak: what weakly active rows are taken for, "open" or "held": the derivative where h of
        these rows is a little larger, or a little smaller.
        """
        if weak not in ("open", "held"):
            raise ArgumentError(f'backward: weak is {weak!r}; expected "open" or "held"')
        gradients = self._layers.backward(self._flat(1, _doubles("slope", slope, 1)), weak == "held")
        return QuadraticGradients(*(part.reshape(*self._batch, *shape) for part, shape in zip(gradients, self._shapes)))

    def _flat(self, part: int, values: Array) -> Array:
        shape = self._shapes[part]
        if values.shape[values.ndim - len(shape) :] != shape:
            name = list(_AXES)[part]
            raise ArgumentError(f"quadratic program: {name} has shape {values.shape}, expected (..., {', '.join(map(str, shape))})")
        try:
            whole = np.broadcast_to(values, (*self._batch, *shape))
        except ValueError:
            raise ArgumentError(f"quadratic program: shape {values.shape} does not fit the batch {self._batch}") from None
        return np.ascontiguousarray(whole.reshape(int(np.prod(self._batch)), *shape))

    def _point(self, parts: Any) -> QuadraticPoint:
        return QuadraticPoint(*(part.reshape(*self._batch, part.shape[-1]) for part in parts))

    def _texts(self, texts: list[str]) -> Any:
        return np.array(texts, dtype=str).reshape(self._batch) if self._batch else texts[0]


_AXES = {"Q": 2, "q": 1, "A": 2, "b": 1, "G": 2, "h": 1}  # axes of one


def _doubles(name: str, given: Any, axes: int) -> Array:
    values = np.asarray(given, dtype=np.float64)
    if values.ndim < axes:
        raise ArgumentError(f"quadratic program: {name} has {values.ndim} axes, expected at least {axes}")
    return values
