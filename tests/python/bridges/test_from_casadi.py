# SPDX-License-Identifier: BSD-3-Clause
"""Functions of CasADi's SX recorded by dyntape: values and derivatives against CasADi's own."""
import numpy as np
import pytest

import dyntape

ca = pytest.importorskip('casadi')
from dyntape.bridges import casadi as bridge  # noqa: E402

# Each on arguments in (0.1, 0.9), where all are defined and smooth.
UNARY = [ca.sin, ca.cos, ca.tan, ca.exp, ca.log, ca.sqrt, ca.asin, ca.acos, ca.atan, ca.sinh, ca.cosh, ca.tanh, ca.asinh, ca.atanh,
         lambda a: ca.acosh(1 + a), ca.fabs, ca.erf, ca.expm1, ca.log1p, lambda a: 1 / a, lambda a: -a, lambda a: a * a, lambda a: a ** 3,
         lambda a: a ** 0.7, ca.floor, ca.ceil, ca.sign]
BINARY = [lambda a, b: a + b, lambda a, b: a - b, lambda a, b: a * b, lambda a, b: a / b, lambda a, b: a ** b, ca.atan2, ca.hypot,
          ca.fmin, ca.fmax, ca.copysign, ca.fmod, lambda a, b: ca.if_else(a < b, a * a, b), lambda a, b: ca.if_else(a <= b, b, a),
          lambda a, b: ca.if_else(ca.logic_and(a > 0.2, ca.logic_not(b > 0.5)), a, b), lambda a, b: ca.if_else(ca.logic_or(a < 0, b < 0), a, 2 * b),
          lambda a, b: (a == b) + (a != b) * b]


def squashed(a):
    """Into (0.1, 0.9)."""
    return 0.5 + 0.4 * ca.sin(a)


def random_function(rng, n_x, n_y, operations):
    x = ca.SX.sym('x', n_x)
    values = [squashed(x[i]) for i in range(n_x)]
    for _ in range(operations):
        a, b = (values[rng.integers(len(values))] for _ in range(2))
        f = UNARY[rng.integers(len(UNARY))] if rng.random() < 0.5 else BINARY[rng.integers(len(BINARY))]
        values.append(squashed(f(a) if f in UNARY else f(a, b)))
    return x, ca.vertcat(*values[-n_y:])


def close(got, expected):
    expected = np.array(expected)
    return np.abs(np.asarray(got).reshape(expected.shape) - expected).max() <= 1e-13 * (1 + np.abs(expected).max())


def test_random_functions():
    rng = np.random.default_rng(11)
    for k in range(200):
        x, y = random_function(rng, int(rng.integers(1, 6)), int(rng.integers(1, 4)), int(rng.integers(1, 40)))
        f = bridge.function(ca.Function(f'f{k}', [x], [y]))
        weights = ca.DM(rng.standard_normal(y.shape[0]))
        exact = ca.Function('e', [x], [y, ca.jacobian(y, x), ca.hessian(ca.dot(weights, y), x)[0]])
        at = rng.uniform(-2, 2, x.shape[0])
        value, jacobian, hessian = exact(at)
        assert close(f(at), value), f'{k}, seed 11'
        assert close(f.jacobian(at), jacobian), f'{k}, seed 11'
        assert close(f.hessian(at, weights=np.array(weights)[:, 0]), hessian), f'{k}, seed 11'


def test_every_operation_alone():
    a, b = ca.SX.sym('a'), ca.SX.sym('b')
    for k, op in enumerate(UNARY + BINARY):
        y = op(a) if op in UNARY else op(a, b)
        f, expected = bridge.function(ca.Function('f', [a, b], [y])), ca.Function('f', [a, b], [y])
        for at in ([0.3, 0.8], [0.8, 0.3], [0.5, 0.5]):
            assert close(f(at), expected(*at)), (k, at)


def test_matrices_and_several_outputs():
    A, v = ca.SX.sym('A', 2, 3), ca.SX.sym('v', 3)
    product = bridge.function(ca.Function('f', [A, v], [A @ v]))
    rows = np.arange(6.0).reshape(2, 3)
    assert np.array_equal(product(np.concatenate([rows.ravel(), [1, 2, 3]])), rows @ [1, 2, 3])
    outer = bridge.function(ca.Function('f', [v], [v @ v.T]))
    assert outer.shape == (3, 3) and np.array_equal(outer([1, 2, 3]), np.outer([1, 2, 3], [1, 2, 3]))
    sparse = bridge.function(ca.Function('f', [v], [ca.diag(v), ca.SX(2, 1)]))
    assert np.array_equal(sparse([1, 2, 3]), [1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0])
    symmetric = ca.SX.sym('T', ca.Sparsity.lower(2))
    lower = bridge.function(ca.Function('f', [symmetric], [ca.sumsqr(symmetric)]))
    assert lower.n_x == 4 and lower([1, 9, 2, 3]) == 14


def test_batches_compiled_and_back():
    x = ca.MX.sym('x', 2)
    f = bridge.function(ca.Function('f', [x], [ca.sin(x[0]) * x[1]])).compile()
    states = np.random.default_rng(1).standard_normal((50, 2))
    assert np.allclose(f(states), np.sin(states[:, 0]) * states[:, 1], rtol=1e-15)
    assert close(f.casadi()(states[0]), f(states[0]))


def test_what_cannot_be_recorded_is_said():
    x = ca.SX.sym('x')
    with pytest.raises(dyntape.ArgumentError, match='no operation like .*OP_ERFINV'):
        bridge.function(ca.Function('f', [x], [ca.erfinv(x)]))
    free = ca.Function('f', [x], [x * ca.SX.sym('loose')], {'allow_free': True})
    with pytest.raises(dyntape.ArgumentError, match='free variables.*loose'):
        bridge.function(free)
    y = ca.MX.sym('y', 2)
    with pytest.raises(dyntape.ArgumentError, match='OP_CALL'):
        bridge.function(ca.Function('f', [y], [ca.interpolant('t', 'linear', [[0, 1]], [0, 1])(y[0])]))
