# SPDX-License-Identifier: BSD-3-Clause
"""What cannot be recorded, found or solved is told at once: what it is, and what to write instead."""

import inspect
import re

import numpy as np
import pytest

import dyntape
from dyntape import _messages

ARM = dyntape.load(dyntape.config_folder() / "robots" / "arm_2r.urdf")


def sentence_of(call, kind=dyntape.Error):
    with pytest.raises(kind) as error:
        call()
    assert "\n" not in str(error.value)
    return str(error.value)


NOT_RECORDED = [
    (lambda x: np.linalg.det(np.diag(x)), "np.linalg.det", "np.linalg.cholesky(a)"),
    (lambda x: np.linalg.det([[x[0], x[1]], [x[1], x[0]]]), "np.linalg.det", "np.linalg.cholesky(a)"),
    (lambda x: np.linalg.solve([[x[0], 0.0], [0.0, x[1]]], [1.0, 2.0]), "np.linalg.solve", "symmetric_solve"),
    (np.median, "np.median cannot", "np.mean"),
    (np.sort, "np.sort cannot", "np.minimum"),
    (lambda x: np.interp(x[0], [0.0, 1.0], [0.0, 2.0]), "np.interp cannot", "np.where"),
    (lambda x: np.interp(x, [0.0, 1.0], [0.0, 2.0]), "np.interp cannot", "np.where"),
    (lambda x: np.sum(x, where=x > 0), "add with where= cannot", "np.where(condition, x, 0)"),
    (lambda x: np.sum(x, where=np.array([True, False])), "add with where= cannot", "x[mask]"),
    (lambda x: x[x > 0], "an index needs integers", "np.where(condition, a, b)"),
    (lambda x: np.sin(np.array([x[0], 1.0])), "np.sin", "dyntape.array"),
    (lambda x: f"{x[0]:.3f}", "format '.3f' of a recorded value", ".value"),
]


@pytest.mark.parametrize("f, what, instead", NOT_RECORDED)
def test_what_cannot_be_recorded_says_what_to_write(f, what, instead):
    sentences = [sentence_of(lambda: dyntape.Problem("p", ["a", "b"], [], 1.0, lambda s: f(s.x)))]
    if f not in (np.median, np.sort):  # which leave guards where these are allowed
        sentences.append(sentence_of(lambda: dyntape.record(f, 2, x0=[0.5, 2.0])))
    for sentence in sentences:
        assert what in sentence and instead in sentence and "expected" in sentence


def test_an_error_of_the_users_own_keeps_its_cause():
    with pytest.raises(IndexError, match="my own"):
        dyntape.record(lambda x: [][IndexError("my own").args and exec("raise IndexError('my own')")], 1)
    with pytest.raises(dyntape.RecordingError) as error:
        dyntape.record(lambda x: x[x > 0], 1)
    assert isinstance(error.value.__cause__, IndexError)


def test_a_plain_format_shows_the_value_at_the_recording_point():
    shown = []
    dyntape.record(lambda x: (shown.append(f"{x[0]}"), shown.append(f"{x[0].value:.2f}"), x)[2], 1, x0=[0.25])
    assert shown == ["AD(0.25, recorded)", "0.25"]


def test_sinc_of_arrays_and_of_single_values_is_that_of_numpy():
    x = np.linspace(-2, 2, 81)
    for sinc in (np.sinc, lambda x: [np.sinc(one) for one in x]):
        np.testing.assert_allclose(dyntape.record(sinc, 81)(x), np.sinc(x), atol=1e-15)
    f = dyntape.record(lambda x: np.sinc(x[0]), 1)
    np.testing.assert_allclose(f.hessian([0.0]), [[-(np.pi**2) / 3]], rtol=1e-12)
    g = dyntape.record(lambda x: np.where(x, 1 / np.where(x, x, 1.0), 7.0), 2)  # a number is a condition unless it is zero
    np.testing.assert_array_equal(g([0.0, 2.0]), [7.0, 0.5])


def test_none_among_numbers_is_told_what_is_free():
    p = ARM.problem(1)
    for wrong in ([0.1, None], np.array([0.1, None])):
        assert sentence_of(lambda: p.end_at(wrong)) == "q: expected numbers, got None among them; NaN is an entry that is free"


def test_remainders_are_those_of_numpy():
    values = [-7.5, -3.0, -2.0, -0.4, -0.0, 0.0, 0.4, 2.0, 3.0, 7.5, 1e9]
    a, b = (m.ravel() for m in np.meshgrid(values, [v for v in values if v != 0]))
    n = len(a)
    both = np.concatenate([a, b])
    for remainder, quotient in (
        (lambda x: x[:n] % x[n:], lambda x: x[:n] // x[n:]),
        (lambda x: np.mod(x[:n], x[n:]), lambda x: np.floor_divide(x[:n], x[n:])),
    ):
        np.testing.assert_array_equal(dyntape.record(remainder, 2 * n)(both), a % b)
        np.testing.assert_array_equal(dyntape.record(quotient, 2 * n)(both), a // b)
    f = dyntape.record(lambda x: [5.0 % x[0], x[1] % 3, np.float64(7) % x[0]], 2)
    np.testing.assert_array_equal(f([-2.0, -1.0]), [5.0 % -2.0, -1.0 % 3, 7.0 % -2.0])
    np.testing.assert_allclose(f.jacobian([-2.0, -1.0]), [[3.0, 0.0], [0.0, 1.0], [4.0, 0.0]])


def test_functions_that_return_nothing_are_named():
    def nothing(x):
        x * x

    assert sentence_of(lambda: dyntape.record(nothing, 1)).startswith("nothing: the function returned None; expected")
    p = ARM.problem(1)
    assert sentence_of(lambda: p.add_cost("effort", lambda s: None)).startswith("effort: the function returned None")
    assert "p: rate: the function returned None" in sentence_of(lambda: dyntape.Problem("p", ["a"], [], 1.0, lambda s: None))


def test_wrong_numbers_of_terms_are_told_at_once():
    p = ARM.problem(1)
    nan = float("nan")
    assert sentence_of(lambda: p.add_squares("q", lambda s: s.q, weight=-1)) == 'add_squares("q"): weight is -1; expected zero or more'
    for name in ("add_effort", "add_accelerations", "add_minimum_time"):
        assert sentence_of(lambda: getattr(p, name)(nan)) == f"{name}: weight is nan; expected zero or more"
    p.add_effort()
    assert 'two terms are called "control"; expected another name' in sentence_of(p.add_effort)
    p.add_cost("q", lambda s: s.q[0])
    for add in (p.add_cost, p.add_squares, p.add_equality):
        assert 'two terms are called "q"' in sentence_of(lambda: add("q", lambda s: s.q[0]))
    assert 'no parameter "mas"; the problem has none' in sentence_of(lambda: p.set_parameter("mas", 1))
    p.add_parameter("mass", 1)
    assert sentence_of(lambda: p.set_parameter("wind", 1)).endswith("valid are 'mass'")
    assert "did you mean 'mass'?" in sentence_of(lambda: p.add_cost("m", lambda s: s["mas"][0]))


def test_intervals_are_checked_before_anything_else():
    p = ARM.problem(1)
    p.add_effort()
    for call in (p.solve, p.solve_ddp, p.ddp):
        assert sentence_of(lambda: call(0)) == "intervals is 0; expected 1 or more"
    assert sentence_of(lambda: dyntape.Mpc(p, intervals=-3)) == "intervals is -3; expected 1 or more"


def test_attributes_that_are_not_there_name_what_is():
    assert sentence_of(lambda: ARM.forward_dynamics, AttributeError) == "Robot has no 'forward_dynamics'; it is called aba here"
    assert sentence_of(lambda: ARM.frame_jacobien, AttributeError).endswith("did you mean 'frame_jacobian'?")
    assert not hasattr(ARM, "_repr_pdf_") and not hasattr(ARM, "nothing_like_it")
    for kind, words in _messages._NAMES_HERE.items():
        for here in words.values():
            for name in re.split(", | and ", here):
                assert hasattr(getattr(dyntape, kind), re.split(r"\W", name)[0]), (kind, here)
    p = ARM.problem(1)
    assert "did you mean 'add_effort'?" in sentence_of(lambda: p.add_efort(), AttributeError)


def block():
    p = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.add_squares("effort", lambda s: s.u)
    p.start = [0, 0]
    return p


@pytest.fixture(scope="module")
def results():
    p, config = block(), dyntape.config_folder()
    mpc = dyntape.Mpc(p)
    scene = dyntape.Scene(config / "scenes" / "pendulum.info")
    arm = ARM.problem(1)
    arm.add_effort()
    found = [p, mpc, mpc.step(0.0, [0.0, 0.1]), p.solve(10), p.solve_ddp(10), p.ddp(10), p.ddp(10).solve_batch(np.zeros((2, 2)))]
    found += [p.solve(10, tolerance=1e-10).sensitivities(), p.solve_ddp(10, sensitivities="cost"), ARM, arm, arm.solve(4), scene]
    found += [dyntape.simulate(scene), dyntape.Task(config / "tasks" / "block_move.info"), dyntape.record(lambda x: x, 1)]
    return [*found, dyntape.solve(config / "tasks" / "block_move.info"), ARM.nonzeros("rnea"), *dyntape.devices()]


def test_what_an_object_has_not_is_an_attribute_error(results):
    """hasattr, getattr with a default and inspect.getmembers work on every object."""
    refused = set()
    for result in results:
        names = {name for name, _ in inspect.getmembers(result)}
        refused |= {(type(result).__name__, name) for name in dir(type(result)) if name not in names and name[0] != "_"}
        assert getattr(result, "nothing_like_it", 3) == 3
    ddp = {("DdpSolution", name) for name in ("dx_dp", "du_dp", "dx_dstart", "du_dstart")}
    assert refused >= {("Solution", "q"), ("Solution", "v")} | ddp
    with pytest.raises(AttributeError, match="^q: only for a robot's problem; expected x$") as error:
        block().solve(4).q
    assert isinstance(error.value, dyntape.ArgumentError) and isinstance(error.value, dyntape.MissingError)
    assert "not asked for" in sentence_of(lambda: block().solve_ddp(4).dx_dp, AttributeError)
    assert "stage: q and v" in sentence_of(
        lambda: dyntape.Problem("p", ["a"], [], 1.0, lambda s: s.q), AttributeError)


def test_attributes_of_every_class_name_what_is_near(results):
    for result in results:
        kind = type(result).__name__
        name = next(word for word in dir(type(result)) if word[0] != "_" and len(word) > 3)
        wrong = name + "s_"
        for call in (lambda: getattr(result, wrong), lambda: setattr(result, wrong, 1)):
            assert sentence_of(call, AttributeError).startswith(f"{kind} has no {wrong!r}; did you mean '")
        values = [word for word in dir(type(result)) if word[0] != "_" and not callable(getattr(type(result), word))]
        far = sentence_of(lambda: result.zzz, AttributeError)
        assert far == f"{kind} has no 'zzz'" + (f"; it has {', '.join(values)}" if values else "")


def test_attributes_that_are_not_there_cannot_be_set():
    p = block()
    assert sentence_of(lambda: setattr(p, "gaol", [1, 0]), AttributeError) == "Problem has no 'gaol'; did you mean 'goal'?"
    p.goal = [1, 0]
    assert "no setter" in sentence_of(lambda: setattr(p, "terms", []), AttributeError)
    step = dyntape.Mpc(p).step(0.0, [0.0, 0.0])
    assert sentence_of(lambda: step.plan, AttributeError) == "MpcStep has no 'plan'; it is called t, x and u here"

    class Mine(dyntape.Problem):
        """Of a class of one's own, which has what it likes."""

    mine = Mine("p", ["a"], [], 1.0, lambda s: s.x)
    mine.note = "kept"
    assert mine.note == "kept" and "did you mean 'goal'?" in sentence_of(lambda: mine.gaol, AttributeError)


def test_ddp_has_the_verdict_of_other_solutions():
    p = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.add_squares("effort", lambda s: s.u)
    p.add_squares("end", lambda s: s.x - np.array([1.0, 0.0]), where="end")
    p.start = [0, 0]
    found = p.solve_ddp(20)
    assert found.success and found.verdict == "A local optimum was found and verified."
    assert p.solve_ddp(20, verify=False).verdict == "A local optimum was found; nothing was verified."
    assert p.solve_ddp(20, max_iterations=0).verdict == p.solve(20, max_iterations=0).verdict
    assert p.ddp(20).solve_batch(np.zeros((2, 2))).verdict == ["A local optimum was found; nothing was verified."] * 2


def test_a_limit_of_seconds_ends_tasks_and_problems_at_once():
    task = dyntape.solve(dyntape.config_folder() / "tasks" / "cart_pole_swing_up.info", set={"solver.max_seconds": 1e-9})
    p = dyntape.Problem("block", ["p", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.add_squares("effort", lambda s: s.u)
    p.start, p.goal = [0, 0], [1, 0]
    for solution in task, p.solve(max_seconds=1e-9):
        assert solution.iterations == 0 and solution.verdict.startswith("The limit on time was reached.")
