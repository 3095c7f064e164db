// SPDX-License-Identifier: BSD-3-Clause
//
// Differentiates the optimal value V(x) = F(x, Y(x)), where Y(x) solves dF/dy = 0, or equations H(x, y) = 0 that
// imply dF/dy = 0.
//
//   BenderQuad(x, y, fun, g, gx, gxx);                        // fun: f(x, y), h(x, y), dy(x, y, h) = -H_y^-1 h
//   int sign = opt_val_hes(x, y, fun, jac, hes);              // fun: ell(), s(k, x, y), sy(k, x, y); F = sum of the s_k
//
// Formulas (Bell and Burke, Algorithmic Differentiation of Implicit Functions and Optimal Values, 2008): one Newton
// step Y + dy is Y(x) to first order in x.  Because F_y = 0 at that point, F(x, Y + dy) is V to second order.  The
// Hessian is F_xx - F_xy F_yy^-1 F_yx.
#pragma once

#include <dyntape/interface/cppad/ad_fun.h>
#include <dyntape/interface/cppad/utilities/lu.h>

namespace CppAD::inline dyntape_names {

// y (m) solves H(x, y) = 0 at x (n).  g (1): V; gx (n): its gradient; gxx (n n): its Hessian, row by row.
template <class BAvector, class Fun>
void BenderQuad(const BAvector& x, const BAvector& y, Fun fun, BAvector& g, BAvector& gx, BAvector& gxx) {
  using Base = detail::Entry<BAvector>;
  using ADvector = CPPAD_TESTVECTOR(AD<Base>);
  const std::size_t n = std::size_t(x.size()), m = std::size_t(y.size());
  ADvector ax(n), ay(m);
  for (std::size_t j = 0; j < n; ++j) ax[j] = x[j];
  Independent(ax);
  const ADvector step = fun.dy(x, y, fun.h(ax, y));
  for (std::size_t i = 0; i < m; ++i) ay[i] = y[i] + step[i];
  ADvector value = fun.f(ax, ay);
  ADFun<Base> f(ax, value);
  g = f.Forward(0, x);
  gx = f.Jacobian(x);
  gxx = f.Hessian(x, std::size_t(0));
}

namespace detail {

// The sum over k of f_k's Jacobian and Hessian, f_k of (x, y) being code(k, x, y).
template <class BaseVector, class ADVector, class Code>
void add_derivatives(std::size_t ell, const BaseVector& x, const BaseVector& y, Code&& code,
                     BaseVector& gradient, BaseVector* hessian) {
  using Base = Entry<BaseVector>;
  const std::size_t n = std::size_t(x.size()), m = std::size_t(y.size());
  BaseVector at(n + m);
  for (std::size_t j = 0; j < n + m; ++j) at[j] = j < n ? x[j] : y[j - n];
  for (std::size_t k = 0; k < ell; ++k) {
    ADVector both(n + m), ax(n), ay(m), value(1);
    for (std::size_t j = 0; j < n + m; ++j) both[j] = at[j];
    Independent(both);
    for (std::size_t j = 0; j < n; ++j) ax[j] = both[j];
    for (std::size_t i = 0; i < m; ++i) ay[i] = both[n + i];
    value[0] = code(k, ax, ay);
    ADFun<Base> f(both, value);
    const BaseVector slope = f.Jacobian(at);
    for (std::size_t j = 0; j < n + m; ++j) gradient[j] = gradient[j] + slope[j];
    if (!hessian) continue;
    const BaseVector second = f.Hessian(at, std::size_t(0));
    for (std::size_t j = 0; j < (n + m) * (n + m); ++j) (*hessian)[j] = (*hessian)[j] + second[j];
  }
}

}  // namespace detail

// y (m) solves F_y = 0 at x (n).  jac (n) and hes (n n): gradient and Hessian of V; of size 0: not asked for.  Returns the sign of det F_yy;
// if 0, hes is left as it is.
template <class BaseVector, class Fun>
int opt_val_hes(const BaseVector& x, const BaseVector& y, Fun fun, BaseVector& jac, BaseVector& hes) {
  using Base = detail::Entry<BaseVector>;
  const std::size_t n = std::size_t(x.size()), m = std::size_t(y.size()), N = n + m;
  const bool second = hes.size() > 0;
  BaseVector gradient(N), H(second ? N * N : 0);
  for (std::size_t j = 0; j < N; ++j) gradient[j] = Base(0);
  for (std::size_t j = 0; j < std::size_t(H.size()); ++j) H[j] = Base(0);
  detail::add_derivatives<BaseVector, typename Fun::ad_vector>(
      fun.ell(), x, y, [&](std::size_t k, const auto& ax, const auto& ay) { return fun.s(k, ax, ay); },
      gradient, second ? &H : nullptr);
  for (std::size_t j = 0; j < std::size_t(jac.size()); ++j) jac[j] = gradient[j];
  if (!second) return 0;
  BaseVector of_y(m * m), mixed(m * n), solved(m * n);
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t j = 0; j < m; ++j) of_y[i * m + j] = H[(n + i) * N + n + j];
    for (std::size_t j = 0; j < n; ++j) mixed[i * n + j] = H[(n + i) * N + j];
  }
  Base logdet;
  const int sign = LuSolve(m, n, of_y, mixed, solved, logdet);
  if (sign == 0) return 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      hes[i * n + j] = H[i * N + j];
      for (std::size_t k = 0; k < m; ++k)
        hes[i * n + j] = hes[i * n + j] - mixed[k * n + i] * solved[k * n + j];
    }
  }
  return sign;
}

}  // namespace CppAD::inline dyntape_names
