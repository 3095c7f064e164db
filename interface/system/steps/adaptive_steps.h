// SPDX-License-Identifier: BSD-3-Clause
//
// Integrates a system to a tolerance by CVODES: from t to t + h in several internal steps.
//
//   AdaptiveSteps steps(system, Integrator::kAdaptive, {.relative = 1e-9}, options, with_jacobians);
//   if (!steps.step(arguments, x_next)) ... steps.trouble()           // arguments: (x, t, h, u, p)
//   steps.jacobians(arguments, matrix)                                // of that step: A, B and P side by side
//
// Manifolds.  The variables are y = (d, v) with q = q_c (+) d (step_problem.h).  If a rotation in d exceeds
// kLongTurn, the centre q_c moves to the current configuration and the method restarts.
//
// Every call starts with order one, so its result does not depend on earlier calls.
//
// Events.  After each internal step g is evaluated kLooks times within the step, at states as in x_next.  If a
// positive entry is no longer positive, the time between is bisected to the precision of double.  The step ends
// after it, so that g <= 0 at x_next; the entry must be positive again before its next event.
//
// Sensitivities S = dy/dw, w = (d, v, m, u, p) at the beginning, satisfy S' = f_y S + f_w along the motion, with
// error control; dq' = J(d) S_d in the moving frame at the end.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>

#include <dyntape/interface/system/steps/step_problem.h>

namespace dyntape {

class AdaptiveSteps {
 public:
  static constexpr long kMostInternalSteps = 100000;  // per call
  static constexpr double kLongTurn = 3;              // (rad)
  static constexpr int kLooks = 4;

  // ArgumentError for invalid tolerances, and as StepScheme.
  AdaptiveSteps(const System& system, Integrator integrator, const Tolerances& tolerances,
                const CodegenOptions& options, bool with_jacobians);
  AdaptiveSteps(const AdaptiveSteps&) = delete;  // its members point to each other
  AdaptiveSteps& operator=(const AdaptiveSteps&) = delete;

  // Returns false if it failed; trouble() is then the reason, without "step of ...: ".
  bool step(const double* arguments, double* x_next);
  // Of the previous step (nt x (nt + n_u + n_p)); likewise.
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
