# SPDX-License-Identifier: BSD-3-Clause
"""dyntape's forward dynamics as a model of Crocoddyl's.

    from dyntape.bridges import crocoddyl as dc
    model = crocoddyl.IntegratedActionModelEuler(dc.ForwardDynamics(state, robot, costs), 0.01)
"""

from __future__ import annotations

from typing import Any

import crocoddyl  # type: ignore[import-not-found, import-untyped, unused-ignore]
import numpy as np
import pinocchio  # type: ignore[import-not-found, import-untyped, unused-ignore]

from .. import ArgumentError, Function, Robot


class ForwardDynamics(crocoddyl.DifferentialActionModelAbstract):  # type: ignore[misc, unused-ignore]
    """A differential action model: accelerations by robot.aba, their derivatives by robot.fd_derivatives, and costs.

    state: a crocoddyl.StateMultibody.  robot: the same robot, a dyntape.Robot with the same joints in the same order.
    costs: a crocoddyl.CostModelSum, or a recorded function of (q, v, u) with one output, whose gradient and Hessian are
        exact; the latter for robots whose q has as many entries as v.
    actuation: a crocoddyl actuation model; by default u (nv,) are the torques, N m or N.
    route: of the robot's functions; "generated" is quickest and needs a C compiler once, "analytic" needs none.

    It takes the place of crocoddyl.DifferentialActionModelFreeFwdDynamics.  Crocoddyl calls Python models on one thread.

    Raises ArgumentError where robot, state and costs do not fit each other.

    >>> pinocchio_robot = pinocchio.buildModelFromUrdf("config/robots/pendulum.urdf")
    >>> state = crocoddyl.StateMultibody(pinocchio_robot)
    >>> cost = dyntape.record(lambda x: x[0] ** 2 + 0.1 * x[2] ** 2, 3)
    >>> model = dc.ForwardDynamics(state, dyntape.load("config/robots/pendulum.urdf"), cost)
    >>> data = model.createData()
    >>> model.calc(data, np.array([2.0, 0.0]), np.array([0.0]))
    >>> data.cost
    4.0
    """

    def __init__(self, state: Any, robot: Robot, costs: Any, actuation: Any = None, *, route: str = "generated") -> None:
        nu = actuation.nu if actuation is not None else robot.nv
        _check(state, robot, costs, nu)
        super().__init__(state, nu, 1 if isinstance(costs, Function) else costs.nr)
        self.robot, self.costs, self.actuation, self.route = robot, costs, actuation, route

    def createData(self) -> Data:
        """What results are written to, one for each use of the model."""
        return Data(self)

    def calc(self, data: Data, x: Any, u: Any = None) -> None:
        """Writes data.xout (nv,), accelerations, and data.cost; without u, the cost of x alone."""
        nq, robot = self.robot.nq, self.robot
        if u is not None:
            data.xout = robot.aba(x[:nq], x[nq:], self._torques(data, x, u), route=self.route)
        if isinstance(self.costs, Function):
            data.cost = float(np.sum(self.costs(np.concatenate([x, u if u is not None else np.zeros(self.nu)]))))
            return
        if data.kinematics:
            pinocchio.forwardKinematics(self.state.pinocchio, data.pinocchio, x[:nq], x[nq:])
            pinocchio.updateFramePlacements(self.state.pinocchio, data.pinocchio)
        self.costs.calc(data.costs, x, *(() if u is None else (u,)))
        data.cost = data.costs.cost

    def calcDiff(self, data: Data, x: Any, u: Any = None) -> None:
        """Writes data.Fx (nv, 2 nv), data.Fu (nv, nu) and the derivatives of the cost; without u, those by x alone."""
        nq, nv, robot = self.robot.nq, self.robot.nv, self.robot
        if u is not None:
            by_q, by_v, by_tau = robot.fd_derivatives(x[:nq], x[nq:], self._torques(data, x, u), route=self.route)
            data.by_q[:], data.by_v[:] = by_q, by_v
            if self.actuation is None:
                data.Fu = by_tau
            else:
                self.actuation.calcDiff(data.actuation, x, u)
                data.Fx += by_tau @ data.actuation.dtau_dx
                data.Fu = by_tau @ data.actuation.dtau_du
        if isinstance(self.costs, Function):
            z = np.concatenate([x, u if u is not None else np.zeros(self.nu)])
            gradient, hessian = np.reshape(self.costs.jacobian(z), -1), self.costs.hessian(z)
            data.Lx, data.Lu = gradient[: 2 * nv], gradient[2 * nv :]
            data.Lxx, data.Lxu, data.Luu = hessian[: 2 * nv, : 2 * nv], hessian[: 2 * nv, 2 * nv :], hessian[2 * nv :, 2 * nv :]
            return
        if data.kinematics:
            pinocchio.computeJointJacobians(self.state.pinocchio, data.pinocchio, x[:nq])
        self.costs.calcDiff(data.costs, x, *(() if u is None else (u,)))

    def quasiStatic(self, data: Data, x: Any, maxiter: int = 100, tol: float = 1e-9) -> Any:
        """(nu,) the controls that hold the robot at x at rest, by least squares."""
        tau = self.robot.gravity(x[: self.robot.nq])
        if self.actuation is None:
            return tau
        self.actuation.calc(data.actuation, x, np.zeros(self.nu))
        self.actuation.calcDiff(data.actuation, x, np.zeros(self.nu))
        return np.linalg.lstsq(np.reshape(data.actuation.dtau_du, (len(tau), -1)), np.asarray(tau), rcond=None)[0]

    def _torques(self, data: Data, x: Any, u: Any) -> Any:
        if self.actuation is None:
            return u
        self.actuation.calc(data.actuation, x, u)
        return data.actuation.tau


class Data(crocoddyl.DifferentialActionDataAbstract):  # type: ignore[misc, unused-ignore]
    """Results of a ForwardDynamics, and what Crocoddyl's costs and actuation keep between calls."""

    def __init__(self, model: ForwardDynamics) -> None:
        super().__init__(model)
        nv = model.robot.nv
        by_x = np.reshape(self.Fx, (nv, 2 * nv))  # a view, which may come with one axis
        self.by_q, self.by_v = by_x[:, :nv], by_x[:, nv:]
        self.actuation: Any = model.actuation.createData() if model.actuation is not None else None
        self.kinematics = False
        if not isinstance(model.costs, Function):
            self.pinocchio = pinocchio.Data(model.state.pinocchio)
            self.costs = model.costs.createData(crocoddyl.DataCollectorMultibody(self.pinocchio))
            self.costs.shareMemory(self)
            self.kinematics = any(_needs_kinematics(item.data().cost.residual) for item in model.costs.costs)


# Residuals that read nothing but x and u.
_OF_STATE = (crocoddyl.ResidualModelState, crocoddyl.ResidualModelControl)


def _needs_kinematics(residual: Any) -> bool:
    return not isinstance(residual, _OF_STATE)


def _check(state: Any, robot: Robot, costs: Any, nu: int) -> None:
    theirs = list(state.pinocchio.names)[1:]
    if (state.nq, state.nv) != (robot.nq, robot.nv):
        raise ArgumentError(f"ForwardDynamics: the state has nq {state.nq}, nv {state.nv}, the robot {robot.nq}, {robot.nv}")
    floats = robot.joint_types[0] == "free-flyer"  # a joint without a name in the file
    if theirs[floats:] != robot.joints[floats:]:
        raise ArgumentError(f"ForwardDynamics: expected the same joints in the same order, got {theirs} and {robot.joints}")
    if not isinstance(costs, Function):
        return
    if robot.nq != robot.nv:
        raise ArgumentError(f"ForwardDynamics: costs by entries of q need nq = nv, got {robot.nq} and {robot.nv}; expected a CostModelSum")
    if costs.n_y != 1 or costs.n_p != 0 or costs.n_x != 2 * robot.nv + nu:
        raise ArgumentError(f"ForwardDynamics: expected a cost of ({2 * robot.nv + nu},) entries q, v, u with one output and no parameters")
