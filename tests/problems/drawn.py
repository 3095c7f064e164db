# SPDX-License-Identifier: BSD-3-Clause
"""Draws optimal control problems of eight kinds, each with its optimum in closed form or by a small linear system.

  energy    x' = A x + B u from 0 to a goal, least integral of u^2: goal' W^-1 goal, W the controllability Gramian
  regulator the same, least integral of x'Qx + u'Ru, end free: x0' P x0, P by Riccati's differential equation
  time      double integrator between two states at rest, |u| <= limit; with a limit of speed in half of them
  saddle    least -|x|^2 on a polygon from a symmetric start: a vertex
  pulse     u^2 and a cost narrower than an interval
  post      u^2 past an obstacle in time that is narrower than an interval
  cost jump, gain jump    the weight, or the gain, of u changes at an instant
"""

import math

import numpy as np
from description import Known, Row
from scipy.integrate import solve_ivp
from scipy.linalg import expm


def squares(m, x, u, t):
    return sum(v * v for v in u)


def linear(random):
    n, m = int(random.integers(1, 5)), int(random.integers(1, 3))
    a, b = random.normal(size=(n, n)), random.normal(size=(n, m))

    def rate(_, x, u, t):
        return [sum(a[i, j] * x[j] for j in range(n)) + sum(b[i, j] * u[j] for j in range(m)) for i in range(n)]

    return n, m, a, b, rate


def energy(random):
    while True:
        n, m, a, b, rate = linear(random)
        duration = random.uniform(0.5, 3)
        block = np.block([[-a, b @ b.T], [np.zeros((n, n)), a.T]]) * duration
        big = expm(block)
        gramian = big[n:, n:].T @ big[:n, n:]
        goal = random.normal(size=n)
        if np.linalg.cond(gramian) < 1e6:
            return Known("energy", n, m, duration, rate, goal @ np.linalg.solve(gramian, goal), digits=5e-3, cost=squares, start=np.zeros(n), goal=goal)


def regulator(random):
    n, m, a, b, rate = linear(random)
    duration, q, r = random.uniform(0.5, 3), random.uniform(0.1, 10), random.uniform(0.05, 2)
    def slope(_, flat):
        p = flat.reshape(n, n)
        return (a.T @ p + p @ a - p @ b @ b.T @ p / r + q * np.eye(n)).ravel()

    p = solve_ivp(slope, (0, duration), np.zeros(n * n), method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1].reshape(n, n)
    start = random.normal(size=n)

    def cost(_, x, u, t):
        return q * sum(v * v for v in x) + r * sum(v * v for v in u)

    return Known("regulator", n, m, duration, rate, start @ p @ start, digits=5e-3, cost=cost, start=start)


def least_time(random):
    limit, way = random.uniform(0.2, 5), random.uniform(0.2, 10) * random.choice([-1, 1])
    best, rows = 2 * math.sqrt(abs(way) / limit), ()
    if random.random() < 0.5:
        speed = random.uniform(0.3, 0.9) * math.sqrt(abs(way) * limit)
        best, rows = abs(way) / speed + speed / limit, [Row(lambda m, x, u, t: x[1], -speed, speed)]
    return Known("time", 2, 1, best * random.uniform(0.5, 2), lambda m, x, u, t: [x[1], u[0]], best, digits=5e-3, time=1, start=np.zeros(2),
                 goal=np.array([way, 0]), controls_within=(-limit, limit), rows=rows, free=(best / 20, best * 20))


def saddle(random):
    p, most = random.uniform(0.5, 3), random.uniform(4, 20)
    return Known("saddle", 2, 2, 1.0, lambda m, x, u, t: [u[0], u[1]], -(most**2), digits=5e-3, start=np.array([p, p]),
                 cost=lambda m, x, u, t: 1e-6 * (u[0] ** 2 + u[1] ** 2), end_cost=lambda m, x: -(x[0] ** 2 + x[1] ** 2),
                 rows=[Row(lambda m, x, u, t: x[0] + x[1], -math.inf, most, True), Row(lambda m, x, u, t: x[0], at_end=True),
                       Row(lambda m, x, u, t: x[1], at_end=True)])


def pulse(random):
    at, width, weight = random.uniform(0.2, 0.8), 10 ** random.uniform(-3, -1.7), random.uniform(0.5, 20)

    def cost(m, x, u, t):
        return u[0] ** 2 + weight / (width * math.sqrt(math.pi)) * m.exp(-(((t - at) / width) ** 2)) * (x[0] - 1) ** 2

    # As width goes to 0, a^2 / at + weight (a - 1)^2; the width leaves what a moves by meanwhile.
    return Known("pulse", 1, 1, 1.0, lambda m, x, u, t: [u[0]], weight / (1 + weight * at), cost=cost, start=np.zeros(1),
                 digits=5e-3 + 20 * width * (1 + weight))


def post(random):
    at, width, height = random.uniform(0.2, 0.8), 10 ** random.uniform(-3, -1.7), random.uniform(0.3, 3)
    return Known("post", 1, 1, 1.0, lambda m, x, u, t: [u[0]], height**2 / at + height**2 / (1 - at), cost=squares, start=np.zeros(1), goal=np.zeros(1),
                 rows=[Row(lambda m, x, u, t: x[0] - height * m.exp(-(((t - at) / width) ** 2)))], digits=5e-3 + 5 * width)


def cost_jump(random):
    at, after = random.uniform(0.1, 0.9), 10 ** random.uniform(-1, 1)
    return Known("cost jump", 1, 1, 1.0, lambda m, x, u, t: [u[0]], 1 / (at + (1 - at) / after), digits=5e-3,
                 cost=lambda m, x, u, t: m.where(t < at, 1.0, after) * u[0] ** 2, start=np.zeros(1), goal=np.ones(1))


def gain_jump(random):
    at, after = random.uniform(0.1, 0.9), 10 ** random.uniform(-0.7, 0.7)
    return Known("gain jump", 1, 1, 1.0, lambda m, x, u, t: [m.where(t < at, 1.0, after) * u[0]], 1 / (at + after**2 * (1 - at)), cost=squares,
                 digits=5e-3, start=np.zeros(1), goal=np.ones(1))


KINDS = (energy, regulator, least_time, saddle, pulse, post, cost_jump, gain_jump)


def drawn(seed, count):
    """`count` problems, of each kind in turn."""
    for i in range(count):
        yield KINDS[i % len(KINDS)](np.random.default_rng([seed, i]))
