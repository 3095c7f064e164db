// SPDX-License-Identifier: BSD-3-Clause
// Atomic functions of five functions of the user (CPPAD_USER_ATOMIC), against closed forms.
#include <set>

#include <dyntape/interface/cppad/nodes/user_atomic.h>
#include "programs.h"

namespace dyntape::user_atomic_test {
namespace {

using Size = std::size_t;

// y = scale (x0 x1, x0) with scale = id + 1, over any class of vectors.
template <template <class...> class Vector>
struct Products {
  using Numbers = Vector<double>;
  using Bools = Vector<bool>;
  using Sets = Vector<std::set<Size>>;
  static bool forward(Size id, Size k, Size n, Size m, const Bools& vx, Bools& vy, const Numbers& tx,
                      Numbers& ty) {
    EXPECT_EQ(n, 2u);
    EXPECT_EQ(m, 2u);
    EXPECT_TRUE(vx.size() == 0 || k == 0);
    if (vx.size() > 0) vy[0] = vx[0] || vx[1], vy[1] = vx[0];
    const auto scale = static_cast<double>(id + 1);
    double sum = 0;
    for (Size l = 0; l <= k; ++l) sum += tx[l] * tx[(k + 1) + k - l];
    ty[k] = scale * sum;
    ty[(k + 1) + k] = scale * tx[k];
    // The orders below are there.
    for (Size l = 0; l < k; ++l) EXPECT_EQ(ty[(k + 1) + l], scale * tx[l]);
    return true;
  }
  static bool reverse(Size id, Size k, Size, Size, const Numbers& tx, const Numbers&, Numbers& px,
                      const Numbers& py) {
    const auto scale = static_cast<double>(id + 1);
    for (Size i = 0; i < px.size(); ++i) px[i] = 0;
    for (Size d = 0; d <= k; ++d) {
      for (Size l = 0; l <= d; ++l) {
        px[l] += scale * py[d] * tx[(k + 1) + d - l];
        px[(k + 1) + l] += scale * py[d] * tx[d - l];
      }
      px[d] += scale * py[(k + 1) + d];
    }
    return true;
  }
  static void unite(std::set<Size>& to, const std::set<Size>& with) { to.insert(with.begin(), with.end()); }
  static bool for_jac_sparse(Size, Size, Size, Size, const Sets& r, Sets& s) {
    s[0] = s[1] = r[0];
    unite(s[0], r[1]);
    return true;
  }
  static bool rev_jac_sparse(Size, Size, Size, Size, Sets& r, const Sets& s) {
    r[0] = r[1] = s[0];
    unite(r[0], s[1]);
    return true;
  }
  static bool rev_hes_sparse(Size, Size, Size, Size, const Sets& r, const Bools& s, Bools& t, const Sets& u,
                             Sets& v) {
    t[0] = s[0] || s[1], t[1] = s[0];
    v[0] = v[1] = u[0];
    unite(v[0], u[1]);
    if (s[0]) unite(v[0], r[1]), unite(v[1], r[0]);
    return true;
  }
};

using OfCppAD = Products<CppAD::vector>;
using OfStd = Products<std::vector>;
CPPAD_USER_ATOMIC(products, CppAD::vector, double, OfCppAD::forward, OfCppAD::reverse,
                  OfCppAD::for_jac_sparse, OfCppAD::rev_jac_sparse, OfCppAD::rev_hes_sparse)
CPPAD_USER_ATOMIC(std_products, std::vector, double, OfStd::forward, OfStd::reverse, OfStd::for_jac_sparse,
                  OfStd::rev_jac_sparse, OfStd::rev_hes_sparse)

// f = (x1 2 sin(x0) x1, 3 x1 + 2 sin(x0)): calls with two ids.
template <template <class...> class Vector, class Call>
ADFun<double> recorded_calls(const Call& call) {
  Vector<ADouble> ax(2), au(2), av(2), aw(2), ay(2);
  ax[0] = 0.5, ax[1] = 2;
  Independent(ax);
  au[0] = sin(ax[0]), au[1] = ax[1];
  call(1, au, av);
  au[0] = ax[1], au[1] = 0;
  call(2, au, aw);
  ay[0] = ax[1] * av[0], ay[1] = aw[1] + av[1];
  ADFun<double> f;
  f.Dependent(ax, ay);
  return f;
}

void check(ADFun<double> f) {
  const DVector x{0.5, 2};
  const double s = std::sin(0.5), c = std::cos(0.5);
  expect_near(f.Forward(0, x), {8 * s, 6 + 2 * s});
  expect_near(f.Forward(1, DVector{1, 0}), {8 * c, 2 * c});
  expect_near(f.Forward(2, DVector{0, 0}), {-4 * s, -s});
  expect_near(f.Forward(3, DVector{0, 0}), {-8 * c / 6, -2 * c / 6});
  f.Forward(0, x);
  expect_near(f.Reverse(1, DVector{1, 10}), {8 * c + 20 * c, 8 * s + 30});
  expect_near(f.Jacobian(x), {8 * c, 8 * s, 2 * c, 3});
  expect_near(f.Hessian(x, DVector{1, 10}), {-28 * s, 8 * c, 8 * c, 4 * s});

  CppAD::sparse_rc<std::vector<Size>> identity(2, 2, 2), pattern;
  identity.set(0, 0, 0), identity.set(1, 1, 1);
  f.for_jac_sparsity(identity, false, false, false, pattern);
  EXPECT_EQ(pattern.nnz(), 4u);
  f.for_hes_sparsity(std::vector<bool>{true, true}, std::vector<bool>{false, true}, false, pattern);
  ASSERT_EQ(pattern.nnz(), 1u);
  EXPECT_EQ(pattern.row()[0] + pattern.col()[0], 0u);
}

TEST(CppadUserAtomic, OverEachClassOfVectors) {
  check(recorded_calls<CppAD::vector>(products));
  check(recorded_calls<std::vector>(std_products));
}

TEST(CppadUserAtomic, OfNumbersIsANumber) {
  CppAD::vector<ADouble> ax(2), ay(2);
  ax[0] = 3, ax[1] = 5;
  products(0, ax, ay);
  EXPECT_EQ(Value(ay[0]), 15);
  EXPECT_TRUE(Constant(ay[1]));
}

}  // namespace
}  // namespace dyntape::user_atomic_test
