# SPDX-License-Identifier: BSD-3-Clause
"""Optimal control problems with published optima.

Sources:
  Augustin  Augustin and Maurer, "Sensitivity analysis and real-time control of a container crane", 2001
  Betts     Betts, "Practical methods for optimal control using nonlinear programming", 3rd ed., 2020
  Bryson    Bryson and Ho, "Applied optimal control", 1975
  COPS      Dolan, More and Munson, "Benchmarking optimization software with COPS 3.0", 2004
  Dadebo    Dadebo and McAuley, "Dynamic optimization of constrained chemical engineering problems", 1995
  Jacobson  Jacobson and Lele, "A transformation technique for optimal control problems with a state variable inequality", 1969
  Luus      Luus, "Iterative dynamic programming", 2000
  Sager     Sager, "A benchmark library of mixed-integer optimal control problems", 2012; controls relaxed to [0, 1]
  Vlassenbroeck   Vlassenbroeck and Van Dooren, "A Chebyshev technique for solving nonlinear optimal control problems", 1988
"""

import math

from description import Known, Row

pi, nan, inf = math.pi, math.nan, math.inf
PUBLISHED = []


def published(optimum, source, digits=1e-4):
    """Adds the problem that a function's keywords describe; its name is the function's."""

    def add(fields):
        PUBLISHED.append(Known(name=fields.__name__.replace("_", " "), optima=optimum, source=source, digits=digits, **fields()))
        return fields

    return add


@published(-1.52527, "Bryson", 2e-4)
def earth_to_mars():
    """Largest radius of a circular orbit after 3.3207 units of time."""

    def rate(m, x, u, t):
        thrust = 0.1405 / (1 - 0.0749 * t)
        return [x[1], x[2] ** 2 / x[0] - 1 / x[0] ** 2 + thrust * m.sin(u[0]), -x[1] * x[2] / x[0] + thrust * m.cos(u[0])]

    return dict(states=3, controls=1, duration=3.3207, rate=rate, end_cost=lambda m, x: -x[0], states_within=([0.5, -5, -5], [5, 5, 5]),
                start=[1, 0, 1], rows=[Row(lambda m, x, u, t: x[1], 0, 0, True), Row(lambda m, x, u, t: x[2] - x[0] ** -0.5, 0, 0, True)])  # fmt: skip


@published(-1.01283, "COPS")
def goddard_rocket():
    def rate(m, x, u, t):
        h, v, mass = x
        return [v, (u[0] - 310 * v**2 * m.exp(-500 * (h - 1))) / mass - h**-2, -u[0] / 0.5]

    return dict(states=3, controls=1, duration=0.2, rate=rate, end_cost=lambda m, x: -x[0], free=(0.05, 1), controls_within=(0, 3.5),
                states_within=([1, 0, 0.6], [2, 1, 1]), start=[1, 0, 1], goal=[nan, nan, 0.6])  # fmt: skip


@published(-0.0480556, "COPS")
def catalyst_mixing():
    def rate(m, x, u, t):
        return [u[0] * (10 * x[1] - x[0]), u[0] * (x[0] - 10 * x[1]) - (1 - u[0]) * x[1]]

    return dict(states=2, controls=1, duration=1.0, rate=rate, end_cost=lambda m, x: x[0] + x[1] - 1, controls_within=(0, 1), start=[1, 0])


@published(0.554571, "COPS")
def particle_steering():
    return dict(states=4, controls=1, duration=1.0, rate=lambda m, x, u, t: [x[2], x[3], 100 * m.cos(u[0]), 100 * m.sin(u[0])], time=1,
                free=(0.05, 5), controls_within=(-pi / 2, pi / 2), start=[0, 0, 0, 0], goal=[nan, 5, 45, 0])  # fmt: skip


@published(9.1409, "COPS", 2e-4)
def robot_arm():
    """A telescopic arm of length 5 turns by 120 degrees: length, azimuth, elevation, and their rates."""

    def rate(m, x, u, t):
        inertia = ((5 - x[0]) ** 3 + x[0] ** 3) / 3
        return [x[3], x[4], x[5], u[0] / 5, u[1] / (inertia * m.sin(x[2]) ** 2), u[2] / inertia]

    return dict(states=6, controls=3, duration=1.0, rate=rate, time=1, free=(0.1, 100), controls_within=(-1, 1),
                states_within=([0, -pi, 0, -inf, -inf, -inf], [5, pi, pi, inf, inf, inf]),
                start=[4.5, 0, pi / 4, 0, 0, 0], goal=[4.5, 2 * pi / 3, pi / 4, 0, 0, 0])  # fmt: skip


@published(-1248.03, "COPS", 3e-4)
def hang_glider():
    """Largest distance through an updraft: position, height and their rates in m and s; the lift coefficient."""

    def rate(m, x, u, t):
        above = (x[0] / 100 - 2.5) ** 2
        sink = x[3] - 2.5 * (1 - above) * m.exp(-above)
        speed = m.sqrt(x[2] ** 2 + sink**2)
        pressure = 0.5 * 1.13 * 14 * speed / 100  # of speed times a component, for a mass of 100 kg
        drag = 0.034 + 0.069662 * u[0] ** 2
        return [x[2], x[3], pressure * (-u[0] * sink - drag * x[2]), pressure * (u[0] * x[2] - drag * sink) - 9.81]

    return dict(states=4, controls=1, duration=100.0, rate=rate, end_cost=lambda m, x: -x[0], free=(10, 200), controls_within=(0, 1.4),
                states_within=([0, -inf, 0, -inf], [inf, inf, inf, inf]), start=[0, 1000, 13.2275675, -1.28750052],
                goal=[nan, 900, 13.2275675, -1.28750052])  # fmt: skip


@published(29.3763, "Luus")
def rayleigh():
    return dict(states=2, controls=1, duration=2.5, rate=lambda m, x, u, t: [x[1], -x[0] + (1.4 - 0.14 * x[1] ** 2) * x[1] + 4 * u[0]],
                cost=lambda m, x, u, t: x[0] ** 2 + u[0] ** 2, start=[-5, -5])  # fmt: skip


@published(0.133094, "Luus", 5e-4)
def stirred_tank():
    def rate(m, x, u, t):
        reaction = (x[1] + 0.5) * m.exp(25 * x[0] / (x[0] + 2))
        return [-2 * (x[0] + 0.25) + reaction - (x[0] + 0.25) * u[0], 0.5 - x[1] - reaction]

    return dict(states=2, controls=1, duration=0.78, rate=rate, cost=lambda m, x, u, t: x[0] ** 2 + x[1] ** 2 + 0.1 * u[0] ** 2, start=[0.09, 0.09])


@published(2.98, "Luus", 2e-3)
def two_link_arm():
    def rate(m, x, u, t):
        a, b, c, _ = x
        sine, cosine = m.sin(c), m.cos(c)
        size = 31 / 36 + 9 / 4 * sine**2
        return [(sine * (9 / 4 * cosine * a**2 + 2 * b**2) + 4 / 3 * (u[0] - u[1]) - 3 / 2 * cosine * u[1]) / size,
                -(sine * (7 / 2 * a**2 + 9 / 4 * cosine * b**2) - 7 / 3 * u[1] + 3 / 2 * cosine * (u[0] - u[1])) / size,
                b - a, a]  # fmt: skip

    return dict(states=4, controls=2, duration=3.0, rate=rate, time=1, free=(0.5, 20), controls_within=(-1, 1), start=[0, 0, 0.5, 0],
                goal=[0, 0, 0.5, 0.522])  # fmt: skip


@published(-0.610775, "Dadebo")
def batch_reactor():
    """A to B to C: most B after an hour, by the temperature in units of 100 K."""

    def rate(m, x, u, t):
        first, second = 4000 * m.exp(-25 / u[0]), 620000 * m.exp(-50 / u[0])
        return [-first * x[0] ** 2, first * x[0] ** 2 - second * x[1]]

    return dict(states=2, controls=1, duration=1.0, rate=rate, end_cost=lambda m, x: -x[1], controls_within=(2.98, 3.98), start=[1, 0])


@published(-0.573545, "Dadebo")
def parallel_reactions():
    return dict(states=2, controls=1, duration=1.0, rate=lambda m, x, u, t: [-(u[0] + u[0] ** 2 / 2) * x[0], u[0] * x[0]],
                end_cost=lambda m, x: -x[1], controls_within=(0, 5), start=[1, 0])  # fmt: skip


@published(0.0375195, "Augustin")
def container_crane():
    def rate(m, x, u, t):
        return [9 * r for r in (x[3], x[4], x[5], u[0] + 17.2656 * x[2], u[1], -(u[0] + 27.0756 * x[2] + 2 * x[4] * x[5]) / x[1])]

    return dict(states=6, controls=2, duration=1.0, rate=rate,
                cost=lambda m, x, u, t: 4.5 * (x[2] ** 2 + x[5] ** 2 + 0.01 * (u[0] ** 2 + u[1] ** 2)),
                states_within=([-inf, 1, -inf, -2.5, -1, -inf], [inf, inf, inf, 2.5, 1, inf]),
                controls_within=([-2.83374, -0.80865], [2.83374, 0.71265]), start=[0, 22, 0, 0, -1, 0], goal=[10, 14, 0, 2.5, 0, 0])  # fmt: skip


def damped(m, x, u, t):
    return [x[1], -x[1] + u[0]]


@published(0.169832, "Jacobson", 1e-3)
def limit_of_speed():
    return dict(states=2, controls=1, duration=1.0, rate=damped, cost=lambda m, x, u, t: x[0] ** 2 + x[1] ** 2 + 0.005 * u[0] ** 2, start=[0, -1],
                rows=[Row(lambda m, x, u, t: 8 * (t - 0.5) ** 2 - 0.5 - x[1])])  # fmt: skip


@published(1.68569, "Vlassenbroeck", 2e-4)
def van_der_pol():
    return dict(states=2, controls=1, duration=5.0, rate=lambda m, x, u, t: [x[1], -x[0] + (1 - x[0] ** 2) * x[1] + u[0]],
                cost=lambda m, x, u, t: 0.5 * (x[0] ** 2 + x[1] ** 2 + u[0] ** 2), start=[1, 0],
                rows=[Row(lambda m, x, u, t: x[1] - x[0], 1, 1, True)])  # fmt: skip


@published(1.344076, "Sager")
def fishing():
    def rate(m, x, u, t):
        return [x[0] - x[0] * x[1] - 0.4 * x[0] * u[0], -x[1] + x[0] * x[1] - 0.2 * x[1] * u[0]]

    return dict(states=2, controls=1, duration=12.0, rate=rate, cost=lambda m, x, u, t: (x[0] - 1) ** 2 + (x[1] - 1) ** 2, controls_within=(0, 1),
                start=[0.5, 0.7])  # fmt: skip


@published(2030.85609, "Betts", 5e-4)
def alp_rider():
    def rate(m, x, u, t):
        a, b, c, d = x
        return [-10 * a + u[0] + u[1], -2 * b + u[0] + 2 * u[1], -3 * c + 5 * d + u[0] - u[1], 5 * c - 3 * d + u[0] + 3 * u[1]]

    def above(m, x, u, t):
        peaks = [(3, 3, 12), (3, 6, 10), (3, 10, 6), (8, 15, 4)]
        return sum(v * v for v in x) - sum(height * m.exp(-width * (t - at) ** 2) for height, at, width in peaks) - 0.01

    return dict(states=4, controls=2, duration=20.0, rate=rate,
                cost=lambda m, x, u, t: 100 * sum(v * v for v in x) + 0.01 * (u[0] ** 2 + u[1] ** 2), start=[2, 1, 2, 1], goal=[2, 3, 1, -2],
                rows=[Row(above)])  # fmt: skip


@published(7.91015, "Betts", 5e-4)
def free_flying_robot():
    """Least fuel of four thrusters that turn and move a robot in the plane; the duration is 12."""

    def rate(m, x, u, t):
        left, right = u[0] - u[1], u[2] - u[3]
        return [x[3], x[4], x[5], (left + right) * m.cos(x[2]), (left + right) * m.sin(x[2]), 0.2 * (left - right)]

    return dict(states=6, controls=4, duration=12.0, rate=rate, cost=lambda m, x, u, t: sum(u), controls_within=(0, 1),
                start=[-10, -10, pi / 2, 0, 0, 0], goal=[0, 0, 0, 0, 0, 0],
                rows=[Row(lambda m, x, u, t: u[0] + u[1], -inf, 1), Row(lambda m, x, u, t: u[2] + u[3], -inf, 1)])  # fmt: skip


@published(7571.67158, "Betts")
def tumour():
    """Smallest volume of a tumour by a drug of limited amount: volume, vessels, amount."""
    size = ((5.85 - 0.02) / 0.00873) ** 1.5

    def rate(m, x, u, t):
        p, q, _ = x
        return [-0.084 * p * m.log(p / q), q * (5.85 - 0.02 - 0.00873 * p ** (2 / 3) - 0.15 * u[0]), u[0]]

    return dict(states=3, controls=1, duration=1.0, rate=rate, end_cost=lambda m, x: x[0], free=(0.1, 10), controls_within=(0, 75),
                states_within=([0.01 * size, 0.01 * size, 0], [size, size, 15]), start=[size / 2, size / 4, 0])  # fmt: skip


@published(-0.595876, "Betts", 2e-4)
def shuttle_reentry():
    """Largest cross range: height in ft, longitude, latitude, speed in ft/s, path angle, azimuth; angle of attack, bank angle."""

    def rate(m, x, u, t):
        height, _, latitude, speed, path, azimuth = x
        radius = 20902900 + height
        gravity = 0.14076539e17 / radius**2
        pressure = 0.5 * 0.002378 * m.exp(-height / 23800) * speed**2 * 2690 / (203000 / 32.174)
        degrees = 180 / pi * u[0]
        lift = pressure * (-0.20704 + 0.029244 * degrees)
        drag = pressure * (0.07854 - 0.61592e-2 * degrees + 0.621408e-3 * degrees**2)
        along = speed / radius * m.cos(path)
        return [speed * m.sin(path), along * m.sin(azimuth) / m.cos(latitude), along * m.cos(azimuth), -drag - gravity * m.sin(path),
                lift / speed * m.cos(u[1]) + m.cos(path) * (speed / radius - gravity / speed),
                lift * m.sin(u[1]) / (speed * m.cos(path)) + along * m.sin(azimuth) * m.sin(latitude) / m.cos(latitude)]  # fmt: skip

    rad, most = pi / 180, 89 * pi / 180
    return dict(states=6, controls=2, duration=2000.0, rate=rate, end_cost=lambda m, x: -x[2], free=(100, 4000),
                states_within=([0, -inf, -most, 1, -most, -inf], [300000, inf, most, 45000, most, inf]),
                controls_within=([-pi / 2, -most], [pi / 2, rad]), start=[260000, 0, 0, 25600, -rad, pi / 2],
                goal=[80000, nan, nan, 2500, -5 * rad, nan])  # fmt: skip
