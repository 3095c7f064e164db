# SPDX-License-Identifier: BSD-3-Clause
"""Robot dynamics with exact derivatives: recorded, simplified, compiled, served.

>>> robot = dyntape.load("config/robots/panda.urdf", lock=["panda_finger_joint1", "panda_finger_joint2"])
>>> q, v = robot.random(1000), np.zeros((1000, robot.nv))   # the leading axes are batch axes
>>> robot.rnea(q, v, v).shape
(1000, 7)
>>> f = dyntape.record(lambda x: np.sin(x[0]) * x[1], 2)
>>> f.jacobian([0.0, 3.0])
array([3., 0.])
"""

import pathlib as _pathlib

from . import _displays, _dyntape, _messages
from ._arrays import RecordedArray, array, norm, safe_divide, where
from ._bodies import Body, Shape, assemble
from ._dyntape import (
    AD,
    ClosedLoop,
    ArgumentError,
    Condition,
    Ddp,
    DdpSolution,
    DdpSolutions,
    Device,
    Error,
    FileError,
    Function,
    GuardViolation,
    Identification,
    MissingError,
    Mpc,
    MpcStep,
    Nonzeros,
    NumericalError,
    Problem,
    RecordingError,
    Robot,
    Scene,
    Simulation,
    Solution,
    Stage,
    StageFunction,
    Task,
    TaskSolution,
    ToolError,
    __version__,
    control,
    devices,
    load,
    load_text,
    maximum,
    minimum,
    record,
    simulate,
    solve,
    sweep,
    symmetric_solve,
)
from ._pictures import Pictures
from ._quadratic import QuadraticGradients, QuadraticLayer, QuadraticPoint

__all__ = [
    "AD",
    "ArgumentError",
    "Body",
    "ClosedLoop",
    "Condition",
    "Ddp",
    "DdpSolution",
    "DdpSolutions",
    "Device",
    "Error",
    "FileError",
    "Function",
    "GuardViolation",
    "Identification",
    "MissingError",
    "Mpc",
    "MpcStep",
    "Nonzeros",
    "NumericalError",
    "Pictures",
    "Problem",
    "QuadraticGradients",
    "QuadraticLayer",
    "QuadraticPoint",
    "RecordedArray",
    "RecordingError",
    "Robot",
    "Scene",
    "Shape",
    "Simulation",
    "Solution",
    "Stage",
    "StageFunction",
    "Task",
    "TaskSolution",
    "ToolError",
    "__version__",
    "array",
    "assemble",
    "config_folder",
    "control",
    "devices",
    "load",
    "load_text",
    "maximum",
    "minimum",
    "norm",
    "record",
    "safe_divide",
    "simulate",
    "solve",
    "sweep",
    "symmetric_solve",
    "where",
]


def config_folder() -> _pathlib.Path:
    """The folder with the robots, scenes and tasks that come with the package."""
    return _pathlib.Path(__file__).parent / "config"


_displays.show_in_notebooks(_dyntape)
for _value in vars(_dyntape).values():  # AD and Condition are looked up in by numpy, for every operation
    if isinstance(_value, type) and not issubclass(_value, (Exception, tuple, AD, Condition)):
        _messages.explain_missing_attributes(_value)
for _value in [globals()[_name] for _name in __all__]:
    if isinstance(_value, type) and _value.__module__ == _dyntape.__name__:
        _value.__module__ = __name__  # the public name, in repr and pickles
