# SPDX-License-Identifier: BSD-3-Clause
"""Recorded functions: values and derivatives of Python code, decisions, dynamics as parts, compilation."""

import copy
import math
import pickle
import time
from concurrent.futures import ThreadPoolExecutor

import dyntape
import numpy as np
import pytest
from conftest import states


def rosenbrock(x, p):
    return (100 * (x[1:] - x[:-1] ** 2) ** 2 + (p[0] - x[:-1]) ** 2).sum()


def rosenbrock_slope(x, p):
    g = np.zeros_like(x)
    inner = x[1:] - x[:-1] ** 2
    g[:-1] = -400 * inner * x[:-1] - 2 * (p[0] - x[:-1])
    g[1:] += 200 * inner
    return g


def test_value_and_derivatives(random):
    f = dyntape.record(rosenbrock, 6, 1)
    x, p = random.normal(size=(11, 6)), np.array([1.3])
    np.testing.assert_allclose(f(x, p), [rosenbrock(row, p) for row in x], rtol=1e-14)
    np.testing.assert_allclose(f.jacobian(x, p), [rosenbrock_slope(row, p) for row in x], rtol=1e-12)
    H, h = f.hessian(x, p), 1e-6
    for k in range(6):
        step = h * np.eye(6)[k]
        np.testing.assert_allclose((f.jacobian(x + step, p) - f.jacobian(x - step, p)) / (2 * h), H[..., k], atol=1e-4)
    assert np.array_equal(H, np.swapaxes(H, 1, 2))


def test_shapes_are_those_of_the_function():
    for shape in ((), (1,), (3,), (2, 2), (0,)):
        f = dyntape.record(lambda x, shape=shape: np.full(shape, 2.0) * x[0] if shape else 2 * x[0], 2)
        assert f.shape == shape
        assert f(np.zeros(2)).shape == shape
        assert f(np.zeros((5, 4, 2))).shape == (5, 4, *shape)
        assert f.jacobian(np.zeros((5, 4, 2))).shape == (5, 4, *shape, 2)


def test_sparse_and_dense_agree(random):
    f = dyntape.record(lambda x: np.sin(x[:-1]) * x[1:], 8)
    x, w = random.normal(size=8), random.normal(size=7)
    assert np.array_equal(f.jacobian(x, sparse=True).toarray(), f.jacobian(x))
    H = f.hessian(x, weights=w, sparse=True)
    assert np.array_equal(H.toarray(), f.hessian(x, weights=w))
    assert f.jacobian(x, sparse=True).nnz == 14 == len(f.jacobian_pattern[0])
    batch = random.normal(size=(3, 8))
    rows, cols = f.jacobian_pattern
    assert np.array_equal(f.jacobian_values(batch), f.jacobian(batch)[:, rows, cols])
    with pytest.raises(dyntape.ArgumentError, match="expected one state"):
        f.jacobian(batch, sparse=True)
    with pytest.raises(dyntape.ArgumentError, match="expected weights"):
        f.hessian(x)


UNARY = "sqrt cbrt sin cos tan arcsin arccos arctan sinh cosh tanh arcsinh arctanh exp expm1 log log1p log10 abs floor"


@pytest.mark.parametrize("name", UNARY.split())
def test_ufuncs_on_recorded_values(name):
    f = dyntape.record(lambda x: getattr(np, name)(x), 3)
    x = np.array([0.2, 0.5, 0.9])
    np.testing.assert_allclose(f(x), getattr(np, name)(x), rtol=1e-14)


def test_numpy_computes_with_recorded_values(random):
    M, b = random.normal(size=(3, 4)), random.normal(size=3)

    def g(x):
        y = M @ x + b
        y = np.concatenate([y, x[:1] / 2, [1.0]])
        return [np.linalg.norm(y), y.dot(y), np.hypot(y[0], 2.0), np.arctan2(1.0, y[1]), np.prod(y), 2 ** x[0],
                np.float64(3) * x[1] - np.int64(1) + x.mean(), np.power(x[0], 3), (x[:, None] * x).trace()]

    f, x = dyntape.record(g, 4), np.array([0.4, 0.7, 0.1, 0.9])
    np.testing.assert_allclose(f(x), np.array(g(x), dtype=float), rtol=1e-13)


def test_decisions_record_both_sides(random):
    f = dyntape.record(lambda x: np.where((x > 0) & (x < 1), x**2, np.maximum(-x, 3)), 5)
    x = np.array([-5.0, -1, 0.5, 0.9, 2])
    np.testing.assert_array_equal(f(x), np.where((x > 0) & (x < 1), x**2, np.maximum(-x, 3)))
    np.testing.assert_array_equal(np.diag(f.jacobian(x)), [-1, 0, 1, 1.8, 0])
    g = dyntape.record(lambda x: dyntape.where(~(x[0] <= x[1]) | (x[1] == 2), np.minimum(x[0], x[1]), 7.0), 2)
    assert [g(x) for x in ([1.0, 3], [3, 1.0], [0, 2])] == [7, 1, 0]


def test_decisions_on_single_numbers_record_both_sides():
    cases = [
        lambda x: np.where(x[0] > 0, x[0]**2, 0.0),
        lambda x: np.where(x[0] <= x[1], np.where(x[1] < 0, 1.0, x[0]), -x[1]),
        lambda x: np.where((x[0] > 0) & (x[1] > 0), x, 3.0).sum(),
        lambda x: np.where(~(x[0] > 0) | (x[1] == 2), 1.0, x[1]),
        lambda x: np.where(np.logical_and(x[0] > 0, np.logical_not(x[1] > 0)), x[0], 5.0),
        lambda x: np.where(np.logical_or(x[0] > 0, x[1] > 0) ^ (x[0] > 0), x[0], 5.0),
        lambda x: np.where(np.True_ & (x[0] > 0), x[0], x[1]),
        lambda x: np.where(np.squeeze(x[:1]) != -1, x[0], x[1]),
        lambda x: np.where(x[0] > 0, np.float64(2), np.array(3.0)),
        lambda x: np.select([x[0] > 1, x[0] > 0], [x[1], x[0]**2], default=7.0),
        lambda x: np.clip(x[0], -1, x[1]) + np.clip(x[1], None, 0.5) + np.clip(2.0, x[0], None),
        lambda x: np.maximum(x[0], 0) + np.minimum(x[1], 0.5) + np.abs(x[0]) + np.sign(x[1]),
    ]
    points = [np.array(p) for p in ([-1.0, -2], [-1, 2], [3, -1], [2, 3], [0.5, 2], [0, 0])]
    for number, case in enumerate(cases):
        f = dyntape.record(case, 2)
        for x in points:
            np.testing.assert_array_equal(f(x), case(x), err_msg=f"case {number} at {x}")
    f = dyntape.record(lambda x: np.where(x[0] > 0, x[0]**2, 0.0), 1)
    assert [f.jacobian([x])[0] for x in (-1.0, 2)] == [0, 4]
    assert [f.hessian([x])[0, 0] for x in (-1.0, 2)] == [0, 2]


def test_an_if_stays_a_guard():
    f = dyntape.record(lambda x: x[0]**2 if x[0] > 0 else 0.0, 1)
    assert f([2.0]) == 4
    with pytest.raises(dyntape.GuardViolation, match="test_functions.py"):
        f([-1.0])


def test_squared_norms_are_smooth():
    for square in (lambda x: np.linalg.norm(x)**2, lambda x: np.linalg.norm(x) * np.linalg.norm(x),
                   lambda x: np.linalg.norm(x[None, :], axis=1)[0]**2, lambda x: 2 * np.linalg.norm(x) * np.linalg.norm(x) / 2):
        f = dyntape.record(square, 3)
        for x in (np.zeros(3), np.array([0.0, -2, 1])):
            np.testing.assert_allclose(f(x), x @ x, rtol=1e-15)
            np.testing.assert_allclose(f.jacobian(x), 2 * x, rtol=1e-15)
            np.testing.assert_allclose(f.hessian(x), 2 * np.eye(3), atol=1e-15)


def test_smoothed_norms_and_quotients():
    s = 0.25
    f = dyntape.record(lambda x: dyntape.norm(x, s), 3)
    g = dyntape.record(lambda x: dyntape.safe_divide(x[0], x[1], s), 2)
    for x in (np.zeros(3), np.array([0.3, -0.4, 1.2])):
        r = np.sqrt(x @ x + s * s)
        np.testing.assert_allclose(f(x), dyntape.norm(x, s), rtol=1e-15)
        np.testing.assert_allclose(f.jacobian(x), x / r, rtol=1e-14)
        np.testing.assert_allclose(f.hessian(x), (np.eye(3) - np.outer(x, x) / r**2) / r, atol=1e-14)
    for a, b in ((3.0, 0.0), (2.0, -0.5)):
        d = b * b + s * s
        slope, curvature = (s * s - b * b) / d**2, 2 * b * (b * b - 3 * s * s) / d**3
        np.testing.assert_allclose(g([a, b]), a * b / d, rtol=1e-14)
        np.testing.assert_allclose(dyntape.safe_divide([a], b, s), [a * b / d], rtol=1e-14)
        np.testing.assert_allclose(g.jacobian([a, b]), [b / d, a * slope], rtol=1e-13)
        np.testing.assert_allclose(g.hessian([a, b]), [[0, slope], [slope, a * curvature]], atol=1e-11)
    with pytest.raises(dyntape.ArgumentError, match="smoothing"):
        dyntape.norm(np.ones(2), 0.0)


def test_a_start_without_a_slope_says_what_to_write():
    p = dyntape.Problem("point", ["x", "y"], ["u", "w"], 1.0, lambda s: [s.u[0], s.u[1]])
    p.start = [0, 0]
    p.add_cost("far", lambda s: np.linalg.norm(s.x))
    with pytest.raises(dyntape.NumericalError, match=r"test_functions.py:\d+: sqrt of 0 has no slope.*; write norm\(v, smoothing\)"):
        p.solve(4)
    p = dyntape.Problem("point", ["x"], ["u"], 1.0, lambda s: [s.u[0]])
    p.start = [0]
    p.add_cost("ratio", lambda s: s.u[0] / s.x[0])
    with pytest.raises(dyntape.NumericalError, match=r"write safe_divide\(a, b, smoothing\)"):
        p.solve(4)


def test_matrices_leave_no_guards(panda, random):
    A, b = random.normal(size=(4, 4)), random.normal(size=(4, 2))
    spd = A @ A.T + np.eye(4)
    f = dyntape.record(lambda x: dyntape.symmetric_solve(spd * x[0] + np.diag(x), b), 4)
    x = np.array([1.0, 0.4, 0.7, 2.0])
    np.testing.assert_allclose(f(x), np.linalg.solve(spd * x[0] + np.diag(x), b), rtol=1e-12)
    g = dyntape.record(lambda x: np.linalg.cholesky(panda.crba(x)), 7)
    q = panda.random(seed=8)
    np.testing.assert_allclose(g(q), np.linalg.cholesky(panda.crba(q)), rtol=1e-11, atol=1e-13)
    h = dyntape.record(lambda x: np.clip(x, -1.0, 0.5), 3)
    np.testing.assert_array_equal(h([-3.0, 0.2, 4]), [-1, 0.2, 0.5])
    with pytest.raises(dyntape.ArgumentError, match="np.linalg.solve of recorded values"):
        dyntape.record(lambda x: np.linalg.solve(np.diag(x), x), 3)
    with pytest.raises(dyntape.ArgumentError, match=r"expected a matrix \(n, n\)"):
        dyntape.record(lambda x: dyntape.symmetric_solve(x, x), 3)


def test_a_branch_is_a_guard_with_its_line():
    def h(x):
        if x[0] > 0.1:  # this line
            return x[0] * 2
        return -x[0]

    f = dyntape.record(h, 1)
    assert f([3.0]) == 6
    line = h.__code__.co_firstlineno + 1
    with pytest.raises(dyntape.GuardViolation, match=rf"test_functions\.py:{line} was true"):
        f([-1.0])
    with pytest.raises(dyntape.GuardViolation, match="at point 1"):
        f([[2.0], [-1.0]])
    assert dyntape.record(h, 1, x0=[-1.0])([-2.0]) == 2
    with pytest.raises(dyntape.RecordingError, match=rf"test_functions\.py:{line}"):
        dyntape.record(h, 1, branches="error")


def test_compiled_code_has_the_same_bits(random):
    f = dyntape.record(rosenbrock, 6, 1)
    x, p = random.normal(size=(133, 6)), random.normal(size=(133, 1))
    before = f(x, p), f.jacobian(x, p), f.hessian(x, p)
    assert not f.is_compiled and "interpreted" in repr(f)
    assert f.compile(lanes=True) is f and f.is_compiled
    for a, b in zip(before, (f(x, p), f.jacobian(x, p), f.hessian(x, p))):
        assert np.array_equal(a, b)
    g = dyntape.record(rosenbrock, 6, 1).compile(order=1)
    assert np.array_equal(g.hessian(x, p), before[2])  # beyond what was compiled the interpreter serves


def test_what_takes_numbers_alone_says_what_to_use():
    def written(x):
        y = np.zeros(1)
        y[0] = x[0]
        return y

    for f in (lambda x: math.sin(x[0])), written:
        with pytest.raises(dyntape.RecordingError, match="expected numpy's functions"):
            dyntape.record(f, 1)
    assert dyntape.record(lambda x: x * math.sin(np.asarray(2.0)), 1)([1.0])[0] == math.sin(2.0)


def test_every_route_has_the_same_bits(random):
    x, p = random.normal(size=(40, 6)), random.normal(size=(40, 1))
    before = dyntape.record(rosenbrock, 6, 1).hessian(x, p)
    for route in "tiered", "machine-code", "compiled":
        f = dyntape.record(rosenbrock, 6, 1).compile(route=route)
        assert f.is_compiled and np.array_equal(f.hessian(x, p), before)
    with pytest.raises(dyntape.ArgumentError, match='got "gcc"'):
        f.compile(route="gcc")


def test_portable_functions_differ_in_the_last_bit_at_most(random):
    x = random.normal(size=(500, 3))
    of_libm, portable = (dyntape.record(lambda x: np.sin(x) * np.cos(x[::-1]), 3).compile(route="compiled", functions=functions)
                         for functions in ("libm", "portable"))
    a, b = of_libm(x), portable(x)
    assert not np.array_equal(a, b)
    assert np.abs(a - b).max() < 4e-16
    alone = np.array([portable(one) for one in x])
    assert np.array_equal(alone, b) and np.array_equal(portable.compile(lanes=True, functions="portable")(x), b)
    by_default = dyntape.record(lambda x: np.sin(x) * np.cos(x[::-1]), 3)
    assert np.array_equal(by_default(x), b) and np.array_equal(by_default.compile(route="compiled")(x), b)
    with pytest.raises(dyntape.ArgumentError, match='functions "sleef" do not exist; there are sines, libm and portable'):
        portable.compile(functions="sleef")


def test_robots_inside(panda, random):
    n = 7

    def power(x, p):
        q, v, a = x[:n], x[n : 2 * n], x[2 * n :]
        return panda.rnea(q, v, a) @ v * p[0]

    f = dyntape.record(power, 3 * n, 1)
    q, v, a = states(panda, random, 4)
    x = np.concatenate([q, v, a], axis=1)
    np.testing.assert_allclose(f(x, [2.0]), 2 * (panda.rnea(q, v, a) * v).sum(1), rtol=1e-13)
    d = panda.id_derivatives(q, v, a)
    np.testing.assert_allclose(f.jacobian(x, [1.0])[:, :n], np.einsum("bij,bi->bj", d.dtau_dq, v), atol=1e-12)
    h, step = 1e-6, 1e-6 * np.eye(3 * n)[2]
    by_differences = (f.jacobian(x + step, [1.0]) - f.jacobian(x - step, [1.0])) / (2 * h)
    np.testing.assert_allclose(f.hessian(x, [1.0])[:, 2], by_differences, atol=1e-6)


def test_any_function_of_a_robot_inside(solo, random):
    q = solo.random(seed=5)
    f = dyntape.record(lambda x: solo.frame_placement(x, frame=solo.frames[-1]).p, solo.nq)
    np.testing.assert_allclose(f(q), solo.frame_placement(q, frame=solo.frames[-1]).p, rtol=1e-13, atol=1e-15)
    with pytest.raises(dyntape.ArgumentError, match="a route is for numbers"):
        dyntape.record(lambda x: solo.crba(x, route="tape"), solo.nq)


def test_functions_inside_functions(random):
    inner = dyntape.record(lambda x, p: np.array([x[0] * p[0], np.sin(x[1])]), 2, 1)
    outer = dyntape.record(lambda x: inner(x[:2], x[2:]).sum() * x[2], 3)
    x = random.normal(size=(5, 3))
    np.testing.assert_allclose(outer(x), inner(x[:, :2], x[:, 2:]).sum(1) * x[:, 2], rtol=1e-14)
    expected = (inner(x[:, :2], x[:, 2:]).sum(1) + x[:, 0] * x[:, 2])[:, None]
    np.testing.assert_allclose(outer.jacobian(x)[:, 2:], expected, rtol=1e-13)


def test_content_not_names(random):
    one, other = (dyntape.record(lambda x: x[0] * x[1] + 1, 2, name=name) for name in ("one", "other"))
    assert one.content_hash == other.content_hash != dyntape.record(lambda x: x[0] * x[1], 2).content_hash
    assert "Mul" in one.to_text()


def test_copies_have_the_same_content(panda, random):
    f = dyntape.record(rosenbrock, 6, 1)
    x, p = random.normal(size=(20, 6)), [1.5]
    for twin in (pickle.loads(pickle.dumps(f)), copy.copy(f), copy.deepcopy(f)):
        assert twin.content_hash == f.content_hash and twin.name == f.name and twin.shape == f.shape
        for a, b in ((twin(x, p), f(x, p)), (twin.jacobian(x, p), f.jacobian(x, p)), (twin.hessian(x, p), f.hessian(x, p))):
            assert np.array_equal(a, b)
    guarded = pickle.loads(pickle.dumps(dyntape.record(lambda x: x[0] if x[0] > 0 else -x[0], 1)))
    with pytest.raises(dyntape.GuardViolation, match="test_functions.py"):
        guarded([-1.0])
    g = dyntape.record(lambda x: panda.rnea(x[:7], x[7:14], x[14:]), 21)
    y = random.normal(size=(4, 21))
    assert np.array_equal(pickle.loads(pickle.dumps(g))(y), g(y))
    np.testing.assert_allclose(pickle.loads(pickle.dumps(g)).jacobian(y), g.jacobian(y), atol=1e-11)


def test_damaged_pickles_are_refused():
    f = dyntape.record(rosenbrock, 3, 1)
    state = list(f.__getstate__())
    for place, damaged in [(0, 99), (3, (2,)), (4, ["Sine"] * len(state[4])), (5, state[5][::-1]), (6, b""), (7, [10**6])]:
        broken = dyntape.Function.__new__(dyntape.Function)
        with pytest.raises(dyntape.ArgumentError, match="a pickled function"):
            broken.__setstate__(tuple([*state[:place], damaged, *state[place + 1 :]]))


def test_what_goes_wrong_says_so():
    with pytest.raises(ZeroDivisionError):  # what the function raises passes through
        dyntape.record(lambda x: 1 / 0, 1)
    with pytest.raises(dyntape.ArgumentError, match="expected recorded values and numbers, got <class 'str'>"):
        dyntape.record(lambda x: ["a"], 1)
    kept = []
    dyntape.record(lambda x: (kept.append(x[0]), x[0])[1], 1)
    with pytest.raises(dyntape.RecordingError, match="after its recording has ended"):
        kept[0] * 2.0
    with pytest.raises(TypeError):
        kept[0] * "two"
    f = dyntape.record(lambda x, p: x[0] * p[0], 1, 1)
    with pytest.raises(dyntape.ArgumentError, match="expected p"):
        f([1.0])
    with pytest.raises(dyntape.ArgumentError, match="without parameters"):
        dyntape.record(lambda x: x, 1)([1.0], [2.0])
    with pytest.raises(dyntape.ArgumentError, match="the recording point has 2 variables"):
        dyntape.record(lambda x: x, 1, x0=[1.0, 2.0])
    with pytest.raises(TypeError):
        float(dyntape.record(lambda x: x, 1))
    with pytest.raises(dyntape.RecordingError):  # a recorded value is no number
        dyntape.record(lambda x: float(x[0]), 1)


def test_threads_record_and_evaluate(random):
    def work(k):
        f = dyntape.record(lambda x: np.sin(x[0] * k) * x[1], 2)
        x = np.linspace(0, 1, 600).reshape(-1, 2)
        return np.allclose(f.jacobian(x)[:, 1], np.sin(x[:, 0] * k))

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(work, range(40)))


def test_the_default_is_as_quick_as_any_option(random):
    """Of many states, on the route that waits for no compiler."""
    def chain(q):
        for _ in range(30):
            q = np.sqrt(q * q + 1) * q[::-1] - q
        return q.sum()

    def seconds(f):
        best = np.inf
        for _ in range(20):
            begin = time.perf_counter()
            f(x)
            best = min(best, time.perf_counter() - begin)
        return best

    x = random.normal(size=(1000, 6))
    options = {}, {"lanes": False}, {"lanes": True}, {"functions": "portable"}, {"functions": "libm"}
    times = [seconds(dyntape.record(chain, 6).compile(0, route="machine-code", **how)) for how in options]
    assert times[0] < 1.5 * min(times)


def test_arrays_of_recorded_values_and_numbers():
    """numpy asks each entry for a method, which numbers lack."""
    x = [0.5, 2.0]
    for f, expected in (
        (lambda x: np.exp(dyntape.array([x[0], 2.0])), np.exp([0.5, 2.0])),
        (lambda x: np.sqrt(np.concatenate([x, [9.0]])), np.sqrt([0.5, 2.0, 9.0])),
        (lambda x: np.arctan2(dyntape.array([x[0], x[1]]), 1.0), np.arctan2(x, 1.0)),
        (lambda x: np.hypot(dyntape.array([x[0], 3.0]), 4.0), [np.hypot(0.5, 4.0), 5.0]),
        (lambda x: np.linalg.cholesky(dyntape.array([[x[0], 0], [0, x[1]]])), np.diag(np.sqrt(x))),
    ):
        np.testing.assert_allclose(dyntape.record(f, 2)(x), expected, rtol=1e-15)
    numbers = dyntape.array([[1, 2.5], [3, 4]])
    assert type(numbers) is np.ndarray and numbers.dtype == float
    with pytest.raises(dyntape.RecordingError, match="isfinite cannot be recorded"):
        dyntape.record(lambda x: np.isfinite(dyntape.array([x[0], 1.0])), 2)
