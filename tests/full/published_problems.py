#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Solves optimal control problems whose optima are published or have a closed form, as a user writes them, and compares.

    PYTHONPATH=build/python build/python_environment/bin/python tests/full/published_problems.py [--method riccati,ipopt] [--table FILE]

No problem has a mesh, a guess or an option of its own.  A row holds if the solve says success and the cost is the optimum within the relative
error of the problem's row, 1e-4 where the source has enough digits.  The exit status is the number of rows that do not hold.

Sources:
  COPS      Dolan, More and Munson, "Benchmarking optimization software with COPS 3.0", 2004
  Bryson    Bryson and Ho, "Applied optimal control", 1975
  Luus      Luus, "Iterative dynamic programming", 2000
  Augustin  Augustin and Maurer, "Sensitivity analysis and real-time control of a container crane", 2001
  Rao       Rao and Mease, "Eigenvector approximate dichotomic basis method for hyper-sensitive problems", 1999
  Meditch   Meditch, "On the problem of optimal thrust programming for a lunar soft landing", 1964
  closed    closed form, computed below
"""

import argparse
import math
import sys
import time

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

import dyntape

pi, nan, inf = math.pi, math.nan, math.inf
Problem = dyntape.Problem
PROBLEMS = []


def published(optimum, source, error=1e-4):
    def add(make):
        PROBLEMS.append((make, optimum() if callable(optimum) else optimum, source, error))
        return make

    return add


def cycloid():
    """Least time to fall from rest by (2, 2) at 9.81 m/s^2."""
    angle = brentq(lambda a: (a - math.sin(a)) / (1 - math.cos(a)) - 1, 0.1, 2 * pi - 0.1)
    radius = 2 / (1 - math.cos(angle))
    return math.sqrt(radius / 9.81) * angle


@published(cycloid, "closed")
def brachistochrone():
    p = Problem("brachistochrone", ["x", "y", "v"], ["angle"], 1.0,
                lambda s: [s.x[2] * np.sin(s.u[0]), s.x[2] * np.cos(s.u[0]), 9.81 * np.cos(s.u[0])])  # fmt: skip
    p.add_minimum_time()
    p.free_duration(0.1, 10)
    p.bound_controls(0, pi)
    p.start, p.goal = [0, 0, 0], [2, 2, nan]
    return p


@published(2 * math.sqrt(3), "closed")
def least_time():
    p = Problem("least time", ["x", "v"], ["a"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.add_minimum_time()
    p.free_duration(0.1, 50)
    p.bound_controls(-1, 1)
    p.start, p.goal = [0, 0], [3, 0]
    return p


@published(4.0, "Bryson")
def bryson_denham():
    p = Problem("Bryson-Denham", ["x", "v"], ["a"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.add_cost("effort", lambda s: 0.5 * s.u[0] ** 2)
    p.bound_states([-inf, -inf], [1 / 9, inf])
    p.start, p.goal = [0, 1], [0, -1]
    return p


@published(-1.52527, "Bryson", 2e-4)
def earth_to_mars():
    """Largest radius of a circular orbit after 3.3207 units of time."""
    thrust = lambda s: 0.1405 / (1 - 0.0749 * s.t)  # noqa: E731
    p = Problem("orbit", ["r", "u", "v"], ["angle"], 3.3207,
                lambda s: [s.x[1],
                           s.x[2] ** 2 / s.x[0] - 1 / s.x[0] ** 2 + thrust(s) * np.sin(s.u[0]),
                           -s.x[1] * s.x[2] / s.x[0] + thrust(s) * np.cos(s.u[0])])  # fmt: skip
    p.add_cost("radius", lambda s: -s.x[0], where="end")
    p.bound_states([0.5, -5, -5], [5, 5, 5])
    p.start = [1, 0, 1]
    p.add_equality("circular", lambda s: [s.x[1], s.x[2] - s.x[0] ** -0.5], where="end")
    return p


@published(-1.01283, "COPS")
def goddard_rocket():
    def rate(s):
        h, v, m = s.x
        return [v, (s.u[0] - 310 * v**2 * np.exp(-500 * (h - 1))) / m - h**-2, -s.u[0] / 0.5]

    p = Problem("Goddard", ["h", "v", "m"], ["thrust"], 0.2, rate)
    p.add_cost("altitude", lambda s: -s.x[0], where="end")
    p.free_duration(0.05, 1)
    p.bound_controls(0, 3.5)
    p.bound_states([1, 0, 0.6], [2, 1, 1])
    p.start, p.goal = [1, 0, 1], [nan, nan, 0.6]
    return p


@published(-0.0480556, "COPS")
def catalyst_mixing():
    p = Problem("catalyst", ["a", "b"], ["u"], 1.0,
                lambda s: [s.u[0] * (10 * s.x[1] - s.x[0]),
                           s.u[0] * (s.x[0] - 10 * s.x[1]) - (1 - s.u[0]) * s.x[1]])  # fmt: skip
    p.add_cost("rest", lambda s: s.x[0] + s.x[1] - 1, where="end")
    p.bound_controls(0, 1)
    p.start = [1, 0]
    return p


@published(0.554571, "COPS")
def particle_steering():
    p = Problem("steering", ["x", "y", "vx", "vy"], ["angle"], 1.0,
                lambda s: [s.x[2], s.x[3], 100 * np.cos(s.u[0]), 100 * np.sin(s.u[0])])  # fmt: skip
    p.add_minimum_time()
    p.free_duration(0.05, 5)
    p.bound_controls(-pi / 2, pi / 2)
    p.start = [0, 0, 0, 0]
    p.add_equality("end", lambda s: [s.x[1] - 5, s.x[2] - 45, s.x[3]], where="end")
    return p


@published(29.3763, "Luus")
def rayleigh():
    p = Problem("Rayleigh", ["x", "v"], ["u"], 2.5,
                lambda s: [s.x[1], -s.x[0] + (1.4 - 0.14 * s.x[1] ** 2) * s.x[1] + 4 * s.u[0]])  # fmt: skip
    p.add_cost("squares", lambda s: s.x[0] ** 2 + s.u[0] ** 2)
    p.start = [-5, -5]
    return p


@published(0.133094, "Luus", 5e-4)
def stirred_tank():
    def rate(s):
        a, b = s.x
        reaction = (b + 0.5) * np.exp(25 * a / (a + 2))
        return [-2 * (a + 0.25) + reaction - (a + 0.25) * s.u[0], 0.5 - b - reaction]

    p = Problem("stirred tank", ["a", "b"], ["u"], 0.78, rate)
    p.add_cost("squares", lambda s: s.x[0] ** 2 + s.x[1] ** 2 + 0.1 * s.u[0] ** 2)
    p.start = [0.09, 0.09]
    return p


@published(2.98, "Luus", 2e-3)
def two_link_arm():
    def rate(s):
        (a, b, c, _), (u, w) = s.x, s.u
        size = 31 / 36 + 9 / 4 * np.sin(c) ** 2
        return [
            (np.sin(c) * (9 / 4 * np.cos(c) * a**2 + 2 * b**2) + 4 / 3 * (u - w) - 3 / 2 * np.cos(c) * w) / size,
            -(np.sin(c) * (7 / 2 * a**2 + 9 / 4 * np.cos(c) * b**2) - 7 / 3 * w + 3 / 2 * np.cos(c) * (u - w)) / size,
            b - a,
            a,
        ]

    p = Problem("two-link arm", ["a", "b", "c", "d"], ["u", "w"], 3.0, rate)
    p.add_minimum_time()
    p.free_duration(0.5, 20)
    p.bound_controls(-1, 1)
    p.start, p.goal = [0, 0, 0.5, 0], [0, 0, 0.5, 0.522]
    return p


@published(0.0375195, "Augustin")
def container_crane():
    def rate(s):
        x, (u, w) = s.x, s.u
        return [9 * r for r in (x[3], x[4], x[5], u + 17.2656 * x[2], w, -(u + 27.0756 * x[2] + 2 * x[4] * x[5]) / x[1])]

    p = Problem("crane", ["x", "l", "angle", "vx", "vl", "rate"], ["u", "w"], 1.0, rate)
    p.add_cost("swing", lambda s: 4.5 * (s.x[2] ** 2 + s.x[5] ** 2 + 0.01 * (s.u[0] ** 2 + s.u[1] ** 2)))
    p.bound_states([-inf, 1, -inf, -2.5, -1, -inf], [inf, inf, inf, 2.5, 1, inf])
    p.bound_controls([-2.83374, -0.80865], [2.83374, 0.71265])
    p.start, p.goal = [0, 22, 0, 0, -1, 0], [10, 14, 0, 2.5, 0, 0]
    return p


def hypersensitive_cost():
    root = lambda x: math.sqrt(x**6 + x**2)  # noqa: E731
    return quad(lambda x: root(x) - x**3, 0, 1.5)[0] + quad(lambda x: root(x) + x**3, 0, 1)[0]


@published(hypersensitive_cost, "Rao")
def hypersensitive():
    p = Problem("hypersensitive", ["x"], ["u"], 25.0, lambda s: [-(s.x[0] ** 3) + s.u[0]])
    p.add_cost("squares", lambda s: 0.5 * (s.x[0] ** 2 + s.u[0] ** 2))
    p.start, p.goal = [1.5], [1]
    return p


def landing_cost():
    """Free fall, then full thrust: from height 10 at -2, gravity 1.5, thrust 3."""
    speed = lambda t: -2 - 1.5 * t  # noqa: E731
    height = lambda t: 10 - 2 * t - 0.75 * t**2  # noqa: E731
    switch = brentq(lambda t: speed(t) ** 2 / 3 - height(t), 0, 2.5)
    return 3 * -speed(switch) / 1.5


@published(landing_cost, "Meditch")
def moon_landing():
    p = Problem("landing", ["h", "v"], ["thrust"], 4.0, lambda s: [s.x[1], s.u[0] - 1.5])
    p.add_cost("fuel", lambda s: s.u[0])
    p.free_duration(0.5, 20)
    p.bound_controls(0, 3)
    p.bound_states([0, -20], [20, 20])
    p.start, p.goal = [10, -2], [0, 0]
    return p


@published(2 * math.sqrt(5), "closed")
def two_axes():
    """Two double integrators in one time: the longer way, 5 with 1, decides."""
    p = Problem("two axes", ["x", "y", "vx", "vy"], ["ax", "ay"], 3.0, lambda s: [s.x[2], s.x[3], s.u[0], s.u[1]])
    p.add_minimum_time()
    p.add_cost("effort", lambda s: 1e-6 * s.u[1] ** 2)
    p.free_duration(0.1, 50)
    p.bound_controls(-1, 1)
    p.start, p.goal = [0, 0, 0, 0], [5, 2, 0, 0]
    return p


@published(5 / 2 + 2 / 1, "closed")
def speed_limit():
    """Least time over 5 with a speed of at most 2 and accelerations of at most 1: 5 / 2 + 2 / 1."""
    p = Problem("speed limit", ["x", "v"], ["a"], 1.0, lambda s: [s.x[1], s.u[0]])
    p.add_minimum_time()
    p.free_duration(0.1, 50)
    p.bound_controls(-1, 1)
    p.bound_states([-inf, -2], [inf, 2])
    p.start, p.goal = [0, 0], [5, 0]
    return p


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--method", default="automatic,riccati,ipopt", help="methods, separated by commas")
    options.add_argument("--table", help="write the table there, Markdown")
    given = options.parse_args()
    rows, short = [], 0
    for make, optimum, source, error in PROBLEMS:
        for method in given.method.split(","):
            begin = time.time()
            s = make().solve(method=method)
            off = abs(s.cost - optimum) / abs(optimum)
            holds = s.success and off <= error
            short += not holds
            rows.append((make.__name__, source, method, f"{optimum:.7g}", f"{s.cost:.7g}", f"{off:.1e}", str(s.iterations), f"{time.time() - begin:.2f}",
                         "yes" if holds else "no: " + s.verdict.split(".")[0]))  # fmt: skip
            print("  ".join(f"{v:16}" for v in rows[-1]), flush=True)
    print(f"{short} of {len(rows)} do not hold")
    if given.table:
        head = ("problem", "source", "method", "optimum", "cost", "off by", "iterations", "s", "holds")
        lines = ["| " + " | ".join(r) + " |" for r in [head, ("---",) * len(head), *rows]]
        with open(given.table, "w") as file:
            file.write("\n".join(lines) + "\n")
    return min(short, 255)


if __name__ == "__main__":
    sys.exit(main())
