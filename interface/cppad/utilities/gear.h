// SPDX-License-Identifier: BSD-3-Clause
//
// Solves stiff differential equations x' = f(t, x) by Gear's multi-step method, for numbers.
//
//   struct { void Ode(t, x, f); void Ode_dep(t, x, f_x); } F;        // f (n) and its Jacobian f_x (n n), row by row
//   OdeGear(F, m, n, T, X, e);                                       // one step, from T[0] ... T[m - 1] to T[m]
//   Vector xf = OdeGearControl(F, M, ti, tf, xi, smin, smax, sini, eabs, erel, ef, maxabs, nstep);
//
// Formula: the solution is the polynomial of degree m through the m previous points with slope f at T[m] (Gear 1971:
// backward differentiation with variable steps).
#pragma once

#include <string>

#include <dyntape/interface/cppad/utilities/ode.h>

namespace CppAD::inline dyntape_names {

namespace detail {

// Slope at T[at] of the polynomial p through m + 1 points: the sum of weights[j] p(T[j]).
template <class Scalar, class Vector>
vector<Scalar> slope_weights(std::size_t m, std::size_t at, const Vector& T) {
  vector<Scalar> weights(m + 1);
  weights[at] = Scalar(0);
  for (std::size_t j = 0; j <= m; ++j) {
    if (j == at) continue;
    Scalar weight = Scalar(1) / (T[j] - T[at]);
    for (std::size_t k = 0; k <= m; ++k) {
      if (k != j && k != at) weight = weight * (T[at] - T[k]) / (T[j] - T[k]);
    }
    weights[j] = weight;
    weights[at] = weights[at] + Scalar(1) / (T[at] - T[j]);
  }
  return weights;
}

// The value at T[m] of the polynomial through the m points before that has the slope f at the last of them.
template <class Scalar, class Vector>
Vector predicted(std::size_t m, std::size_t n, const Vector& T, const Vector& X, const Vector& f) {
  const vector<Scalar> weights = slope_weights<Scalar>(m, m - 1, T);
  Vector x(n);
  for (std::size_t i = 0; i < n; ++i) {
    x[i] = f[i];
    for (std::size_t j = 0; j < m; ++j) x[i] = x[i] - weights[j] * X[j * n + i];
    x[i] = x[i] / weights[m];
  }
  return x;
}

}  // namespace detail

// T (m + 1): ascending times.  X ((m + 1) n): the solution at them, [j n + i]; that of T[m] is set.  e (n): by how much it differs from the
// prediction by the polynomial through the points before and the slope at the last of them.
template <class Fun, class Vector>
void OdeGear(Fun& F, std::size_t m, std::size_t n, const Vector& T, Vector& X, Vector& e) {
  using Scalar = std::remove_cvref_t<decltype(X[0])>;
  if (m == 0 || n == 0) detail::refuse("OdeGear: m or n is 0, expected at least 1");
  const vector<Scalar> weights = detail::slope_weights<Scalar>(m, m, T);
  Vector x(n), f(n), f_x(n * n), slope(n), step(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = X[(m - 1) * n + i];
  F.Ode(T[m - 1], x, f);
  const Vector start = x = detail::predicted<Scalar>(m, n, T, X, f);
  for (int iteration = 0; iteration < 10; ++iteration) {  // Newton's, of sum of weights X - f = 0
    F.Ode(T[m], x, f);
    F.Ode_dep(T[m], x, f_x);
    for (std::size_t i = 0; i < n; ++i) {
      Scalar rest = f[i] - weights[m] * x[i];
      for (std::size_t j = 0; j < m; ++j) rest = rest - weights[j] * X[j * n + i];
      slope[i] = rest;
      for (std::size_t j = 0; j < n; ++j) f_x[i * n + j] = (i == j ? weights[m] : Scalar(0)) - f_x[i * n + j];
    }
    Scalar logdet;
    if (LuSolve(n, std::size_t(1), f_x, slope, step, logdet) == 0)
      detail::refuse("OdeGear: the equations of the step are singular");
    bool moves = false;
    for (std::size_t i = 0; i < n; ++i) {
      const Scalar before = x[i];
      x[i] = x[i] + step[i];
      moves = moves || detail::size_of(Scalar(x[i] - before)) > Scalar(1e-14) * detail::size_of(x[i]);
    }
    if (!moves) break;
  }
  for (std::size_t i = 0; i < n; ++i) {
    X[m * n + i] = x[i];
    e[i] = detail::size_of(Scalar(x[i] - start[i]));
  }
}

// Integrates from ti to tf with steps between smin and smax (at the start between sini and smax) such that the error stays
// within (eabs + erel |x|) step / (tf - ti).  ef: the sum of the errors; maxabs: the largest |x|; nstep: all steps, rejected ones included.
template <class Scalar, class Vector, class Fun>
Vector OdeGearControl(Fun& F, std::size_t M, const Scalar& ti, const Scalar& tf, const Vector& xi,
                      const Scalar& smin, const Scalar& smax, Scalar& sini, const Vector& eabs,
                      const Scalar& erel, Vector& ef, Vector& maxabs, std::size_t& nstep) {
  const std::size_t n = std::size_t(xi.size());
  if (M == 0 || !(smin <= smax) || !(sini <= smax))
    detail::refuse("OdeGearControl: expected M >= 1, smin <= smax and sini <= smax");
  const auto smaller = [](const Scalar& a, const Scalar& b) { return a < b ? a : b; };
  const auto larger = [](const Scalar& a, const Scalar& b) { return a < b ? b : a; };
  Vector T(M + 1), X((M + 1) * n), e(n);
  for (std::size_t i = 0; i < n; ++i) X[i] = xi[i], ef[i] = Scalar(0), maxabs[i] = detail::size_of(xi[i]);
  T[0] = ti;
  nstep = 0;
  Scalar step = sini;
  bool starts = true;
  for (std::size_t m = 1; T[m - 1] < tf;) {
    starts = starts && step < smin;  // steps grow from sini: points of very unequal distance have no slopes
    const Scalar least = starts ? sini : smin, left = tf - T[m - 1];
    step = smaller(smax, larger(least, step));
    const bool last_step = left <= step * Scalar(1.001);
    if (last_step) step = left;
    if (!last_step && left < step * Scalar(2)) step = left / Scalar(2);  // no tiny last one
    T[m] = last_step ? tf : Scalar(T[m - 1] + step);
    OdeGear(F, m, n, T, X, e);
    ++nstep;
    Scalar ratio(4);  // of what is allowed to what there is
    for (std::size_t i = 0; i < n; ++i) {
      const Scalar bound = (eabs[i] + erel * detail::size_of(X[m * n + i])) * step / (tf - ti);
      // Differences of points that are close, as at the start, are rounding to a few digits more.
      const Scalar rounding = Scalar(starts ? 1e-12 : 1e-14) * detail::size_of(X[m * n + i]);
      if (rounding < e[i]) ratio = smaller(ratio, bound / e[i]);
    }
    const bool fits = !(ratio < Scalar(1));
    if (fits || step <= least * Scalar(1.001)) {  // as the last one may be
      for (std::size_t i = 0; i < n; ++i) {
        ef[i] = ef[i] + e[i];
        maxabs[i] = larger(maxabs[i], detail::size_of(X[m * n + i]));
      }
      if (m < M) {
        ++m;
      } else {  // forget the first
        for (std::size_t j = 0; j < M; ++j) {
          T[j] = T[j + 1];
          for (std::size_t i = 0; i < n; ++i) X[j * n + i] = X[(j + 1) * n + i];
        }
      }
    }
    using std::pow;
    step = step * smaller(Scalar(2),
                          larger(Scalar(0.2), Scalar(0.9) * pow(ratio, Scalar(1) / Scalar(double(m + 1)))));
  }
  std::size_t last = 0;
  while (last < M && T[last] < tf) ++last;
  Vector xf(n);
  for (std::size_t i = 0; i < n; ++i) xf[i] = X[last * n + i];
  return xf;
}

}  // namespace CppAD::inline dyntape_names
