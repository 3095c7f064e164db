#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Draws optimal control problems with known optima, solves them as a user writes them, and counts what is called solved and is not.

    PYTHONPATH=build/python build/python_environment/bin/python tests/full/known_problems.py --count 1000 [--peers] [--table FILE]

Kinds, each with its optimum in closed form or by a small linear system:
  energy    x' = A x + B u from 0 to a goal, least integral of u^2: goal' W^-1 goal, W the controllability Gramian
  regulator the same, least integral of x'Qx + u'Ru, end free: x0' P x0, P by Riccati's differential equation
  time      double integrator between two states at rest, |u| <= limit; with a limit of speed in half of them
  saddle    least -|x|^2 on a polygon from a symmetric start: a vertex
  pulse     u^2 and a cost narrower than an interval
  post      u^2 past an obstacle in time that is narrower than an interval
  cost jump, gain jump    the weight, or the gain, of u changes at an instant
A success is false if its cost is off by more than `digits` of the kind: what the widths of pulses and posts leave, 5e-3 else.
The exit status is the number of false successes, or 1 if more than 3 % are refused.
"""

import argparse
import collections
import importlib.util
import math
import sys
import time

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import expm

Known = collections.namedtuple("Known", "kind states controls duration rate cost end_cost start goal bounds rows free optima digits")


def known(kind, n, m, duration, rate, optima, *, cost=None, end_cost=None, start=None, goal=None, bounds=None, rows=(), free=None, digits=5e-3):
    """rate, cost(m, x, u, t) of a module m with exp and where; rows: (function, lower, upper, at the end alone)."""
    return Known(kind, n, m, duration, rate, cost, end_cost, start, goal, bounds, rows, free, np.atleast_1d(optima), digits)


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
            return known("energy", n, m, duration, rate, goal @ np.linalg.solve(gramian, goal), cost=squares, start=np.zeros(n), goal=goal)


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

    return known("regulator", n, m, duration, rate, start @ p @ start, cost=cost, start=start)


def least_time(random):
    limit, way = random.uniform(0.2, 5), random.uniform(0.2, 10) * random.choice([-1, 1])
    best, rows = 2 * math.sqrt(abs(way) / limit), ()
    if random.random() < 0.5:
        speed = random.uniform(0.3, 0.9) * math.sqrt(abs(way) * limit)
        best, rows = abs(way) / speed + speed / limit, ((lambda m, x, u, t: x[1], -speed, speed, False),)
    return known("time", 2, 1, best * random.uniform(0.5, 2), lambda m, x, u, t: [x[1], u[0]], best, start=np.zeros(2), goal=np.array([way, 0]),
                 bounds=(-limit, limit), rows=rows, free=(best / 20, best * 20))


def saddle(random):
    p, most = random.uniform(0.5, 3), random.uniform(4, 20)
    return known("saddle", 2, 2, 1.0, lambda m, x, u, t: [u[0], u[1]], -(most**2), cost=lambda m, x, u, t: 1e-6 * (u[0] ** 2 + u[1] ** 2),
                 end_cost=lambda m, x: -(x[0] ** 2 + x[1] ** 2), start=np.array([p, p]),
                 rows=((lambda m, x, u, t: x[0] + x[1], -math.inf, most, True), (lambda m, x, u, t: x[0], 0, math.inf, True),
                       (lambda m, x, u, t: x[1], 0, math.inf, True)))


def pulse(random):
    at, width, weight = random.uniform(0.2, 0.8), 10 ** random.uniform(-3, -1.7), random.uniform(0.5, 20)

    def cost(m, x, u, t):
        return u[0] ** 2 + weight / (width * math.sqrt(math.pi)) * m.exp(-(((t - at) / width) ** 2)) * (x[0] - 1) ** 2

    # As width goes to 0, a^2 / at + weight (a - 1)^2; the width leaves what a moves by meanwhile.
    return known("pulse", 1, 1, 1.0, lambda m, x, u, t: [u[0]], weight / (1 + weight * at), cost=cost, start=np.zeros(1),
                 digits=5e-3 + 20 * width * (1 + weight))


def post(random):
    at, width, height = random.uniform(0.2, 0.8), 10 ** random.uniform(-3, -1.7), random.uniform(0.3, 3)
    return known("post", 1, 1, 1.0, lambda m, x, u, t: [u[0]], height**2 / at + height**2 / (1 - at), cost=squares, start=np.zeros(1), goal=np.zeros(1),
                 rows=((lambda m, x, u, t: x[0] - height * m.exp(-(((t - at) / width) ** 2)), 0, math.inf, False),), digits=5e-3 + 5 * width)


def cost_jump(random):
    at, after = random.uniform(0.1, 0.9), 10 ** random.uniform(-1, 1)
    return known("cost jump", 1, 1, 1.0, lambda m, x, u, t: [u[0]], 1 / (at + (1 - at) / after),
                 cost=lambda m, x, u, t: m.where(t < at, 1.0, after) * u[0] ** 2, start=np.zeros(1), goal=np.ones(1))


def gain_jump(random):
    at, after = random.uniform(0.1, 0.9), 10 ** random.uniform(-0.7, 0.7)
    return known("gain jump", 1, 1, 1.0, lambda m, x, u, t: [m.where(t < at, 1.0, after) * u[0]], 1 / (at + after**2 * (1 - at)), cost=squares,
                 start=np.zeros(1), goal=np.ones(1))


KINDS = (energy, regulator, least_time, saddle, pulse, post, cost_jump, gain_jump)


def by_dyntape(k, method):
    import dyntape

    m = np
    p = dyntape.Problem(k.kind, [f"x{i}" for i in range(k.states)], [f"u{i}" for i in range(k.controls)], k.duration,
                        lambda s: k.rate(m, s.x, s.u, s.t))
    p.start = k.start
    if k.goal is not None:
        p.goal = k.goal
    if k.cost:
        p.add_cost("running", lambda s: k.cost(m, s.x, s.u, s.t))
    if k.end_cost:
        p.add_cost("end", lambda s: k.end_cost(m, s.x), where="end")
    if k.bounds:
        p.bound_controls(*k.bounds)
    if k.free:
        p.add_minimum_time()
        p.free_duration(*k.free)
    for i, (row, lower, upper, at_end) in enumerate(k.rows):
        p.add_inequality(f"row{i}", lambda s, row=row: row(m, s.x, s.u, s.t), lower, upper, **({"where": "end"} if at_end else {}))
    s = p.solve(method=method)
    return s.success, s.cost, s.verdict


def by_casadi(k, solver, intervals=100):
    """Runge-Kutta 4 from node to node, variables and rows in the order of time, as FATROP has them."""
    import casadi as c

    class Words:
        exp = staticmethod(c.exp)
        where = staticmethod(c.if_else)

    opti, n = c.Opti(), k.states + (1 if k.free else 0)
    x, u = [], []
    for i in range(intervals + 1):
        x.append(opti.variable(n))
        if i < intervals:
            u.append(opti.variable(k.controls))
    total = 0

    def slopes(t, state, control):
        parts, inputs = [state[i] for i in range(k.states)], [control[i] for i in range(k.controls)]
        scale = state[k.states] if k.free else 1
        own = [scale * v for v in k.rate(Words, parts, inputs, t)] + ([0] if k.free else [])
        return c.vertcat(*own, k.cost(Words, parts, inputs, t) if k.cost else 0)

    h = (1 if k.free else k.duration) / intervals
    for i in range(intervals):
        t, now = i * h, c.vertcat(x[i], 0)
        k1 = slopes(t, now, u[i])
        k2 = slopes(t + h / 2, now + h / 2 * k1, u[i])
        k3 = slopes(t + h / 2, now + h / 2 * k2, u[i])
        k4 = slopes(t + h, now + h * k3, u[i])
        end = now + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        opti.subject_to(x[i + 1] == end[:n])
        total += end[n]
        if i == 0:
            opti.subject_to(x[0][: k.states] == k.start)
            if k.free:
                opti.subject_to(opti.bounded(k.free[0], x[0][k.states], k.free[1]))
        for row, lower, upper, at_end in k.rows:
            if not at_end and i > 0:
                value = row(Words, [x[i][j] for j in range(k.states)], None, t)
                opti.subject_to(lower <= value) if upper == math.inf else opti.subject_to(opti.bounded(lower, value, upper))
        if k.bounds:
            opti.subject_to(opti.bounded(k.bounds[0], u[i], k.bounds[1]))
    last = [x[-1][j] for j in range(k.states)]
    if k.goal is not None:
        opti.subject_to(x[-1][: k.states] == k.goal)
    for row, lower, upper, at_end in k.rows:
        if at_end:
            value = row(Words, last, None, k.duration)
            opti.subject_to(value >= lower if upper == math.inf else value <= upper)
    if k.end_cost:
        total += k.end_cost(Words, last)
    if k.free:
        total = x[-1][k.states]
        for state in x:
            opti.set_initial(state[k.states], k.duration)
    for i, state in enumerate(x):
        share = i / intervals
        goal = k.goal if k.goal is not None else k.start
        opti.set_initial(state[: k.states], (1 - share) * k.start + share * goal)
    opti.minimize(total)
    options = {"print_time": False, "expand": True}
    if solver == "fatrop":
        options["structure_detection"] = "auto"
        opti.solver("fatrop", options, {"print_level": 0})
    else:
        opti.solver("ipopt", options, {"print_level": 0, "sb": "yes"})
    try:
        return True, float(opti.solve().value(total)), "solved"
    except RuntimeError as error:
        return False, math.nan, str(error).splitlines()[0][:80]


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--count", type=int, default=1000)
    options.add_argument("--seed", type=int, default=int(time.time()))
    options.add_argument("--peers", action="store_true", help="also CasADi with Ipopt and FATROP, 100 intervals of Runge-Kutta 4")
    options.add_argument("--table", help="write the table there, Markdown")
    given = options.parse_args()
    if importlib.util.find_spec("dyntape") is None:
        print("known_problems: the package dyntape is not in reach, which tools/build --python makes")
        return 77
    print(f"seed {given.seed}", flush=True)
    solvers = {"dyntape, ipopt": lambda k: by_dyntape(k, "ipopt"), "dyntape, riccati": lambda k: by_dyntape(k, "riccati")}
    if given.peers:
        solvers |= {"CasADi, Ipopt": lambda k: by_casadi(k, "ipopt"), "CasADi, FATROP": lambda k: by_casadi(k, "fatrop")}
    counts = {name: collections.defaultdict(collections.Counter) for name in solvers}
    seconds = collections.Counter()
    for i in range(given.count):
        random = np.random.default_rng([given.seed, i])
        k = KINDS[i % len(KINDS)](random)
        for name, solve in solvers.items():
            begin = time.perf_counter()
            try:
                success, cost, verdict = solve(k)
            except Exception as error:  # an error is a refusal
                success, cost, verdict = False, math.nan, f"{type(error).__name__}: {error}"
            seconds[name] += time.perf_counter() - begin
            off = min(abs(cost - optimum) / max(abs(optimum), 1e-9) for optimum in k.optima)
            word = "refused" if not success else "right" if off <= k.digits else "false"
            counts[name][k.kind][word] += 1
            if word != "right" and name.startswith("dyntape"):
                print(f"{i:5d} {k.kind:10s} {name:17s} {word}: cost {cost:.8g} of {k.optima[0]:.8g}; {verdict[:110]}", flush=True)
    kinds = sorted({kind for of in counts.values() for kind in of})
    lines = ["| kind | " + " | ".join(solvers) + " |", "|---|" + "---|" * len(solvers)]
    for kind in kinds + ["all"]:
        row = []
        for name in solvers:
            of = counts[name][kind] if kind != "all" else sum(counts[name].values(), collections.Counter())
            row.append(f"{of['right']} right, {of['refused']} refused, {of['false']} false")
        lines.append(f"| {kind} | " + " | ".join(row) + " |")
    lines.append("| seconds | " + " | ".join(f"{seconds[name]:.0f}" for name in solvers) + " |")
    print("\n".join(lines))
    if given.table:
        with open(given.table, "w") as file:
            file.write("\n".join(lines) + "\n")
    ours = [sum(of.values(), collections.Counter()) for name, of in counts.items() if name.startswith("dyntape")]
    false = sum(of["false"] for of in ours)
    return false or int(any(of["refused"] > 0.03 * given.count for of in ours))


if __name__ == "__main__":
    sys.exit(main())
