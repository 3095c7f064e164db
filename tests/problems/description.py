# SPDX-License-Identifier: BSD-3-Clause
"""An optimal control problem with a known optimum, as data that dyntape and CasADi both read.

    Known("least time", 2, 1, 1.0, lambda m, x, u, t: [x[1], u[0]], optima=2 * math.sqrt(3), source="closed", time=1, free=(0.1, 50),
          controls_within=(-1, 1), start=[0, 0], goal=[3, 0])

Functions take a module m (numpy, or CasADi's with the same names), states x, controls u and the time t, and return lists or numbers.
"""

import dataclasses
import math
from collections.abc import Callable, Sequence

import numpy as np


@dataclasses.dataclass
class Row:
    """lower <= function(m, x, u, t) <= upper along the path, or at its end."""

    function: Callable
    lower: float = 0.0
    upper: float = math.inf
    at_end: bool = False


@dataclasses.dataclass
class Known:
    name: str
    states: int
    controls: int
    duration: float  # where free, the guess
    rate: Callable
    optima: float | Sequence[float]  # one of them
    source: str = "closed"
    digits: float = 1e-4  # relative; 5e-3 where a kind says so
    cost: Callable | None = None  # integrated
    end_cost: Callable | None = None
    time: float = 0.0  # weight of the duration
    free: tuple[float, float] | None = None  # shortest and longest duration
    start: Sequence[float] = ()  # NaN: free
    goal: Sequence[float] | None = None  # NaN: free
    controls_within: tuple | None = None
    states_within: tuple | None = None
    rows: Sequence[Row] = ()

    def off(self, cost):
        """The relative distance to the nearest optimum."""
        return min(abs(cost - best) / max(abs(best), 1e-9) for best in np.atleast_1d(self.optima))


@dataclasses.dataclass
class Answer:
    success: bool
    cost: float
    iterations: int
    seconds: float
    verdict: str
    digits: float = 0.0  # of a solver on a given mesh

    def word(self, known):
        """right, refused or false; the last is a success with a wrong cost."""
        most = max(known.digits, self.digits)
        return "refused" if not self.success else "right" if known.off(self.cost) <= most else "false"
