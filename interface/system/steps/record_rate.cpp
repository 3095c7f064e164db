// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/steps/record_rate.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/system/steps/step_scheme.h>

namespace dyntape {

namespace {

// Everything that the motion at s depends on.
struct Moving {
  VectorXad d, v, m, u, p, centre;
  AD t, s;

  StepArguments step() const { return {t, AD(0), stacked({centre, v, m}), u, p, {}}; }
  VectorXad configuration(const StepScheme& scheme) const {
    return scheme.configurations().integrate(centre, d);
  }
};

struct Sizes {
  int q, v, m, u, p;
  int given() const { return q + m + u + p + 2; }
};

// From (d, v) and (q_c, m, u, p, t, s).
Moving moving(const Sizes& n, Cutter moves, Cutter given) {
  Moving x;
  x.d = moves(n.v), x.v = moves(n.v);
  x.centre = given(n.q), x.m = given(n.m), x.u = given(n.u), x.p = given(n.p);
  x.t = given.one(), x.s = given.one();
  return x;
}

VectorXad rate_of(const StepScheme& scheme, const Moving& x) {
  const VectorXad turning = scheme.configurations().difference_jacobians(x.d).second * x.v;
  const SystemPoint<AD> point = scheme.point(x.step(), x.s, x.configuration(scheme), x.v);
  return stacked({turning, scheme.dynamics()(point)});
}

Function record_rate_alone(const System& system, const StepScheme& scheme, const Sizes& n) {
  return record_for(system, " rate", 2 * n.v, n.given(), [&](const VectorXad& moves, const VectorXad& given) {
    return rate_of(scheme, moving(n, Cutter(moves), Cutter(given)));
  });
}

Function record_by_all(const System& system, const StepScheme& scheme, const Sizes& n) {
  return record_for(system, " rate by all", 2 * n.v + n.m + n.u + n.p, n.q + 2,
                    [&](const VectorXad& variables, const VectorXad& parameters) {
                      Cutter cut(variables), fixed(parameters);
                      Moving x;
                      x.d = cut(n.v), x.v = cut(n.v), x.m = cut(n.m), x.u = cut(n.u), x.p = cut(n.p);
                      x.centre = fixed(n.q), x.t = fixed.one(), x.s = fixed.one();
                      return rate_of(scheme, x);
                    });
}

Function record_state(const System& system, const StepScheme& scheme, const Sizes& n) {
  return record_for(system, " state", 0, 2 * n.v + n.given(), [&](const VectorXad&, const VectorXad& all) {
    const VectorXad given = all.tail(n.given());
    const Moving x = moving(n, Cutter(all), Cutter(given));
    return stacked({x.configuration(scheme), x.v, scheme.motors(x.step(), x.s)});
  });
}

Function record_frame(const System& system, const StepScheme& scheme, const Sizes& n) {
  return record_for(system, " frame", 0, n.v + 1, [&](const VectorXad&, const VectorXad& all) {
    const MatrixXad J = scheme.configurations().integrate_jacobians(all.head(n.v)).second;
    VectorXad rest(n.m);
    int i = 0;
    for (const int k : lagged_motors(system)) rest[i++] = exp(-(all[n.v] / system.lag[k]));
    return stacked({VectorXad(J.reshaped()), rest});
  });
}

Function record_events(const System& system, const StepScheme& scheme, const Sizes& n) {
  const int nx = scheme.nx();
  return record_for(system, " events", 0, nx + 1 + n.u + n.p, [&](const VectorXad&, const VectorXad& all) {
    Cutter cut(all);
    const VectorXad x = cut(nx);
    const AD t = cut.one();
    const VectorXad u = cut(n.u), p = cut(n.p);
    const StepArguments here{t, AD(0), x, u, p, {}};
    return system.events(scheme.point(here, AD(0), x.head(n.q), x.segment(n.q, n.v)));
  });
}

}  // namespace

RecordedRate record_rate(const System& system, Integrator integrator) {
  const StepScheme scheme(system, integrator);
  const Sizes n{scheme.nq(), scheme.nv(), scheme.n_m(), system.n_u, system.n_p};
  RecordedRate recorded;
  recorded.nq = n.q, recorded.nv = n.v, recorded.n_m = n.m;
  recorded.rate = record_rate_alone(system, scheme, n);
  recorded.by_all = record_by_all(system, scheme, n);
  recorded.state = record_state(system, scheme, n);
  recorded.frame = record_frame(system, scheme, n);
  if (!system.events) return recorded;
  recorded.events = record_events(system, scheme, n);
  recorded.n_g = int(recorded.events.n_y());
  if (recorded.n_g == 0)
    throw ArgumentError("system \"" + system.name + "\": its events have no entry, expected one or more");
  return recorded;
}

}  // namespace dyntape
