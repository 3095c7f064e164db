// SPDX-License-Identifier: BSD-3-Clause
//
// A staged program (staged_program.h) as a nonlinear program for solvers.
//
//   StagedNlp nlp = discretize(problem, {.scheme = hermite_simpson(), .intervals = 40});
//   NlpSolution s = solve_with_ipopt(nlp, nlp.start());
//   Trajectory motion = nlp.trajectory(s.x);                           // of a problem, or of phase 0
//   std::vector<Trajectory> motions = nlp.trajectories(s.x);           // one per phase, each from t = 0, in real time
//
// Patterns are fixed at construction.  Evaluations do not allocate.
//
// Values of a problem may change between solves, without recording or compiling.  Patterns stay; previous
// evaluations become invalid:
//
//   Problem now = nlp.problem();
//   now.start = measured, now.parameters.set("target", target);
//   nlp.set_values(now);
//   NlpSolution s = solve_with_ipopt(nlp, last.x);                       // e.g. from the last solution
//
// Scaling (staged_scaling.cpp), one value for each entry of z, each row of a point and the cost.  States: their
// movement in the start.  Other variables: equilibration of the Jacobian, sampled around the start if it is
// constant.  Rows and cost: their resulting size.  Links: the scales of their states.  A change of the units of
// mass, length or time changes only these values.
#pragma once

#include <dyntape/interface/control/discretize/staged_program.h>
#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

class StagedNlp : public Nlp {
 public:
  StagedNlp(StagedProgram program);  // NOLINT: implicit conversion

  const StagedProgram& program() const { return program_; }
  BuildReport build() const;  // times and counts of recording and compiling
  std::size_t phases() const { return program_.phases.size(); }
  const StagedPhase& phase(std::size_t k = 0) const { return program_.phases[k]; }
  const Problem& problem(std::size_t k = 0) const { return phase(k).asked; }  // with the current values
  std::vector<double> times(
      std::size_t k = 0) const;  // times of the points, s; for a free duration of the initial guess

  // Takes over values of a problem with the same functions: parameters, start, goal, bounds, guess
  // (Problem::take_values); bounds of terms stay.  If something does not fit, throws ArgumentError and changes
  // nothing.
  void set_values(const Problem& now, std::size_t phase = 0);
  void set_parameters(const Parameters& now);  // of phase 0
  // Sets the start, also beyond its bounds, since a plant may be there.  For problems with a given start.
  void start_at(const Eigen::VectorXd& x);

  // Variables from the guesses; conversions from and to trajectories on these meshes.
  std::vector<double> start() const;
  Trajectory trajectory(const std::vector<double>& x, std::size_t phase = 0) const;
  std::vector<Trajectory> trajectories(const std::vector<double>& x) const;
  std::vector<double> variables(const std::vector<Trajectory>& motions) const;
  std::vector<double> variables(const Trajectory& motion) const {
    return variables(std::vector<Trajectory>{motion});
  }
  // Shifts the multipliers of a solution by a number of intervals; the last ones stay.  For an even mesh, phase 0.
  void make_earlier(NlpSolution& multipliers, int intervals) const;

  // Nominal values of the program for a phase's trajectory, which has no state for the duration (verify.h).
  NlpScaling of_motion(const NlpScaling& scaling, std::size_t phase = 0) const;

  const NlpShape& shape() const override { return program_.shape; }
  bool objective(const double* x, double& value) override;
  bool gradient(const double* x, double* gradient) override;
  bool constraints(const double* x, double* g) override;
  bool jacobian(const double* x, double* nonzeros) override;
  bool hessian(const double* x, double sigma, const double* lambda, double* nonzeros) override;
  NlpScaling scaling(const std::vector<double>& at, const NlpScaling& before = {}) override;
  std::string variable_name(std::size_t i) const override { return dyntape::variable_name(program_, i); }
  std::string constraint_name(std::size_t j) const override { return row_name(program_, j); }

  // Throws NumericalError, with function, point, row, variable and operation, unless values and first derivatives
  // are finite at x.
  void check_finite(const std::vector<double>& x) override;

 private:
  friend class PhaseScaling;

  // Added to entry `target` of the gradient or the Jacobian: factor * (non-zero `source` of the evaluators' Jacobians).
  struct Contribution {
    std::size_t target;
    double factor;
    std::size_t source;
  };
  // Product of two entries of the Jacobian of the residuals, added to a Hessian entry.
  struct SquareEntry {
    std::size_t target;
    double factor;
    std::size_t left, right;
  };

  void lay_out_jacobian();
  void lay_out_gradient();
  void lay_out_exact_hessian();
  void lay_out_gauss_newton();
  void forget();
  bool evaluate_values(const double* x);
  bool evaluate_first(const double* x);
  void collect_weights(double sigma, const double* lambda);
  bool gauss_newton(const double* x, double sigma, double* nonzeros);
  void check_finite(const StagedPhase& phase, std::size_t evaluator, std::size_t point,
                    const std::vector<double>& x) const;
  void check_finite(const StagedLink& link, const std::vector<double>& x);
  std::string not_finite(const Evaluator& e, const std::vector<std::string>& states) const;

  StagedProgram program_;
  std::vector<double> constants_;            // of the Jacobian
  std::vector<Contribution> of_jacobian_;    // in the order of targets
  std::vector<Contribution> of_gradient_;    // phase by phase
  std::vector<std::size_t> gradient_begin_;  // (phases + 1)
  std::vector<std::size_t> of_hessian_;      // target index of the non-zeros of the evaluators' Hessians
  std::vector<SquareEntry> of_squares_;

  // The last evaluation point and results: values, or values with derivatives.
  std::vector<double> x_values_, x_first_;
  bool values_good_ = false, first_good_ = false;
  bool are_of_first_ = false;  // the last values came with derivatives
  const std::vector<double>& values() const { return are_of_first_ ? first_.y : values_.y; }
  Evaluation values_, first_, squares_;
};

// The problem on other nodes; keeps recorded and compiled functions (staged_program.h).
inline StagedProgram discretize(const StagedNlp& ready, const std::vector<double>& nodes) {
  return discretize(ready.program(), std::vector<std::vector<double>>{nodes});
}

}  // namespace dyntape
