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

namespace dyntape::testing {

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
  // Variables that are not finite are infinities that nobody foresees.
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
}  // namespace dyntape::testing
