// SPDX-License-Identifier: BSD-3-Clause
//
// Problems of a robot whose mimic joints follow their leaders: states have the other joints only.
//
//   const TiedJoints tied(scene);                                    // with scene.mimics
//   Problem p = tied.shortened(robot_problem(scene, options));       // and its terms, bounds, ends and guess
//   p.add(tied.of_all(keep_clear(scene, body, obstacle)));           // a term of the scene's model
//   Trajectory motion = tied.of_all(optimise(p).motion);             // of all joints
//
// With q_all = expand(q), v_all = G v (robot_scene.h), a function of the stage of all joints is one of the short
// stage.  For a robot without mimic joints all functions return their argument.
#pragma once

#include <functional>
#include <string>

#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

class TiedJoints {
 public:
  explicit TiedJoints(const RobotScene& scene);

  int nq() const { return ties_.empty() ? scene_.model.nq : int(ties_.q_owners.size()); }
  int nv() const { return ties_.empty() ? scene_.model.nv : int(ties_.v_owners.size()); }

  Problem shortened(const Problem& all) const;
  StageFunction of_all(const StageFunction& function) const;
  Term of_all(Term term) const;
  // A function of the stage of all joints that returns a state of all joints.
  StageFunction own_rows(const StageFunction& function) const;
  Trajectory of_all(Trajectory motion) const;
  Eigen::VectorXd all_x(const Eigen::VectorXd& x) const;
  Eigen::VectorXd own_x(const Eigen::VectorXd& all) const;
  // Index among the states of all joints.
  int index_in_all(int own) const;
  Eigen::VectorXd all_q(const Eigen::VectorXd& q) const;
  Eigen::VectorXd all_v(const Eigen::VectorXd& v) const;
  Eigen::VectorXd own_q(const Eigen::VectorXd& all) const;

  // Start and goal of all joints become those of the short problem.  Terms that `set` adds are added, except goals of followers.
  void set_ends(Problem& problem, const std::function<void(Problem& all)>& set) const;
  // Bounds of states that `set` makes for all joints: a leader keeps those of its followers too.
  void set_bounds(Problem& problem, const std::function<void(Problem& all)>& set) const;

 private:
  Problem of_all_joints() const;
  // The bounds of the states: a leader keeps those of its followers too.
  Bounds own_bounds(Bounds all) const;
  // Start and goal, where given, and the terms.
  void take_ends(Problem& own, const Problem& all) const;

  RobotScene scene_;
  Ties ties_;
};

}  // namespace dyntape
