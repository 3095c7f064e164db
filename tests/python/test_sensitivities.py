# SPDX-License-Identifier: BSD-3-Clause
"""Derivatives of a solution by parameters and start, against solves at moved values and a closed form."""

import pytest

import dyntape


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
