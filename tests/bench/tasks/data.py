# SPDX-License-Identifier: BSD-3-Clause
"""What the six tasks are about, the same for all who do them; arrays only."""
import pathlib

import numpy as np

ROBOT = str(pathlib.Path(__file__).resolve().parents[3] / 'config/robots/panda.urdf')
LOCKED = ['panda_finger_joint1', 'panda_finger_joint2']  # at 0
N = 7
TARGET = np.array([0.4, 0.1, 0.5])                                      # m, of the hand
START, GOAL = np.array([0, -.5, 0, -2, 0, 1.5, .5]), np.array([1, .5, -.5, -1.2, .5, 2, -.5])
ANGLE, RATE, TORQUE, END = 10, .1, 1e-3, 100                            # weights of squares
STEP, STEPS = 1e-3, 100                                                 # s


def states(count):
    """(count, 7) q, v and accelerations or torques; around the middle of the limits."""
    rng = np.random.default_rng(1)
    return np.array([0, 0, 0, -1.5, 0, 1.8, 0]) + rng.uniform(-1, 1, (count, N)), rng.uniform(-1, 1, (count, N)), rng.uniform(-5, 5, (count, N))
