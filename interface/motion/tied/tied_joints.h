// SPDX-License-Identifier: BSD-3-Clause
//
// Problems of a robot whose mimic joints follow their leaders: states have the other joints only.
//
//   const TiedJoints tied(scene);                                    // with scene.mimics
//   Problem p = tied.shortened(robot_problem(scene, options));       // and its terms, bounds, ends and guess
//   p.add(tied.of_all(keep_clear(scene, body, obstacle)));           // a term of the scene's model
//
// With q_all = expand(q), v_all = G v (robot_scene.h), a function of the stage of all joints is one of the short
// stage.
#pragma once

#include <functional>
#include <string>

#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

// Bounds of the states of all joints: a leader keeps those of its followers too, which then have none.
void tie_bounds(const RobotScene& scene, Bounds& x);

class TiedJoints {
 public:
  explicit TiedJoints(const RobotScene& scene);

  int nq() const { return int(ties_.q_owners.size()); }
  int nv() const { return int(ties_.v_owners.size()); }

  Problem shortened(const Problem& all) const;
  StageFunction of_all(const StageFunction& function) const;
  Term of_all(Term term) const;
  Eigen::VectorXd all_q(const Eigen::VectorXd& q) const;
  Eigen::VectorXd all_v(const Eigen::VectorXd& v) const;
  Eigen::VectorXd own_q(const Eigen::VectorXd& all) const;

  // Start and goal of all joints become those of the short problem.  Terms that `set` adds are added, except goals of followers.
  void set_ends(Problem& problem, const std::function<void(Problem& all)>& set) const;
  // Bounds of states that `set` makes for all joints: a leader keeps those of its followers too.
  void set_bounds(Problem& problem, const std::function<void(Problem& all)>& set) const;

 private:
  Problem of_all_joints() const;
  Eigen::VectorXd own_x(const Eigen::VectorXd& all) const;
  // Start and goal, where given, and the terms.
  void take_ends(Problem& own, const Problem& all) const;

  RobotScene scene_;
  Ties ties_;
};

}  // namespace dyntape
