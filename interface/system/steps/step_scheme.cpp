// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/steps/step_scheme.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using dynamics::EuclideanSpace;
using dynamics::ProductSpace;
using PhaseAd = dynamics::Phase<AD>;

void check_system(const System& system, Integrator integrator) {
  const std::string name = "system \"" + system.name + "\"";
  if (system.model.nv == 0) throw ArgumentError(name + " has no joints, expected one or more");
  if (system.n_u < 0 || system.n_p < 0)
    throw ArgumentError(name + ": n_u is " + std::to_string(system.n_u) + " and n_p " +
                        std::to_string(system.n_p) + ", expected none below zero");
  if (system.lag.size() != 0 && system.lag.size() != system.n_u)
    throw ArgumentError(name + ": lag has " + std::to_string(system.lag.size()) +
                        " entries, expected none or one a command: " + std::to_string(system.n_u));
  for (double lag : system.lag)
    if (!(lag >= 0 && std::isfinite(lag)))
      throw ArgumentError(name + ": a lag is " + io::shortest(lag) + " s, expected zero or more");
  if (!system.acceleration && integrator != Integrator::kVariational)
    throw ArgumentError(name + " has no acceleration, which the scheme " + to_string(integrator) + " needs");
  if (system.events && !is_adaptive(integrator))
    throw ArgumentError(name + " has events, at which steps of the scheme " + to_string(integrator) +
                        " do not end; expected adaptive or adaptive-stiff");
}

VectorXad checked_rows(const System& system, const char* what, VectorXad values) {
  if (values.size() == system.model.nv) return values;
  throw ArgumentError("system \"" + system.name + "\": " + what + " has " + std::to_string(values.size()) +
                      " entries, expected one a velocity: " + std::to_string(system.model.nv));
}

}  // namespace

VectorXad stacked(const std::vector<VectorXad>& parts) {
  Eigen::Index size = 0, next = 0;
  for (const VectorXad& part : parts) size += part.size();
  VectorXad all(size);
  for (const VectorXad& part : parts) {
    all.segment(next, part.size()) = part;
    next += part.size();
  }
  return all;
}

Function record_for(const System& system, const char* what, int n_x, int n_p,
                    const std::function<VectorXad(const VectorXad&, const VectorXad&)>& f) {
  return record(system.name + what, std::size_t(n_x), std::size_t(n_p), f, {}, nullptr, 0);
}

StepScheme::StepScheme(const System& system, Integrator integrator)
    : system_(system),
      integrator_(integrator),
      model_(system.model.cast<AD>()),
      configurations_(model_),
      lagged_(lagged_motors(system)) {
  check_system(system, integrator);
  if (integrator == Integrator::kVariational) lagrangian_ = std::make_unique<Lagrangian>(system);
}

bool StepScheme::has_unknowns() const {
  return integrator_ == Integrator::kImplicitMidpoint || integrator_ == Integrator::kImplicitVelocity ||
         integrator_ == Integrator::kVariational;
}

ProductSpace<dynamics::ConfigurationSpace<AD>, EuclideanSpace<AD>> StepScheme::states() const {
  return {configurations_, EuclideanSpace<AD>(nv() + n_m())};
}

StepScheme::Dynamics StepScheme::dynamics() const {
  if (!is_variational())
    return [this](const SystemPoint<AD>& at) {
      return checked_rows(system_, "the acceleration", system_.acceleration(at));
    };
  return [this](const SystemPoint<AD>& at) {
    const dynamics::LagrangianDerivatives<AD> s = lagrangian_->derivatives(at.q, at.v, at.p);
    if (!system_.forces) return stacked({s.q, s.v});
    return stacked({s.q + checked_rows(system_, "the forces", system_.forces(at)), s.v});
  };
}

// States of the lagged motors at s after the beginning.
VectorXad StepScheme::motors(const StepArguments& a, const AD& s) const {
  VectorXad m = a.x.tail(n_m());
  if (!s.is_recorded() && s.value() == 0) return m;
  for (int i = 0; i < n_m(); ++i) {
    const int k = lagged_[std::size_t(i)];
    m[i] = a.u[k] + (m[i] - a.u[k]) * exp(-(s / system_.lag[k]));
  }
  return m;
}

SystemPoint<AD> StepScheme::point(const StepArguments& a, const AD& s, const VectorXad& q,
                                  const VectorXad& v) const {
  const VectorXad m = motors(a, s);
  SystemPoint<AD> point{a.t + s, q, v, a.u, a.p};
  for (int i = 0; i < n_m(); ++i) point.drive[lagged_[std::size_t(i)]] = m[i];
  return point;
}

StepValues StepScheme::operator()(const StepArguments& a, const Dynamics& at) const {
  VectorXad residual;
  const PhaseAd end = end_of(a, {a.x.head(nq()), a.x.segment(nq(), nv())}, at, residual);
  return {residual, stacked({end.q, end.v, motors(a, a.h)})};
}

PhaseAd StepScheme::end_of(const StepArguments& a, const PhaseAd& x, const Dynamics& at,
                           VectorXad& residual) const {
  const auto& Q = configurations_;
  const auto acceleration = [&](const AD& s, const VectorXad& q, const VectorXad& v) {
    return at(point(a, s, q, v));
  };
  switch (integrator_) {
    case Integrator::kSemiImplicitEuler:
      return semi_implicit_euler(Q, acceleration, a.h, x);
    case Integrator::kRungeKutta4:
      return runge_kutta(a, x, at);
    case Integrator::kImplicitMidpoint:
      residual = implicit_midpoint_residual(Q, acceleration, a.h, x, a.z);
      return implicit_midpoint_end(Q, a.h, x, a.z);
    case Integrator::kImplicitVelocity:
      residual = implicit_velocity_residual(Q, acceleration, a.h, x, a.z);
      return implicit_velocity_end(Q, a.h, x, a.z);
    case Integrator::kVariational:
    case Integrator::kAdaptive:
    case Integrator::kAdaptiveStiff:
      break;
  }
  return variational(a, x, at, residual);
}

PhaseAd StepScheme::runge_kutta(const StepArguments& a, const PhaseAd& x, const Dynamics& at) const {
  const ProductSpace space(configurations_, EuclideanSpace<AD>(nv()));
  const auto rate = [&](const AD& s, const VectorXad& y) {
    const VectorXad q = y.head(nq()), v = y.tail(nv());
    return stacked({v, at(point(a, s, q, v))});
  };
  const VectorXad end = runge_kutta_4(space, rate, a.h, stacked({x.q, x.v}));
  return {end.head(nq()), end.tail(nv())};
}

PhaseAd StepScheme::variational(const StepArguments& a, const PhaseAd& x, const Dynamics& at,
                                VectorXad& residual) const {
  const VectorXad xi = a.z.head(nv());
  const auto derivatives = [&](const VectorXad& q, const VectorXad& v) {
    const VectorXad both = at(point(a, a.h * 0.5, q, v));
    return dynamics::LagrangianDerivatives<AD>{both.head(nv()), both.tail(nv())};
  };
  const auto momenta = discrete_momenta(configurations_, derivatives, a.h, x.q, xi);
  residual = momenta.before - at(point(a, AD(0), x.q, x.v)).tail(nv());
  const VectorXad q = configurations_.integrate(x.q, xi);
  if (a.z.size() == nv()) return {q, lagrangian_->velocity(q, momenta.after, a.p)};
  const VectorXad v = a.z.tail(nv());
  residual = stacked({residual, at(point(a, a.h, q, v)).tail(nv()) - momenta.after});
  return {q, v};
}

}  // namespace dyntape
