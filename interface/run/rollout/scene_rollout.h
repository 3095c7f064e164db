// SPDX-License-Identifier: BSD-3-Clause
//
// Many motions of a scene at once, from states and commands, and the derivatives of each.  Internal; programs use
// policy_rollout.h, or scene.rollout in Python.
//
//   SceneRollout rollout(scene, false);                                      // compiles the step
//   rollout.in_parts(worlds, [&](std::size_t first, std::size_t count) {     // in the threads of the process
//     rollout.run({first, count, x0, stride}, steps, law, states);
//   });
//   SceneRollout linear(scene, true);                                        // the step and its Jacobians
//   linear.run(x0, steps, law, states, slopes);                              // one world
//   const WorldGradient g = gradient_of(slopes, by_x, by_u);
//
// States are x = (q, v, motors with a lag) of the independent joints (tied_system.h).
// Steps are those of the scene's file, without a sample grid; commands are
// held over a step.  If a world has no step, its states are NaN from there on, and so are its derivatives; others
// continue.  Explicit schemes run several worlds in a register.  With rigid contacts or stops each world runs alone
// (robot_stepper.h).
//
// Errors.  ArgumentError: derivatives of a scene with rigid contacts or hard limits; a world that starts below its
// ground.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>

#include <dyntape/codegen/run/workspace_pool.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/system/rigid/robot_stepper.h>
#include <dyntape/interface/system/tied_system.h>

namespace dyntape {

// States of worlds from `first` on, a row each; the stride is in doubles.
struct WorldRows {
  std::size_t first = 0, count = 1;
  const double* x = nullptr;
  std::size_t stride = 0;
};
struct CommandRows {
  const double* u = nullptr;
  std::size_t stride = 0;
};

// Derivatives along the motion of one world; the rows of a step follow those of the step before.  States have n_t
// increments of the moving frame, n_t = 2 nv + motors with a lag.
struct WorldSlopes {
  using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  WorldSlopes(Eigen::Index steps, Eigen::Index n_t, Eigen::Index n_u, Eigen::Index n_p)
      : A(steps * n_t, n_t), B(steps * n_t, n_u), by_x(steps * n_u, n_t), by_p(steps * n_u, n_p) {}

  Rows A, B;        // dx'/dx, dx'/du of a step
  Rows by_x, by_p;  // du/dx, du/dp of a policy; set by its law
};

struct WorldGradient {
  Eigen::VectorXd start, parameters;  // (n_t), (n_p)
  Eigen::MatrixXd commands;           // (n_u x steps)
};

// Gradient of a cost with the derivatives `by_x` (n_t x steps) and `by_u` (n_u x steps) along the motion; either may
// have no columns.  With g_k = by_u_k + B_k^T lambda_k and F, P the derivatives of the policy:
//   lambda_{k-1} = by_x_{k-1} + A_k^T lambda_k + F_k^T g_k,    dJ/du_k = g_k,    dJ/dp = sum P_k^T g_k
using CostSlopes = Eigen::Ref<const Eigen::MatrixXd>;
WorldGradient gradient_of(const WorldSlopes& slopes, const CostSlopes& by_x, const CostSlopes& by_u,
                          bool has_policy);

class SceneRollout {
 public:
  // Keeps a copy of the scene.
  SceneRollout(const Scene& scene, bool with_jacobians, const std::stop_token& stop = {});

  const Scene& scene() const { return scene_; }
  const dynamics::Model<double>& state_model() const { return state_model_; }
  int n_x() const { return n_x_; }
  int n_t() const { return n_t_; }
  int n_u() const { return n_u_; }

  // Calls part(first, count) for all worlds, some at a time.
  void in_parts(std::size_t worlds, const std::function<void(std::size_t, std::size_t)>& part) const;

  // Commands of worlds at the beginning of a step.
  using Law = std::function<CommandRows(long step, const WorldRows& at)>;
  // States after each step, (n_x x steps) of each of these worlds, one after the other.
  void run(const WorldRows& starts, long steps, const Law& law, double* states,
           const std::stop_token& stop = {});

  // Commands of one world; called as long as there are steps.
  using LawOfOne = std::function<const double*(long step, const double* x)>;
  void run(const double* start, long steps, const LawOfOne& law, double* states, WorldSlopes& slopes,
           const std::stop_token& stop = {});

 private:
  Stepper stepper_of(bool with_jacobians) const;
  void run_rigid(const WorldRows& starts, const StepRange& range, const Law& law, double* states,
                 const std::stop_token& stop);

  const Scene scene_;
  const dynamics::Model<double> state_model_;
  const Ties ties_;
  const CodegenOptions options_;
  int n_x_, n_t_, n_u_;
  // Without Jacobians: rigid contacts or stops, or neither.
  std::unique_ptr<const RobotStepper> first_rigid_;
  std::unique_ptr<const Stepper> first_free_;
  detail::WorkspacePool<RobotStepper> rigid_;
  detail::WorkspacePool<Stepper> free_, linear_;
};

}  // namespace dyntape
