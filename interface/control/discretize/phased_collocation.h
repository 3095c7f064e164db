// SPDX-License-Identifier: BSD-3-Clause
//
// A motion in phases (phases.h) as one nonlinear program: the collocation of each phase, tied by its links.
//
//   PhasedCollocation nlp(phases, {{.intervals = 20}, {.intervals = 10}});
//   NlpSolution s = solve_nlp(nlp, nlp.start(), {.method = NlpMethod::kRiccati});
//   std::vector<Trajectory> motions = nlp.trajectories(s.x);                     // one a phase, each from t = 0
//
// Variables: those of phase 0, 1, ... (collocation.h).  Constraints: those of phase 0, the link from it, those of phase 1, ...;
// of a link one row a state, x(0) of the phase behind less what the link makes of x(T) of the phase before.  Links tie
// neighbours, so the program stays a chain of stages; a closing link ties its ends, by rows that are linear in x(0): stage by
// stage it is solved with copies of that (lifted_nlp.h).
//
// With Gauss-Newton's Hessian the curvature of links is left out, as is that of all constraints.
//
// Errors: ArgumentError as of Collocation and check(Phases), as many meshes as there are phases or one for all, one kind of
// Hessian.
#pragma once

#include <memory>
#include <vector>

#include <dyntape/interface/control/discretize/collocation.h>
#include <dyntape/interface/control/problem/phases.h>

namespace dyntape {

class PhasedCollocation : public Nlp {
 public:
  PhasedCollocation(const Phases& phases, const std::vector<MeshOptions>& meshes);
  // The same phases on other nodes; what is recorded and compiled of them is taken over.
  PhasedCollocation(const PhasedCollocation& ready, const Phases& phases,
                    const std::vector<std::vector<double>>& nodes);

  std::size_t phases() const { return parts_.size(); }
  const Collocation& phase(std::size_t k) const { return *parts_[k].program; }
  const std::string& phase_name(std::size_t k) const { return parts_[k].name; }

  std::vector<double> start() const;
  std::vector<Trajectory> trajectories(const std::vector<double>& x) const;
  std::vector<double> variables(const std::vector<Trajectory>& motions) const;
  // Of one phase, of nominal values of the whole.
  NlpScaling of_phase(std::size_t k, const NlpScaling& scaling) const;
  // NumericalError where functions or first derivatives are not finite at x.
  void check_finite(const std::vector<double>& x) override;
  BuildReport build() const;

  const NlpShape& shape() const override { return shape_; }
  bool objective(const double* x, double& value) override;
  bool gradient(const double* x, double* gradient) override;
  bool constraints(const double* x, double* g) override;
  bool jacobian(const double* x, double* nonzeros) override;
  bool hessian(const double* x, double sigma, const double* lambda, double* nonzeros) override;
  NlpScaling scaling(const std::vector<double>& at, const NlpScaling& before = {}) override;
  std::string variable_name(std::size_t i) const override;
  std::string constraint_name(std::size_t j) const override;

 private:
  struct Part {
    std::string name;
    std::unique_ptr<Collocation> program;
    std::size_t variable, row, jacobian;  // its first ones
    std::vector<std::size_t> hessian;     // where its entries are
    std::vector<double> curvature;        // room for them
  };
  struct Link {
    std::size_t from, to;                      // first variables: x(T), x(0)
    std::size_t row, n_x;                      // first row; rows
    std::string name;                          // "push-off to flight"
    std::vector<std::string> states;           // of the phase behind
    std::unique_ptr<CompiledFunction> change;  // null: none
    std::unique_ptr<CompiledFunction::Workspace> workspace;
    std::vector<double> p, y, J, H, w;
    std::vector<std::size_t> of_J, of_H;  // where entries are
    std::vector<std::size_t> of_one;      // where x(0) stands
  };

  void place(const Phases& phases, std::vector<std::unique_ptr<Collocation>> programs);
  void place_link(const Phases& phases, const PhaseLink& link);
  std::string prefix(const Part& part) const;
  void lay_out_jacobian();
  void lay_out_hessian();
  bool evaluate(Link& link, Order order, const double* x);

  std::vector<Part> parts_;
  std::vector<Link> links_;
  CodegenOptions of_links_;
  NlpShape shape_;
};

}  // namespace dyntape
