// SPDX-License-Identifier: BSD-3-Clause
//
// Integrates a system by one step: maps the state x = (q, v, m) at t to the state at t + h.  The step is recorded
// and compiled; use it for simulation and for exact Jacobians of a step.
//
//   Stepper stepper(pendulum, Integrator::kRungeKutta4);
//   Eigen::Vector2d x(2, 0);
//   std::string why;
//   for (int k = 0; k < 1000; ++k)
//     if (!stepper.step(k * h, h, x.data(), nullptr, nullptr, x.data(), &why)) ...
//
// x (nx = nq + nv + motors with lag); u (n_u), p (n_p), null if empty.  t and h (s) are arguments, so one library
// serves all steps.  x_next may be x.  A step does not allocate and has the same bits in every run.
//
// Adaptive steps (adaptive_steps.h) integrate to the tolerances with u fixed, in several internal steps.  They end
// before t + h if an event of the system occurs:
//
//   Stepper stepper(ball, Integrator::kAdaptive, {}, false, 1, {.relative = 1e-12});     // ball.events: its height
//   stepper.step(t, h, x, nullptr, nullptr, x);
//   if (const auto& event = stepper.event()) t = event->t, x[1] *= -0.8;                 // else t += h
//
// Implicit schemes iterate Newton's method with the exact Jacobian until rounding (newton.h).  A step fails, with the
// reason in one sentence, if:
//
// - Newton's method finds no solution nearby
// - the step takes another branch than the recording
// - the state is not finite, before or after
// - adaptive only: the tolerances cannot be met, 100000 internal steps do not suffice, or options.stop was requested
//
// Jacobians are those of the numerical step: A = d x'/d x (nt x nt), B = d x'/d u (nt x n_u), P = d x'/d p (nt x
// n_p), with increments in the moving frame on both sides, nt = 2 nv + motors with lag.  Implicit schemes use the
// implicit function theorem.  An adaptive step returns Jacobians of the exact motion, to the tolerances; if the step
// ended at an event, the time of the event is held fixed.  Jacobians are compiled only if `with_jacobians`.
//
// Not thread-safe.  Errors.  ArgumentError: a system that is inconsistent, or lacks what the scheme needs.
// GuardViolation: the Jacobians, but not the step, take another branch than the recording.
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

// Many states, one per row.  A stride is the distance between rows in doubles; kDense: contiguous; 0: all states use
// one row.
struct StateRows {
  static constexpr std::size_t kDense = SIZE_MAX;
  std::size_t count = 1;
  const double* t = nullptr;  // (count)
  const double *x = nullptr, *u = nullptr, *p = nullptr;
  double* x_next = nullptr;
  std::size_t stride_t = kDense, stride_x = kDense, stride_u = kDense, stride_p = kDense,
              stride_next = kDense;
};

// Sums over the functions of a stepper.
struct StepperReport {
  std::size_t step_operations =
      0;  // of an explicit step; of an implicit step's residual and final update; of an adaptive step's rate
  std::size_t newton_operations = 0;  // a residual, or rate, with its Jacobian; 0: explicit
  std::size_t jacobian_operations =
      0;                    // of A, B and P, or of one rate with derivatives for them; 0: not compiled
  bool from_cache = false;  // true: no compilation
  Timings seconds;
  std::vector<std::string> sources = {};  // C files, if any
};

class Stepper {
 public:
  // threads: for steps() of explicit schemes; 0: all hardware threads.
  Stepper(const System& system, Integrator integrator, const CodegenOptions& options = {},
          bool with_jacobians = false, unsigned threads = 1, const Tolerances& tolerances = {});
  ~Stepper();
  Stepper(Stepper&&) noexcept;
  Stepper& operator=(Stepper&&) noexcept;

  int nx() const;
  int nt() const;
  int n_u() const;
  int n_p() const;

  // Returns false if the step failed; x_next is then NaN, and *why is the reason.
  bool step(double t, double h, const double* x, const double* u, const double* p, double* x_next,
            std::string* why = nullptr);

  // The same step with its Jacobians, which are resized.
  bool jacobians(double t, double h, const double* x, const double* u, const double* p, double* x_next,
                 Eigen::MatrixXd& A, Eigen::MatrixXd& B, Eigen::MatrixXd& P, std::string* why = nullptr);

  // Steps many states; with options.lanes several states of an explicit scheme at once.  Returns the number of
  // failures; their x_next is NaN, and *why is the reason of the first.  x_next must not overlap the inputs.
  std::size_t steps(double h, const StateRows& rows, std::string* why = nullptr);

  // For explicit schemes and states in SIMD layout: blocks of W = lane_width() states; entry i of lane l of block b
  // of an array with n entries per state is at [(b n + i) W + l].  x, x_next (nx); arguments (2 + n_u + n_p): t, h,
  // u, p; status: one word per state.  `count` must be a multiple of W.  Values that are not finite are not
  // reported.  Returns false if a state takes another branch than the recording; its word is nonzero.
  bool steps_side_by_side(std::size_t count, const double* x, const double* arguments, double* x_next,
                          std::uint32_t* status);
  std::size_t lane_width() const;  // 1 without options.lanes, or interpreted

  // Returns a stepper of the same compiled functions with its own memory, for another thread; it has no Jacobians.
  Stepper twin() const;

  // Of the last step.  residuals(): evaluations by Newton's method in an implicit step.  event(): where an adaptive
  // step ended early.  effort(): cost of an adaptive step; after jacobians(), of the integration for the Jacobians.
  int residuals() const;
  const std::optional<StepEvent>& event() const;
  StepEffort effort() const;

  // Sets a callback for integrals along an adaptive step.  The step calls `at` at the Gauss points of its internal
  // steps: the sum of weight f(x) is int f dt, as accurate as the step.  Other schemes do not call `at`.
  void watch(const std::function<void(const double* x, double weight)>& at);

  const StepperReport& report() const;

 private:
  struct Fixed;
  struct Made;
  explicit Stepper(std::unique_ptr<Made> made);
  std::unique_ptr<Made> made_;
};

}  // namespace dyntape
