// SPDX-License-Identifier: BSD-3-Clause
//
// A robot with its effects and driven joints: the input of simulation and optimal control.
//
//   RobotScene scene{load_urdf("cart_pole.urdf"), {}, {"slider"}};
//   scene.effects.damping = dynamics::model_damping(scene.model);
//   const std::vector<int> dofs = actuated_dofs(scene);                  // of the commands
//   VectorX<double> tau = torques_at(dofs, commands, scene.model.nv);    // zero for other joints
//
// Only the chosen effects are recorded (dynamics/effects/effects.h).
//
// Errors.  ArgumentError: a driven joint that is unknown, named twice, or of several degrees of freedom.
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/interface/robot/scene_constraints.h>

namespace dyntape {

struct RobotScene {
  dynamics::Model<double> model;
  dynamics::Effects<double> effects = {};
  std::vector<std::string> actuated = {};  // joints; empty: all with one degree of freedom
  // (s) lag of each driven joint, m' = (u - m) / lag, or empty.  0: no lag.
  Eigen::VectorXd lag = {};
  SceneConstraints constraints = {};  // loops, rigid contacts, hard limits
};

// An ArgumentError that names the robot.
[[noreturn]] void refuse(const dynamics::Model<double>& model, const std::string& what);

// Degrees of freedom that are driven, in the order of the commands.
std::vector<int> actuated_dofs(const RobotScene& scene);

// Joints that are driven, in the same order.
std::vector<std::string> driven_names(const RobotScene& scene);

// (nv) the torques of the drives: drive k at degree of freedom dofs[k].
template <class Drive>
dynamics::VectorX<typename Drive::Scalar> torques_at(const std::vector<int>& dofs, const Drive& drive,
                                                     int nv) {
  using T = typename Drive::Scalar;
  dynamics::VectorX<T> tau = dynamics::VectorX<T>::Constant(nv, T(0));
  for (std::size_t k = 0; k < dofs.size(); ++k) tau[dofs[k]] = drive[Eigen::Index(k)];
  return tau;
}

// Returns true if the base is a free-flyer.
bool floats(const dynamics::Model<double>& model);

// The unit of an entry of (q, v), e.g. " rad/s"; "" for entries of a quaternion, or a cosine and sine.
std::string unit_of_state(const dynamics::Model<double>& model, int index);

// Column names of q ("q") or v ("v") in tables: q.elbow; for joints with several entries by number, q0.
std::vector<std::string> entry_names(const dynamics::Model<double>& model, const std::string& block);

}  // namespace dyntape
