# SPDX-License-Identifier: BSD-3-Clause
"""A robot to a verified motion: the hand reaches behind a post."""

import sys

import dyntape

config = sys.argv[1] if len(sys.argv) > 1 else dyntape.config_folder()
arm = dyntape.load(f"{config}/robots/ur5.urdf")
place = [0.4, 0.4, 0.3]

p = arm.problem(2, form="inverse")
p.add_accelerations()
p.add_equality("place", p.frame_error("tool0", place), where="end")
p.keep_clear(("hand", "tool0", [0, 0, 0], 0.08), ("post", [0.6, 0.1, 0], [0.6, 0.1, 0.8], 0.05))
p.limit_positions()
p.limit_efforts()
p.start_at([-0.8, -1.2, 1.4, -0.6, 0.9, 0.2])
p.end_at()
there = p.inverse_kinematics("tool0", place)
assert there is not None
p.guess_towards(there)

motion = p.solve()
print(motion)
with open("motion.html", "w") as page:
    page.write(motion.page())
sys.exit(0 if motion.success else 1)
