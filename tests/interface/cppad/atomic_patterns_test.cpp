// SPDX-License-Identifier: BSD-3-Clause
//
// Patterns of functions that call an atomic function whose pattern depends on which arguments are variables.
#include "programs.h"

namespace {

// y = x0 x1, with the entries of its Jacobian that are asked for.
class Product : public CppAD::atomic_four<double> {
 public:
  Product() : CppAD::atomic_four<double>("product with a pattern") {}

 private:
  bool for_type(std::size_t, const CppAD::vector<CppAD::ad_type_enum>& x,
                CppAD::vector<CppAD::ad_type_enum>& y) override {
    y[0] = std::max(x[0], x[1]);
    return true;
  }
  bool forward(std::size_t, const CppAD::vector<bool>&, std::size_t low, std::size_t up,
               const CppAD::vector<double>& x, CppAD::vector<double>& y) override {
    const std::size_t n = up + 1;
    for (std::size_t k = low; k <= up; ++k) {
      y[k] = 0;
      for (std::size_t j = 0; j <= k; ++j) y[k] += x[j] * x[n + k - j];
    }
    return true;
  }
  bool reverse(std::size_t, const CppAD::vector<bool>&, std::size_t up, const CppAD::vector<double>& x,
               const CppAD::vector<double>&, CppAD::vector<double>& px,
               const CppAD::vector<double>& py) override {
    if (up != 0) return false;
    px[0] = py[0] * x[1], px[1] = py[0] * x[0];
    return true;
  }
  bool jac_sparsity(std::size_t, bool, const CppAD::vector<bool>&, const CppAD::vector<bool>& select_x,
                    const CppAD::vector<bool>& select_y,
                    CppAD::sparse_rc<CppAD::vector<std::size_t>>& pattern) override {
    const std::size_t entries = select_y[0] ? std::size_t(select_x[0]) + select_x[1] : 0;
    pattern.resize(1, 2, entries);
    std::size_t k = 0;
    for (std::size_t j = 0; j < 2; ++j)
      if (select_y[0] && select_x[j]) pattern.set(k++, 0, j);
    return true;
  }
};

// y = (p x0) (p 2 p): the second factor is a call without variables.  dy/dx = (2 p^3, 0).
TEST(AtomicPatterns, ACallWithoutVariablesIsAFactor) {
  Product product;
  AVector p(1), x(2), v(1), w(1), y(1), of_x(2), of_p(2);
  p[0] = 2, x[0] = 3, x[1] = 4;
  CppAD::Independent(x, std::size_t(0), false, p);
  of_x[0] = p[0], of_x[1] = x[0];
  product(of_x, v);
  of_p[0] = p[0], of_p[1] = 2 * p[0];
  product(of_p, w);
  y[0] = v[0] * w[0];
  ADFun<double> f(x, y);
  EXPECT_EQ(f.Jacobian(DVector{3, 4}), (DVector{16, 0}));
  CppAD::sparse_rc<CppAD::vector<std::size_t>> all, pattern;
  all.resize(2, 2, 2), all.set(0, 0, 0), all.set(1, 1, 1);
  for (const bool dependency : {false, true}) {
    f.for_jac_sparsity(all, false, dependency, false, pattern);
    ASSERT_EQ(pattern.nnz(), 1u) << dependency;
    EXPECT_EQ(pattern.col()[0], 0u);
  }
}

}  // namespace
