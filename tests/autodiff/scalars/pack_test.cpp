// SPDX-License-Identifier: BSD-3-Clause
//
// Packs: every lane has the bits of one lane alone, whatever the others hold.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <dyntape/autodiff/scalars/pack_eigen.h>

namespace dyntape::pack_test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

// Distance in units of the last digit of b.
double ulps(double a, double b) {
  if (same_bits(a, b) || a == b) return 0;
  return std::abs(a - b) / (std::nextafter(std::abs(b), kInf) - std::abs(b));
}

// f on packs against f on one lane, and against the C library's long double.
template <int N>
struct Lanes {
  template <class F, class G>
  static void compare(const char* name, F f, G reference, double lo, double hi) {
    std::mt19937_64 random(N);
    std::uniform_real_distribution<double> uniform(lo, hi);
    for (int trial = 0; trial < 500; ++trial) {
      double x[N], y[N];
      for (int i = 0; i < N; ++i) x[i] = uniform(random), y[i] = uniform(random);
      if (N > 1 && trial % 5 == 0) x[trial % N] = trial % 2 ? kNan : -kInf;
      const auto r = f(Pack<double, N>::load(x), Pack<double, N>::load(y));
      for (int i = 0; i < N; ++i) {
        const double alone = f(Pack<double, 1>(x[i]), Pack<double, 1>(y[i]))[0];
        ASSERT_TRUE(same_bits(r[i], alone)) << name << "(" << x[i] << ", " << y[i] << ") lane " << i << ": "
                                            << r[i] << " and alone " << alone;
        if (std::isfinite(x[i])) {
          ASSERT_LE(ulps(r[i], static_cast<double>(reference(x[i], y[i]))), 2) << name << " at " << x[i];
        }
      }
    }
  }
};

template <int N>
void every_function() {
#define OP(...)
#define FN(op, fn, n, value, dx, dy, dz, c, laws, lo, hi) DYNTAPE_TEST_##n(fn, lo, hi)
#define DYNTAPE_TEST_1(fn, lo, hi)                                                                        \
  Lanes<N>::compare(                                                                                      \
      #fn, [](auto x, auto) { return fn(x); }, [](long double x, long double) { return std::fn(x); }, lo, \
      hi);
#define DYNTAPE_TEST_2(fn, lo, hi)                  \
  Lanes<N>::compare(                                \
      #fn, [](auto x, auto y) { return fn(x, y); }, \
      [](long double x, long double y) { return std::fn(x, y); }, lo, hi);
#define DYNTAPE_TEST_3(fn, lo, hi)                     \
  Lanes<N>::compare(                                   \
      #fn, [](auto x, auto y) { return fn(x, y, x); }, \
      [](long double x, long double y) { return std::fn(x, y, x); }, lo, hi);
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_TEST_1
#undef DYNTAPE_TEST_2
#undef DYNTAPE_TEST_3
}

TEST(Pack, EveryFunctionOfTheTableHasTheBitsOfOneLane) {
  every_function<1>();
  every_function<2>();
  every_function<4>();
  every_function<8>();
}

TEST(Pack, LargeAndSpecialArgumentsHaveTheBitsOfOneLane) {
  const double special[] = {0.0,  -0.0,  1e-310, -1e-310, 1e-20, 1e5, -1e9, 1e15,  1e300,
                            kInf, -kInf, kNan,   1.0,     -1.0,  0.5, 2.0,  709.0, -745.0};
  const int n = static_cast<int>(std::size(special));
  for (int k = 0; k < n; ++k) {
    Pack<double, 8> x;
    for (int i = 0; i < 8; ++i) x.set(i, special[(k + i) % n]);
    const Pack<double, 8> s = sin(x), c = cos(x), e = exp(x), a = atan2(x, c), h = tanh(x), r = sqrt(x);
    Pack<double, 8> both_s, both_c;
    sincos(x, both_s, both_c);
    for (int i = 0; i < 8; ++i) {
      const Pack<double, 1> one(x[i]);
      Pack<double, 1> one_s, one_c;
      sincos(one, one_s, one_c);
      EXPECT_TRUE(same_bits(s[i], sin(one)[0])) << x[i];
      EXPECT_TRUE(same_bits(c[i], cos(one)[0])) << x[i];
      EXPECT_TRUE(same_bits(e[i], exp(one)[0])) << x[i];
      EXPECT_TRUE(same_bits(a[i], atan2(one, cos(one))[0])) << x[i];
      EXPECT_TRUE(same_bits(h[i], tanh(one)[0])) << x[i];
      EXPECT_TRUE(same_bits(r[i], std::sqrt(x[i]))) << x[i];
      EXPECT_TRUE(same_bits(both_s[i], one_s[0])) << x[i];
      EXPECT_TRUE(same_bits(both_c[i], one_c[0])) << x[i];
    }
  }
}

TEST(Pack, ArithmeticIsThatOfDoubles) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-2, 2);
  double x[8], y[8];
  for (int i = 0; i < 8; ++i) x[i] = uniform(random), y[i] = uniform(random);
  const auto a = Pack<double, 8>::load(x), b = Pack<double, 8>::load(y);
  const auto sum = a * b + a, quotient = a / b - 2.0 * b, negative = -a;
  auto in_place = a;
  in_place += b, in_place *= a, in_place -= 1.0, in_place /= b;
  for (int i = 0; i < 8; ++i) {
    const double product = x[i] * y[i];
    EXPECT_TRUE(same_bits(sum[i], product + x[i]));  // two roundings
    EXPECT_TRUE(same_bits(quotient[i], x[i] / y[i] - 2.0 * y[i]));
    EXPECT_TRUE(same_bits(negative[i], -x[i]));
    EXPECT_TRUE(same_bits(in_place[i], ((x[i] + y[i]) * x[i] - 1.0) / y[i]));
    EXPECT_TRUE(same_bits(abs(a)[i], std::abs(x[i])));
    EXPECT_TRUE(same_bits(copysign(a, b)[i], std::copysign(x[i], y[i])));
    EXPECT_TRUE(same_bits(min(a, b)[i], std::min(x[i], y[i])));
    EXPECT_TRUE(same_bits(max(a, b)[i], std::max(x[i], y[i])));
    EXPECT_TRUE(same_bits(sign(a)[i], x[i] > 0 ? 1.0 : -1.0));
  }
  EXPECT_EQ(azmul(Pack<double, 2>(0.0), Pack<double, 2>(kInf))[1], 0.0);
}

template <class A, class B>
concept BranchesOn = requires(A a, B b) {
  a < b ? 1 : 2;
};

TEST(Pack, ComparisonsAreMasksAndSelectNeverMixes) {
  static_assert(BranchesOn<double, double>);
  static_assert(!BranchesOn<Pack<double, 4>, Pack<double, 4>>, "lanes may disagree");
  static_assert(!BranchesOn<Pack<double, 4>, double>);
  Pack<double, 4> x;
  for (int i = 0; i < 4; ++i) x.set(i, i - 1.5);
  x.set(2, kNan);
  const auto positive = x > 0.0;
  EXPECT_FALSE(positive[0]);
  EXPECT_FALSE(positive[2]);
  EXPECT_TRUE(positive[3]);
  EXPECT_TRUE(any(positive));
  EXPECT_FALSE(all(positive));
  EXPECT_TRUE(all(positive || !positive));
  EXPECT_FALSE(any(positive && false));
  EXPECT_TRUE((x != x)[2]);
  const auto root = select(positive, sqrt(x), Pack<double, 4>(7));
  EXPECT_EQ(root[0], 7);
  EXPECT_EQ(root[2], 7);
  EXPECT_EQ(root[3], std::sqrt(1.5));
}

TEST(Pack, MatricesOfPacksAreAlignedAndSumLikeOneLane) {
  using P = Pack<double, 8>;
  using M = Eigen::Matrix<P, Eigen::Dynamic, Eigen::Dynamic>;
  using M1 = Eigen::Matrix<Pack<double, 1>, Eigen::Dynamic, Eigen::Dynamic>;
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> uniform(-2, 2);
  M a(37, 41), b(41, 29);
  for (M* m : {&a, &b}) {
    for (Eigen::Index k = 0; k < m->size(); ++k) {
      for (int i = 0; i < 8; ++i) m->data()[k].set(i, uniform(random));
    }
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(m->data()) % alignof(P), 0u);
  }
  const M product = a * b, vector = a * b.col(3), shrunk = a.topRows(5) * b.leftCols(2);
  M1 a1(37, 41), b1(41, 29);
  for (int lane : {0, 7}) {
    for (Eigen::Index k = 0; k < a.size(); ++k) a1.data()[k] = a.data()[k][lane];
    for (Eigen::Index k = 0; k < b.size(); ++k) b1.data()[k] = b.data()[k][lane];
    const M1 product1 = a1 * b1, vector1 = a1 * b1.col(3);
    for (Eigen::Index i = 0; i < product.rows(); ++i) {
      EXPECT_TRUE(same_bits(vector(i, 0)[lane], vector1(i, 0)[0]));
      for (Eigen::Index j = 0; j < product.cols(); ++j) {
        ASSERT_TRUE(same_bits(product(i, j)[lane], product1(i, j)[0])) << i << " " << j;
        double sum = 0;
        for (Eigen::Index k = 0; k < a.cols(); ++k) sum += a(i, k)[lane] * b(k, j)[lane];
        ASSERT_NEAR(product(i, j)[lane], sum, 1e-12);
      }
    }
  }
  M grown = a;
  grown.conservativeResize(50, 60);
  EXPECT_EQ(grown(36, 40)[5], a(36, 40)[5]);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(grown.data()) % alignof(P), 0u);
  std::vector<Eigen::Matrix<P, 3, 1>> many(3);
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(many.data()) % alignof(P), 0u);
}

}  // namespace
}  // namespace dyntape::pack_test
