// SPDX-License-Identifier: BSD-3-Clause
//
// A step of a system, recorded and compiled: the state x = (q, v, m) from t to t + h.
//
//   Stepper stepper(pendulum, Integrator::kRungeKutta4);
//   Eigen::Vector2d x(2, 0);
//   std::string why;
//   for (int k = 0; k < 1000; ++k)
//     if (!stepper.step(k * h, h, x.data(), nullptr, nullptr, x.data(), &why)) ...
//
// x (nx = nq + nv + motors with a lag); u (n_u), p (n_p), null where there are none; t and h (s) are arguments, so that
// one library serves all steps.  x_next may be x.  A step allocates nothing and gives the same bits on each run, whatever
// was before it.
//
// Adaptive steps follow the motion itself, with u held, in as many internal steps as the tolerances take
// (adaptive_steps.h says what these allow), and end ahead of t + h where an event of the system happens:
//
//   Stepper stepper(ball, Integrator::kAdaptive, {}, false, 1, {.relative = 1e-12});     // ball.events: its height
//   stepper.step(t, h, x, nullptr, nullptr, x);
//   if (const auto& event = stepper.event()) t = event->t, x[1] *= -0.8;                 // else t += h
//
// Implicit schemes are solved by Newton's method with the exact Jacobian, to rounding (newton.h).  A step fails, and
// says why in a sentence, where that finds no solution near, where a recorded branch is left, or where the state is
// not finite, before or after; an adaptive one also where the tolerances cannot be kept, after 100000 internal steps, and
// soon after options.stop asks for it.
//
// Jacobians are those of the step itself, not of the motion: A = d x'/d x (nt x nt), B = d x'/d u (nt x n_u),
// P = d x'/d p (nt x n_p), increments in the moving frame on both sides, nt = 2 nv + lagged motors; of implicit schemes
// by the implicit function theorem.  Those of an adaptive step are those of the motion, to the tolerances; of one that
// ended at an event, with the time of the event held.  They are compiled where `with_jacobians` asks for them.
//
// One call at a time.  ArgumentError where a system does not fit together, or lacks what the scheme needs; GuardViolation
// where only the Jacobians leave a recorded branch.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/codegen/options/options.h>
#include <dyntape/codegen/timings.h>
#include <dyntape/interface/system/steps/tolerances.h>
#include <dyntape/interface/system/system.h>

namespace dyntape {

// Many states, a row each: rows follow each other without gaps, or by so many doubles; a stride of 0 is one row for all.
struct StateRows {
  static constexpr std::size_t kDense = SIZE_MAX;
  std::size_t count = 1;
  const double* t = nullptr;  // (count)
  const double *x = nullptr, *u = nullptr, *p = nullptr;
  double* x_next = nullptr;
  std::size_t stride_t = kDense, stride_x = kDense, stride_u = kDense, stride_p = kDense,
              stride_next = kDense;
};

// What was made: sums over the functions of a stepper.
struct StepperReport {
  std::size_t step_operations =
      0;  // an explicit step; one residual and the end of an implicit one; or one rate
  std::size_t newton_operations = 0;    // a residual, or rate, with its Jacobian; 0: explicit
  std::size_t jacobian_operations = 0;  // of A, B and P, or of one rate with derivatives for them; 0: without
  bool from_cache = false;              // nothing was compiled
  Timings seconds;
  std::vector<std::string> sources = {};  // C files, where there are any
};

class Stepper {
 public:
  // threads: of steps(), among which the states of explicit schemes are shared out; 0: as many as the processor has.
  Stepper(const System& system, Integrator integrator, const CodegenOptions& options = {},
          bool with_jacobians = false, unsigned threads = 1, const Tolerances& tolerances = {});
  ~Stepper();
  Stepper(Stepper&&) noexcept;
  Stepper& operator=(Stepper&&) noexcept;

  int nx() const;
  int nt() const;
  int n_u() const;
  int n_p() const;

  // False where there is no step: x_next is then NaN, and *why says what happened.
  bool step(double t, double h, const double* x, const double* u, const double* p, double* x_next,
            std::string* why = nullptr);

  // The same step and its Jacobians, which are resized.
  bool jacobians(double t, double h, const double* x, const double* u, const double* p, double* x_next,
                 Eigen::MatrixXd& A, Eigen::MatrixXd& B, Eigen::MatrixXd& P, std::string* why = nullptr);

  // A step of each state; with options.lanes several states of an explicit scheme at once.  Returns how many failed:
  // their x_next is NaN, and *why is about the first.  x_next overlaps with nothing.
  std::size_t steps(double h, const StateRows& rows, std::string* why = nullptr);

  // For those who keep many states in lanes over many steps, of explicit schemes: blocks of W = lane_width(), entry i of
  // lane l of block b of an array of n entries a state at [(b n + i) W + l].  x, x_next (nx); arguments (2 + n_u + n_p):
  // t, h, u, p; status, a word a state.  The count is a multiple of W.  What is not finite stays so, and is for the caller
  // to see.  False where a recorded branch is left: the words that are not zero tell whose.
  bool steps_side_by_side(std::size_t count, const double* x, const double* arguments, double* x_next,
                          std::uint32_t* status);
  std::size_t lane_width() const;  // 1 without options.lanes, or interpreted

  // The same functions with working memory of their own, for another thread; without Jacobians.
  Stepper twin() const;

  // Of the last step.  Newton's method of an implicit one: residuals that were looked at.  An adaptive one: where it
  // ended ahead of its time, and what it took; of jacobians() without them, what came after the step.
  int residuals() const;
  const std::optional<StepEvent>& event() const;
  StepEffort effort() const;

  // Adaptive steps tell `at` of Gauss' points within their internal steps: sum weight f(x) is int f dt over a step, as
  // exactly as the step itself.  Other steps tell nothing.
  void watch(const std::function<void(const double* x, double weight)>& at);

  const StepperReport& report() const;

 private:
  struct Fixed;
  struct Made;
  explicit Stepper(std::unique_ptr<Made> made);
  std::unique_ptr<Made> made_;
};

}  // namespace dyntape
