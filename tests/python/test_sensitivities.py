# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives of solutions and of controllers' plans by parameters and start, against solves at moved values and closed forms."""

import re

import dyntape
import numpy as np
import pytest


def solved(load=2.0, q0=0.0):
    """A mass moves by one metre in one second with the least integral of u^2."""
    p = dyntape.Problem("lift", ["q", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0] / s.p[0]], parameters={"load": [load]})
    p.start, p.goal = [q0, 0.0], [1.0, 0.0]
    p.add_squares("effort", lambda s: s.u)
    return p.solve(20, tolerance=1e-10)


def test_derivatives_are_those_of_moved_solves():
    solution = solved()
    by = solution.sensitivities()
    assert by.good and by.why == "" and len(by.parameters) == 1
    points = len(solution.t)
    assert by.dx_dp.shape == (points, 2, 1) and by.du_dp.shape == (points, 1, 1) and by.dcost_dp.shape == (1,)
    assert by.dx_dstart.shape == (points, 2, 2) and by.gain.shape == (1, 2)
    h = 1e-4
    more, less = solved(load=2 + h), solved(load=2 - h)
    assert by.dcost_dp[0] == pytest.approx((more.cost - less.cost) / (2 * h), rel=1e-6)
    assert by.du_dp[:, 0, 0] == pytest.approx((more.u[:, 0] - less.u[:, 0]) / (2 * h), rel=1e-5, abs=1e-6)
    more, less = solved(q0=h), solved(q0=-h)
    assert by.dcost_dstart[0] == pytest.approx((more.cost - less.cost) / (2 * h), rel=1e-6)
    assert by.du_dstart[:, 0, 0] == pytest.approx((more.u[:, 0] - less.u[:, 0]) / (2 * h), rel=1e-5, abs=1e-6)
    assert by.dx_dstart[:, 0, 0] == pytest.approx((more.x[:, 0] - less.x[:, 0]) / (2 * h), rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("scheme", ["euler", "trapezoid", "hermite-simpson", "radau-3"])
def test_every_control_of_every_scheme_has_its_derivative(scheme):
    def solved_by(load):
        p = dyntape.Problem(
            "lift", ["q", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0] / s.p[0] - 0.3 * s.x[0] ** 2], parameters={"load": [load]}
        )
        p.start, p.goal = [0.1, 0.2], [1.0, 0.0]
        p.add_squares("effort", lambda s: s.u)
        return p.solve(4, scheme=scheme, tolerance=1e-11)

    h = 1e-4
    by, more, less = solved_by(2.0).sensitivities(), solved_by(2 + h), solved_by(2 - h)
    assert by.good
    assert by.du_dp[:, 0, 0] == pytest.approx((more.u[:, 0] - less.u[:, 0]) / (2 * h), rel=1e-5, abs=1e-5)
    assert by.dx_dp[:, :, 0] == pytest.approx((more.x - less.x) / (2 * h), rel=1e-5, abs=1e-5)


def test_derivatives_are_those_of_the_closed_form():
    """u = load (6 - 12 t) d over a distance d; the cost is 12 load^2 d^2."""
    by = solved().sensitivities()
    assert by.dcost_dp[0] == pytest.approx(48.0, rel=1e-6)
    assert by.dcost_dstart[0] == pytest.approx(-96.0, rel=1e-6)
    assert by.gain[0, 0] == pytest.approx(-12.0, rel=1e-6)
    assert by.gain[0, 1] == pytest.approx(-8.0, rel=1e-6)
    assert by.du_dp[0, 0, 0] == pytest.approx(6.0, rel=1e-6)


# --- Of a controller's plan ---


def pendulum(load=1.0, limit=None):
    """Swings to an angle of 0.5; Gauss-Newton is not exact, as the residuals are neither zero nor linear."""
    p = dyntape.Problem(
        "pendulum", ["q", "v"], ["u"], 1.0, lambda s: [s.x[1], s.u[0] / s["load"][0] - 9.81 * np.sin(s.x[0])], parameters={"load": load}
    )
    p.add_parameter("target", [0.5, 0.0])
    p.add_squares("near", lambda s: [3 * np.sin(s.x[0] - s["target"][0]), 0.3 * (s.x[1] - s["target"][1])])
    p.add_squares("calm", lambda s: 0.1 * s.u)
    p.start = [0, 0]
    if limit:
        p.bound_controls(-limit, limit)
    return p


def controller(scheme="trapezoid", limit=None, **values):
    mpc = dyntape.Mpc(pendulum(limit=limit), intervals=12, scheme=scheme, tolerance=1e-11)
    for name, value in values.items():
        mpc.set_parameter(name, value)
    return mpc


def differences(change, h=1e-4):
    more, less = change(h), change(-h)
    return (more.x - less.x) / (2 * h), (more.u - less.u) / (2 * h), (more.cost - less.cost) / (2 * h)


def assert_differences(by_x, by_u, by_cost, change):
    x, u, cost = differences(change)
    assert by_x == pytest.approx(x, rel=1e-5, abs=2e-6)
    assert by_u == pytest.approx(u, rel=1e-5, abs=2e-5)
    assert by_cost == pytest.approx(cost, rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("scheme", ["euler", "trapezoid", "hermite-simpson", "radau-3"])
def test_a_plan_has_the_derivatives_of_moved_controllers(scheme):
    x = np.array([0.2, -0.3])
    mpc = controller(scheme)
    step = mpc.step(0.0, x)
    by = mpc.sensitivities()
    assert by.good and by.parameters == ["load", "target[0]", "target[1]"]
    points = len(step.t)
    assert by.dx_dp.shape == (points, 2, 3) and by.du_dp.shape == (points, 1, 3) and by.dcost_dp.shape == (3,)
    assert by.dx_dstart.shape == (points, 2, 2) and by.du_dstart.shape == (points, 1, 2) and by.gain.shape == (1, 2)
    assert by.gain == pytest.approx(by.du_dstart[0], rel=1e-9)
    changes = [
        lambda h: controller(scheme, load=1 + h).step(0.0, x),
        lambda h: controller(scheme, target=[0.5 + h, 0.0]).step(0.0, x),
        lambda h: controller(scheme, target=[0.5, h]).step(0.0, x),
    ]
    for k, change in enumerate(changes):
        assert_differences(by.dx_dp[:, :, k], by.du_dp[:, :, k], by.dcost_dp[k], change)
    for k in range(2):
        assert_differences(
            by.dx_dstart[:, :, k], by.du_dstart[:, :, k], by.dcost_dstart[k], lambda h, k=k: controller(scheme).step(0.0, x + h * np.eye(2)[k])
        )


def test_a_plan_at_limits_holds_its_controls_there():
    limit, x = 4.0, np.array([-0.6, 0.0])
    mpc = controller(limit=limit)
    step = mpc.step(0.0, x)
    by = mpc.sensitivities()
    held = step.u[:, 0] > limit - 1e-6
    assert by.good and held[0] and held.sum() >= 2 and not held.all()
    assert abs(by.du_dstart[held]).max() < 1e-9 and abs(by.gain).max() < 1e-9 and abs(by.du_dp[held]).max() < 1e-9
    for k in range(2):
        assert_differences(
            by.dx_dstart[:, :, k], by.du_dstart[:, :, k], by.dcost_dstart[k], lambda h, k=k: controller(limit=limit).step(0.0, x + h * np.eye(2)[k])
        )


def test_later_plans_and_parameters_of_time():
    """Of a later, warm-started step; times of a parameter are the plant's."""
    times = np.linspace(0, 3, 13)

    def stepped(x, offset=0.0):
        mpc = controller()
        mpc.set_parameter("target", np.stack([0.5 * np.sin(times) + offset, np.zeros_like(times)], axis=1), times)
        mpc.step(0.0, [0.0, 0.0])
        return mpc, mpc.step(0.4, x)

    x = np.array([0.1, 0.4])
    mpc, step = stepped(x)
    assert step.t[0] == 0.4
    by = mpc.sensitivities()
    assert by.good
    for k in range(2):
        assert_differences(
            by.dx_dstart[:, :, k], by.du_dstart[:, :, k], by.dcost_dstart[k], lambda h, k=k: stepped(x + h * np.eye(2)[k])[1]
        )
    assert_differences(by.dx_dp[:, :, 1], by.du_dp[:, :, 1], by.dcost_dp[1], lambda h: stepped(x, offset=h)[1])


def test_the_gain_of_a_linear_controller_is_riccatis():
    """x' = x + h (A x + B u), h (x' Q x + u' R u) each step: the recursion backwards over the horizon."""
    A, B = np.array([[0.0, 1.0], [-2.0, 0.3]]), np.array([[0.0], [1.5]])
    p = dyntape.Problem("linear", ["a", "b"], ["u"], 2.0, lambda s: A @ s.x + B @ s.u)
    p.add_squares("state", lambda s: [2.0 * s.x[0], 0.5 * s.x[1]])
    p.add_squares("control", lambda s: 0.7 * s.u)
    p.start = [0, 0]
    n = 25
    mpc = dyntape.Mpc(p, intervals=n, scheme="euler", gains=True)
    h, Q, R, P = 2.0 / n, np.diag([4.0, 0.25]), np.array([[0.49]]), np.zeros((2, 2))
    F, G = np.eye(2) + h * A, h * B
    for _ in range(n):
        K = -np.linalg.solve(h * R + G.T @ P @ G, G.T @ P @ F)
        P = h * Q + F.T @ P @ (F + G @ K)
    x = np.array([0.4, -1.0])
    step = mpc.step(0.0, x)
    by = mpc.sensitivities()
    assert by.good and by.parameters == [] and by.du_dp.shape == (n + 1, 1, 0)
    assert by.gain == pytest.approx(K, rel=1e-8)
    assert by.du_dstart[0] == pytest.approx(K, rel=1e-8)
    assert by.dcost_dstart == pytest.approx(2 * P @ x, rel=1e-8)
    assert step.u[0] == pytest.approx(K @ x, rel=1e-7)
    change = 1e-3 * np.array([1.0, -2.0])
    assert step.control(0.0, x + change) - step.control(0.0) == pytest.approx(by.gain @ change, rel=1e-6)  # the policy's own gain


def test_a_plan_that_is_no_solution_says_so():
    mpc = dyntape.Mpc(pendulum(), intervals=12, iterations=1)
    with pytest.raises(dyntape.ArgumentError, match="no plan yet"):
        mpc.sensitivities()
    mpc.step(0.0, [0.0, 0.0])
    assert mpc.sensitivities().good
    mpc.step(0.0, [1.5, 3.0])  # far away, one iteration
    by = mpc.sensitivities()
    assert not by.good and "not a solution" in by.status and by.why and np.isnan(by.gain).all()
    for _ in range(20):  # the iterations converge where the plant waits
        mpc.step(0.0, [1.5, 3.0])
    by = mpc.sensitivities()
    assert by.good
    moved = controller().step(0.0, [1.5, 3.0 + 1e-4]), controller().step(0.0, [1.5, 3.0 - 1e-4])
    assert by.gain[0, 1] == pytest.approx((moved[0].u[0, 0] - moved[1].u[0, 0]) / 2e-4, rel=1e-4)


def test_a_weakly_active_bound_is_at_its_bound():
    def rate(s):
        return [s.x[3] * np.cos(s.x[2]), s.x[3] * np.sin(s.x[2]), s.u[1], s.u[0]]

    p = dyntape.Problem("car", ["x", "y", "th", "v"], ["a", "w"], 5.0, rate)
    p.start, p.goal = [0, 0, 0, 0], [10, 0, 0, 0]
    p.add_squares("calm", lambda s: s.u)
    p.add_inequality("disc", lambda s: [(s.x[0] - a) ** 2 + (s.x[1] + b) ** 2 - 1 for a, b in ((3, -0.2), (7, 0.2))], 0)
    p.bound_controls(-5, 5)
    m = p.solve()
    said = m.sensitivities().why
    named = re.match(r'"([aw]) at point (\d+) .* rests on a bound', said)
    assert not named or abs(abs(m.u[int(named[2]), "aw".index(named[1])]) - 5) < 1e-2, said
