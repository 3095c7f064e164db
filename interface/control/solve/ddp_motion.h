// SPDX-License-Identifier: BSD-3-Clause
//
// The computations of differential dynamic programming for one problem: simulation, linearisation, and the Riccati
// recursion for the policy.  ddp_course.h is the algorithm that requests them.
//
//   DdpMotionWork work(problem, options, step, end);     // the functions of record_shooting(), compiled
//   double cost = work.start();                          // the guess, or its simulation
//   work.linearise(), work.backward();                   // results in at(0)
//   if (auto cost = work.roll_out(0.5)) work.accept();   // makes the motion with half the step the current motion
#pragma once

#include <optional>

#include <dyntape/interface/control/discretize/end_cost.h>
#include <dyntape/interface/control/solve/ddp_solution.h>
#include <dyntape/interface/control/solve/ddp_work.h>
#include <dyntape/interface/control/solve/shooting_steps.h>
#include <dyntape/interface/control/solve/stage_secants.h>

namespace dyntape {

class DdpMotionWork final : public DdpWork {
 public:
  DdpMotionWork(const Problem& problem, const DdpOptions& options, const CompiledFunction& step,
                const CompiledFunction& end);

  // Returns the cost.  ArgumentError for a guess that does not fit, NumericalError if the functions are not finite.
  double start();
  void linearise();
  void backward();
  std::optional<double> roll_out(double length);  // the trial's cost, if finite
  void accept() { std::swap(now_, trial_); }

  DdpState& at(int) override { return state_; }
  DdpMotion motion(int) const override;
  void set_policy(int, int last, const Eigen::MatrixXd& k) override;
  void set_policy(int, const std::vector<LqrPolicy>& policy) override { policy_ = policy; }
  std::vector<double> costs_of(int, const std::vector<Eigen::MatrixXd>& changes) override;

 private:
  struct Nodes {
    Eigen::MatrixXd x, u;  // (n_x x N + 1), (n_u x N)
  };

  bool is_exact() const { return options_.hessian == DdpHessian::kExact; }
  Eigen::VectorXd limited(const Eigen::VectorXd& u) const;
  std::string not_finite(const Eigen::VectorXd& next, double cost) const;
  void take_guess();
  bool find_adjoint();
  void add_projected(int k, const double* slope);
  bool push(int k);
  void predict();

  const Problem& problem_;
  const DdpOptions& options_;
  int N_, n_, m_;
  double h_;
  ShootingSteps steps_;
  EndCost end_;
  bool is_limited_;
  std::vector<StageColumns>& stages_;
  std::vector<bool> has_secants_;  // (N) true if the last step used secants
  Riccati riccati_;
  std::vector<LqrPolicy> policy_;
  Eigen::VectorXd at_end_, g_end_, weights_, of_stage_, work_;
  Eigen::MatrixXd H_end_, gap_, slope_, adjoint_;
  Nodes now_, trial_;
  StageSecants secants_;
  DdpState state_;
};

}  // namespace dyntape
