// SPDX-License-Identifier: BSD-3-Clause
//
// Applies a scheme of dynamics/simulation/ to a system, on the tape.
//
//   const StepScheme scheme(system, Integrator::kRungeKutta4);
//   StepValues end = scheme({t, h, x, u, p, {}}, scheme.dynamics());          // inside a recording
//
// A scheme evaluates the dynamics at some points: the acceleration (nv), or for the variational scheme the
// derivatives of the Lagrangian, by q with the forces and by v (2 nv).  The caller provides these: dynamics()
// records the system's; variables in its place give the chain from point to point alone (record_step.h).
#pragma once

#include <memory>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/dynamics/simulation/steps.h>
#include <dyntape/interface/system/lagrangian.h>
#include <dyntape/interface/system/system.h>

namespace dyntape {

struct StepArguments {
  AD t, h;
  VectorXad x, u, p;
  // Unknowns of an implicit scheme: the change of v, or xi (nv) of a variational step, optionally followed by v'
  // (nv): the momentum at the end is then an additional residual; otherwise v' is solved for on the tape.
  VectorXad z;
};

struct StepValues {
  VectorXad residual, end;  // (n_z); x'
};

class StepScheme {
 public:
  using Dynamics = std::function<VectorXad(const SystemPoint<AD>&)>;

  // Holds a reference to the system.  ArgumentError if the system is inconsistent, or lacks what the scheme needs.
  StepScheme(const System& system, Integrator integrator);
  StepScheme(const StepScheme&) = delete;  // its members point to each other
  StepScheme& operator=(const StepScheme&) = delete;

  int nq() const { return model_.nq; }
  int nv() const { return model_.nv; }
  int n_m() const { return int(lagged_.size()); }
  int nx() const { return nq() + nv() + n_m(); }
  int nt() const { return 2 * nv() + n_m(); }
  int n_z() const { return has_unknowns() ? nv() : 0; }
  bool is_variational() const { return lagrangian_ != nullptr; }
  int n_dynamics() const { return is_variational() ? 2 * nv() : nv(); }
  const dynamics::ConfigurationSpace<AD>& configurations() const { return configurations_; }
  dynamics::ProductSpace<dynamics::ConfigurationSpace<AD>, dynamics::EuclideanSpace<AD>> states() const;

  Dynamics dynamics() const;
  StepValues operator()(const StepArguments& a, const Dynamics& at) const;  // not of adaptive steps

  // s after the beginning of a step: the states of the lagged motors; all that the dynamics see, at q and v there.
  VectorXad motors(const StepArguments& a, const AD& s) const;
  SystemPoint<AD> point(const StepArguments& a, const AD& s, const VectorXad& q, const VectorXad& v) const;

 private:
  bool has_unknowns() const;
  dynamics::Phase<AD> end_of(const StepArguments& a, const dynamics::Phase<AD>& x, const Dynamics& at,
                             VectorXad& residual) const;
  dynamics::Phase<AD> runge_kutta(const StepArguments& a, const dynamics::Phase<AD>& x,
                                  const Dynamics& at) const;
  dynamics::Phase<AD> variational(const StepArguments& a, const dynamics::Phase<AD>& x, const Dynamics& at,
                                  VectorXad& residual) const;

  const System& system_;
  Integrator integrator_;
  dynamics::Model<AD> model_;
  dynamics::ConfigurationSpace<AD> configurations_;
  std::vector<int> lagged_;
  std::unique_ptr<const Lagrangian> lagrangian_;  // null: not variational
};

VectorXad stacked(const std::vector<VectorXad>& parts);

// Takes vectors apart from their beginning.
class Cutter {
 public:
  explicit Cutter(const VectorXad& all) : all_(all) {}
  VectorXad operator()(Eigen::Index size) { return all_.segment((next_ += size) - size, size); }
  AD one() { return all_[next_++]; }

 private:
  const VectorXad& all_;
  Eigen::Index next_ = 0;
};

// Records for the user, whose callables they are: errors do not name this file.
Function record_for(const System& system, const char* what, int n_x, int n_p,
                    const std::function<VectorXad(const VectorXad&, const VectorXad&)>& f);

}  // namespace dyntape
