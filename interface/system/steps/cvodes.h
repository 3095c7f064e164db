// SPDX-License-Identifier: BSD-3-Clause
//
// Solves initial value problems y' = f(s, y) with CVODES, one internal step at a time.
//
//   Cvodes solver(problem, n, 0, relative, absolute, Cvodes::Method::kAdams);
//   solver.begin(0, y0);
//   solver.start(1, first_step);
//   while (solver.s() != 1 && solver.advance() == Cvodes::Outcome::kAdvanced) ...
//   solver.y()
//
// With sensitivities (n x columns), S' = f_y S + f_w for the problem's w are integrated with y, with the same
// tolerances.  start() discards all history.
//
// Source: A. Hindmarsh et al., SUNDIALS: Suite of Nonlinear and Differential/Algebraic Equation Solvers, ACM TOMS 31
// (2005); Debian's libsundials-dev.
#pragma once

#include <Eigen/Core>
#include <memory>

namespace dyntape {

// Returns false if f is undefined; CVODES then tries shorter steps.
class InitialValueProblem {
 public:
  virtual bool rate(double s, const double* y, double* dy) = 0;
  virtual bool jacobian(double s, const double* y, double* J) = 0;  // by y (n x n), by columns
  virtual bool sensitivity_rate(double s, const double* y, const Eigen::MatrixXd& S, Eigen::MatrixXd& dS) = 0;
  virtual void allowed_errors(const double* y, double* errors) = 0;  // of one internal step, positive

 protected:
  ~InitialValueProblem() = default;
};

class Cvodes {
 public:
  enum class Method { kAdams, kBackwardDifferentiation };
  // kNoRate: f is undefined at the start, or beyond s for any step.  kRough: the error stays too large; kUnsolved:
  // the equations of a step have no solution, for any step.  kTooTight: the tolerance is below rounding.  kOther:
  // unexpected.
  enum class Outcome { kAdvanced, kNoRate, kRough, kUnsolved, kTooTight, kOther };

  // Holds a reference to the problem.  A sensitivity S has the tolerance relative * |S| + absolute.
  Cvodes(InitialValueProblem& problem, int n, int columns, double relative, double absolute, Method method);
  ~Cvodes();
  Cvodes(const Cvodes&) = delete;
  Cvodes& operator=(const Cvodes&) = delete;

  const double* y() const { return y_.data(); }
  Eigen::MatrixXd& sensitivities() { return S_; }
  double s() const { return s_; }

  // A problem begins at s and y; sensitivities() are what they are there.
  void begin(double s, const double* y);
  // Its first step; no internal step goes beyond `end`.
  void start(double end, double first_step);
  // An internal step: s() and y() are where it leads, and sensitivities() once they are read.
  Outcome advance();
  void read_sensitivities();
  int order() const;  // of the last internal step
  // y at s within the last internal step, to its order.
  void at(double s, double* y);

 private:
  struct Solver;
  Eigen::VectorXd y_, at_;
  Eigen::MatrixXd S_;
  double s_ = 0, end_ = 0;
  std::unique_ptr<Solver> solver_;
};

}  // namespace dyntape
