// SPDX-License-Identifier: BSD-3-Clause
//
// dyntape's own sin and cos, printed and compiled into the library, against 113 bits: small, ordinary, huge and special
// arguments, next to multiples of pi / 2, and the arguments that are nearest to one of them.
#include <dyntape/autodiff/own_sines.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <gtest/gtest.h>

#include <bit>
#include <boost/math/constants/constants.hpp>
#include <cmath>
#include <limits>

#include "embedded_text.h"
#include "random_function.h"

namespace dyntape::own_trig_test {
namespace {

using Quad = dynamics::Float128;
using std::abs, std::cos, std::ldexp, std::sin;  // of `long double`
using testing::EmbeddedLibrary;
using testing::Random;

Function sin_cos() {
  return record("circle", 1, [](const VectorXad& x) {
    VectorXad y(2);
    y << sin(x[0]), cos(x[0]);
    return y;
  });
}

template <class Real>
class OwnTrig : public ::testing::Test {
 protected:
  OwnTrig() : library_(text()) {}

  static codegen::EmbeddedSource text() {
    codegen::EmbeddedOptions how;
    how.single = sizeof(Real) == sizeof(float);
    CodegenOptions options;
    options.order = Order::kValue;
    return generate_embedded(sin_cos(), options, how);
  }

  std::array<Real, 2> values(Real x) const {
    std::array<Real, 2> y;
    library_.template call<void>("circle_value", static_cast<const Real*>(&x), y.data());
    return y;
  }

  // Distance in units of the last place of the true value.
  static double ulps(Real found, Quad truth) {
    int exponent = 0;
    std::frexp(static_cast<Real>(truth), &exponent);
    const int smallest = std::numeric_limits<Real>::min_exponent - std::numeric_limits<Real>::digits;
    const Quad ulp = ldexp(Quad(1), std::max(exponent - std::numeric_limits<Real>::digits, smallest));
    return static_cast<double>(abs(Quad(found) - truth) / ulp);
  }

  void check(Real x) {
    const auto y = values(x);
    Real sine, cosine;
    own::sincos(x, sine, cosine);
    EXPECT_TRUE(y[0] == sine && y[1] == cosine && sine == own::sin(x) && cosine == own::cos(x)) << "at " << x;
    worst_ = std::max({worst_, ulps(y[0], sin(Quad(x))), ulps(y[1], cos(Quad(x)))});
    EXPECT_LT(worst_, sizeof(Real) == sizeof(float) ? 0.82 : 0.79) << "at " << x;
    ASSERT_FALSE(std::isnan(worst_));
  }

  EmbeddedLibrary library_;
  double worst_ = 0;
};

using Reals = ::testing::Types<double, float>;
TYPED_TEST_SUITE(OwnTrig, Reals);

TYPED_TEST(OwnTrig, IsWithinAnUlpOfTheTruth) {
  using Bits = std::conditional_t<sizeof(TypeParam) == 4, std::uint32_t, std::uint64_t>;
  Random random(61);
  SCOPED_TRACE(random.seed_text());
  for (int i = 0; i < 60000; ++i) {
    for (const double range : {0.8, 10.0, 1e6})
      this->check(static_cast<TypeParam>(random.uniform(-range, range)));
    const auto any = std::bit_cast<TypeParam>(static_cast<Bits>(random.bits()));
    if (std::isfinite(any)) this->check(any);
    if (this->HasFailure()) return;
  }
  std::printf("worst: %.3f ulp\n", this->worst_);
}

TYPED_TEST(OwnTrig, NextToMultiplesOfAQuarterTurn) {
  const Quad quarter = boost::math::constants::half_pi<Quad>();
  Random random(62);
  SCOPED_TRACE(random.seed_text());
  for (int i = 0; i < 12000 && !this->HasFailure(); ++i) {
    const double n =
        i < 4000 ? i : std::floor(std::exp2(random.uniform(0, sizeof(TypeParam) == 4 ? 60.0 : 110.0)));
    const auto x = static_cast<TypeParam>(quarter * n);
    for (const TypeParam near : {x, std::nextafter(x, TypeParam(0)), std::nextafter(x, TypeParam(1e30)), -x})
      this->check(near);
  }
}

TYPED_TEST(OwnTrig, OfTheLargestTheSmallestAndTheNearestToAMultiple) {
  using Limits = std::numeric_limits<TypeParam>;
  const TypeParam nearest = sizeof(TypeParam) == 8
                                ? static_cast<TypeParam>(std::ldexp(6381956970095103.0, 797))
                                : static_cast<TypeParam>(16367173.0 * 0x1p72);
  for (const TypeParam size :
       {Limits::max(), nearest, TypeParam(1e22), TypeParam(1e6), TypeParam(1e3),
        TypeParam(0.78539816339744831), TypeParam(1e-8), Limits::min(), Limits::denorm_min()}) {
    for (const TypeParam x : {size, -size, std::nextafter(size, TypeParam(0))}) this->check(x);
  }
}

TYPED_TEST(OwnTrig, OfWhatIsNotANumberAndOfZeros) {
  using Limits = std::numeric_limits<TypeParam>;
  for (const TypeParam x : {Limits::infinity(), -Limits::infinity(), Limits::quiet_NaN()}) {
    EXPECT_TRUE(std::isnan(this->values(x)[0])) << x;
    EXPECT_TRUE(std::isnan(this->values(x)[1])) << x;
  }
  for (const TypeParam zero : {TypeParam(0.0), TypeParam(-0.0)}) {
    EXPECT_EQ(std::signbit(this->values(zero)[0]), std::signbit(zero));
    EXPECT_EQ(this->values(zero)[0], 0);
    EXPECT_EQ(this->values(zero)[1], 1);
  }
}

// Compiled text asks libm for both at once.
#ifdef __GLIBC__
TEST(SineAndCosine, OneCallHasTheBitsOfTwo) {
  Random random(63);
  SCOPED_TRACE(random.seed_text());
  double (*volatile sine)(double) = ::sin;  // so that the compiler does not make one call of the two
  double (*volatile cosine)(double) = ::cos;
  const auto check = [&](double x) {
    double s, c;
    ::sincos(x, &s, &c);
    return testing::same(s, sine(x)) && testing::same(c, cosine(x));
  };
  int other = 0;
  for (double x : testing::kSpecials) other += !check(x);
  for (int i = 0; i < 4000000; ++i) {
    other += !check(random.uniform(-4, 4));
    other += !check(std::bit_cast<double>(random.bits()));
  }
  EXPECT_EQ(other, 0);
}
#endif

TEST(SineAndCosine, ArePrintedAsOneCall) {
  CodegenOptions options;
  options.order = Order::kSecond;
  options.use_cache = false;
  const std::string text = generate_source(sin_cos(), options).text;
  EXPECT_NE(text.find("  dt_sincos(x0, &t"), std::string::npos);
  EXPECT_EQ(text.find("= sin(x0)"), std::string::npos);
  EXPECT_EQ(text.find("sincos(double, double*, double*)"), std::string::npos);
  options.functions = Functions::kLibm;
  EXPECT_NE(generate_source(sin_cos(), options).text.find("  dt_sincos(x0, &t"), std::string::npos);
}

}  // namespace
}  // namespace dyntape::own_trig_test
