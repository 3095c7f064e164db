// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/simulation/record_step.h>

#include <cmath>
#include <optional>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/simulation/steps.h>
#include <dyntape/interface/simulation/lagrangian.h>

namespace dyntape {

namespace {

using dynamics::ConfigurationSpace;
using dynamics::EuclideanSpace;
using dynamics::Model;
using dynamics::ProductSpace;
using Phase = dynamics::Phase<AD>;

struct StepArguments {
  AD t, h;
  VectorXad x, u, p, z;
};

struct StepValues {
  VectorXad residual, end;
};

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
      throw ArgumentError(name + ": a lag is " + std::to_string(lag) + " s, expected zero or more");
  if (!system.acceleration && integrator != Integrator::kVariational)
    throw ArgumentError(name + " has no acceleration, which the scheme " + to_string(integrator) + " needs");
}

VectorXad checked_rows(const System& system, const char* what, VectorXad values) {
  if (values.size() == system.model.nv) return values;
  throw ArgumentError("system \"" + system.name + "\": " + what + " has " + std::to_string(values.size()) +
                      " entries, expected one a velocity: " + std::to_string(system.model.nv));
}

// A scheme on the tape.
class RecordedScheme {
 public:
  RecordedScheme(const System& system, Integrator integrator)
      : system_(system),
        integrator_(integrator),
        model_(system.model.cast<AD>()),
        lagged_(lagged_motors(system)) {
    check_system(system, integrator);
    if (integrator == Integrator::kVariational) lagrangian_.emplace(system);
  }

  int nq() const { return model_.nq; }
  int nv() const { return model_.nv; }
  int n_m() const { return int(lagged_.size()); }
  int nx() const { return nq() + nv() + n_m(); }
  int nt() const { return 2 * nv() + n_m(); }
  int n_z() const {
    const bool is_explicit =
        integrator_ == Integrator::kSemiImplicitEuler || integrator_ == Integrator::kRungeKutta4;
    return is_explicit ? 0 : nv();
  }
  auto configurations() const { return ConfigurationSpace<AD>(model_); }
  auto states() const {
    return ProductSpace(ProductSpace(configurations(), EuclideanSpace<AD>(nv())), EuclideanSpace<AD>(n_m()));
  }

  StepValues operator()(const StepArguments& a) const {
    Cutter cut(a.x);
    const VectorXad q = cut(nq()), v = cut(nv());
    VectorXad residual;
    const Phase end = phase_after(a, {q, v}, residual);
    return {residual, stacked({end.q, end.v, motors(a, a.h)})};
  }

 private:
  // States of the lagged motors at s after the beginning.
  VectorXad motors(const StepArguments& a, const AD& s) const {
    VectorXad m = a.x.tail(n_m());
    if (!s.is_recorded() && s.value() == 0) return m;
    for (int i = 0; i < n_m(); ++i) {
      const AD& u = a.u[lagged_[std::size_t(i)]];
      m[i] = u + (m[i] - u) * exp(-(s / system_.lag[lagged_[std::size_t(i)]]));
    }
    return m;
  }

  SystemPoint<AD> point(const StepArguments& a, const AD& s, const VectorXad& q, const VectorXad& v) const {
    const VectorXad m = motors(a, s);
    SystemPoint<AD> point{a.t + s, q, v, a.u, a.p};
    for (int i = 0; i < n_m(); ++i) point.drive[lagged_[std::size_t(i)]] = m[i];
    return point;
  }

  auto acceleration(const StepArguments& a) const {
    return [this, &a](const AD& s, const VectorXad& q, const VectorXad& v) {
      return checked_rows(system_, "the acceleration", system_.acceleration(point(a, s, q, v)));
    };
  }

  Phase phase_after(const StepArguments& a, const Phase& x, VectorXad& residual) const {
    const auto Q = configurations();
    switch (integrator_) {
      case Integrator::kSemiImplicitEuler:
        return semi_implicit_euler(Q, acceleration(a), a.h, x);
      case Integrator::kRungeKutta4:
        return runge_kutta(a, x);
      case Integrator::kImplicitMidpoint:
        residual = implicit_midpoint_residual(Q, acceleration(a), a.h, x, a.z);
        return implicit_midpoint_end(Q, a.h, x, a.z);
      case Integrator::kImplicitVelocity:
        residual = implicit_velocity_residual(Q, acceleration(a), a.h, x, a.z);
        return implicit_velocity_end(Q, a.h, x, a.z);
      case Integrator::kVariational:
        break;
    }
    return variational(a, x, residual);
  }

  Phase runge_kutta(const StepArguments& a, const Phase& x) const {
    const ProductSpace space(configurations(), EuclideanSpace<AD>(nv()));
    const auto rate = [&](const AD& s, const VectorXad& y) {
      const VectorXad q = y.head(nq()), v = y.tail(nv());
      return stacked({v, acceleration(a)(s, q, v)});
    };
    const VectorXad end = runge_kutta_4(space, rate, a.h, stacked({x.q, x.v}));
    return {end.head(nq()), end.tail(nv())};
  }

  Phase variational(const StepArguments& a, const Phase& x, VectorXad& residual) const {
    const auto slopes = [&](const VectorXad& q, const VectorXad& v) {
      dynamics::LagrangianSlopes<AD> s = lagrangian_->slopes(q, v, a.p);
      if (system_.forces)
        s.q += checked_rows(system_, "the forces", system_.forces(point(a, a.h * 0.5, q, v)));
      return s;
    };
    const auto momenta = discrete_momenta(configurations(), slopes, a.h, x.q, a.z);
    residual = momenta.before - lagrangian_->slopes(x.q, x.v, a.p).v;
    const VectorXad q = configurations().integrate(x.q, a.z);
    return {q, lagrangian_->velocity(q, momenta.after, a.p)};
  }

  const System& system_;
  Integrator integrator_;
  Model<AD> model_;
  std::vector<int> lagged_;
  std::optional<Lagrangian> lagrangian_;
};

enum class What { kResidual, kEnd };

Function record_values(const System& system, const RecordedScheme& scheme, What what) {
  const int n_z = scheme.n_z(), nx = scheme.nx();
  const std::string name = system.name + (what == What::kResidual ? " residual" : " step");
  const std::size_t variables = std::size_t(n_z ? n_z : nx),
                    inputs = std::size_t(2 + system.n_u + system.n_p);
  return record(
      name, variables, inputs + std::size_t(n_z ? nx : 0),
      [&](const VectorXad& z, const VectorXad& y) {
        Cutter cut(y);
        const VectorXad x = n_z ? cut(nx) : z;
        const AD t = cut.one(), h = cut.one();
        const VectorXad u = cut(system.n_u), p = cut(system.n_p);
        const StepValues values = scheme({t, h, x, u, p, n_z ? z : VectorXad()});
        return what == What::kResidual ? values.residual : values.end;
      },
      {}, nullptr, 0);  // the callables are the user's, this line is not
}

}  // namespace

RecordedStep record_step(const System& system, Integrator integrator) {
  const RecordedScheme scheme(system, integrator);
  RecordedStep recorded{scheme.nx(), scheme.nt(), scheme.n_z(), {}, {}};
  recorded.end = record_values(system, scheme, What::kEnd);
  if (scheme.n_z()) recorded.residual = record_values(system, scheme, What::kResidual);
  return recorded;
}

RecordedJacobians record_jacobians(const System& system, Integrator integrator) {
  const RecordedScheme scheme(system, integrator);
  const int n_z = scheme.n_z(), nt = scheme.nt(), nx = scheme.nx();
  const Function values = record(
      system.name + " step Jacobians", std::size_t(n_z + nt + system.n_u + system.n_p),
      std::size_t(2 * nx + 2),
      [&](const VectorXad& variables, const VectorXad& y) {
        Cutter cut(variables), fixed(y);
        const VectorXad z = cut(n_z), dx = cut(nt), u = cut(system.n_u), p = cut(system.n_p), x = fixed(nx);
        const AD t = fixed.one(), h = fixed.one();
        const VectorXad x_next = fixed(nx);
        const StepValues moved = scheme({t, h, scheme.states().integrate(x, dx), u, p, z});
        return stacked({moved.residual, scheme.states().difference(x_next, moved.end)});
      },
      {}, nullptr, 0);
  const SparseFunction slopes = sparse_jacobian(values);
  std::vector<Binding> zeros;
  for (int k = 0; k < nt; ++k) zeros.push_back({std::size_t(n_z + k), 0.0});
  return {dyntape::bind(slopes.function, Block::kVariables, zeros), slopes.pattern};
}

std::string argument_name(const System& system, int entry) {
  const dynamics::Model<double>& model = system.model;
  const auto indexed = [](const std::string& name, int i, int of) {
    return of == 1 ? name : name + "[" + std::to_string(i) + "]";
  };
  for (const auto& joint : model.joints) {
    const int nq = dynamics::nq(joint.type), nv = dynamics::nv(joint.type);
    const int i = entry - joint.idx_q, k = entry - model.nq - joint.idx_v;
    if (i >= 0 && i < nq) return indexed("q." + joint.name, i, nq);
    if (k >= 0 && k < nv) return indexed("v." + joint.name, k, nv);
  }
  const std::vector<int> lagged = lagged_motors(system);
  int k = entry - model.nq - model.nv;
  if (k < int(lagged.size())) return "m[" + std::to_string(lagged[std::size_t(k)]) + "]";
  k -= int(lagged.size());
  if (k < 2) return k == 0 ? "t" : "h";
  k -= 2;
  return k < system.n_u ? "u[" + std::to_string(k) + "]" : "p[" + std::to_string(k - system.n_u) + "]";
}

}  // namespace dyntape
