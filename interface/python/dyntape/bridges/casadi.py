# SPDX-License-Identifier: BSD-3-Clause
"""Functions of CasADi's SX as functions of dyntape.  The other way round: robot.casadi("aba"), f.casadi().

>>> x = ca.SX.sym("x", 2)
>>> f = function(ca.Function("f", [x], [ca.sin(x[0]) * x[1] ** 2]))
>>> f.jacobian([0.0, 3.0]).tolist()
[9.0, 0.0]
"""

from __future__ import annotations

from typing import Any, Callable

import casadi as ca
import numpy as np

from .. import ArgumentError, Function, _dyntape, record, where

Value = Any  # a number or a recorded value


def function(f: ca.Function) -> Function:
    """A function of CasADi's, recorded: batched, derived twice exactly, compiled at a call, a part of other recordings.

    f: of SX, or of MX that `expand()` turns into SX.  x (..., n_x): its inputs one after another, matrices row by row, entries
    that are no non-zeros included.  Its value: the output, a vector (..., rows), a matrix (..., rows, cols), a number (...); of
    several outputs all entries, one output after another.

    Raises ArgumentError for free variables and for operations that dyntape has not (erfinv, calls of foreign functions).

    >>> x, p = ca.SX.sym("x", 3), ca.SX.sym("p")
    >>> function(ca.Function("g", [x, p], [p * x, ca.sumsqr(x)])).n_y
    4
    """
    try:
        plain = f if f.is_a("SXFunction") else f.expand()
    except RuntimeError as refused:
        reason = str(refused).strip().splitlines()[-1]
        raise ArgumentError(f"{f.name()}: expected a function of SX, or one that can be expanded into it: {reason}") from refused
    if plain.has_free():
        raise ArgumentError(f"{f.name()}: expected no free variables, got {', '.join(map(str, plain.get_free()))}")
    places_in = _places([plain.sparsity_in(i) for i in range(plain.n_in())])
    places_out = _places([plain.sparsity_out(i) for i in range(plain.n_out())])
    shape = _shape(plain)

    def run(x: Any) -> Any:
        y: list[Value] = [0.0] * places_out.size
        _run(plain, x, places_in.of, places_out.of, y)
        return np.array(y, dtype=object).reshape(shape)

    run.__name__ = f.name()
    return record(run, places_in.size)


class _places:
    """Where the non-zeros of each argument stand in all of its entries, row by row, one argument after another."""

    def __init__(self, sparsities: list[Any]) -> None:
        self.size, self.of = 0, []
        for sparsity in sparsities:
            rows, cols = np.array(sparsity.row(), dtype=int), np.array(sparsity.get_col(), dtype=int)
            self.of.append((self.size + rows * sparsity.size2() + cols).tolist())
            self.size += sparsity.numel()


def _shape(f: Any) -> tuple[int, ...]:
    if f.n_out() != 1:
        return (sum(f.numel_out(i) for i in range(f.n_out())),)
    rows, cols = f.size_out(0)
    if cols != 1:
        return (rows, cols)
    return () if rows == 1 else (rows,)


def _run(f: Any, x: Any, places_in: list[list[int]], places_out: list[list[int]], y: list[Value]) -> None:
    work: list[Value] = [0.0] * f.sz_w()
    for k in range(f.n_instructions()):
        op, i, o = f.instruction_id(k), f.instruction_input(k), f.instruction_output(k)
        if op == ca.OP_INPUT:
            work[o[0]] = x[places_in[i[0]][i[1]]]
        elif op == ca.OP_OUTPUT:
            y[places_out[o[0]][o[1]]] = work[i[0]]
        elif op == ca.OP_CONST:
            work[o[0]] = np.float64(f.instruction_constant(k))
        elif op in _OPERATIONS:
            work[o[0]] = _OPERATIONS[op](*(work[a] for a in i))
        else:
            name = next((name for name in dir(ca) if name.startswith("OP_") and getattr(ca, name) == op), f"number {op}")
            raise ArgumentError(f"{f.name()}: dyntape has no operation like CasADi's {name}, instruction {k}")


def _truth(condition: Any) -> Value:
    return where(condition, 1.0, 0.0)


def _is(x: Value) -> Any:
    return x != 0


_OPERATIONS: dict[int, Callable[..., Value]] = {
    ca.OP_ASSIGN: lambda a: a,
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a - b,
    ca.OP_MUL: lambda a, b: a * b,
    ca.OP_DIV: lambda a, b: a / b,
    ca.OP_NEG: lambda a: -a,
    ca.OP_SQ: lambda a: a * a,
    ca.OP_TWICE: lambda a: 2 * a,
    ca.OP_INV: lambda a: 1 / a,
    ca.OP_POW: _dyntape.power,
    ca.OP_CONSTPOW: _dyntape.power,
    ca.OP_ATAN2: _dyntape.arctan2,
    ca.OP_FMOD: _dyntape.fmod,
    ca.OP_REMAINDER: _dyntape.remainder,
    ca.OP_COPYSIGN: _dyntape.copysign,
    ca.OP_HYPOT: _dyntape.hypot,
    ca.OP_FMIN: _dyntape.minimum,
    ca.OP_FMAX: _dyntape.maximum,
    ca.OP_FABS: _dyntape.abs,
    ca.OP_SQRT: _dyntape.sqrt,
    ca.OP_EXP: _dyntape.exp,
    ca.OP_EXPM1: _dyntape.expm1,
    ca.OP_LOG: _dyntape.log,
    ca.OP_LOG1P: _dyntape.log1p,
    ca.OP_SIN: _dyntape.sin,
    ca.OP_COS: _dyntape.cos,
    ca.OP_TAN: _dyntape.tan,
    ca.OP_ASIN: _dyntape.arcsin,
    ca.OP_ACOS: _dyntape.arccos,
    ca.OP_ATAN: _dyntape.arctan,
    ca.OP_SINH: _dyntape.sinh,
    ca.OP_COSH: _dyntape.cosh,
    ca.OP_TANH: _dyntape.tanh,
    ca.OP_ASINH: _dyntape.arcsinh,
    ca.OP_ACOSH: _dyntape.arccosh,
    ca.OP_ATANH: _dyntape.arctanh,
    ca.OP_ERF: _dyntape.erf,
    ca.OP_FLOOR: _dyntape.floor,
    ca.OP_CEIL: _dyntape.ceil,
    ca.OP_SIGN: _dyntape.sign,
    ca.OP_LT: lambda a, b: _truth(a < b),
    ca.OP_LE: lambda a, b: _truth(a <= b),
    ca.OP_EQ: lambda a, b: _truth(a == b),
    ca.OP_NE: lambda a, b: _truth(a != b),
    ca.OP_NOT: lambda a: where(_is(a), 0.0, 1.0),
    ca.OP_AND: lambda a, b: where(_is(a), _truth(_is(b)), 0.0),
    ca.OP_OR: lambda a, b: where(_is(a), 1.0, _truth(_is(b))),
    ca.OP_IF_ELSE_ZERO: lambda a, b: where(_is(a), b, 0.0),
    ca.OP_LIFT: lambda a, b: a,
}
