# SPDX-License-Identifier: BSD-3-Clause
"""dyntape.bridges.crocoddyl: Crocoddyl's solver finds the same with our dynamics as with its own."""

import dyntape
import numpy as np
import pytest
from conftest import CONFIG, FINGERS, page_section

crocoddyl = pytest.importorskip("crocoddyl")
pinocchio = pytest.importorskip("pinocchio")
from dyntape.bridges import crocoddyl as dc

PANDA, SOLO = str(CONFIG / "robots" / "panda.urdf"), str(CONFIG / "robots" / "solo12.urdf")
START = np.array([0, -0.5, 0, -2, 0, 1.5, 0.5] + [0] * 7)
GOAL = np.array([1, 0.5, -0.5, -1.2, 0.5, 2, -0.5] + [0] * 7)


@pytest.fixture(scope="module")
def arm():
    whole = pinocchio.buildModelFromUrdf(PANDA)
    fingers = [whole.getJointId(name) for name in FINGERS]
    return crocoddyl.StateMultibody(pinocchio.buildReducedModel(whole, fingers, pinocchio.neutral(whole)))


@pytest.fixture(scope="module")
def literal():
    """Rotations as the file has them, as Pinocchio reads them."""
    return dyntape.load(PANDA, lock=FINGERS, snap=0)


def costs(state, nu, at_end, frame=None):
    weights = 2 * np.array([10.0] * state.nv + [0.1] * state.nv)
    total = crocoddyl.CostModelSum(state, nu)
    missed = crocoddyl.ResidualModelState(state, GOAL, nu)
    total.addCost("missed", crocoddyl.CostModelResidual(state, crocoddyl.ActivationModelWeightedQuad(weights), missed), 100 if at_end else 1)
    total.addCost("torques", crocoddyl.CostModelResidual(state, crocoddyl.ResidualModelControl(state, nu)), 2e-3)
    if frame:
        at = crocoddyl.ResidualModelFrameTranslation(state, state.pinocchio.getFrameId(frame), np.array([0.3, 0.2, 0.6]), nu)
        total.addCost("hand", crocoddyl.CostModelResidual(state, at), 5)
    return total


def solved(state, dynamics, steps=50):
    running = [crocoddyl.IntegratedActionModelEuler(dynamics(False), 1 / steps)] * steps
    problem = crocoddyl.ShootingProblem(START, running, crocoddyl.IntegratedActionModelEuler(dynamics(True), 0))
    solver = crocoddyl.SolverFDDP(problem)
    solver.th_stop = 1e-12
    controls = problem.quasiStatic([START] * steps)
    assert solver.solve(problem.rollout(controls), controls, 100, False)
    return solver


@pytest.mark.parametrize("frame", [None, "panda_hand"])
def test_the_arm_costs_the_same(arm, literal, frame):
    actuation = crocoddyl.ActuationModelFull(arm)
    of = lambda at_end: costs(arm, 7, at_end, frame)
    theirs = solved(arm, lambda at_end: crocoddyl.DifferentialActionModelFreeFwdDynamics(arm, actuation, of(at_end)))
    ours = solved(arm, lambda at_end: dc.ForwardDynamics(arm, literal, of(at_end)))
    assert ours.cost == pytest.approx(theirs.cost, rel=1e-9)
    assert np.allclose(np.array(ours.xs), np.array(theirs.xs), atol=1e-6)


def test_a_recorded_cost_is_the_same_cost(arm, literal):
    weights = np.array([10.0] * 7 + [0.1] * 7)

    def cost(scale):
        return dyntape.record(lambda z: scale * (weights * (z[:14] - GOAL) ** 2).sum() + 1e-3 * (z[14:] ** 2).sum(), 21)

    ours = solved(arm, lambda at_end: dc.ForwardDynamics(arm, literal, cost(100 if at_end else 1)))
    theirs = solved(arm, lambda at_end: dc.ForwardDynamics(arm, literal, costs(arm, 7, at_end)))
    assert ours.cost == pytest.approx(theirs.cost, rel=1e-9)


def test_a_floating_base_has_the_same_derivatives(random):
    model = pinocchio.buildModelFromUrdf(SOLO, pinocchio.JointModelFreeFlyer())
    state = crocoddyl.StateMultibody(model)
    actuation = crocoddyl.ActuationModelFloatingBase(state)
    total = crocoddyl.CostModelSum(state, actuation.nu)
    total.addCost("x", crocoddyl.CostModelResidual(state, crocoddyl.ResidualModelState(state, state.zero(), actuation.nu)), 1)
    theirs = crocoddyl.DifferentialActionModelFreeFwdDynamics(state, actuation, total)
    ours = dc.ForwardDynamics(state, dyntape.load(SOLO, base="floating", snap=0), total, actuation, route="analytic")
    x, u = np.concatenate([ours.robot.random(), random.normal(size=18)]), random.normal(size=actuation.nu)
    data = [model.createData() for model in (ours, theirs)]
    for model, results in zip((ours, theirs), data):
        model.calc(results, x, u)
        model.calcDiff(results, x, u)
    for name in "xout", "Fx", "Fu", "cost", "Lx", "Lu", "Lxx", "Luu":
        mine, other = (np.array(getattr(results, name)) for results in data)
        assert np.allclose(mine, other, rtol=1e-9, atol=1e-9 * max(1, np.abs(other).max())), name


def test_what_does_not_fit(arm, literal, solo):
    with pytest.raises(dyntape.ArgumentError, match="the state has nq 7"):
        dc.ForwardDynamics(arm, solo, costs(arm, 7, False))
    with pytest.raises(dyntape.ArgumentError, match=r"cost of \(21,\) entries"):
        dc.ForwardDynamics(arm, literal, dyntape.record(lambda z: z[0], 3))


def test_the_page():
    names = {}
    exec(page_section("Crocoddyl"), names)
    assert names["solver"].cost < 1
