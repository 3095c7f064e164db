// SPDX-License-Identifier: BSD-3-Clause
//
// Many closed-loop motions of a scene at once: a recorded function sets the commands at the beginning of each step.  Use it to
// evaluate and to tune a policy, with the gradient of a cost by the starts and by the policy's parameters.
//
//   const Scene scene = read_scene("config/scenes/pendulum.info");
//   const Function policy = record("damping", 2, 1, [](const VectorXad& x, const VectorXad& p) {
//     return VectorXad::Constant(1, -p[0] * x[1]);                            // (x, p) -> commands
//   });
//   PolicyRollout rollout(scene, policy);                                     // compiles once
//   const Eigen::MatrixXd x0 = ...;                                           // (n_x x worlds)
//   const PolicyMotions motions = rollout.run(x0, Eigen::VectorXd::Constant(1, 0.3), 500);
//   motions.of_world(3).col(499);                                             // the last state of world 3
//
//   const auto end = [](int world, const auto& x, auto& weights) { weights.col(499) = x.col(499); };   // of |x(T)|^2 / 2
//   const PolicyGradient g = rollout.gradient(x0, p, 500, end);
//   g.parameters, g.start;                                                    // (n_p x worlds), (n_t x worlds)
//
// A state is x = (q, v, motors with lag) as in stepper.h; steps are those of the scene's file, without a sample grid.  The
// commands are held over a step.  Parameters are a column for all worlds or a column per world.  Gradients by states are along
// increments of the moving frame, n_t = 2 nv + motors with lag.
//
// If a world diverges, its states are NaN from there on, and so is its gradient; other worlds continue.  Worlds are distributed
// over the threads of the process and the lanes of a register; the bits of a world do not depend on the others.  Time and memory
// are linear in worlds times steps; a gradient stores the Jacobians of one world per thread and takes one sweep back.
//
// Worlds with rigid contacts or hard limits run one by one; gradients of such scenes are refused, since impacts have no
// derivatives here.
//
// Errors.  ArgumentError: gradients of a scene with rigid contacts or hard limits; a world that starts below its
// ground; a policy of other sizes than the scene's states and commands; starts, parameters or weights of another shape.  GuardViolation: a finite state takes another branch of
// the policy than its recording.
#pragma once

#include <functional>
#include <memory>

#include <Eigen/Core>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/interface/files/scene/scene.h>

namespace dyntape {

struct PolicyMotions {
  int steps = 0;
  Eigen::MatrixXd x;  // (n_x x worlds * steps) after each step, world by world

  auto of_world(Eigen::Index k) const { return x.middleCols(k * steps, steps); }
};

struct PolicyGradient {
  PolicyMotions motions;
  Eigen::MatrixXd start, parameters;  // (n_t x worlds), (n_p x worlds)
};

class PolicyRollout {
 public:
  PolicyRollout(const Scene& scene, const Function& policy);
  ~PolicyRollout();
  PolicyRollout(PolicyRollout&&) noexcept;
  PolicyRollout& operator=(PolicyRollout&&) noexcept;

  int n_x() const;
  int n_t() const;

  // x0 (n_x x worlds), p (n_p x worlds or n_p x 1; without parameters empty).
  PolicyMotions run(const Eigen::MatrixXd& x0, const Eigen::MatrixXd& p, int steps);

  // Sets `weights` (n_t x steps, zero before): the gradient of the cost of this world by the state after each step.  Called from
  // several threads.
  using CostGradient = std::function<void(Eigen::Index world, const Eigen::Ref<const Eigen::MatrixXd>& x,
                                          Eigen::MatrixXd& weights)>;
  PolicyGradient gradient(const Eigen::MatrixXd& x0, const Eigen::MatrixXd& p, int steps,
                          const CostGradient& by_states);

 private:
  struct Made;
  std::unique_ptr<Made> made_;
};

}  // namespace dyntape
