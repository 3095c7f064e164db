// SPDX-License-Identifier: BSD-3-Clause
//
// The initial value problem of an adaptive step, compiled: y = (d, v) with q = q_c (+) d (record_rate.h).
//
//   StepProblem problem(system, Integrator::kAdaptive, tolerances, options, with_jacobians);
//   problem.begin(arguments);                     // (x, t, h, u, p): the centre q_c is q
//   problem.rate(s, y, dy); problem.state(s, y, x);
//
// Tolerance of an internal step: relative * size + absolute in each entry.  Sizes: |q| of a prismatic joint, one
// radian for angles and rotations, one metre for the position of a free body; the norms of its linear and angular
// velocity; |v| of other joints.
#pragma once

#include <optional>
#include <vector>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/system/steps/cvodes.h>
#include <dyntape/interface/system/steps/record_rate.h>
#include <dyntape/interface/system/steps/tolerances.h>

namespace dyntape {

class StepProblem final : public InitialValueProblem {
 public:
  // ArgumentError as StepScheme.
  StepProblem(const System& system, Integrator integrator, const Tolerances& tolerances,
              const CodegenOptions& options, bool with_jacobians);

  int n_x() const { return nx_; }
  int n_y() const { return 2 * nv_; }
  int n_w() const { return n_y() + n_m_ + n_u_ + n_p_; }  // (d, v, m, u, p)
  int n_g() const { return n_g_; }

  void begin(const double* arguments);
  void move_centre(const double* q);
  void start(double* y) const;  // the initial values

  bool rate(double s, const double* y, double* dy) override;
  bool jacobian(double s, const double* y, double* J) override;
  bool sensitivity_rate(double s, const double* y, const Eigen::MatrixXd& S, Eigen::MatrixXd& dS) override;
  void allowed_errors(const double* y, double* errors) override;

  bool state(double s, const double* y, double* x);
  bool events(double s, const double* x);  // into g()
  const Eigen::VectorXd& g() const { return events_->y; }
  // What becomes of dd in the moving frame of q_c (+) d, and of the states of lagged motors.
  bool frame(double s, const double* y);
  // Behind frame(): sensitivities S = dy/dw (n_y x n_w) of a centre there; and dx/dw (nt x n_w).
  void turn(Eigen::MatrixXd& S) const;
  void moved(const Eigen::MatrixXd& S, Eigen::MatrixXd& dx) const;

  double longest_turn(const double* y) const;  // (rad) of a rotation in d
  // When something had last no value since the beginning, whether that were derivatives alone, and the recorded branch
  // that was left then, or "".
  std::optional<double> refused_at() const { return refused_at_; }
  bool refused_slopes() const { return refused_slopes_; }
  std::string left_branch() const;

  StepEffort effort;  // counted on

  std::vector<const CompiledFunction*> functions() const;
  std::size_t operations(Order order) const { return rate_.function.operations(order); }
  std::size_t sensitivity_operations() const;

 private:
  // A compiled function with room for its values, at one point.
  struct Part {
    Part(const Function& function, CodegenOptions options, Order order);

    CompiledFunction function;
    CompiledFunction::Workspace workspace;
    Eigen::VectorXd y, non_zeros;
  };
  // Neighbours in d, and in v, that make one vector.
  struct Group {
    int first, count;
    bool turns = false;  // a rotation, whose coordinates end at a whole turn
    int slider = -1;     // its place in q
  };
  StepProblem(const System& system, Integrator integrator, const Tolerances& tolerances,
              const CodegenOptions& options, bool with_jacobians, const RecordedRate& recorded);
  Eigen::Map<const Eigen::MatrixXd> turned() const { return {frame_->y.data(), nv_, nv_}; }
  void append_groups(const dynamics::Joint<double>& joint);
  bool run(Part& part, Order order, double s, const double* x, const double* p);

  const int nq_, nv_, n_m_, n_u_, n_p_, n_g_, nx_;
  const Tolerances tolerances_;
  const std::vector<int> lagged_;
  std::vector<Group> groups_;
  Part rate_, state_;
  std::optional<Part> by_all_, frame_, events_;
  Eigen::VectorXd v_, given_;              // at the beginning; (q_c, m, u, p, t, s)
  Eigen::VectorXd of_state_, of_events_;   // (d, v, given), (x, t, u, p)
  Eigen::VectorXd of_all_, fixed_of_all_;  // (d, v, m, u, p), (q_c, t, s)
  Eigen::VectorXd of_frame_, slopes_at_;   // (d, s), (y, s)
  Eigen::MatrixXd slopes_;                 // of the rate, by (d, v, m, u, p), at slopes_at_
  std::optional<double> refused_at_;
  bool refused_slopes_ = false;
  const CompiledFunction* left_ = nullptr;  // whose branch was left, the first as `violation_` says
  Violation violation_;
};

}  // namespace dyntape
