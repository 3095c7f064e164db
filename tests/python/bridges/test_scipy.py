# SPDX-License-Identifier: BSD-3-Clause
"""Recorded functions in SciPy and cyipopt, as docs/bridges.md has them; no bridge is needed."""

import dyntape
import numpy as np
import pytest
from conftest import page_section

pytest.importorskip("scipy")
from scipy.integrate import solve_ivp
from scipy.optimize import NonlinearConstraint, minimize


@pytest.fixture(scope="module")
def hand(panda):
    """The hand less a place within reach, of q."""
    return dyntape.record(lambda q: panda.frame_placement(q, frame="panda_hand").p - np.array([0.4, 0.3, 0.5]), 7)


@pytest.fixture(scope="module")
def from_rest(panda):
    rest = np.array([0, -0.5, 0, -2, 0, 1.5, 0.5])
    return dyntape.record(lambda q: ((q - rest) ** 2).sum(), 7), rest


def test_minimize_with_exact_derivatives(hand, from_rest):
    cost, rest = from_rest
    place = NonlinearConstraint(hand, 0, 0, jac=hand.jacobian, hess=lambda q, w: hand.hessian(q, weights=w))
    found = minimize(cost, rest, jac=cost.jacobian, hess=cost.hessian, method="trust-constr", constraints=place, options={"gtol": 1e-10})
    assert found.constr_violation < 1e-9
    multipliers = np.linalg.lstsq(hand.jacobian(found.x).T, cost.jacobian(found.x), rcond=None)[0]
    assert np.abs(cost.jacobian(found.x) - hand.jacobian(found.x).T @ multipliers).max() < 1e-6


def test_cyipopt_takes_the_same(hand, from_rest):
    cyipopt = pytest.importorskip("cyipopt")
    cost, rest = from_rest
    place = {"type": "eq", "fun": hand, "jac": hand.jacobian, "hess": lambda q, w: hand.hessian(q, weights=w)}
    found = cyipopt.minimize_ipopt(cost, rest, jac=cost.jacobian, hess=cost.hessian, constraints=place, tol=1e-10)
    assert found.success and np.abs(hand(found.x)).max() < 1e-9 and found.nit < 15


def test_stiff_integration_with_exact_jacobians(panda):
    damped = lambda z: np.concatenate([z[7:], panda.aba(z[:7], z[7:], -20 * z[7:])])
    rate = dyntape.record(damped, 14)
    z = np.concatenate([panda.random(seed=3), np.zeros(7)])
    exact = solve_ivp(lambda t, z: rate(z), (0, 0.5), z, method="Radau", jac=lambda t, z: rate.jacobian(z), rtol=1e-8, atol=1e-10)
    plain = solve_ivp(lambda t, z: damped(z), (0, 0.5), z, method="Radau", rtol=1e-8, atol=1e-10)
    assert exact.success and np.allclose(exact.y[:, -1], plain.y[:, -1], atol=1e-6)
    assert np.allclose(rate.jacobian(z)[:7, 7:], np.eye(7)) and exact.njev > 0


def test_the_page():
    names = {}
    exec(page_section("SciPy and cyipopt"), names)
    assert names["found"].success and names["motion"].success
