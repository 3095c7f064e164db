// SPDX-License-Identifier: BSD-3-Clause
//
// Jets: values of the scalar, tangents of the table, the same bits for any number of directions.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <complex>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <dyntape/autodiff/scalars/jet_eigen.h>
#include "autodiff/quad.h"

namespace dyntape::jet_test {
namespace {

using testing::Quad;

constexpr double kEps = std::numeric_limits<double>::epsilon();

bool same_bits(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

TEST(Jet, DualOfTheExerciseIsZero) {
  // d/dx (sin^2 x + cos x) = sin 2x - sin x, zero at pi/3
  const auto x = Jet<double, 1>::variable(std::acos(-1.0) / 3, 0);
  const auto y = sin(x) * sin(x) + cos(x);
  EXPECT_NEAR(y.value(), 1.25, 2 * kEps);
  EXPECT_NEAR(y.tangent(0), 0, 2 * kEps);
}

// Directions by the dozen in groups of N; entry k is the tangent of direction k.
template <int N, class F>
std::vector<double> columns(F f, const std::vector<double>& x) {
  using J = Jet<double, N>;
  std::vector<double> d;
  const int n = static_cast<int>(x.size());
  for (int first = 0; first < n; first += N) {
    Eigen::Matrix<J, Eigen::Dynamic, 1> at(n);
    for (int i = 0; i < n; ++i) {
      at[i] = i >= first && i < first + N ? J::variable(x[i], i - first) : J(x[i]);
    }
    const J y = f(at);
    for (int k = 0; k < N && first + k < n; ++k) d.push_back(y.tangent(k));
  }
  return d;
}

TEST(Jet, OneFourAndEightDirectionsHaveTheSameBits) {
  const auto f = [](const auto& x) {
    using T = std::decay_t<decltype(x[0])>;
    T y = T(0);
    for (int i = 0; i < x.size(); ++i) {
      const T& next = x[(i + 1) % x.size()];
      y += sin(x[i]) * exp(next * T(0.3)) / (T(2) + x[i] * x[i]) + atan2(x[i], next + T(3));
      y -= select(x[i] < next, sqrt(x[i] * x[i] + T(1)), tanh(next));
    }
    return T(y * x.dot(x));
  };
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<double> x(11);
    for (double& entry : x) entry = uniform(random);
    const auto one = columns<1>(f, x), four = columns<4>(f, x), eight = columns<8>(f, x);
    ASSERT_EQ(one.size(), 11u);
    for (std::size_t k = 0; k < one.size(); ++k) {
      ASSERT_TRUE(same_bits(one[k], four[k])) << k;
      ASSERT_TRUE(same_bits(one[k], eight[k])) << k;
    }
  }
}

// The function of a row, found by its name.
template <class J>
J call(Op op, const J* x) {
  switch (op) {
#define OP(name, fn, n, ...) \
  case Op::name:             \
    return DYNTAPE_CALL_##n(fn);
#define DYNTAPE_CALL_1(fn) fn(x[0])
#define DYNTAPE_CALL_2(fn) fn(x[0], x[1])
#define DYNTAPE_CALL_3(fn) fn(x[0], x[1], x[2])
#include <dyntape/autodiff/graph/ops.def>
#undef DYNTAPE_CALL_1
#undef DYNTAPE_CALL_2
#undef DYNTAPE_CALL_3
    default:
      return x[0];
  }
}

// Of the row `op`, differentiated along i.
Quad slope_along(Op op, const Quad* x, int i) {
  Jet<Quad, 1> in[3];
  for (int k = 0; k < 3; ++k) in[k] = k == i ? Jet<Quad, 1>::variable(x[k], 0) : Jet<Quad, 1>(x[k]);
  return call(op, in).tangent(0);
}

// Central differences with Richardson extrapolation of g at x along j.
template <class G>
Quad difference_along(G g, const Quad* x, int j) {
  const auto central = [&](const Quad& h) {
    Quad up[3] = {x[0], x[1], x[2]}, down[3] = {x[0], x[1], x[2]};
    up[j] += h;
    down[j] -= h;
    return Quad((g(up) - g(down)) / (2 * h));
  };
  return (4 * central(Quad(0.5e-6)) - central(Quad(1e-6))) / 3;
}

TEST(Jet, FirstAndSecondDerivativesOfEveryRowAgreeWithDifferencesIn113Bits) {
  using Dual = Jet<double, 1>;
  using Twice = Jet<Dual, 1>;
  std::mt19937_64 random(2);
  for (int row = 0; row < kTableOps; ++row) {
    const Op op = static_cast<Op>(row);
    SCOPED_TRACE(std::string(info(op).name));
    std::uniform_real_distribution<double> uniform(info(op).lo, info(op).hi);
    for (int trial = 0; trial < 20; ++trial) {
      const double x[3] = {uniform(random), uniform(random), uniform(random)};
      const Quad exact[3] = {x[0], x[1], x[2]};
      const auto value = [&](const Quad* at) { return evaluate<Quad>(op, at[0], at[1], at[2]); };
      for (int i = 0; i < info(op).arity; ++i) {
        for (int j = 0; j < info(op).arity; ++j) {
          Twice in[3];
          for (int k = 0; k < 3; ++k) {
            in[k] = k == i ? Dual::variable(x[k], 0) : Dual(x[k]);
            if (k == j) in[k].tangent(0) = 1.0;
          }
          const Twice y = call(op, in);
          const double first = static_cast<double>(difference_along(value, exact, j));
          const double second = static_cast<double>(
              difference_along([&](const Quad* at) { return slope_along(op, at, i); }, exact, j));
          EXPECT_TRUE(same_bits(y.value().value(), evaluate<double>(op, x[0], x[1], x[2])));
          EXPECT_NEAR(y.tangent(0).value(), first, 1e-14 * (1 + std::abs(first)));
          EXPECT_NEAR(y.tangent(0).tangent(0), second, 1e-13 * (1 + std::abs(second)));
        }
      }
    }
  }
}

// f' = Im f(x + ih) / h without a difference: as exact as the functions themselves.
TEST(Jet, AgreesWithTheComplexStep) {
  const double h = 1e-100;
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> uniform(-2, 2);
  for (int trial = 0; trial < 200; ++trial) {
    const double x = uniform(random);
    const std::complex<double> z(x, h);
    const auto j = Jet<double, 1>::variable(x, 0);
    EXPECT_NEAR(std::sin(z).imag() / h, std::cos(x), 4 * kEps * std::abs(std::cos(x)));
    EXPECT_NEAR(std::exp(z).imag() / h, std::exp(x), 4 * kEps * std::exp(x));
    EXPECT_NEAR(sin(j).tangent(0), std::cos(x), 4 * kEps * std::abs(std::cos(x)));
    EXPECT_NEAR(exp(j).tangent(0), std::exp(x), 4 * kEps * std::exp(x));
  }
}

}  // namespace
}  // namespace dyntape::jet_test
