# SPDX-License-Identifier: BSD-3-Clause
"""A cost of one's own on a robot, with its exact Hessian: how far the hand is from a target that moves."""

import sys

import dyntape
import numpy as np

config = sys.argv[1] if len(sys.argv) > 1 else dyntape.config_folder()
arm = dyntape.load(f"{config}/robots/ur5.urdf")


def cost(q: dyntape.RecordedArray, target: dyntape.RecordedArray) -> object:
    return ((arm.frame_placement(q, frame="tool0").p - target) ** 2).sum()


f = dyntape.record(cost, 6, 3).compile()
q, target = arm.random(100), np.array([0.4, 0.1, 0.5])
H = f.hessian(q, target)
print(f, "\nHessians", H.shape, "the first:\n", H[0].round(3))
