// SPDX-License-Identifier: BSD-3-Clause
//
// Solves differential equations x' = f(t, x), for numbers or recorded values.
//
//   struct { void Ode(const Float& t, const Vector& x, Vector& f) { ... } } F;
//   Vector xf = Runge45(F, M, ti, tf, xi, e);                 // M steps of order five; e bounds the error
//   Vector xf = Rosen34(F, M, ti, tf, xi, e);                 // for stiff ones: F has Ode_ind and Ode_dep too
//   Vector xf = OdeErrControl(method, ti, tf, xi, smin, smax, scur, eabs, erel, ef, maxabs, nstep);
#pragma once

#include <string>

#include <dyntape/interface/cppad/utilities/lu.h>
#include <dyntape/interface/cppad/vector.h>

namespace CppAD::inline dyntape_names {

namespace detail {

template <class S>
S size_of(const S& x) {
  return plain_value(x) < 0 ? S(-x) : x;
}

inline void check_steps(const char* what, std::size_t M) {
  if (M == 0) refuse(std::string(what) + ": M is 0 steps, expected at least one");
}

}  // namespace detail

// The pair of Cash and Karp, orders four and five.
template <class Fun, class Float, class Vector>
Vector Runge45(Fun& F, std::size_t M, const Float& ti, const Float& tf, const Vector& xi, Vector& e) {
  using S = std::remove_cvref_t<decltype(xi[0])>;
  static constexpr double kTimes[] = {0, 0.2, 0.3, 0.6, 1, 0.875};
  static constexpr double kInner[6][5] = {
      {0, 0, 0, 0, 0},
      {1. / 5, 0, 0, 0, 0},
      {3. / 40, 9. / 40, 0, 0, 0},
      {3. / 10, -9. / 10, 6. / 5, 0, 0},
      {-11. / 54, 5. / 2, -70. / 27, 35. / 27, 0},
      {1631. / 55296, 175. / 512, 575. / 13824, 44275. / 110592, 253. / 4096}};
  static constexpr double kFifth[] = {37. / 378, 0, 250. / 621, 125. / 594, 0, 512. / 1771};
  static constexpr double kFourth[] = {2825. / 27648, 0, 18575. / 48384, 13525. / 55296, 277. / 14336, 0.25};
  detail::check_steps("Runge45", M);
  const std::size_t n = xi.size();
  const Float step = (tf - ti) / Float(double(M));
  Vector x = xi, at(n);
  for (std::size_t i = 0; i < n; ++i) e[i] = S(0);
  for (std::size_t m = 0; m < M; ++m) {
    const Float t = ti + step * Float(double(m));
    vector<Vector> k(6);
    for (std::size_t s = 0; s < 6; ++s) {
      for (std::size_t i = 0; i < n; ++i) {
        at[i] = x[i];
        for (std::size_t j = 0; j < s; ++j) at[i] = at[i] + S(step) * S(kInner[s][j]) * k[j][i];
      }
      k[s] = Vector(n);
      F.Ode(Float(t + step * Float(kTimes[s])), at, k[s]);
    }
    for (std::size_t i = 0; i < n; ++i) {
      S apart(0);
      for (std::size_t s = 0; s < 6; ++s) {
        x[i] = x[i] + S(step) * S(kFifth[s]) * k[s][i];
        apart = apart + S(step) * S(kFifth[s] - kFourth[s]) * k[s][i];
      }
      e[i] = e[i] + detail::size_of(apart);
    }
  }
  return x;
}

template <class Fun, class Float, class Vector>
Vector Runge45(Fun& F, std::size_t M, const Float& ti, const Float& tf, const Vector& xi) {
  Vector e(xi.size());
  return Runge45(F, M, ti, tf, xi, e);
}

// Rosenbrock's method in the form of Shampine: four stages of one factorisation, orders three and four.
template <class Fun, class Float, class Vector>
Vector Rosen34(Fun& F, std::size_t M, const Float& ti, const Float& tf, const Vector& xi, Vector& e) {
  using S = std::remove_cvref_t<decltype(xi[0])>;
  static constexpr double kInner[4][3] = {
      {0, 0, 0}, {2, 0, 0}, {48. / 25, 6. / 25, 0}, {48. / 25, 6. / 25, 0}};
  static constexpr double kMixed[4][3] = {
      {0, 0, 0}, {-8, 0, 0}, {372. / 25, 12. / 5, 0}, {-112. / 125, -54. / 125, -2. / 5}};
  static constexpr double kTimes[] = {0, 1, 0.6, 0.6}, kSlopes[] = {0.5, -1.5, 121. / 50, 29. / 250};
  static constexpr double kFourth[] = {19. / 9, 0.5, 25. / 108, 125. / 108},
                          kApart[] = {17. / 54, 7. / 36, 0, 125. / 108};
  detail::check_steps("Rosen34", M);
  const std::size_t n = xi.size();
  const Float step = (tf - ti) / Float(double(M));
  const S h(step);
  Vector x = xi;
  for (std::size_t i = 0; i < n; ++i) e[i] = S(0);
  for (std::size_t m = 0; m < M; ++m) {
    const Float t = ti + step * Float(double(m));
    Vector f_t(n), f_x(n * n), LU(n * n);
    F.Ode_ind(t, x, f_t);
    F.Ode_dep(t, x, f_x);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) LU[i * n + j] = S(i == j ? 2. : 0.) / h - f_x[i * n + j];
    }
    vector<std::size_t> ip(n), jp(n);
    if (LuFactor(ip, jp, LU) == 0) detail::refuse("Rosen34: the matrix of a step is singular");
    vector<Vector> k(4);
    for (std::size_t s = 0; s < 4; ++s) {
      Vector at(n), right(n);
      for (std::size_t i = 0; i < n; ++i) {
        at[i] = x[i];
        for (std::size_t j = 0; j < s; ++j) at[i] = at[i] + S(kInner[s][j]) * k[j][i];
      }
      F.Ode(Float(t + step * Float(kTimes[s])), at, right);
      for (std::size_t i = 0; i < n; ++i) {
        right[i] = right[i] + h * S(kSlopes[s]) * f_t[i];
        for (std::size_t j = 0; j < s; ++j) right[i] = right[i] + S(kMixed[s][j]) / h * k[j][i];
      }
      LuInvert(ip, jp, LU, right);
      k[s] = right;
    }
    for (std::size_t i = 0; i < n; ++i) {
      S apart(0);
      for (std::size_t s = 0; s < 4; ++s) {
        x[i] = x[i] + S(kFourth[s]) * k[s][i];
        apart = apart + S(kApart[s]) * k[s][i];
      }
      e[i] = e[i] + detail::size_of(apart);
    }
  }
  return x;
}

template <class Fun, class Float, class Vector>
Vector Rosen34(Fun& F, std::size_t M, const Float& ti, const Float& tf, const Vector& xi) {
  Vector e(xi.size());
  return Rosen34(F, M, ti, tf, xi, e);
}

// Integrates from ti to tf with steps between smin and smax; method.step(ta, tb, xa, xb, eb), method.order().  A step is accepted if
// it is the smallest, or if its error is at most (eabs + erel |x(tb)|) (tb - ta) / (tf - ti).  The last two steps may be as small as
// smin / 2.  If the smallest step gives NaN, xf and ef are NaN.
template <class Float, class Vector, class Method>
Vector OdeErrControl(Method& method, const Float& ti, const Float& tf, const Vector& xi, const Float& smin,
                     const Float& smax, Float& scur, const Vector& eabs, const Float& erel, Vector& ef,
                     Vector& maxabs, std::size_t& nstep) {
  const std::size_t n = xi.size();
  const auto smaller = [](const Float& a, const Float& b) { return a < b ? a : b; };
  const auto larger = [](const Float& a, const Float& b) { return a < b ? b : a; };
  Vector x = xi, xb(n), eb(n);
  for (std::size_t i = 0; i < n; ++i) ef[i] = Float(0), maxabs[i] = detail::size_of(x[i]);
  nstep = 0;
  // The error grows with step^order, the bound with step.
  const Float power = Float(1) / Float(double(method.order() > 1 ? method.order() - 1 : 1));
  Float t = ti, step = larger(smin, smaller(smax, scur));
  while (t < tf) {
    const Float left = tf - t;
    const bool last = left <= step * Float(1.001), one_before = !last && left < step * Float(2);
    const Float tried = last         ? left
                        : one_before ? Float(left / Float(2))
                                     : step,
                tb = last ? tf : Float(t + tried);
    const bool smallest = tried <= smin * Float(1.001);  // as the last one may be
    method.step(t, tb, x, xb, eb);
    ++nstep;
    Float ratio(4);  // of the allowed to the estimated error
    bool finite = true;
    for (std::size_t i = 0; i < n; ++i) {
      finite = finite && !isnan(xb[i]) && !isnan(eb[i]);
      const Float bound = (eabs[i] + erel * detail::size_of(xb[i])) * tried / (tf - ti);
      if (finite && Float(0) < eb[i]) ratio = smaller(ratio, bound / eb[i]);
    }
    if (!finite && smallest) {
      for (std::size_t i = 0; i < n; ++i) xb[i] = ef[i] = nan(Float(0));
      return xb;
    }
    using std::pow;
    Float next =
        tried * (finite ? smaller(Float(2), larger(Float(0.1), Float(0.9) * pow(ratio, power))) : Float(0.5));
    if (finite && (smallest || !(ratio < Float(1)))) {
      for (std::size_t i = 0; i < n; ++i) {
        ef[i] = ef[i] + eb[i];
        maxabs[i] = larger(maxabs[i], detail::size_of(xb[i]));
        x[i] = xb[i];
      }
      t = tb;
      if (last || one_before) next = larger(next, step);  // shortened, and not for its error
      scur = larger(smin, smaller(smax, next));
    }
    step = larger(smin, smaller(smax, next));
  }
  return x;
}

template <class Float, class Vector, class Method>
Vector OdeErrControl(Method& method, const Float& ti, const Float& tf, const Vector& xi, const Float& smin,
                     const Float& smax, Float& scur, const Vector& eabs, const Float& erel, Vector& ef) {
  Vector maxabs(xi.size());
  std::size_t nstep;
  return OdeErrControl(method, ti, tf, xi, smin, smax, scur, eabs, erel, ef, maxabs, nstep);
}
template <class Float, class Vector, class Method>
Vector OdeErrControl(Method& method, const Float& ti, const Float& tf, const Vector& xi, const Float& smin,
                     const Float& smax, Float& scur, const Vector& eabs, const Float& erel, Vector& ef,
                     Vector& maxabs) {
  std::size_t nstep;
  return OdeErrControl(method, ti, tf, xi, smin, smax, scur, eabs, erel, ef, maxabs, nstep);
}

}  // namespace CppAD::inline dyntape_names
