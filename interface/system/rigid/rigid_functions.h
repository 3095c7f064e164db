// SPDX-License-Identifier: BSD-3-Clause
//
// The robot functions for steps with rigid contacts and stops, recorded and compiled.
//
//   RigidFunctions functions(scene, {});
//   const Nearness& near = functions.near(x);           // x = (q, v, ...): gaps and velocities of the rows
//   const RigidResponse& at = functions.response(x);    // J and W: an impulse p of the rows changes v by W J^T p
//
// W = M^-1, including armature.  With closed loops it is the part that keeps the loops closed, W = M^-1 - K (G M^-1
// G^T)^+ K^T with K = M^-1 G^T, G the rows of the loops.
//
// With numbers of the scene as parameters, as in its system (scene_system.h): set_parameters() before the calls.
#pragma once

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/system/scene_system.h>

namespace dyntape {

struct Nearness {
  Eigen::VectorXd gap;  // (n) of each contact and stop: m or rad
  Eigen::VectorXd u;    // (m) of each row: m/s or rad/s
};

struct RigidResponse {
  Eigen::MatrixXd J;  // (m x nv)
  Eigen::MatrixXd W;  // (nv x nv), symmetric
};

// "the contact at 'foot'", "joint 'knee'"
std::string contact_text(const dynamics::UnilateralConstraints& rigid, std::size_t i);
// "the contact at 'foot' is 0.01 m below its ground", "joint 'knee' is 0.01 beyond its limit"
std::string depth_text(const dynamics::UnilateralConstraints& rigid, std::size_t i, double depth, int digits);

class RigidFunctions {
 public:
  RigidFunctions(const RobotScene& scene, const CodegenOptions& options, int n_p = 0,
                 const SceneEdit& edit = {});
  RigidFunctions(const RigidFunctions& other);  // with its own working memory, for another thread

  void set_parameters(const Eigen::VectorXd& p) { p_ = p; }  // (n_p)

  // Both results are valid until the next call of the same function.
  const Nearness& near(const Eigen::VectorXd& x);
  const RigidResponse& response(const Eigen::VectorXd& x);

 private:
  CompiledFunction near_, response_;
  CompiledFunction::Workspace of_near_, of_response_;
  Nearness nearness_;
  RigidResponse responses_;
  Eigen::VectorXd y_near_, y_response_, p_;
};

}  // namespace dyntape
