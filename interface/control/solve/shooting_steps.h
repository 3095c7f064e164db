// SPDX-License-Identifier: BSD-3-Clause
//
// The integration steps of a problem (record_shooting() in record_stage.h): run in sequence, or linearised all at
// once.
//
//   ShootingSteps steps(step, problem, 100);
//   double cost = steps.run(k, x.col(k), u.col(k), next);             // next = x', and int L dt
//   if (steps.linearise(x, u)) ...                                    // finite: stages()[k].Ft, g; ends of the steps
//                                                                     in ends()
//   steps.curve(k, weights);                                          // stages()[k].H, with weights of (x', int L dt)
//
// A step with residuals r has H = 2 R^T R, with R their Jacobian, after linearise(); do not call curve() then.
//
// No allocation after construction.  Not thread-safe.
#pragma once

#include <functional>
#include <stop_token>
#include <vector>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/problem/problem.h>
#include <dyntape/interface/control/riccati/riccati.h>

namespace dyntape {

class ShootingSteps {
 public:
  // ArgumentError if a parameter has no value at some time.
  ShootingSteps(const CompiledFunction& step, const Problem& problem, int intervals);

  double run(int k, const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& u,
             Eigen::Ref<Eigen::VectorXd> next);
  // Simulates as many motions as x has columns, in lanes.  x becomes their final states; returns their running
  // costs.  set(k, u) sets the controls of step k, one column per motion.
  Eigen::VectorXd run_side_by_side(Eigen::MatrixXd& x,
                                   const std::function<void(int k, Eigen::MatrixXd& u)>& set);
  bool linearise(const Eigen::MatrixXd& x, const Eigen::MatrixXd& u);  // (n_x x N or more), (n_u x N)
  void curve(int k, const Eigen::VectorXd& weights);  // (n_x + 1), at the point of the last linearise()

  std::vector<StageColumns>& stages() { return stages_; }  // the caller sets c and limits
  // With residuals: results of the previous linearisation.
  const std::vector<StageSlopes>& before() const { return before_; }
  auto ends() const { return y_.topRows(n_x_); }  // (n_x x N) x' of the last linearise()
  bool has_residuals() const { return y_.rows() > n_x_ + 1; }

 private:
  struct Run {  // non-zeros, and the positions of their entries
    Eigen::Index from, to, count;
  };
  struct Residual {  // non-zeros, and the offset in dense_; -1: sparse
    std::size_t begin, end;
    Eigen::Index dense;
  };

  void find_places();
  void place(std::size_t k);
  void add_squares(const Residual& residual, const double* J, Eigen::MatrixXd& H);

  CompiledFunction step_;
  CompiledFunction::Workspace one_, all_;
  Eigen::Index n_x_, n_z_;
  Eigen::MatrixXd parameters_;  // (2 + 3 n_p x N) t, h, p at the beginning, middle and end of each step
  Eigen::MatrixXd z_, y_, J_;   // one column per step; J_: the non-zeros of the pattern
  std::vector<Run> of_F_, of_g_;
  std::vector<Residual> residuals_;
  Eigen::VectorXd dense_;  // gradients of residuals, padded (columns.h)
  Eigen::VectorXd point_, value_, weights_;
  Eigen::VectorXd H_;  // one stage's non-zeros
  std::vector<StageColumns> stages_;
  std::vector<StageSlopes> before_;
};

// The motion of steps with constant controls between nodes: x (n_x x N + 1), u (n_u x N).
Trajectory held_motion(const Problem& problem, const Eigen::VectorXd& t, const Eigen::MatrixXd& x,
                       const Eigen::MatrixXd& u);
// verify() of this motion, with `cost` the sum of the steps.
Verification verify_steps(const Problem& problem, const Trajectory& motion, double cost,
                          const std::stop_token& stop = {});

}  // namespace dyntape
