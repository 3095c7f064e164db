// SPDX-License-Identifier: BSD-3-Clause
//
// Periodic gaits: maps the state at the end of a step to the state at the start of the next, equal step
// (Phases::close, phases.h).
//
//   const PeriodicGait step{.swapped = {{"left_hip", "right_hip"}, {"left_knee", "right_knee"}}, .advance = by};
//   Phases walk("walk");
//   walk.add("step", problem);                                            // start and goal free
//   walk.close(periodic_gait(scene, step, impact(scene, {swing_foot})));      // contact_changes.h
//
// The map does, in this order:
//
// - the impact, if given
// - swapped joints exchange positions and velocities, so that the left leg becomes the right one
// - positions are reduced by `advance`
//
// A floating base keeps its orientation and velocities: it is not mirrored.
//
// Errors.  ArgumentError: a joint that is unknown, swapped twice or with itself; swapped joints of different types;
// an advance of wrong size, or of joints that are not on a line.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <dyntape/interface/control/problem/stage.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

struct PeriodicGait {
  std::vector<std::pair<std::string, std::string>> swapped = {};  // joints
  Eigen::VectorXd advance = {};  // (nq) change of the positions per step; empty: zero
};

void check(const dynamics::Model<double>& model, const PeriodicGait& step);

// The map from the end of a step to the start of the next; an empty `impact` means none.
StageFunction periodic_gait(const RobotScene& scene, const PeriodicGait& step,
                            const StageFunction& impact = {});

// (nq) The positions at the end of a step that starts at q.
Eigen::VectorXd end_of_step(const dynamics::Model<double>& model, const PeriodicGait& step,
                            const Eigen::VectorXd& q);

}  // namespace dyntape
