// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/steps/record_step.h>

#include <numeric>

#include <dyntape/dynamics/simulation/steps.h>
#include <dyntape/interface/system/steps/step_scheme.h>

namespace dyntape {

namespace {

enum class StepPart { kResidual, kEnd };

Function record_part(const System& system, const StepScheme& scheme, StepPart part) {
  const int n_z = scheme.n_z(), nx = scheme.nx(), inputs = 2 + system.n_u + system.n_p;
  return record_for(
      system, part == StepPart::kResidual ? " residual" : " step", n_z ? n_z : nx, inputs + (n_z ? nx : 0),
      [&](const VectorXad& z, const VectorXad& y) {
        Cutter cut(y);
        const VectorXad x = n_z ? cut(nx) : z;
        const AD t = cut.one(), h = cut.one();
        const VectorXad u = cut(system.n_u), p = cut(system.n_p);
        const StepValues values = scheme({t, h, x, u, p, n_z ? z : VectorXad()}, scheme.dynamics());
        return part == StepPart::kResidual ? values.residual : values.end;
      });
}

// Value and Jacobian, with variables first ... first + count at zero.
Derivatives derived_at_zero(const Function& f, int first, int count) {
  Derivatives d = derive(f, Order::kFirst);
  std::vector<Binding> zeros;
  for (int k = first; k < first + count; ++k) zeros.push_back({std::size_t(k), 0.0});
  d.function = dyntape::bind(d.function, Block::kVariables, zeros);
  return d;
}

// Unknowns of the Jacobians: of a variational step also v'.
int unknowns(const StepScheme& scheme) { return scheme.is_variational() ? 2 * scheme.nv() : scheme.n_z(); }

Function record_points(const System& system, const StepScheme& scheme, int& n_points) {
  const int nx = scheme.nx(), n_z = unknowns(scheme);
  return record_for(system, " points", 0, nx + 2 + system.n_u + system.n_p + n_z,
                    [&](const VectorXad&, const VectorXad& y) {
                      Cutter cut(y);
                      const VectorXad x = cut(nx);
                      const AD t = cut.one(), h = cut.one();
                      const VectorXad u = cut(system.n_u), p = cut(system.n_p), z = cut(n_z);
                      std::vector<VectorXad> rows;
                      const StepScheme::Dynamics dynamics = scheme.dynamics();
                      scheme({t, h, x, u, p, z}, [&](const SystemPoint<AD>& at) {
                        rows.push_back(stacked({VectorXad::Constant(1, at.t), at.q, at.v, at.drive}));
                        return dynamics(at);
                      });
                      n_points = int(rows.size());
                      return stacked(rows);
                    });
}

Function record_dynamics(const System& system, const StepScheme& scheme) {
  const int nq = scheme.nq(), nv = scheme.nv();
  return record_for(system, " dynamics", 2 * nv + system.n_u + system.n_p, 1 + nq,
                    [&](const VectorXad& variables, const VectorXad& y) {
                      Cutter cut(variables), fixed(y);
                      const VectorXad dq = cut(nv), v = cut(nv), drive = cut(system.n_u), p = cut(system.n_p);
                      const AD t = fixed.one();
                      const VectorXad q = scheme.configurations().integrate(fixed(nq), dq);
                      return scheme.dynamics()({t, q, v, drive, p});
                    });
}

Function record_chain(const System& system, const StepScheme& scheme, int n_points) {
  const int nx = scheme.nx(), nt = scheme.nt(), nq = scheme.nq(), n = scheme.n_dynamics(),
            n_z = unknowns(scheme);
  return record_for(system, " chain", n_points * n + n_z + nt + system.n_u, nx + 2 + n_points * nq + nx,
                    [&](const VectorXad& variables, const VectorXad& y) {
                      Cutter cut(variables), fixed(y);
                      const VectorXad values = cut(n_points * n), z = cut(n_z), dx = cut(nt),
                                      u = cut(system.n_u), x = fixed(nx);
                      const AD t = fixed.one(), h = fixed.one();
                      const VectorXad q_at = fixed(n_points * nq), x_next = fixed(nx);
                      std::vector<VectorXad> rows;
                      int k = 0;
                      const StepArguments arguments{t, h, scheme.states().integrate(x, dx), u, {}, z};
                      const StepValues step = scheme(arguments, [&](const SystemPoint<AD>& at) {
                        const VectorXad dq =
                            scheme.configurations().difference(q_at.segment(k * nq, nq), at.q);
                        rows.push_back(stacked({dq, at.v, at.drive}));
                        return VectorXad(values.segment(k++ * n, n));
                      });
                      rows.push_back(step.residual);
                      rows.push_back(scheme.states().difference(x_next, step.end));
                      return stacked(rows);
                    });
}

}  // namespace

RecordedStep record_step(const System& system, Integrator integrator) {
  const StepScheme scheme(system, integrator);
  RecordedStep recorded{scheme.nx(), scheme.nt(), scheme.n_z(), {}, {}};
  recorded.end = record_part(system, scheme, StepPart::kEnd);
  if (scheme.n_z()) recorded.residual = record_part(system, scheme, StepPart::kResidual);
  return recorded;
}

RecordedJacobians record_jacobians(const System& system, Integrator integrator) {
  const StepScheme scheme(system, integrator);
  RecordedJacobians recorded;
  recorded.n_dynamics = scheme.n_dynamics();
  recorded.n_z = unknowns(scheme);
  recorded.points = record_points(system, scheme, recorded.n_points);
  const Derivatives dynamics = derived_at_zero(record_dynamics(system, scheme), 0, scheme.nv());
  recorded.dynamics = dynamics.function;
  recorded.of_dynamics = dynamics.jacobian;
  const int before = recorded.n_points * recorded.n_dynamics + recorded.n_z;
  const Function rows = record_chain(system, scheme, recorded.n_points);
  const Derivatives chain = derived_at_zero(rows, before, scheme.nt());
  std::vector<std::size_t> non_zeros(chain.jacobian.nnz());
  std::iota(non_zeros.begin(), non_zeros.end(), chain.n_y);
  recorded.chain = select_outputs(chain.function, non_zeros);
  recorded.of_chain = chain.jacobian;
  return recorded;
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
