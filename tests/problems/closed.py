# SPDX-License-Identifier: BSD-3-Clause
"""Optimal control problems whose optimum is a closed form, or follows from one equation in one unknown."""

import math

import numpy as np
from description import Known, Row
from scipy.integrate import quad
from scipy.optimize import brentq

pi, nan, inf = math.pi, math.nan, math.inf
CLOSED = []


def closed(optimum, source="closed", digits=1e-4):
    """Adds the problem that a function's keywords describe; its name is the function's."""

    def add(fields):
        best = optimum() if callable(optimum) else optimum
        CLOSED.append(Known(name=fields.__name__.replace("_", " "), optima=best, source=source, digits=digits, **fields()))
        return fields

    return add


def integrators(n):
    """x_0' = x_1, ..., x_(n-1)' = u."""
    return lambda m, x, u, t: [*x[1:], u[0]]


def rest_to_rest(n, way, **fields):
    return dict(states=n, controls=1, rate=integrators(n), start=[0] * n, goal=[way] + [0] * (n - 1), **fields)


def effort(m, x, u, t):
    return sum(v * v for v in u)


# Integrators: x' = v, v' = u, and longer chains.


@closed(2 * math.sqrt(3))
def least_time():
    return rest_to_rest(2, 3, duration=1.0, time=1, free=(0.1, 50), controls_within=(-1, 1))


@closed(32 ** (1 / 3))
def least_time_of_a_jerk():
    """Way d, jerk at most 1: a quarter up, half down, a quarter up; d = T^3 / 32."""
    return rest_to_rest(3, 1, duration=1.0, time=1, free=(0.1, 50), controls_within=(-1, 1))


@closed(0.5 + math.sqrt(0.25 + 8))
def least_time_of_a_jerk_with_limited_acceleration():
    """A / j + sqrt((A / j)^2 + 4 d / A) with A = 1/2."""
    return rest_to_rest(3, 1, duration=1.0, time=1, free=(0.1, 50), controls_within=(-1, 1), states_within=([-inf, -inf, -0.5], [inf, inf, 0.5]))


@closed(5 / 2 + 2 / 1)
def speed_limit():
    """Way / speed + speed / acceleration."""
    return rest_to_rest(2, 5, duration=1.0, time=1, free=(0.1, 50), controls_within=(-1, 1), states_within=([-inf, -2], [inf, 2]))


@closed(12 / 8)
def least_effort():
    """12 d^2 / T^3."""
    return rest_to_rest(2, 1, duration=2.0, cost=effort)


@closed(720 / 32)
def least_jerk():
    """720 d^2 / T^5."""
    return rest_to_rest(3, 1, duration=2.0, cost=effort)


@closed(100800 / 128)
def least_snap():
    """100800 d^2 / T^7."""
    return rest_to_rest(4, 1, duration=2.0, cost=effort)


@closed(3 - math.sqrt(5))
def least_fuel():
    """Full thrust for b, none, full brake for b: 1 = b (3 - b)."""
    return dict(states=2, controls=2, duration=3.0, rate=lambda m, x, u, t: [x[1], u[0] - u[1]], cost=lambda m, x, u, t: u[0] + u[1],
                controls_within=(0, 1), start=[0, 0], goal=[1, 0])  # fmt: skip


@closed(2 * math.sqrt(5))
def two_axes():
    """Two double integrators in one time: the longer way, 5 with 1, decides."""
    return dict(states=4, controls=2, duration=3.0, rate=lambda m, x, u, t: [x[2], x[3], u[0], u[1]], time=1, cost=lambda m, x, u, t: 1e-6 * u[1] ** 2,
                free=(0.1, 50), controls_within=(-1, 1), start=[0, 0, 0, 0], goal=[5, 2, 0, 0])  # fmt: skip


def denham(wall):
    return dict(states=2, controls=1, duration=1.0, rate=integrators(2), cost=lambda m, x, u, t: 0.5 * u[0] ** 2,
                states_within=([-inf, -inf], [wall, inf]), start=[0, 1], goal=[0, -1])  # fmt: skip


@closed(4.0, "Bryson")
def wall_at_a_ninth():
    """4 / (9 l): the motion stays at the wall."""
    return denham(1 / 9)


@closed(2 + 6 * (1 - 4 * 0.2) ** 2, "Bryson")
def wall_at_a_fifth():
    """2 + 6 (1 - 4 l)^2: the motion touches the wall."""
    return denham(0.2)


@closed(1.5)
def interception():
    """3 v^2 / (2 T)."""
    return dict(states=2, controls=1, duration=1.0, rate=integrators(2), cost=lambda m, x, u, t: 0.5 * u[0] ** 2, start=[0, 1], goal=[0, nan])


def landing_cost():
    """Free fall, then full thrust: from height 10 at -2, gravity 1.5, thrust 3."""
    switch = brentq(lambda t: (-2 - 1.5 * t) ** 2 / 3 - (10 - 2 * t - 0.75 * t**2), 0, 2.5)
    return 3 * (2 + 1.5 * switch) / 1.5


@closed(landing_cost, "Meditch, 1964")
def moon_landing():
    return dict(states=2, controls=1, duration=4.0, rate=lambda m, x, u, t: [x[1], u[0] - 1.5], cost=lambda m, x, u, t: u[0], free=(0.5, 20),
                controls_within=(0, 3), states_within=([0, -20], [20, 20]), start=[10, -2], goal=[0, 0])  # fmt: skip


def sled_time():
    """Full thrust for t, speed 1 - exp(-t), then full brake for ln(1 + speed)."""
    push = brentq(lambda t: t - math.log(2 - math.exp(-t)) - 1, 0.5, 5)
    return push + math.log(2 - math.exp(-push))


@closed(sled_time)
def sled_with_drag():
    return dict(states=2, controls=1, duration=1.0, rate=lambda m, x, u, t: [x[1], u[0] - x[1]], time=1, free=(0.1, 50), controls_within=(-1, 1),
                start=[0, 0], goal=[1, 0])  # fmt: skip


@closed(math.atan2(math.sqrt(15) / 4, 7 / 4) + math.acos(1 / 4))
def oscillator_to_rest():
    """Arcs about -1 of radius 2 and about 1 of radius 1, a radian in a unit of time."""
    return dict(states=2, controls=1, duration=1.0, rate=lambda m, x, u, t: [x[1], -x[0] + u[0]], time=1, free=(0.1, 50), controls_within=(-1, 1),
                start=[1, 0], goal=[0, 0])  # fmt: skip


# Linear systems with quadratic costs.


@closed(math.tanh(1) / 2, "Hager, 1976")
def scalar_regulator():
    return dict(states=1, controls=1, duration=1.0, rate=lambda m, x, u, t: [0.5 * x[0] + u[0]],
                cost=lambda m, x, u, t: 0.5 * (1.25 * x[0] ** 2 + x[0] * u[0] + u[0] ** 2), start=[1])  # fmt: skip


@closed((1 - math.exp(-3)) / (1 + 2 * math.exp(-3)), "Hager, 2000")
def second_scalar_regulator():
    """p / 2 of p' = p^2 - p - 2, p(1) = 0."""
    return dict(states=1, controls=1, duration=1.0, rate=lambda m, x, u, t: [0.5 * x[0] + u[0]], cost=lambda m, x, u, t: 0.5 * (u[0] ** 2 + 2 * x[0] ** 2),
                start=[1])  # fmt: skip


# Calculus of variations: x is the independent variable t, y' = u.


def cycloid():
    """Least time to fall from rest by (2, 2) at 9.81 m/s^2."""
    angle = brentq(lambda a: (a - math.sin(a)) / (1 - math.cos(a)) - 1, 0.1, 2 * pi - 0.1)
    return math.sqrt(2 / (1 - math.cos(angle)) / 9.81) * angle


@closed(cycloid, "Bernoulli")
def brachistochrone():
    return dict(states=3, controls=1, duration=1.0, rate=lambda m, x, u, t: [x[2] * m.sin(u[0]), x[2] * m.cos(u[0]), 9.81 * m.cos(u[0])], time=1,
                free=(0.1, 10), controls_within=(0, pi), start=[0, 0, 0], goal=[2, 2, nan])  # fmt: skip


def arc_area():
    """Of an arc of length 1.3 over a chord of 1."""
    half = brentq(lambda a: a / math.sin(a) - 1.3, 0.1, 3)
    return -(half - math.sin(half) * math.cos(half)) / (4 * math.sin(half) ** 2)


@closed(arc_area, "Dido")
def largest_area():
    return dict(states=2, controls=1, duration=1.0, rate=lambda m, x, u, t: [u[0], m.sqrt(1 + u[0] ** 2)], cost=lambda m, x, u, t: -x[0], start=[0, 0],
                goal=[0, 1.3])  # fmt: skip


def chain_energy():
    """Of a catenary from height 1 to 3 over a width of 1, of length 4: y = c cosh((t - s) / c) + h."""
    c = brentq(lambda c: 2 * c * math.sinh(1 / (2 * c)) - math.sqrt(12), 0.05, 10)
    s = 0.5 - c * math.atanh(2 / 4)
    h = 1 - c * math.cosh(s / c)
    return quad(lambda t: (c * math.cosh((t - s) / c) + h) * math.cosh((t - s) / c), 0, 1)[0]


@closed(chain_energy, "COPS")
def hanging_chain():
    return dict(states=2, controls=1, duration=1.0, rate=lambda m, x, u, t: [u[0], m.sqrt(1 + u[0] ** 2)],
                cost=lambda m, x, u, t: x[0] * m.sqrt(1 + u[0] ** 2), start=[1, 0], goal=[3, 4])  # fmt: skip


@closed(0.5 + math.sinh(1) / 2, "Euler")
def soap_film():
    """The catenoid y = cosh(t - 1/2); its area without 2 pi."""
    return dict(states=1, controls=1, duration=1.0, rate=lambda m, x, u, t: [u[0]], cost=lambda m, x, u, t: x[0] * m.sqrt(1 + u[0] ** 2),
                start=[math.cosh(0.5)], goal=[math.cosh(0.5)])  # fmt: skip


# Paths in the plane: of speed 1, or as told, by their direction.


@closed(math.acosh(3))
def speed_is_the_height():
    """A geodesic of the hyperbolic half-plane: cosh T = 1 + distance^2 / (2 y_0 y_1)."""
    return dict(states=2, controls=1, duration=1.0, rate=lambda m, x, u, t: [x[1] * m.cos(u[0]), x[1] * m.sin(u[0])], time=1, free=(0.1, 20),
                start=[0, 1], goal=[2, 1])  # fmt: skip


@closed(math.acos(math.sin(0.5) ** 2 + math.cos(0.5) ** 2 * math.cos(2)))
def great_circle():
    return dict(states=2, controls=1, duration=1.0, rate=lambda m, x, u, t: [m.cos(u[0]), m.sin(u[0]) / m.cos(x[0])], time=1, free=(0.1, 20),
                start=[0.5, 0], goal=[0.5, 2])  # fmt: skip


def zermelo_start():
    """Where a boat of speed 1 in a current -y along x starts that steers from 105 to 240 degrees and ends at the origin (Bryson, 2.7)."""
    first, last = math.radians(105), math.radians(240)
    sec = lambda v: 1 / math.cos(v)  # noqa: E731

    def x(v):
        return 0.5 * math.log(abs(sec(v) + math.tan(v))) - 0.5 * sec(v) * math.tan(v) + sec(last) * math.tan(v)

    return [x(first) - x(last), sec(first) - sec(last)]


@closed(math.tan(math.radians(240)) - math.tan(math.radians(105)), "Zermelo")
def boat_in_a_current():
    return dict(states=2, controls=1, duration=5.0, rate=lambda m, x, u, t: [m.cos(u[0]) - x[1], m.sin(u[0])], time=1, free=(0.1, 50),
                start=zermelo_start(), goal=[0, 0])  # fmt: skip


@closed(pi / 2 + 3 * math.sqrt(2), "Dubins")
def car_that_turns_left():
    """Left by 45 degrees, straight, left by 45 degrees."""
    return dict(states=3, controls=1, duration=5.0, rate=lambda m, x, u, t: [m.cos(x[2]), m.sin(x[2]), u[0]], time=1, free=(0.1, 50),
                controls_within=(-1, 1), start=[0, 0, 0], goal=[4, 4, pi / 2])  # fmt: skip


@closed(2 * math.sqrt(4.01 - 1) + 2 * math.atan2(2, 0.1) - 2 * math.acos(1 / math.sqrt(4.01)))
def way_around_a_disc():
    """Two tangents and an arc, on the side on which the disc stands out less."""
    return dict(states=2, controls=1, duration=4.0, rate=lambda m, x, u, t: [m.cos(u[0]), m.sin(u[0])], time=1, free=(0.1, 50), start=[-2, 0],
                goal=[2, 0], rows=[Row(lambda m, x, u, t: x[0] ** 2 + (x[1] + 0.1) ** 2 - 1)])  # fmt: skip


@closed(2 * pi, "Brockett")
def car_that_parks():
    """Around an area of a half: 4 pi area / T."""
    return dict(states=3, controls=2, duration=1.0, rate=lambda m, x, u, t: [u[0], u[1], x[0] * u[1] - x[1] * u[0]], cost=effort, start=[0, 0, 0],
                goal=[0, 0, 1])  # fmt: skip


# Singular arcs.


@closed(1 / 3)
def down_and_stay():
    return dict(states=1, controls=1, duration=2.0, rate=lambda m, x, u, t: [u[0]], cost=lambda m, x, u, t: x[0] ** 2, controls_within=(-1, 1), start=[1])


def aly_cost():
    """Full brake until t, then x'' = x, with x' = 0 at the end."""
    t = brentq(lambda t: 1 - t + (t - t**2 / 2) * math.tanh(5 - t), 1, 2)
    return quad(lambda s: (s - s**2 / 2) ** 2 + (1 - s) ** 2, 0, t)[0] / 2 - (t - t**2 / 2) * (1 - t) / 2


@closed(aly_cost, "Aly, 1978")
def singular_regulator():
    return dict(states=2, controls=1, duration=5.0, rate=integrators(2), cost=lambda m, x, u, t: 0.5 * (x[0] ** 2 + x[1] ** 2), controls_within=(-1, 1),
                start=[0, 1])  # fmt: skip


def harvest():
    """No catch to a half, a quarter meanwhile, full catch to a tenth; all in 5."""
    grow = math.log(9)
    fall = 2 / math.sqrt(3) * math.atan(0.8 / math.sqrt(3))
    return -((5 - grow - fall) / 4 + fall)


@closed(harvest, "Clark")
def fishery():
    return dict(states=1, controls=1, duration=5.0, rate=lambda m, x, u, t: [x[0] * (1 - x[0]) - u[0]], cost=lambda m, x, u, t: -u[0],
                controls_within=(0, 1), start=[0.1], goal=[0.1])  # fmt: skip


# Long and nearly singular.


def hypersensitive_cost():
    root = lambda x: math.sqrt(x**6 + x**2)  # noqa: E731
    return quad(lambda x: root(x) - x**3, 0, 1.5)[0] + quad(lambda x: root(x) + x**3, 0, 1)[0]


def hypersensitive_for(duration):
    return dict(states=1, controls=1, duration=duration, rate=lambda m, x, u, t: [-(x[0] ** 3) + u[0]],
                cost=lambda m, x, u, t: 0.5 * (x[0] ** 2 + u[0] ** 2), start=[1.5], goal=[1])  # fmt: skip


@closed(hypersensitive_cost, "Rao and Mease, 1999")
def hypersensitive():
    return hypersensitive_for(25.0)


@closed(hypersensitive_cost, "Rao and Mease, 1999")
def hypersensitive_and_long():
    return hypersensitive_for(1000.0)


# Economics.


def ramsey_cost():
    """c = c_0 exp(2 (r - rho) t), the budget spent: -2 sqrt(W I), I the integral of exp((r - 2 rho) t)."""
    k = 0.1 - 2 * 0.15
    return -2 * math.sqrt(10 * (math.exp(k * 8) - 1) / k)


@closed(ramsey_cost, "Ramsey, 1928")
def saving():
    return dict(states=1, controls=1, duration=8.0, rate=lambda m, x, u, t: [0.1 * x[0] - u[0]],
                cost=lambda m, x, u, t: -2 * m.exp(-0.15 * t) * m.sqrt(u[0]), controls_within=(0.01, 100), start=[10], goal=[0])  # fmt: skip


assert all(np.all(np.isfinite(k.optima)) for k in CLOSED)
