# SPDX-License-Identifier: BSD-3-Clause
"""Solves a Known problem by dyntape as a user writes it, without mesh, guess or option, and by CasADi with 100 intervals of Runge-Kutta 4."""

import math
import time

import numpy as np
from description import Answer, Known

INTERVALS = 100


def by_dyntape(k: Known, method: str) -> Answer:
    import dyntape

    begin = time.perf_counter()
    p = dyntape.Problem(k.name, [f"x{i}" for i in range(k.states)], [f"u{i}" for i in range(k.controls)], k.duration,
                        lambda s: k.rate(np, s.x, s.u, s.t))  # fmt: skip
    p.start = k.start
    if k.goal is not None:
        p.goal = k.goal
    if k.cost:
        p.add_cost("running", lambda s: k.cost(np, s.x, s.u, s.t))
    if k.end_cost:
        p.add_cost("end", lambda s: k.end_cost(np, s.x), where="end")
    if k.time:
        p.add_minimum_time(k.time)
    if k.free:
        p.free_duration(*k.free)
    if k.controls_within:
        p.bound_controls(*k.controls_within)
    if k.states_within:
        p.bound_states(*k.states_within)
    for i, row in enumerate(k.rows):
        where = {"where": "end"} if row.at_end else {}
        function = lambda s, f=row.function: f(np, s.x, s.u, s.t)  # noqa: E731
        if row.lower == row.upper:
            p.add_equality(f"row{i}", lambda s, f=function, value=row.lower: f(s) - value, **where)
        else:
            p.add_inequality(f"row{i}", function, row.lower, row.upper, **where)
    s = p.solve(method=method)
    return Answer(s.success, s.cost, s.iterations, time.perf_counter() - begin, s.verdict)


class Words:
    """numpy's names for CasADi's expressions."""

    @staticmethod
    def where(condition, a, b):
        import casadi

        return casadi.if_else(condition, a, b)

    def __getattr__(self, name):
        import casadi

        return getattr(casadi, {"arctan2": "atan2", "arccos": "acos"}.get(name, name))


def bounded(opti, lower, values, upper):
    """The rows of `values` that have a finite bound; lower and upper are numbers or lists."""
    rows = values.shape[0]
    for i, (low, high) in enumerate(zip(np.broadcast_to(lower, rows), np.broadcast_to(upper, rows))):
        if low == high:
            opti.subject_to(values[i] == float(low))
        elif math.isfinite(low) and math.isfinite(high):
            opti.subject_to(opti.bounded(float(low), values[i], float(high)))
        elif math.isfinite(low):
            opti.subject_to(values[i] >= float(low))
        elif math.isfinite(high):
            opti.subject_to(values[i] <= float(high))


def slopes_of(k, m, t, state, control):
    """The rates of the states, of the duration where it is one, and of the running cost."""
    import casadi as c

    x, u = [state[i] for i in range(k.states)], [control[i] for i in range(k.controls)]
    scale = state[k.states] if k.free else 1
    at = t * scale
    own = [scale * v for v in k.rate(m, x, u, at)] + ([0] if k.free else [])
    return c.vertcat(*own, scale * k.cost(m, x, u, at) if k.cost else 0)


def guess_of(k):
    """The straight line from start to goal, the free parts of each from the other."""
    goal = np.array(k.goal if k.goal is not None else k.start, dtype=float)
    start = np.where(np.isnan(k.start), goal, k.start)
    start, goal = np.nan_to_num(start), np.nan_to_num(np.where(np.isnan(goal), start, goal))
    return [(1 - i / INTERVALS) * start + i / INTERVALS * goal for i in range(INTERVALS + 1)]


def add_rows(opti, k, m, x, u, at_end):
    parts = [x[j] for j in range(k.states)]
    import casadi as c

    controls = [u[j] for j in range(k.controls)] if u is not None else [0] * k.controls
    for row in k.rows:
        if row.at_end == at_end[0]:
            value = row.function(m, parts, controls, at_end[1])
            values = c.vertcat(*value) if isinstance(value, list) else c.vertcat(value)
            bounded(opti, row.lower, values, row.upper)


def by_casadi(k: Known, solver: str) -> Answer:
    """Variables and rows in the order of time, as FATROP has them."""
    import casadi as c

    begin = time.perf_counter()
    m, opti, n = Words(), c.Opti(), k.states + (1 if k.free else 0)
    x, u = [], []
    for i in range(INTERVALS + 1):
        x.append(opti.variable(n))
        if i < INTERVALS:
            u.append(opti.variable(k.controls))
    total, h = 0, (1 if k.free else k.duration) / INTERVALS
    for i in range(INTERVALS):
        t, now = i * h, c.vertcat(x[i], 0)
        k1 = slopes_of(k, m, t, now, u[i])
        k2 = slopes_of(k, m, t + h / 2, now + h / 2 * k1, u[i])
        k3 = slopes_of(k, m, t + h / 2, now + h / 2 * k2, u[i])
        k4 = slopes_of(k, m, t + h, now + h * k3, u[i])
        end = now + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        opti.subject_to(x[i + 1] == end[:n])
        total += end[n]
        if i == 0:
            fixed = [float(v) for v in np.nan_to_num(np.array(k.start, dtype=float), nan=math.inf)]
            bounded(opti, [-math.inf if v == math.inf else v for v in fixed], x[0][: k.states], fixed)
            if k.free:
                opti.subject_to(opti.bounded(k.free[0], x[0][k.states], k.free[1]))
        else:
            add_rows(opti, k, m, x[i], u[i], (False, t * (x[i][k.states] if k.free else 1)))
            if k.states_within:
                bounded(opti, k.states_within[0], x[i][: k.states], k.states_within[1])
        if k.controls_within:
            bounded(opti, k.controls_within[0], u[i], k.controls_within[1])
    duration = x[-1][k.states] if k.free else k.duration
    if k.goal is not None:
        goal = np.array(k.goal, dtype=float)
        bounded(opti, np.where(np.isnan(goal), -math.inf, goal), x[-1][: k.states], np.where(np.isnan(goal), math.inf, goal))
    add_rows(opti, k, m, x[-1], u[-1], (True, duration))
    if k.end_cost:
        total += k.end_cost(m, [x[-1][j] for j in range(k.states)])
    total += k.time * duration
    for state, value in zip(x, guess_of(k)):
        opti.set_initial(state[: k.states], value)
        if k.free:
            opti.set_initial(state[k.states], k.duration)
    opti.minimize(total)
    options = {"print_time": False, "expand": True}
    if solver == "fatrop":
        options["structure_detection"] = "auto"
        opti.solver("fatrop", options, {"print_level": 0})
    else:
        opti.solver("ipopt", options, {"print_level": 0, "sb": "yes"})
    try:
        cost, success, verdict = float(opti.solve().value(total)), True, "solved"
    except RuntimeError as error:
        cost, success, verdict = math.nan, False, str(error).splitlines()[0][:80]
    stats = opti.stats() if success else {}
    iterations = stats.get("iter_count", stats.get("fatrop", {}).get("iterations_count", -1))
    return Answer(success, cost, iterations, time.perf_counter() - begin, verdict, digits=1e-2)


SOLVERS = {
    "riccati": lambda k: by_dyntape(k, "riccati"),
    "ipopt": lambda k: by_dyntape(k, "ipopt"),
    "automatic": lambda k: by_dyntape(k, "automatic"),
    "casadi-ipopt": lambda k: by_casadi(k, "ipopt"),
    "casadi-fatrop": lambda k: by_casadi(k, "fatrop"),
}
