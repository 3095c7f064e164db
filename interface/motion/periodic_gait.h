// SPDX-License-Identifier: BSD-3-Clause
//
// Motions that go on for ever, as walking does: what becomes of the state at the end of a step, so that the next step begins as
// this one did (Phases::close, phases.h).
//
//   const PeriodicGait step{.swapped = {{"left_hip", "right_hip"}, {"left_knee", "right_knee"}}, .advance = by};
//   Phases walk("walk");
//   walk.add("step", problem);                                            // start and goal free
//   walk.close(periodic_gait(scene, step, impact(scene, {swing_foot})));      // contact_changes.h
//
// In the order of time: the impact, if there is one; joints that are swapped take each other's positions and velocities, so that
// the left leg is called the right one; positions go back by what the step advances.  A floating base keeps its orientation and
// its velocities: it is not mirrored.
//
// Errors: ArgumentError for a joint that is unknown or swapped twice or with itself, for joints of different types, for an advance
// of another size, or of joints that have no position on a line.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <dyntape/interface/control/problem/stage.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

struct PeriodicGait {
  std::vector<std::pair<std::string, std::string>> swapped = {};  // joints
  Eigen::VectorXd advance = {};  // (nq) what positions gain from step to step; empty: nothing
};

void check(const dynamics::Model<double>& model, const PeriodicGait& step);

// The state at the beginning of the next step from that at the end of this one; `impact` empty: there is none.
StageFunction periodic_gait(const RobotScene& scene, const PeriodicGait& step,
                            const StageFunction& impact = {});

// (nq) Positions at the end of a step that begins at q.
Eigen::VectorXd end_of_step(const dynamics::Model<double>& model, const PeriodicGait& step,
                            const Eigen::VectorXd& q);

}  // namespace dyntape
