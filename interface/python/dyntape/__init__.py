# SPDX-License-Identifier: BSD-3-Clause
"""Robot dynamics with exact derivatives: recorded, simplified, compiled, served.

>>> robot = dyntape.load("panda.urdf")
>>> robot.rnea(q, v, a)                                  # (..., nq), (..., nv), (..., nv) -> (..., nv)
>>> f = dyntape.record(lambda x: np.sin(x[0]) * x[1], 2)
>>> f.jacobian([0.0, 3.0])
array([3., 0.])
"""

from ._arrays import RecordedArray, where
from ._dyntape import (
    AD,
    ArgumentError,
    Condition,
    Error,
    FileError,
    Function,
    GuardViolation,
    NumericalError,
    RecordingError,
    Robot,
    ToolError,
    __version__,
    load,
    maximum,
    minimum,
    record,
)

__all__ = [
    "AD",
    "ArgumentError",
    "Condition",
    "Error",
    "FileError",
    "Function",
    "GuardViolation",
    "NumericalError",
    "RecordedArray",
    "RecordingError",
    "Robot",
    "ToolError",
    "__version__",
    "load",
    "maximum",
    "minimum",
    "record",
    "where",
]
