// SPDX-License-Identifier: BSD-3-Clause
//
// A program some of whose equalities tie stages that are no neighbours, as one where neighbours alone are tied: what such a row
// knows of earlier stages is carried to its last one by copies, one a stage, each equal to the one before.
//
//   LiftedNlp carried(nlp, start);                                      // LiftedNlp::is_needed(nlp.shape())
//   NlpSolution s = carried.in_own_variables(StructuredInteriorPoint(carried).solve(carried.start(start), options));
//
// A motion that ends as it began is one: x(0) = change(x(T)).  Its stages have twice as many states then, and the solve is
// linear in the number of stages still.
//
// Such rows are linear in what is carried, as NlpShape::stages says: with the derivatives J of the start,
//   g(x, copy) = g(x) + J (copy - x)
// and copies have neither costs nor curvature.  Variables of a stage are its own, then its copies; rows are those of the
// program, then the ones of copies.
#pragma once

#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

class LiftedNlp : public Nlp {
 public:
  static bool is_needed(const NlpShape& shape);

  LiftedNlp(Nlp& nlp, const std::vector<double>& start);

  std::vector<double> start(const std::vector<double>& own) const;
  NlpSolution in_own_variables(NlpSolution solution) const;
  std::size_t place_of(std::size_t own) const { return at_[own]; }  // of a variable of the program

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
        at;  // variable of the program; the copy of the stage before, or itself; where this one is
  };
  struct Carried {
    std::size_t row, of, at;  // what a row takes from a copy in place of a variable of the program
    double slope;
  };

  const double* own(const double* x);
  void place(const std::vector<double>& derivatives);

  Nlp& nlp_;
  NlpShape shape_;
  std::vector<std::size_t> at_;  // (n) where the program's variables are
  std::vector<Copy> copies_;
  std::vector<Carried> carried_;
  std::vector<double> x_, gradient_;
};

}  // namespace dyntape
