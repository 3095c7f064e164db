// SPDX-License-Identifier: BSD-3-Clause
// Taylor coefficients of orders 0 to 10, forward and in reverse, against series that are known.
#include "programs.h"

namespace {

constexpr std::size_t kOrder = 10;

double factorial(std::size_t k) { return k < 2 ? 1 : double(k) * factorial(k - 1); }
double sign_of(std::size_t k) { return k % 2 ? -1 : 1; }
double binomial(double a, std::size_t k) {
  return k == 0 ? 1 : binomial(a, k - 1) * (a - double(k) + 1) / double(k);
}

struct Known {
  const char* name;
  ADouble (*code)(const ADouble& t);  // of t around t = 0
  double (*coefficient)(std::size_t k);
};

const double kTangents[] = {0, 1, 0, 1.0 / 3, 0, 2.0 / 15, 0, 17.0 / 315, 0, 62.0 / 2835, 0};
const double kRootPi = std::sqrt(std::acos(-1.0));

const Known kKnown[] = {
    {"exp", [](const ADouble& t) { return exp(t); }, [](std::size_t k) { return 1 / factorial(k); }},
    {"expm1", [](const ADouble& t) { return expm1(t); },
     [](std::size_t k) { return k ? 1 / factorial(k) : 0; }},
    {"exp2", [](const ADouble& t) { return exp2(t); },
     [](std::size_t k) { return std::pow(std::log(2.0), double(k)) / factorial(k); }},
    {"sin", [](const ADouble& t) { return sin(t); },
     [](std::size_t k) { return k % 2 ? sign_of(k / 2) / factorial(k) : 0; }},
    {"cos", [](const ADouble& t) { return cos(t); },
     [](std::size_t k) { return k % 2 ? 0 : sign_of(k / 2) / factorial(k); }},
    {"sinh", [](const ADouble& t) { return sinh(t); },
     [](std::size_t k) { return k % 2 ? 1 / factorial(k) : 0; }},
    {"cosh", [](const ADouble& t) { return cosh(t); },
     [](std::size_t k) { return k % 2 ? 0 : 1 / factorial(k); }},
    {"tan", [](const ADouble& t) { return tan(t); }, [](std::size_t k) { return kTangents[k]; }},
    {"tanh", [](const ADouble& t) { return tanh(t); },
     [](std::size_t k) { return k % 2 ? sign_of(k / 2) * kTangents[k] : 0; }},
    {"quotient", [](const ADouble& t) { return 1 / (1 - t); }, [](std::size_t) { return 1.0; }},
    {"log", [](const ADouble& t) { return log(1 + t); },
     [](std::size_t k) { return k ? -sign_of(k) / double(k) : 0; }},
    {"log1p", [](const ADouble& t) { return log1p(t); },
     [](std::size_t k) { return k ? -sign_of(k) / double(k) : 0; }},
    {"log10", [](const ADouble& t) { return log10(1 + t); },
     [](std::size_t k) { return k ? -sign_of(k) / double(k) / std::log(10.0) : 0; }},
    {"sqrt", [](const ADouble& t) { return sqrt(1 + t); }, [](std::size_t k) { return binomial(0.5, k); }},
    {"cbrt", [](const ADouble& t) { return cbrt(1 + t); },
     [](std::size_t k) { return binomial(1.0 / 3, k); }},
    {"pow", [](const ADouble& t) { return pow(1 + t, 2.5); }, [](std::size_t k) { return binomial(2.5, k); }},
    {"pow_of_exponent", [](const ADouble& t) { return pow(2.0, t); },
     [](std::size_t k) { return std::pow(std::log(2.0), double(k)) / factorial(k); }},
    {"pow_of_both", [](const ADouble& t) { return pow(exp(t), 1 + 0 * t + t / 1e300); },
     [](std::size_t k) { return 1 / factorial(k); }},
    {"large_power_at_zero", [](const ADouble& t) { return pow(t, 20.0) + pow(t, 3.0); },
     [](std::size_t k) { return k == 3 ? 1.0 : 0.0; }},
    {"atan", [](const ADouble& t) { return atan(t); },
     [](std::size_t k) { return k % 2 ? sign_of(k / 2) / double(k) : 0; }},
    {"atanh", [](const ADouble& t) { return atanh(t); },
     [](std::size_t k) { return k % 2 ? 1 / double(k) : 0; }},
    {"asin", [](const ADouble& t) { return asin(t); },
     [](std::size_t k) { return k % 2 ? sign_of(k / 2) * binomial(-0.5, k / 2) / double(k) : 0; }},
    {"acos", [](const ADouble& t) { return acos(t); },
     [](std::size_t k) {
       return k == 0 ? std::acos(0.0) : k % 2 ? -sign_of(k / 2) * binomial(-0.5, k / 2) / double(k) : 0;
     }},
    {"asinh", [](const ADouble& t) { return asinh(t); },
     [](std::size_t k) { return k % 2 ? binomial(-0.5, k / 2) / double(k) : 0; }},
    {"acosh", [](const ADouble& t) { return acosh(cosh(1 + t)); },
     [](std::size_t k) { return k < 2 ? 1.0 : 0.0; }},
    {"erf", [](const ADouble& t) { return erf(t); },
     [](std::size_t k) { return k % 2 ? 2 / kRootPi * sign_of(k / 2) / factorial(k / 2) / double(k) : 0; }},
    {"erfc", [](const ADouble& t) { return 1 - erfc(t); },
     [](std::size_t k) { return k % 2 ? 2 / kRootPi * sign_of(k / 2) / factorial(k / 2) / double(k) : 0; }},
    {"atan2", [](const ADouble& t) { return atan2(sin(t), cos(t)); },
     [](std::size_t k) { return k == 1 ? 1.0 : 0.0; }},
    {"hypot", [](const ADouble& t) { return hypot(3 * exp(t), 4 * exp(t)); },
     [](std::size_t k) { return 5 / factorial(k); }},
    {"abs", [](const ADouble& t) { return abs(t - 1); },
     [](std::size_t k) { return k == 0   ? 1.0
                                : k == 1 ? -1.0
                                         : 0.0; }},
    {"product", [](const ADouble& t) { return exp(t) * exp(t); },
     [](std::size_t k) { return std::pow(2.0, double(k)) / factorial(k); }},
    {"fma", [](const ADouble& t) { return fma(t, t, exp(t)); },
     [](std::size_t k) { return 1 / factorial(k) + (k == 2); }},
    {"fmod", [](const ADouble& t) { return fmod(5.5 + 2 * t, 2.0 + 0 * t); },
     [](std::size_t k) { return k == 0   ? 1.5
                                : k == 1 ? 2.0
                                         : 0.0; }},
    {"select", [](const ADouble& t) { return CondExpLt(t, ADouble(1), exp(t), log(t)); },
     [](std::size_t k) { return 1 / factorial(k); }},
    {"min_max", [](const ADouble& t) { return min(sin(t), ADouble(1)) + max(exp(t), ADouble(0)) - sin(t); },
     [](std::size_t k) { return 1 / factorial(k); }},
    {"azmul", [](const ADouble& t) { return azmul(1 + t, exp(t)); },
     [](std::size_t k) { return 1 / factorial(k) + (k ? 1 / factorial(k - 1) : 0); }},
};

class KnownSeries : public ::testing::TestWithParam<Known> {};

TEST_P(KnownSeries, ForwardOrderByOrder) {
  ADFun<double> f =
      recorded({0}, [](const AVector& x) -> std::vector<ADouble> { return {GetParam().code(x[0])}; });
  for (std::size_t q = 0; q <= kOrder; ++q) {
    const DVector xq{q == 1 ? 1.0 : 0.0}, y = f.Forward(q, xq);
    EXPECT_NEAR(y[0], GetParam().coefficient(q), 1e-13) << "order " << q;
    EXPECT_EQ(f.size_order(), q + 1);
  }
}

TEST_P(KnownSeries, ForwardAllOrdersAtOnce) {
  ADFun<double> f =
      recorded({0}, [](const AVector& x) -> std::vector<ADouble> { return {GetParam().code(x[0])}; });
  DVector x(kOrder + 1);
  x[1] = 1;
  const DVector y = f.Forward(kOrder, x);
  for (std::size_t q = 0; q <= kOrder; ++q)
    EXPECT_NEAR(y[q], GetParam().coefficient(q), 1e-13) << "order " << q;
}

// dw[q - k - 1] is dW/dx^(k) of W = y^(q - 1), as documented: coefficient q - 1 - k of the slope series, (q - k) y^(q - k) along t.
TEST_P(KnownSeries, ReverseOfEveryOrder) {
  ADFun<double> f =
      recorded({0}, [](const AVector& x) -> std::vector<ADouble> { return {GetParam().code(x[0])}; });
  DVector x(kOrder + 1);
  x[1] = 1;
  f.Forward(kOrder, x);
  for (std::size_t q = 1; q <= kOrder; ++q) {
    const DVector dw = f.Reverse(q, DVector{1});
    ASSERT_EQ(dw.size(), q);
    for (std::size_t k = 0; k < q; ++k) {
      const double n = double(q - k);
      EXPECT_NEAR(dw[q - k - 1], n * GetParam().coefficient(q - k), 1e-12) << "order " << q << ", of " << k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Functions, KnownSeries, ::testing::ValuesIn(kKnown),
                         [](const auto& info) { return info.param.name; });

// azmul is absolute coefficient by coefficient: of 1 / t at 0 no coefficient is a number, and a zero outweighs them all.
TEST(CppadSeries, AbsoluteProductsOfPoles) {
  ADFun<double> f =
      recorded({1, 1}, [](const AVector& x) -> std::vector<ADouble> { return {azmul(x[0], 1 / x[1])}; });
  expect_near(f.Forward(0, DVector{0, 0}), {0});
  expect_near(f.Forward(1, DVector{0, 1}), {0});
  expect_near(f.Forward(2, DVector{0, 0}), {0});
  f.Forward(0, DVector{0, 0});
  EXPECT_EQ(f.Forward(1, DVector{1, 0})[0], kInf) << "x0 has moved";
}

TEST(CppadSeries, SeveralDirectionsAtOnce) {
  ADFun<double> f = recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> {
    return {x[0] * x[1] * x[1], sin(x[0])};
  });
  const DVector x{1, 2};
  f.Forward(0, x);
  const DVector x1{1, 0, 1, 0, 1, 1}, x2{0, 0, 0, 0, 0, 0};  // r = 3: e0, e1, e0 + e1
  expect_near(f.Forward(1, 3, x1), {4, 4, 8, std::cos(1.0), 0, std::cos(1.0)});
  expect_near(f.Forward(2, 3, x2), {0, 1, 5, -std::sin(1.0) / 2, 0, -std::sin(1.0) / 2});
  EXPECT_EQ(f.size_direction(), 3u);
  EXPECT_EQ(f.size_order(), 3u);
}

// Weights of all orders: W = sum of w[i q + k] y_i^(k).
TEST(CppadSeries, ReverseWithWeightsOfEveryOrder) {
  ADFun<double> f =
      recorded({2}, [](const AVector& x) -> std::vector<ADouble> { return {x[0] * x[0] * x[0]}; });
  f.Forward(0, DVector{2}), f.Forward(1, DVector{5});
  // y0 = x^3, y1 = 3 x^2 x1: W = 7 y0 + 11 y1
  expect_near(f.Reverse(2, DVector{7, 11}), {7 * 12 + 11 * 6 * 2 * 5, 11 * 12});
  expect_near(f.Reverse(2, DVector{11}), {11 * 12, 11 * 6 * 2 * 5});  // W = 11 y1: by x1 first
}

std::vector<ADouble> mixed_code(const AVector& x) {
  return {sin(x[0] * x[1]) + exp(x[2]), x[0] * x[0] * x[2] / x[1], sqrt(x[1] + x[2] * x[2])};
}

// w . y^(order) of the coefficients x[3 k + j], all orders up to it.
double weighted_coefficient(ADFun<double>& f, const DVector& x, std::size_t order, const DVector& w) {
  double sum = 0;
  for (std::size_t k = 0; k <= order; ++k) {
    const DVector xk{x[3 * k], x[3 * k + 1], x[3 * k + 2]}, yk = f.Forward(k, xk);
    if (k < order) continue;
    for (std::size_t i = 0; i < w.size(); ++i) sum += w[i] * yk[i];
  }
  return sum;
}

// dw[j q + q - k - 1] is the derivative by x_j^(k) of w . y^(q - 1): central differences of Forward.
TEST(CppadSeries, ReverseIsTheDerivativeByEveryCoefficient) {
  ADFun<double> f = recorded({1, 2, 0.5}, mixed_code);
  const DVector x{0.7, 1.3, 0.4, 1, -0.5, 0.25, 0.5, 0.75, -1, 0.2, -0.3, 0.6}, w{0.5, -2, 1.5};
  for (std::size_t q = 1; q <= 4; ++q) {
    weighted_coefficient(f, x, 3, w);  // orders beyond q - 1 are there, and do not matter
    const DVector dw = f.Reverse(q, w);
    ASSERT_EQ(dw.size(), 3 * q);
    for (std::size_t j = 0; j < 3; ++j) {
      for (std::size_t k = 0; k < q; ++k) {
        const double h = 1e-5;
        DVector up = x, down = x;
        up[3 * k + j] += h, down[3 * k + j] -= h;
        const double slope =
            (weighted_coefficient(f, up, q - 1, w) - weighted_coefficient(f, down, q - 1, w)) / (2 * h);
        EXPECT_NEAR(dw[j * q + q - k - 1], slope, 1e-8) << "q " << q << ", j " << j << ", k " << k;
      }
    }
  }
}

// After Forward(1, dx), Reverse(2, w) is the gradient at 2 j and the Hessian of w . y times dx at 2 j + 1.
TEST(CppadSeries, HessianTimesDirection) {
  ADFun<double> f = recorded({1, 1}, [](const AVector& x) -> std::vector<ADouble> {
    return {x[0] * x[0] * x[1], x[1] * x[1]};
  });
  f.Forward(0, DVector{3, 5}), f.Forward(1, DVector{7, 11});
  // w . y = 2 x0^2 x1 + 13 x1^2: gradient (4 x0 x1, 2 x0^2 + 26 x1), Hessian ((4 x1, 4 x0), (4 x0, 26))
  expect_near(f.Reverse(2, DVector{2, 13}), {60, 20 * 7 + 12 * 11, 18 + 130, 12 * 7 + 26 * 11});
}

TEST(CppadSeries, CapacityForgetsHigherOrders) {
  ADFun<double> f = recorded({2}, [](const AVector& x) -> std::vector<ADouble> { return {exp(x[0])}; });
  f.Forward(0, DVector{0}), f.Forward(1, DVector{1}), f.Forward(2, DVector{0});
  EXPECT_EQ(f.size_order(), 3u);
  f.capacity_order(2);
  EXPECT_EQ(f.size_order(), 2u);
  EXPECT_EQ(f.capacity_order(), 2u);
  expect_near(f.Forward(2, DVector{0}), {0.5});
}

TEST(CppadSeries, OrderZeroAgainForgetsTheOthers) {
  ADFun<double> f = recorded({2}, [](const AVector& x) -> std::vector<ADouble> { return {x[0] * x[0]}; });
  f.Forward(0, DVector{3}), f.Forward(1, DVector{1});
  f.Forward(0, DVector{4});
  EXPECT_EQ(f.size_order(), 1u);
  expect_near(f.Forward(1, DVector{1}), {8});
}

}  // namespace
