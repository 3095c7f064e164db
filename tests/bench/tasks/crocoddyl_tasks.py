# SPDX-License-Identifier: BSD-3-Clause
"""The tasks of the six that are Crocoddyl's; torques are Pinocchio's, and Hessians of one's own cost are Gauss-Newton's, not exact."""


def derivatives():
    import crocoddyl
    import numpy as np
    import pinocchio as pin
    from data import LOCKED, N, ROBOT, states
    whole = pin.buildModelFromUrdf(ROBOT)
    state = crocoddyl.StateMultibody(pin.buildReducedModel(whole, [whole.getJointId(name) for name in LOCKED], pin.neutral(whole)))
    model = crocoddyl.DifferentialActionModelFreeFwdDynamics(state, crocoddyl.ActuationModelFull(state), crocoddyl.CostModelSum(state))
    data = model.createData()
    q, v, tau = states(10_000)

    def each(x, u):
        model.calc(data, x, u)
        model.calcDiff(data, x, u)
        return data.Fx[:, :N].copy()

    return lambda: np.array([each(*one) for one in zip(np.hstack([q, v]), tau)])


def reach():
    import crocoddyl
    import numpy as np
    import pinocchio as pin
    from data import ANGLE, END, GOAL, LOCKED, N, RATE, ROBOT, START, TORQUE
    whole = pin.buildModelFromUrdf(ROBOT)
    state = crocoddyl.StateMultibody(pin.buildReducedModel(whole, [whole.getJointId(name) for name in LOCKED], pin.neutral(whole)))
    start, goal = np.append(START, 0 * START), np.append(GOAL, 0 * GOAL)
    miss = crocoddyl.CostModelResidual(state, crocoddyl.ActivationModelWeightedQuad(2 * np.array([ANGLE] * N + [RATE] * N)),
                                       crocoddyl.ResidualModelState(state, goal))
    running, end = crocoddyl.CostModelSum(state), crocoddyl.CostModelSum(state)
    running.addCost('missed', miss, 1)
    running.addCost('torques', crocoddyl.CostModelResidual(state, crocoddyl.ResidualModelControl(state)), 2 * TORQUE)
    end.addCost('missed', miss, END)
    actuation = crocoddyl.ActuationModelFull(state)
    run, last = (crocoddyl.DifferentialActionModelFreeFwdDynamics(state, actuation, costs) for costs in (running, end))
    step = crocoddyl.IntegratedActionModelRK(run, crocoddyl.RKType.four, 1 / 100)
    problem = crocoddyl.ShootingProblem(start, [step] * 100, crocoddyl.IntegratedActionModelEuler(last, 0))

    def solve():
        solver = crocoddyl.SolverFDDP(problem)
        solver.th_stop = 1e-9
        controls = problem.quasiStatic([start] * 100)
        solver.solve(problem.rollout(controls), controls, 100)
        return np.array([solver.cost])

    return solve


def simulate():
    import crocoddyl
    import numpy as np
    import pinocchio as pin
    from data import LOCKED, N, ROBOT, STEP, STEPS, states
    whole = pin.buildModelFromUrdf(ROBOT)
    state = crocoddyl.StateMultibody(pin.buildReducedModel(whole, [whole.getJointId(name) for name in LOCKED], pin.neutral(whole)))
    dynamics = crocoddyl.DifferentialActionModelFreeFwdDynamics(state, crocoddyl.ActuationModelFull(state), crocoddyl.CostModelSum(state))
    step = crocoddyl.IntegratedActionModelEuler(dynamics, STEP)
    q, v, _ = states(1024)
    problem, controls = crocoddyl.ShootingProblem(np.append(q[0], v[0]), [step] * STEPS, step), [np.zeros(N)] * STEPS

    def end(x0):
        problem.x0 = x0
        xs = problem.rollout(controls)  # what holds the states
        return xs[-1].copy()

    return lambda: np.array([end(x0) for x0 in np.hstack([q, v])])


def slopes():
    import crocoddyl
    import numpy as np
    import pinocchio as pin
    from data import LOCKED, N, ROBOT, STEP, STEPS, states
    whole = pin.buildModelFromUrdf(ROBOT)
    state = crocoddyl.StateMultibody(pin.buildReducedModel(whole, [whole.getJointId(name) for name in LOCKED], pin.neutral(whole)))
    dynamics = crocoddyl.DifferentialActionModelFreeFwdDynamics(state, crocoddyl.ActuationModelFull(state), crocoddyl.CostModelSum(state))
    q, v, u = states(STEPS)
    step = crocoddyl.IntegratedActionModelEuler(dynamics, STEP)
    problem = crocoddyl.ShootingProblem(np.append(q[0], v[0]), [step] * STEPS, step)

    def gradient():
        xs = problem.rollout(list(u))
        problem.calc(xs, list(u))
        problem.calcDiff(xs, list(u))
        by_x, by_u = np.ones(2 * N), np.zeros((STEPS, N))
        for k in reversed(range(STEPS)):
            data = problem.runningDatas[k]
            by_u[k], by_x = data.Fu.T @ by_x, data.Fx.T @ by_x
        return by_u

    return gradient
