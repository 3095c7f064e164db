// SPDX-License-Identifier: BSD-3-Clause
//
// Rewrites a program whose equalities couple distant stages so that only neighbours are coupled.  Copies of the
// variables, one per stage, each equal to the previous, carry their values to the last stage of such a row.
//
//   LiftedNlp carried(nlp, start);                                      // LiftedNlp::is_needed(nlp.shape())
//   NlpSolution s = carried.in_own_variables(StructuredInteriorPoint(carried).solve(carried.start(start), options));
//
// Example: a periodic motion, x(0) = change(x(T)).  Its stages then have twice as many states, and the solve is
// still linear in the number of stages.
//
// Such rows are linear in the carried variables, as NlpShape::stages requires: with the derivatives J of the start,
//   g(x, copy) = g(x) + J (copy - x)
// Copies have neither cost nor curvature.  Variables of a stage are its own, then its copies; rows are the
// program's, then those of the copies.
#pragma once

#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

class LiftedNlp : public Nlp {
 public:
  static bool is_needed(const NlpShape& shape);

  LiftedNlp(Nlp& nlp, const std::vector<double>& start);

  std::vector<double> start(const std::vector<double>& own) const;
  NlpSolution in_own_variables(NlpSolution solution) const;
  std::size_t place_of(std::size_t own) const { return at_[own]; }  // index of a variable of the program

  const NlpShape& shape() const override { return shape_; }
  bool objective(const double* x, double& value) override;
  bool gradient(const double* x, double* gradient) override;
  bool constraints(const double* x, double* g) override;
  bool jacobian(const double* x, double* nonzeros) override;
  bool hessian(const double* x, double sigma, const double* lambda, double* nonzeros) override;
  std::string variable_name(std::size_t i) const override;
  std::string constraint_name(std::size_t j) const override;

 private:
  struct Copy {
    std::size_t of, before,
        at;  // variable of the program; index of the previous copy, or of the variable; index of this copy
  };
  struct Carried {
    std::size_t row, of, at;  // a row, the variable, and the copy that replaces it
    double slope;
  };

  const double* own(const double* x);
  void place(const std::vector<double>& derivatives);

  Nlp& nlp_;
  NlpShape shape_;
  std::vector<std::size_t> at_;  // (n) indices of the program's variables
  std::vector<Copy> copies_;
  std::vector<Carried> carried_;
  std::vector<double> x_, gradient_;
};

}  // namespace dyntape
