// SPDX-License-Identifier: BSD-3-Clause
//
// The edge cases through every derivative route of the tape.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <ostream>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>

#include "edge_cases.h"

namespace dyntape::testing::elementary_test {

void PrintTo(const EdgeCase& c, std::ostream* out) { *out << c.name; }

namespace {

class Edge : public ::testing::TestWithParam<EdgeCase> {
 protected:
  const EdgeCase& c = GetParam();
  Function f = c.recorded();
  std::size_t n = c.x.size();

  std::vector<double> unit(std::size_t j) const {
    std::vector<double> e(n, 0.0);
    e[j] = 1;
    return e;
  }
  // Variables that are not finite are unforeseen infinities.
  bool variables_are_finite() const {
    return std::all_of(c.x.begin(), c.x.end(), [](double t) { return std::isfinite(t); });
  }
  void expect(double got, double expected, const char* route, std::size_t i, std::size_t j = 0,
              double scale = 0) {
    EXPECT_TRUE(agrees(got, expected, scale))
        << route << " [" << i << ", " << j << "]: got " << got << ", expected " << expected;
  }

  void check_gradient();
  void check_hessian();
  void check_zero_weight();
};

void Edge::check_gradient() {
  const std::vector<double> reverse = evaluate(vjp(f), c.x, {}, {1});
  const Derivatives d = derive(f, Order::kFirst);
  const std::vector<double> all = evaluate(d.function, c.x);
  std::vector<double> sparse(n, 0.0);
  for (std::size_t k = 0; k < d.jacobian.nnz(); ++k) sparse[d.jacobian.col[k]] = all[1 + k];
  for (std::size_t j = 0; j < n; ++j) {
    expect(reverse[j], c.gradient[j], "vjp", j);
    expect(sparse[j], c.gradient[j], "sparse Jacobian", j);
    if (!variables_are_finite()) continue;
    expect(evaluate(jvp(f), c.x, {}, unit(j))[0], c.gradient[j], "jvp", j);
  }
}

void Edge::check_hessian() {
  const SparseFunction h = sparse_hessian(f);
  const std::vector<double> entries = evaluate(h.function, c.x, {}, {1});
  std::vector<double> sparse(n * n, 0.0);
  for (std::size_t k = 0; k < entries.size(); ++k) {
    sparse[h.pattern.row[k] * n + h.pattern.col[k]] = sparse[h.pattern.col[k] * n + h.pattern.row[k]] =
        entries[k];
  }
  double scale = 0;
  for (double t : c.hessian) scale = std::isfinite(t) ? std::max(scale, std::abs(t)) : scale;
  const Function forward_reverse = jvp(vjp(f)), reverse_forward = vjp(jvp(f));
  for (std::size_t j = 0; j < n; ++j) {
    std::vector<double> l_dx = {1}, dx_l = unit(j);
    l_dx.insert(l_dx.end(), dx_l.begin(), dx_l.end());
    dx_l.push_back(1);
    const std::vector<double> fr = evaluate(forward_reverse, c.x, {}, l_dx),
                              rf = evaluate(reverse_forward, c.x, {}, dx_l);
    for (std::size_t i = 0; i < n; ++i) {
      expect(sparse[i * n + j], c.hessian[i * n + j], "sparse Hessian", i, j, scale);
      expect(fr[i], c.hessian[i * n + j], "jvp of vjp", i, j, scale);
      expect(rf[i], c.hessian[i * n + j], "vjp of jvp", i, j, scale);
    }
  }
}

// A weight of zero is a strong zero, whatever the value is (hard case 45), to second order.
void Edge::check_zero_weight() {
  for (double g : evaluate(vjp(f), c.x, {}, {0})) expect(g, 0, "vjp with weight zero", 0);
  for (double h : evaluate(sparse_hessian(f).function, c.x, {}, {0}))
    expect(h, 0, "Hessian of weight zero", 0);
  expect(evaluate(jvp(f), c.x, {}, std::vector<double>(n, 0.0))[0], 0, "jvp in no direction", 0);
}

// 3, 4, 5, 6, 9, 10, 11 | naive: expm1 as exp - 1, erfc as 1 - erf, derivatives of tanh that overflow, NaN where a
// slope is infinite | holds: value, slope and curvature known by hand, near zero, at poles and far out | routes:
// interpreter, forward, reverse, both orders of both
// 13, 14, 15, H21 | naive: abs, sign, steps, min and max follow another convention by each route | holds: the
// conventions of ops.def, at ties, signed zeros and NaN | routes: the same
// 17, 18, 19, 20, 21, 22, 23, 24, 25, 27, 29, 30, H16 | naive: powers by logarithms: NaN at zero and at negative
// numbers | holds: value, slope and curvature of integer, negative and broken powers at 0, -1.5, -2 and 2, and of
// general ones | routes: the same
// 32, 33, 34, H18 | naive: atan2 on axes, with signed zeros, at extremes of its range | holds: values are those of C,
// derivatives x / r^2 and -y / r^2 without overflow | routes: the same
// 37, 38, 40, 42, 43, 45 | naive: zeros, infinities and NaN are folded away or invented | holds: IEEE's rules with
// the exceptions of ops.def; what a weight of zero meets is zero | routes: the same
// 47, 48, 49, 52, H19 | naive: the branch that is not taken is NaN in a derivative | holds: exactly zero in value,
// gradient and Hessian | routes: the same
// H17 | naive: acos and asin next to 1 lose their slope, beyond 1 something is clamped | holds: to 1e-14 below,
// infinite at, NaN beyond | routes: the same
// H22 | naive: sines of 1e8 and more by a rounded 2 pi | holds: sin, cos and tan at 1e8, 1e15, 1e22 and 1e300 with
// derivatives and curvatures to 1e-14 | routes: the same
// H24, H14 | naive: softplus, logistic and tanh of large numbers are inf / inf; a norm is sqrt(x . x) | holds: finite
// with the right slope; x . x goes through no root | routes: the same
// 119 | naive: errors of sums and products are simplified to zero | holds: two-sum, fma's two-product and Kahan's sum
// | routes: the same
TEST_P(Edge, EveryRouteGivesWhatIsClaimed) {
  expect(evaluate(f, c.x)[0], c.value, "interpreter", 0);
  if (!c.gradient.empty()) check_gradient();
  if (!c.hessian.empty()) check_hessian();
  if (variables_are_finite()) check_zero_weight();
}

std::string legal(const ::testing::TestParamInfo<EdgeCase>& row) {
  std::string name = std::to_string(row.index) + "_";
  for (char ch : row.param.name) name += std::isalnum(static_cast<unsigned char>(ch)) ? ch : '_';
  return name;
}

INSTANTIATE_TEST_SUITE_P(Cases, Edge, ::testing::ValuesIn(edge_cases()), legal);

}  // namespace
}  // namespace dyntape::testing::elementary_test
