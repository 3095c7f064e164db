# SPDX-License-Identifier: BSD-3-Clause
"""Thousands of states at once: torques, their derivatives, and thousands of motions."""

import sys

import dyntape
import numpy as np

config = sys.argv[1] if len(sys.argv) > 1 else dyntape.config_folder()
arm = dyntape.load(f"{config}/robots/panda.urdf", lock=["panda_finger_joint1", "panda_finger_joint2"])
q = arm.random(10_000)
v = a = np.zeros_like(q)
print("torques", arm.rnea(q, v, a).shape, "by q", arm.id_derivatives(q, v, a).dtau_dq.shape)

scene = dyntape.Scene(f"{config}/scenes/pendulum.info")
x0 = np.stack([np.linspace(-3, 3, 1000), np.zeros(1000)], axis=1)
x = scene.rollout(x0, steps=500)
print("motions", x.shape, "of which", int(np.isfinite(x).all(axis=(1, 2)).sum()), "came to their end")
