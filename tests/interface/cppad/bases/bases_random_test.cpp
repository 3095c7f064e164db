// SPDX-License-Identifier: BSD-3-Clause
// Random expressions over every kind of base, against dual numbers: complex numbers in long double, floats in 113 bits.
#include "bases.h"
#include "interface/cppad/programs.h"
#include "interface/cppad/random_expressions.h"

namespace {

using namespace expressions;

template <class Base>
struct
    Reference;  // the type in which derivatives are computed, and the largest error relative to 1 + |derivative|
template <>
struct Reference<std::complex<double>> {
  using Type = std::complex<long double>;
  static constexpr double kError = 1e-11;
};
template <>
struct Reference<std::complex<float>> {
  using Type = std::complex<long double>;
  static constexpr double kError = 1e-2;
};
template <>
struct Reference<long double> {
  using Type = Quad;
  static constexpr double kError = 1e-16;
};
template <>
struct Reference<AD<float>> {
  using Type = Quad;
  static constexpr double kError = 1e-2;
};
template <>
struct Reference<units::Number> {
  using Type = Quad;
  static constexpr double kError = 1e-11;
};
template <>
struct Reference<Triple> {
  using Type = Quad;
  static constexpr double kError = 1e-11;
};

double magnitude(const std::complex<long double>& z) { return double(std::abs(z)); }
double magnitude(const Quad& q) { return double(abs(q)); }

template <class Base>
Quad real_reference(const Base& b) {
  if constexpr (std::is_same_v<Base, units::Number>)
    return b.value;
  else if constexpr (std::is_same_v<Base, Triple>)
    return b.v[1];
  else if constexpr (CppAD::detail::kIsRecorded<Base>)
    return Quad(double(b.value()));
  else
    return Quad(b);
}
template <class Type, class Base>
Type reference_of(const Base& b) {
  if constexpr (CppAD::detail::kIsComplex<Base>)
    return Type(b.real(), b.imag());
  else
    return real_reference(b);
}

template <class Base>
Base number(Random& random) {
  const double re = random.uniform(-1, 1), im = random.uniform(-1, 1);
  if constexpr (CppAD::detail::kIsComplex<Base>)
    return Base(float(re), float(im));
  else if constexpr (std::is_same_v<Base, long double>)
    return re / 3.0L;  // no double has this value
  else if constexpr (std::is_same_v<Base, Triple>)
    return Triple(im, re, 0.5 * re);
  else
    return Base(float(re));
}

template <class Base>
class CppadBases : public ::testing::Test {
 public:
  using Type = typename Reference<Base>::Type;
  using Many = std::vector<Base>;

  static std::vector<Type> references(const Many& values) {
    std::vector<Type> r;
    for (const Base& b : values) r.push_back(reference_of<Type>(b));
    return r;
  }
  static void expect_near(const Base& got, const Type& expected, const char* what) {
    EXPECT_LE(magnitude(reference_of<Type>(got) - expected),
              Reference<Base>::kError * (1 + magnitude(expected)))
        << what;
  }
  static std::vector<std::complex<double>> points(const std::vector<Type>& x) {
    std::vector<std::complex<double>> z;
    for (const Type& t : x) {
      if constexpr (std::is_same_v<Type, Quad>)
        z.push_back(double(t));
      else
        z.push_back({double(t.real()), double(t.imag())});
    }
    return z;
  }
  static CppAD::vector<Base> made(const Many& values) { return {values.begin(), values.end()}; }
  template <class S>
  static ADFun<Base> recorded(const Expression& e, const Many& x, const S&) {
    CppAD::vector<AD<Base>> ax(x.size()), ay(1);
    for (std::size_t j = 0; j < x.size(); ++j) ax[j] = x[j];
    Independent(ax);
    ay[0] = run(e, std::vector<AD<Base>>(ax.begin(), ax.end()));
    return ADFun<Base>(ax, ay);
  }
};
using Bases =
    ::testing::Types<std::complex<double>, std::complex<float>, long double, AD<float>, units::Number, Triple>;
TYPED_TEST_SUITE(CppadBases, Bases);

TYPED_TEST(CppadBases, DerivativesOfRandomExpressions) {
  using Base = TypeParam;
  using Test = CppadBases<Base>;
  using Type = typename Test::Type;
  constexpr std::size_t n = 3;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.seed_text());
    std::vector<Base> at(n), x(n), dx(n);
    for (std::size_t j = 0; j < n; ++j) {
      x[j] = number<Base>(random), dx[j] = number<Base>(random);
      at[j] = x[j] + Base(0.0078125);  // recorded elsewhere
    }
    const std::vector<Type> rx = Test::references(x), rdx = Test::references(dx);
    const Expression e = random_expression(random, Test::points(rx), 4 + random.below(14));
    ADFun<Base> f = Test::recorded(e, at, Base());

    const auto vx = Test::made(x), w = CppAD::vector<Base>{Base(1)};
    Test::expect_near(f.Forward(0, vx)[0], run(e, rx), "value");
    Test::expect_near(f.Forward(1, Test::made(dx))[0], slope(e, rx, rdx), "order 1");
    const auto second = f.Reverse(2, w);
    const CppAD::vector<Base> zero(n, Base(0));
    Test::expect_near(f.Forward(2, zero)[0] * Base(2), curvature(e, rx, rdx, rdx), "order 2");
    Test::expect_near(f.Forward(3, zero)[0] * Base(6), third(e, rx, rdx), "order 3");
    const auto J = f.Jacobian(vx), H = f.Hessian(vx, 0);
    for (std::size_t j = 0; j < n; ++j) {
      std::vector<Type> unit(n, Type(0.0));
      unit[j] = Type(1.0);
      Test::expect_near(J[j], slope(e, rx, unit), "Jacobian");
      Test::expect_near(second[2 * j], slope(e, rx, unit), "reverse");
      Test::expect_near(second[2 * j + 1], curvature(e, rx, rdx, unit), "second order in reverse");
      for (std::size_t k = 0; k < n; ++k) {
        std::vector<Type> other(n, Type(0.0));
        other[k] = Type(1.0);
        Test::expect_near(H[j * n + k], curvature(e, rx, unit, other), "Hessian");
      }
    }
    if (::testing::Test::HasFailure()) return;
  }
}

// The gradient recorded in reverse, on two levels, and its Jacobian.
TYPED_TEST(CppadBases, LevelsOfRandomExpressions) {
  using Base = TypeParam;
  using Test = CppadBases<Base>;
  using Type = typename Test::Type;
  constexpr std::size_t n = 2;
  for (std::uint64_t seed = 100; seed < 120; ++seed) {
    Random random(seed);
    SCOPED_TRACE(random.seed_text());
    std::vector<Base> x(n);
    for (Base& value : x) value = number<Base>(random);
    const std::vector<Type> rx = Test::references(x);
    const Expression e = random_expression(random, Test::points(rx), 4 + random.below(8));
    auto af = Test::recorded(e, x, Base()).base2ad();
    CppAD::vector<AD<Base>> ax(n), aw(1);
    for (std::size_t j = 0; j < n; ++j) ax[j] = x[j];
    aw[0] = Base(1);
    Independent(ax);
    af.Forward(0, ax);
    const auto gradient = af.Reverse(1, aw);
    ADFun<Base> g(ax, gradient);
    const auto H = g.Jacobian(Test::made(x));
    for (std::size_t j = 0; j < n; ++j) {
      for (std::size_t k = 0; k < n; ++k) {
        std::vector<Type> first(n, Type(0.0)), other(n, Type(0.0));
        first[j] = Type(1.0), other[k] = Type(1.0);
        Test::expect_near(H[j * n + k], curvature(e, rx, first, other), "Hessian");
      }
    }
    if (::testing::Test::HasFailure()) return;
  }
}

}  // namespace
