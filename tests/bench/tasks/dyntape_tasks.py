# SPDX-License-Identifier: BSD-3-Clause
"""The six tasks by dyntape.  Each function prepares and returns what runs."""


def torques():
    import dyntape
    from data import LOCKED, ROBOT, states
    robot = dyntape.load(ROBOT, lock=LOCKED)
    q, v, a = states(100_000)
    return lambda: robot.rnea(q, v, a)


def derivatives():
    import dyntape
    from data import LOCKED, ROBOT, states
    robot = dyntape.load(ROBOT, lock=LOCKED)
    q, v, tau = states(10_000)
    return lambda: robot.fd_derivatives(q, v, tau).ddq_dq


def own_cost():
    import dyntape
    from data import LOCKED, N, ROBOT, TARGET, states
    robot = dyntape.load(ROBOT, lock=LOCKED)

    def cost(q):
        miss = robot.frame_placement(q, frame='panda_hand').p - TARGET
        return (miss ** 2).sum() + 1e-3 * (robot.gravity(q) ** 2).sum()

    hessian = dyntape.record(cost, N).compile().hessian
    q, _, _ = states(1000)
    return lambda: hessian(q)


def reach():
    import dyntape
    import numpy as np
    from data import ANGLE, END, GOAL, LOCKED, N, RATE, ROBOT, START, TORQUE
    robot = dyntape.load(ROBOT, lock=LOCKED)
    p = robot.problem(1)
    weights = np.sqrt([ANGLE] * N + [RATE] * N)
    missed = lambda s: (s.x - np.append(GOAL, np.zeros(N))) * weights
    p.add_squares('missed', missed)
    p.add_squares('torques', lambda s: s.u, weight=TORQUE)
    p.add_squares('end', missed, weight=END, where='end')
    p.start_at(START)
    p.guess(np.append(START, np.zeros(N)), robot.gravity(START))
    return lambda: np.array([p.solve_ddp(100, hessian='gauss_newton').cost])


def simulate():
    import dyntape
    import numpy as np
    from data import LOCKED, N, ROBOT, STEP, STEPS, states
    scene = dyntape.Scene.from_text(f'robot {{ urdf {ROBOT}\n lock "{" ".join(LOCKED)}" }}\n'
                                    f'simulation {{ duration 1\n step {STEP}\n integrator semi-implicit-euler }}')
    q, v, _ = states(1024)
    x0 = np.hstack([q, v])
    return lambda: scene.rollout(x0, np.zeros((STEPS, N)))[:, -1]


def slopes():
    import dyntape
    import numpy as np
    from data import LOCKED, N, ROBOT, STEP, STEPS, states
    scene = dyntape.Scene.from_text(f'robot {{ urdf {ROBOT}\n lock "{" ".join(LOCKED)}" }}\n'
                                    f'simulation {{ duration 1\n step {STEP}\n integrator semi-implicit-euler }}')
    q, v, u = states(STEPS)
    x0 = np.append(q[0], v[0])
    by = np.zeros((STEPS, 2 * N))
    by[-1] = 1  # of the sum of the last state
    return lambda: scene.rollout_gradient(x0, u, by)[2]
