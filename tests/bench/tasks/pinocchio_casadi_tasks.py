# SPDX-License-Identifier: BSD-3-Clause
"""The six tasks by Pinocchio and CasADi.  PyPI's Pinocchio does not know CasADi, so that recursions in CasADi's symbols are the
user's: casadi_robot.py, whose lines are counted where it is imported.
"""


def torques():
    import numpy as np
    import pinocchio as pin
    from data import LOCKED, ROBOT, states
    whole = pin.buildModelFromUrdf(ROBOT)
    model = pin.buildReducedModel(whole, [whole.getJointId(name) for name in LOCKED], pin.neutral(whole))
    data = model.createData()
    q, v, a = states(100_000)
    return lambda: np.array([pin.rnea(model, data, *one) for one in zip(q, v, a)])


def derivatives():
    import numpy as np
    import pinocchio as pin
    from data import LOCKED, ROBOT, states
    whole = pin.buildModelFromUrdf(ROBOT)
    model = pin.buildReducedModel(whole, [whole.getJointId(name) for name in LOCKED], pin.neutral(whole))
    data = model.createData()
    q, v, tau = states(10_000)

    def each(q, v, tau):
        pin.computeABADerivatives(model, data, q, v, tau)
        return data.ddq_dq.copy()

    return lambda: np.array([each(*one) for one in zip(q, v, tau)])


def casadi_model():
    """The robot as casadi_robot.py takes it, its hand's placement on the last joint, and Pinocchio's model."""
    import pinocchio as pin
    from casadi_robot import Robot
    from data import LOCKED, ROBOT
    whole = pin.buildModelFromUrdf(ROBOT)
    model = pin.buildReducedModel(whole, [whole.getJointId(name) for name in LOCKED], pin.neutral(whole))
    joints = [{'type': 'revolute', 'axis': [0, 0, 1], 'idx_q': k - 1, 'idx_v': k - 1, 'parent': model.parents[k] - 1,
               'rotation': place.rotation.ravel().tolist(), 'translation': place.translation.tolist(), 'armature': 0,
               'mass': body.mass, 'com': body.lever.tolist(), 'inertia': body.inertia.ravel().tolist()}
              for k, (place, body) in enumerate(zip(model.jointPlacements, model.inertias)) if k > 0]
    robot = Robot({'nq': model.nq, 'nv': model.nv, 'gravity': model.gravity.linear.tolist(), 'joints': joints})
    return robot, model.frames[model.getFrameId('panda_hand')].placement, model


def own_cost():
    import casadi as ca
    from casadi_robot import rnea
    from data import N, TARGET, states
    r, hand, _ = casadi_model()
    R, p = ca.SX.eye(3), ca.SX(3, 1)
    for i in range(N):
        R, p = R @ r.R[i], p + R @ r.p[i]
    gravity = ca.substitute(rnea(r, ca.SX(N, 1)), r.v, ca.DM.zeros(N))
    cost = ca.sumsqr(p + R @ hand.translation - TARGET) + 1e-3 * ca.sumsqr(gravity)
    hessian = ca.Function('hessian', [r.q], [ca.hessian(cost, r.q)[0]], {'cse': True}).map(1000)
    q, _, _ = states(1000)
    return lambda: hessian(q.T).full().T.reshape(1000, N, N)


def reach():
    import casadi as ca
    import numpy as np
    import pinocchio as pin
    from casadi_robot import aba
    from data import ANGLE, END, GOAL, N, RATE, START, TORQUE
    r, _, model = casadi_model()
    hold = pin.rnea(model, model.createData(), START, 0 * START, 0 * START)
    start, goal, h = np.append(START, 0 * START), np.append(GOAL, 0 * GOAL), 1 / 100
    x, u = ca.MX.sym('x', 2 * N), ca.MX.sym('u', N)
    missed = lambda x: ca.dot([ANGLE] * N + [RATE] * N, (x - goal) ** 2)
    ddq = ca.Function('aba', [r.q, r.v, r.w], [aba(r, r.w)], {'cse': True})
    rate = ca.Function('rate', [x, u], [ca.vertcat(x[N:], ddq(x[:N], x[N:], u)), missed(x) + TORQUE * ca.sumsqr(u)])
    k1, c1 = rate(x, u)
    k2, c2 = rate(x + h / 2 * k1, u)
    k3, c3 = rate(x + h / 2 * k2, u)
    k4, c4 = rate(x + h * k3, u)
    step = ca.Function('step', [x, u], [x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4), h / 6 * (c1 + 2 * c2 + 2 * c3 + c4)])
    opti = ca.Opti()
    X, U = opti.variable(2 * N, 101), opti.variable(N, 100)
    there, costs = step.map(100)(X[:, :-1], U)
    opti.subject_to(ca.vec(X[:, 1:] - there) == 0)
    opti.subject_to(X[:, 0] == start)
    opti.minimize(ca.sum2(costs) + END * missed(X[:, -1]))
    opti.set_initial(X, np.tile(start[:, None], 101))
    opti.set_initial(U, np.tile(hold[:, None], 100))
    opti.solver('ipopt', {'print_time': False, 'ipopt': {'print_level': 0, 'sb': 'yes'}})
    return lambda: np.array([opti.solve().value(opti.f)])


def simulate():
    import numpy as np
    import pinocchio as pin
    from data import LOCKED, ROBOT, STEP, STEPS, states
    whole = pin.buildModelFromUrdf(ROBOT)
    model = pin.buildReducedModel(whole, [whole.getJointId(name) for name in LOCKED], pin.neutral(whole))
    data = model.createData()
    q, v, u = states(1024)

    def end(q, v):
        for _ in range(STEPS):
            v = v + STEP * pin.aba(model, data, q, v, 0 * v)
            q = pin.integrate(model, q, STEP * v)
        return np.append(q, v)

    return lambda: np.array([end(*one) for one in zip(q, v)])


def slopes():
    import casadi as ca
    from casadi_robot import aba
    from data import N, STEP, STEPS, states
    r, _, _ = casadi_model()
    x = ca.vertcat(r.q, r.v)
    v = r.v + STEP * aba(r, r.w)
    step = ca.Function('step', [x, r.w], [ca.vertcat(r.q + STEP * v, v)], {'cse': True})
    x0, U = ca.MX.sym('x0', 2 * N), ca.MX.sym('U', N, STEPS)
    end = step.mapaccum(STEPS)(x0, U)[:, -1]
    gradient = ca.Function('gradient', [x0, U], [ca.gradient(ca.sum1(end), U)])
    q, v, u = states(STEPS)
    start = ca.vertcat(q[0], v[0])
    return lambda: gradient(start, u.T).full().T
