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
#pragma once

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

struct Nearness {
  Eigen::VectorXd gap;  // (n) of each contact and stop: m or rad
  Eigen::VectorXd u;    // (m) of each row: m/s or rad/s
};

struct RigidResponse {
  Eigen::MatrixXd J;  // (m x nv)
  Eigen::MatrixXd W;  // (nv x nv), symmetric
};

class RigidFunctions {
 public:
  RigidFunctions(const RobotScene& scene, const CodegenOptions& options);

  // Both results are valid until the next call of the same function.
  const Nearness& near(const Eigen::VectorXd& x);
  const RigidResponse& response(const Eigen::VectorXd& x);

 private:
  CompiledFunction near_, response_;
  CompiledFunction::Workspace of_near_, of_response_;
  Nearness nearness_;
  RigidResponse responses_;
  Eigen::VectorXd y_near_, y_response_;
};

}  // namespace dyntape
