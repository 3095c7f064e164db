# SPDX-License-Identifier: BSD-3-Clause
"""Which solver finds a motion, and what it does with guesses that lead nowhere."""

import dyntape
import numpy as np
import pytest


def pendulum():
    p = dyntape.Problem("pendulum", ["angle", "rate"], ["torque"], 2.0, lambda s: [s.x[1], s.u[0] - np.sin(s.x[0])])
    p.add_effort(1)
    p.start, p.goal = [0, 0], [np.pi, 0]
    return p


@pytest.mark.parametrize(
    "options, method", [({}, "riccati"), ({"method": "ipopt"}, "ipopt"), ({"hessian": "limited_memory"}, "ipopt")]
)
def test_the_method_of_a_solution(options, method):
    s = pendulum().solve(20, **options)
    assert s.success and s.method == method, s.verdict
    assert {a["method"] for a in s.attempts} == {method}


def test_limited_memory_is_not_for_riccati():
    with pytest.raises(dyntape.ArgumentError, match="limited"):
        pendulum().solve(20, method="riccati", hessian="limited_memory")


def test_an_unknown_method():
    with pytest.raises(dyntape.ArgumentError, match='expected "automatic", "riccati" or "ipopt", got "stages"'):
        pendulum().solve(20, method="stages")


def test_a_solution_says_how_it_was_found():
    p = dyntape.Problem("corner", ["x", "y"], ["u", "w"], 1.0, lambda s: [s.u[0], s.u[1]])
    p.start = [2, 2]
    p.add_cost("far", lambda s: -(s.x[0] ** 2 + s.x[1] ** 2), where="end")
    p.add_inequality("sum", lambda s: s.x[0] + s.x[1], upper=10, where="end")
    p.bound_states(0, 100)
    p.add_effort(1e-9)
    s = p.solve(20, refine=False)  # the start is symmetric, and so is the saddle point that it leads to
    assert s.success and s.method == "ipopt" and abs(s.cost + 100) < 1e-4
    assert [a["start"] for a in s.attempts][:2] == ["the guess", "beside a saddle point"]
    assert sum(a["iterations"] for a in s.attempts) == s.iterations
    assert len(s.multipliers["lower"]) == len(s.multipliers["upper"]) > s.x.size


@pytest.mark.parametrize("method, optimum", [("automatic", 3.907159), ("ipopt", 5.106343)])
def test_a_guess_through_the_middle_of_an_obstacle(method, optimum):
    # The straight line from start to goal passes the centre of the disc, where no side is nearer: every solve from there reaches its limit
    # of iterations.  Guesses beside the disc lead to the first optimum, by both methods.
    p = dyntape.Problem(
        "car", ["x", "y", "heading", "speed"], ["pull", "turn"], 5.0,
        lambda s: [s.x[3] * np.cos(s.x[2]), s.x[3] * np.sin(s.x[2]), s.u[0], s.u[1]],
    )  # fmt: skip
    p.bound_controls([-2, -1.5], [2, 1.5])
    p.bound_states([-50, -50, -20, -3], [50, 50, 20, 3])
    p.add_inequality("disc", lambda s: [(s.x[0] - 2.5) ** 2 + s.x[1] ** 2], lower=1)
    p.add_minimum_time()
    p.free_duration(0.5, 40)
    p.add_cost("effort", lambda s: 1e-2 * (s.u[0] ** 2 + s.u[1] ** 2))
    p.start, p.goal = [0, 0, 0, 0], [5, 0, 0, 0]
    s = p.solve(method=method)
    assert s.success and s.cost == pytest.approx(optimum, abs=1e-4) and s.iterations < 2000, s.verdict
