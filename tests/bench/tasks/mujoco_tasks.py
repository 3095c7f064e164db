# SPDX-License-Identifier: BSD-3-Clause
"""The tasks of the six that MuJoCo knows; derivatives are differences, and there is no solver for motions."""


def torques():
    import mujoco
    import numpy as np
    from data import LOCKED, ROBOT, states
    spec = mujoco.MjSpec.from_file(ROBOT)
    for part in [*spec.equalities, *map(spec.joint, LOCKED)]:
        spec.delete(part)
    model = spec.compile()
    model.dof_damping[:] = 0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    q, v, a = states(100_000)

    def each(q, v, a):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_inverse(model, data)
        return data.qfrc_inverse.copy()

    return lambda: np.array([each(*one) for one in zip(q, v, a)])


def derivatives():
    import mujoco
    import numpy as np
    from data import LOCKED, N, ROBOT, states
    spec = mujoco.MjSpec.from_file(ROBOT)
    for part in [*spec.equalities, *map(spec.joint, LOCKED)]:
        spec.delete(part)
    model = spec.compile()
    model.dof_damping[:] = 0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    q, v, tau = states(10_000)

    def qacc(q):
        data.qpos[:] = q
        mujoco.mj_forward(model, data)
        return data.qacc.copy()

    def each(q, v, tau):
        data.qvel[:], data.qfrc_applied[:] = v, tau
        steps = 1e-6 * np.eye(N)
        return np.array([(qacc(q + d) - qacc(q - d)) / 2e-6 for d in steps]).T

    return lambda: np.array([each(*one) for one in zip(q, v, tau)])


def own_cost():
    import mujoco
    import numpy as np
    from data import LOCKED, N, ROBOT, TARGET, states
    spec = mujoco.MjSpec.from_file(ROBOT)
    spec.compiler.fusestatic = False
    for part in [*spec.equalities, *map(spec.joint, LOCKED)]:
        spec.delete(part)
    model = spec.compile()
    data = mujoco.MjData(model)
    hand = model.body('panda_hand').id

    def cost(q):
        data.qpos[:] = q
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        tau = np.zeros(N)
        mujoco.mj_rne(model, data, 0, tau)
        return ((data.xpos[hand] - TARGET) ** 2).sum() + 1e-3 * (tau ** 2).sum()

    def hessian(q, h=1e-4):
        d, H = h * np.eye(N), np.zeros((N, N))
        for i in range(N):
            for j in range(i + 1):
                H[i, j] = H[j, i] = (cost(q + d[i] + d[j]) - cost(q + d[i] - d[j]) - cost(q - d[i] + d[j]) + cost(q - d[i] - d[j])) / (4 * h * h)
        return H

    q, _, _ = states(1000)
    return lambda: np.array([hessian(one) for one in q])


def simulate():
    import os
    import mujoco
    import mujoco.rollout
    import numpy as np
    from data import LOCKED, N, ROBOT, STEP, STEPS, states
    spec = mujoco.MjSpec.from_file(ROBOT)
    for part in [*spec.equalities, *map(spec.joint, LOCKED)]:
        spec.delete(part)
    model = spec.compile()
    model.dof_damping[:] = 0
    model.opt.timestep = STEP
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    threads = len(os.sched_getaffinity(0))
    data = [mujoco.MjData(model) for _ in range(threads)]
    pool = mujoco.rollout.Rollout(nthread=threads)
    q, v, _ = states(1024)
    x0 = np.hstack([np.zeros((1024, 1)), q, v])
    return lambda: pool.rollout(model, data, x0, nstep=STEPS)[0][:, -1, 1:]


def slopes():
    import mujoco
    import numpy as np
    from data import LOCKED, N, ROBOT, STEP, STEPS, states
    spec = mujoco.MjSpec.from_file(ROBOT)
    for part in [*spec.equalities, *map(spec.joint, LOCKED)]:
        spec.delete(part)
    for joint in spec.joints:
        spec.add_actuator(target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    model = spec.compile()
    model.dof_damping[:] = 0
    model.opt.timestep = STEP
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data = mujoco.MjData(model)
    q, v, u = states(STEPS)

    def gradient():
        A, B = np.zeros((STEPS, 2 * N, 2 * N)), np.zeros((STEPS, 2 * N, N))
        data.qpos[:], data.qvel[:] = q[0], v[0]
        for k in range(STEPS):
            data.ctrl[:] = u[k]
            mujoco.mjd_transitionFD(model, data, 1e-6, 1, A[k], B[k], None, None)
            mujoco.mj_step(model, data)
        by_x, by_u = np.ones(2 * N), np.zeros((STEPS, N))
        for k in reversed(range(STEPS)):
            by_u[k], by_x = B[k].T @ by_x, A[k].T @ by_x
        return by_u

    return gradient
