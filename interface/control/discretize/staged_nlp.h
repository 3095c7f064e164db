// SPDX-License-Identifier: BSD-3-Clause
//
// A staged program (staged_program.h) as a nonlinear program: what solvers evaluate.
//
//   StagedNlp nlp = discretize(problem, {.scheme = hermite_simpson(), .intervals = 40});
//   NlpSolution s = solve_with_ipopt(nlp, nlp.start());
//   Trajectory motion = nlp.trajectory(s.x);                           // of a problem, or of phase 0
//   std::vector<Trajectory> motions = nlp.trajectories(s.x);           // one a phase, each from t = 0, in real time
//
// Patterns are fixed at construction; evaluations allocate nothing.
//
// Between solves values may change: what a problem says besides its functions.  Nothing is recorded or compiled anew,
// patterns stay, and what was evaluated before is forgotten:
//
//   Problem now = nlp.problem();
//   now.start = measured, now.parameters.set("target", target);
//   nlp.set_values(now);
//   NlpSolution s = solve_with_ipopt(nlp, last.x);                       // from the last solution, say
//
// Scaling (staged_scaling.cpp), one for each part of z, row of a point and the cost: how far the start moves states; of the others
// what equilibrates the Jacobian, sampled around the start where it stands still; of rows and the cost what they then amount to; of a
// link that of the states that it sets.  A change of the units of mass, length or time changes them alike.
#pragma once

#include <dyntape/interface/control/discretize/staged_program.h>
#include <dyntape/interface/control/discretize/trajectory.h>
#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

class StagedNlp : public Nlp {
 public:
  StagedNlp(StagedProgram program);  // NOLINT: a program is one

  const StagedProgram& program() const { return program_; }
  BuildReport build() const;  // what it took to make its functions ready
  std::size_t phases() const { return program_.phases.size(); }
  const StagedPhase& phase(std::size_t k = 0) const { return program_.phases[k]; }
  const Problem& problem(std::size_t k = 0) const { return phase(k).asked; }  // with the values of now
  std::vector<double> times(
      std::size_t k = 0) const;  // of the points, s; of the first guess where the duration is free

  // Of a problem with the same functions: parameters, start, goal, bounds, guess (Problem::take_values); bounds of terms
  // stay.  ArgumentError where something does not fit, and then nothing has changed.
  void set_values(const Problem& now, std::size_t phase = 0);
  void set_parameters(const Parameters& now);  // of phase 0
  // Where the motion begins, beyond its bounds too: a plant may be there.  Of a problem whose start is given.
  void start_at(const Eigen::VectorXd& x);

  // Variables from the guesses, and from and to trajectories on these meshes.
  std::vector<double> start() const;
  Trajectory trajectory(const std::vector<double>& x, std::size_t phase = 0) const;
  std::vector<Trajectory> trajectories(const std::vector<double>& x) const;
  std::vector<double> variables(const std::vector<Trajectory>& motions) const;
  std::vector<double> variables(const Trajectory& motion) const {
    return variables(std::vector<Trajectory>{motion});
  }
  // Multipliers of a solution, each that of what stood so many intervals later; the last ones stay.  Of an even mesh, phase 0.
  void make_earlier(NlpSolution& multipliers, int intervals) const;

  // Nominal values of the program as those of a phase's motion, which has no state for the duration (verify.h).
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

  // Throws NumericalError naming function, point, row, variable and operation unless values and first
  // derivatives are finite at x.
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
  std::vector<std::size_t> of_hessian_;      // where the non-zeros of the evaluators' Hessians go
  std::vector<SquareEntry> of_squares_;

  // What was evaluated last, and where: values alone, and with derivatives.
  std::vector<double> x_values_, x_first_;
  bool values_good_ = false, first_good_ = false;
  bool are_of_first_ = false;  // the values asked for last came with derivatives
  const std::vector<double>& values() const { return are_of_first_ ? first_.y : values_.y; }
  Evaluation values_, first_, squares_;
};

// A problem on other nodes; what is recorded and compiled is taken over (staged_program.h).
inline StagedProgram discretize(const StagedNlp& ready, const std::vector<double>& nodes) {
  return discretize(ready.program(), std::vector<std::vector<double>>{nodes});
}

}  // namespace dyntape
