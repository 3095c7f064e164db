# ---
# jupyter:
#   jupytext:
#     text_representation:
#       extension: .py
#       format_name: percent
#   kernelspec:
#     display_name: Python 3
#     name: python3
# ---

# %% [markdown]
# # A tour of dyntape
#
# A notebook as text: `jupytext --to notebook tour.py` makes `tour.ipynb`; as it stands it is a program.

# %%
import sys

import dyntape
import numpy as np

config = sys.argv[1] if len(sys.argv) > 1 and not sys.argv[1].startswith("-") else dyntape.config_folder()
arm = dyntape.load(f"{config}/robots/ur5.urdf")
arm

# %% [markdown]
# ## Many states at once
#
# The leading axes of arguments are batch axes.

# %%
q = arm.random(10_000, seed=1)
v = np.zeros((10_000, 6))
tau = arm.rnea(q, v, v)
print("torques at rest:", np.abs(tau).max(axis=0).round(1), "N m at most")

# %% [markdown]
# ## A function of your own
#
# Recorded once, derived exactly.


# %%
def cost(q: dyntape.RecordedArray, target: dyntape.RecordedArray) -> object:
    return ((arm.frame_placement(q, frame="tool0").p - target) ** 2).sum()


f = dyntape.record(cost, 6, 3).compile()
H = f.hessian(q, np.array([0.4, 0.1, 0.5]))
print("Hessians", H.shape, "symmetric to", np.abs(H - H.transpose(0, 2, 1)).max())

# %% [markdown]
# ## A motion
#
# Optimised and verified; in a notebook, the result shows itself as a page that plays it.

# %%
p = arm.problem(2, form="inverse")
p.add_accelerations()
p.limit_positions()
p.limit_efforts()
p.start_at([-0.8, -1.2, 1.4, -0.6, 0.9, 0.2])
p.end_at([0.6, -1.0, 1.2, -0.4, 0.9, 0.2])
motion = p.solve()
motion

# %% [markdown]
# ## Roll-outs with gradients
#
# A pendulum from 100 angles, and how each final angle depends on where it began.

# %%
scene = dyntape.Scene(f"{config}/scenes/pendulum.info")
x0 = np.column_stack([np.linspace(-2, 2, 100), np.zeros(100)])
u = np.zeros((500, scene.nu))
x = scene.rollout(x0, u)
w = np.zeros_like(x)
w[:, -1, 0] = 1
_, by_x0, _ = scene.rollout_gradient(x0, u, w)
print("final angles", x.shape, "their slopes", by_x0[:, 0].round(2)[:5])
assert motion.success and np.isfinite(by_x0).all()
