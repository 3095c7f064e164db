// SPDX-License-Identifier: BSD-3-Clause
//
// Random tasks for robots of config/robots, as text of task files, and what each asks for in plain numbers, so that a motion can
// be held against it by code that reads no task file.
//
//   const RandomTask task = draw_task("config/robots", seed, index);
//   write_file_atomically(path, file_text(task, "riccati"));
//   RobotAlone robot(task);
//   robot.pose(q, "tool0");                       // a chain of turns, written out
//   robot.rate(x, u);                             // articulated bodies in doubles
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/motion/capsules.h>

namespace dyntape::testing {

struct RandomTask {
  enum class Cost { kControl, kEffort, kAcceleration };

  std::string robot, kind;  // "panda"; "pose goal, 2 obstacles, trapezoid, inverse"
  std::string text;         // of the task file, but for scheme, form and solver
  bool is_for_ddp = false;  // forward dynamics, no limits but those of controls, costs that draw to the goal
  bool bounds_states = true;  // by the limits of the robot's file
  dynamics::Model<double> model;
  std::vector<int> driven;          // degree of freedom of each control that is a joint's
  std::vector<std::string> rotors;  // frames whose z the other controls push along
  std::vector<double> moments;      // N m a newton, of each
  bool is_damped = false;           // as the robot's file says
  Eigen::VectorXd start;            // (nq + nv)
  Eigen::VectorXd goal;             // (nq + nv); empty: a pose
  std::string frame;                // that is to be at `place`, turned to `axes`
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  std::optional<Eigen::Matrix3d> axes = {};
  std::vector<Capsule> bodies, obstacles;
  std::string scheme, dynamics;  // forward or inverse
  double duration = 1;
  Eigen::VectorXd least, most;  // of controls
  Cost cost = Cost::kControl;
  // Weights: of the squared velocities; of the squared distance to the goal at the end, where it is for ddp.
  double slows = 0, draws_q = 0, draws_v = 0;

  // Of a floating base, at rest at the goal.
  bool floats() const { return !rotors.empty(); }
};

// Of one seed and index always the same one.
RandomTask draw_task(const std::string& robots, unsigned seed, int index);
// The task file that asks for a method.
std::string file_text(const RandomTask& task, const std::string& method);

class RobotAlone {
 public:
  explicit RobotAlone(const RandomTask& task) : task_(task), data_(task.model) {}

  Eigen::Isometry3d pose(const Eigen::VectorXd& q, const std::string& frame) const;
  // Least distance of two capsules at a configuration, negative where they overlap.
  double gap(const Eigen::VectorXd& q, const Capsule& a, const Capsule& b) const;
  double least_gap(const Eigen::VectorXd& q) const;  // of all bodies from all obstacles; infinite without
  Eigen::VectorXd acceleration(const Eigen::VectorXd& x, const Eigen::VectorXd& u);
  Eigen::VectorXd rate(const Eigen::VectorXd& x, const Eigen::VectorXd& u);

 private:
  const RandomTask& task_;
  dynamics::Data<double> data_;
};

}  // namespace dyntape::testing
