// SPDX-License-Identifier: BSD-3-Clause
//
// Problems of a robot whose mimic joints follow their leaders: states have the other joints only.
//
//   const TiedJoints tied(scene, rules);
//   Problem p = tied.shortened(detail::tied_problem(scene, options, rules));
//   p.add(tied.of_all(keep_clear(scene, body, obstacle)));           // a term of the scene's model
//
// With q_all = expand(q), v_all = G v (dynamics/algorithms/mimic.h), a function of the stage of all joints is one of the short
// stage.  Residuals of inverse dynamics are G^T of those of all joints.
#pragma once

#include <functional>
#include <string>

#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape::python {

class TiedJoints {
 public:
  TiedJoints(const RobotScene& scene, const std::vector<dynamics::MimicRule>& rules);

  int nq() const { return tied_.nq; }
  int nv() const { return tied_.nv; }

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

  // Joints of one degree of freedom that follow no other.
  std::vector<std::string> leaders() const;
  // ArgumentError for a joint among these that follows another.
  void check_driven(const std::vector<std::string>& driven) const;

 private:
  Problem of_all_joints() const;
  Eigen::VectorXd own_x(const Eigen::VectorXd& all) const;

  RobotScene scene_;
  dynamics::MimicModel<double> tied_;
};

}  // namespace dyntape::python
