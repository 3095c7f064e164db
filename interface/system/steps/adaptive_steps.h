// SPDX-License-Identifier: BSD-3-Clause
//
// Steps to a tolerance: the motion from t to t + h by CVODES, in as many internal steps as it takes.
//
//   AdaptiveSteps steps(system, Integrator::kAdaptive, {.relative = 1e-9}, options, with_jacobians);
//   if (!steps.step(arguments, x_next)) ... steps.trouble()           // arguments: (x, t, h, u, p)
//   steps.jacobians(arguments, matrix)                                // of that step: A, B and P side by side
//
// On the manifold: what is integrated is y = (d, v) with q = q_c (+) d (step_problem.h), and where a rotation in d gets
// longer than kLongTurn the centre moves there and the method begins anew.
//
// Every step begins anew, with order one: what a call gives depends on nothing before it.
//
// Events: after each internal step g is looked at kLooks times within it, at states as x_next would have them.  Where an
// entry that was above zero is so no more, the time between is halved until doubles end; the step ends behind it, so that
// g <= 0 at x_next, and an entry has to rise above zero again before it is an event again.
//
// Sensitivities S = dy/dw, w = (d, v, m, u, p) at the beginning, follow S' = f_y S + f_w along the motion, under error
// control as well; dq' = J(d) S_d in the moving frame at the end.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>

#include <dyntape/interface/system/steps/step_problem.h>

namespace dyntape {

class AdaptiveSteps {
 public:
  static constexpr long kMostInternalSteps = 100000;  // of one step
  static constexpr double kLongTurn = 3;              // (rad)
  static constexpr int kLooks = 4;

  // ArgumentError where tolerances are none, and as StepScheme.
  AdaptiveSteps(const System& system, Integrator integrator, const Tolerances& tolerances,
                const CodegenOptions& options, bool with_jacobians);
  AdaptiveSteps(const AdaptiveSteps&) = delete;  // its parts point to each other
  AdaptiveSteps& operator=(const AdaptiveSteps&) = delete;

  // False: there is no x_next, and trouble() says why, behind "step of ...: ".
  bool step(const double* arguments, double* x_next);
  // Of the step before (nt x (nt + n_u + n_p)); likewise.
  bool jacobians(const double* arguments, Eigen::MatrixXd& matrix);

  // Of step(): Gauss' points of each internal step, three up to order 3 and seven beyond, at states of its interpolant.
  using AtNode = std::function<void(const double* x, double weight)>;
  void watch(AtNode at) { at_node_ = std::move(at); }

  const std::optional<StepEvent>& event() const { return event_; }
  const StepEffort& effort() const { return problem_.effort; }
  const std::string& trouble() const { return trouble_; }
  const StepProblem& problem() const { return problem_; }

 private:
  bool follow(Cvodes& solver, double length, bool to_events);
  bool start(Cvodes& solver, double end);
  bool move_centre(Cvodes& solver, double end);
  bool tell_nodes(Cvodes& solver, double from);
  bool find_event(Cvodes& solver, double from);
  bool narrow(Cvodes& solver, double before, double after);
  bool look_at_events(Cvodes& solver, double s);
  int fallen() const;  // the first entry that was above zero and is so no more; -1
  bool fails(const std::string& why);
  bool has_no_value(const char* what, double s);
  bool ends_here(double before, double s, double end) const;
  bool fails(Cvodes::Outcome outcome, double s);
  std::string at(double s) const;

  const bool is_stiff_;
  const std::stop_token stop_;
  StepProblem problem_;
  Cvodes solver_;
  std::optional<Cvodes> with_sensitivities_;
  Eigen::VectorXd x_, y_, f_, f_later_, errors_;
  std::vector<char> was_above_;  // entries of g, at the last look
  double t_ = 0, length_ = 0;    // of the last step: where it began, how far it went
  std::optional<StepEvent> event_;
  AtNode at_node_;
  std::string trouble_;
};

}  // namespace dyntape
