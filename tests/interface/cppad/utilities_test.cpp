// SPDX-License-Identifier: BSD-3-Clause
// Vectors, equations, integrals, polynomials and the like, of numbers and of recorded values.
#include <complex>
#include <sstream>

#include "programs.h"

namespace {

using Sizes = CPPAD_TESTVECTOR(std::size_t);

TEST(CppadVector, GrowsKeepsAndPrints) {
  CppAD::vector<double> v(2);
  v[0] = 1, v[1] = 2;
  v.push_back(3);
  v.push_vector(CppAD::vector<double>{4, 5});
  EXPECT_EQ(v.size(), 5u);
  v.resize(3);
  EXPECT_EQ(v[2], 3);
  EXPECT_GE(v.capacity(), 5u);
  std::ostringstream out;
  out << v;
  EXPECT_EQ(out.str(), "{ 1, 2, 3 }");
  CppAD::vector<double> w;
  w.swap(v);
  EXPECT_TRUE(v.empty());
  w.clear();
  EXPECT_EQ(w.capacity(), 0u);
}

TEST(CppadVector, BoolsHaveAddresses) {
  CppAD::vectorBool v(3);
  bool& first = v[0];
  first = true;
  EXPECT_TRUE(v[0]);
  EXPECT_FALSE(v[1]);
}

TEST(CppadUtilities, NearEqual) {
  EXPECT_TRUE(NearEqual(1.0, 1.0 + 1e-12, 1e-10, 0.0));
  EXPECT_FALSE(NearEqual(1.0, 1.1, 1e-10, 1e-10));
  EXPECT_TRUE(NearEqual(0.0, 1e-12, 0.0, 1e-10));
  EXPECT_FALSE(NearEqual(kNan, kNan, 1.0, 1.0));
  EXPECT_FALSE(NearEqual(kInf, kInf, 1.0, 1.0));
  EXPECT_TRUE(NearEqual(ADouble(1), 1.0, 1e-10, 1e-10));
  EXPECT_TRUE(NearEqual(AD<ADouble>(1), ADouble(1), ADouble(1e-10), 1e-10));
  EXPECT_TRUE(NearEqual(std::complex<double>(1, 2), std::complex<double>(1, 2), 1e-10, 1e-10));
}

TEST(CppadUtilities, Poly) {
  const DVector a{1, 2, 3, 4};
  EXPECT_EQ(CppAD::Poly(0, a, 2.0), 1 + 4 + 12 + 32);
  EXPECT_EQ(CppAD::Poly(1, a, 2.0), 2 + 12 + 48);
  EXPECT_EQ(CppAD::Poly(2, a, 2.0), 6 + 48);
  EXPECT_EQ(CppAD::Poly(4, a, 2.0), 0);
  ADFun<double> f =
      recorded({2}, [&](const AVector& x) -> std::vector<ADouble> { return {CppAD::Poly(0, a, x[0])}; });
  expect_near(f.Jacobian(DVector{3}), {CppAD::Poly(1, a, 3.0)});
}

TEST(CppadLu, SolvesWithDeterminant) {
  DVector A{0, 2, 1, 1, 1, 0, 3, 0, 1}, B{3, 2, 4}, X(3);
  double logdet;
  const int sign = CppAD::LuSolve(3, 1, A, B, X, logdet);
  expect_near(X, {1, 1, 1});
  EXPECT_NEAR(sign * std::exp(logdet), -5, 1e-12);
}

TEST(CppadLu, SingularAndSteps) {
  DVector A{1, 2, 2, 4}, B{1, 1}, X(2);
  double logdet;
  EXPECT_EQ(CppAD::LuSolve(2, 1, A, B, X, logdet), 0);
  Sizes ip(2), jp(2);
  DVector LU{4, 3, 6, 3}, right{7, 9};
  double ratio;
  EXPECT_NE(CppAD::LuRatio(ip, jp, LU, ratio), 0);
  CppAD::LuInvert(ip, jp, LU, right);
  expect_near(right, {1, 1});
}

// (1 + i, 2; i, 3 - i) has the determinant 4.
TEST(CppadLu, OfComplexNumbers) {
  using Complex = std::complex<double>;
  const Complex i(0, 1);
  CppAD::vector<Complex> A{1.0 + i, 2, i, 3.0 - i}, B{3.0 + i, 3}, X(2);
  Complex logdet;
  const int sign = CppAD::LuSolve(2, 1, A, B, X, logdet);
  EXPECT_LT(std::abs(double(sign) * exp(logdet) - (4.0 + 0.0 * i)), 1e-14);
  for (std::size_t row = 0; row < 2; ++row)
    EXPECT_LT(std::abs(A[2 * row] * X[0] + A[2 * row + 1] * X[1] - B[row]), 1e-14);
  A[0] = 2, A[1] = 2.0 * i, A[2] = i, A[3] = -1;
  EXPECT_EQ(CppAD::LuSolve(2, 1, A, B, X, logdet), 0);
  EXPECT_TRUE(CppAD::AbsGeq(i, Complex(-1)) && !CppAD::AbsGeq(i, 1.0 + i) &&
              CppAD::AbsGeq(ADouble(-3), ADouble(2)));
  EXPECT_TRUE(CppAD::LeqZero(-2.0) && CppAD::LeqZero(Complex(0)) && !CppAD::LeqZero(Complex(-1)));
}

TEST(CppadLu, OfRecordedValues) {
  ADFun<double> f = recorded({4, 1, 2, 3}, [](const AVector& x) -> std::vector<ADouble> {
    AVector B{1, 0, 0, 1}, X(4);
    ADouble logdet;
    CppAD::LuSolve(2, 2, x, B, X, logdet);
    return {X[0], X[1], X[2], X[3], logdet};
  });
  expect_near(f.Forward(0, DVector{4, 1, 2, 3}), {0.3, -0.1, -0.2, 0.4, std::log(10.0)});
  const DVector J = f.Jacobian(DVector{4, 1, 2, 3});
  EXPECT_NEAR(J[16], 0.3, 1e-12);  // d log det A / dA is the inverse's transpose
  EXPECT_NEAR(J[17], -0.2, 1e-12);
}

// 1 where pivots are chosen; at other values the largest element left over the recorded pivot, and infinite where that is zero.
TEST(CppadLu, RatioSaysWhetherPivotsAreStillTheBest) {
  ADFun<double> f = recorded({1, 2, 3, 8}, [](const AVector& x) -> std::vector<ADouble> {
    Sizes ip(2), jp(2);
    AVector LU = x;
    ADouble ratio;
    EXPECT_NE(CppAD::LuRatio(ip, jp, LU, ratio), 0);
    return {ratio};
  });
  expect_near(f.Forward(0, DVector{1, 2, 3, 8}), {1});
  expect_near(f.Forward(0, DVector{1, 2, 3, 4}), {1});  // 4 is the largest
  expect_near(f.Forward(0, DVector{10, 2, 3, 4}), {2.5});
  expect_near(f.Forward(0, DVector{1, 2, 3, 0.5}), {6});
  expect_near(f.Forward(0, DVector{1, 2, 3, 0}), {kInf});
}

// n trapezoid sums of halved steps, extrapolated p times: of x^2 over (0, 1) the sums are 1/2, 3/8, 11/32.
TEST(CppadRomberg, ErrorIsTheChangeByTheLastStep) {
  auto square = [](const double& x) { return x * x; };
  double e;
  EXPECT_DOUBLE_EQ(CppAD::RombergOne(square, 0.0, 1.0, 1, 0, e), 0.5);
  EXPECT_DOUBLE_EQ(e, 0.5);
  EXPECT_DOUBLE_EQ(CppAD::RombergOne(square, 0.0, 1.0, 3, 0, e), 11.0 / 32);
  EXPECT_DOUBLE_EQ(e, 1.0 / 32);
  EXPECT_DOUBLE_EQ(CppAD::RombergOne(square, 0.0, 1.0, 2, 1, e), 1.0 / 3);
  EXPECT_DOUBLE_EQ(e, 1.0 / 6);                                             // by 1/2 before
  EXPECT_DOUBLE_EQ(CppAD::RombergOne(square, 0.0, 1.0, 2, 2, e), 1.0 / 3);  // p may be n
  EXPECT_NEAR(CppAD::RombergOne(square, 0.0, 1.0, 4, 1, e), 1.0 / 3, 1e-15);
  EXPECT_NEAR(e, 0, 1e-15);
}

TEST(CppadRomberg, OneVariable) {
  auto integrand = [](const double& x) { return std::exp(x); };
  double e;
  const double integral = CppAD::RombergOne(integrand, 0.0, 1.0, 5, 4, e);
  EXPECT_NEAR(integral, std::exp(1.0) - 1, 1e-10);
  EXPECT_LE(std::abs(integral - std::exp(1.0) + 1), e + 1e-14);
}

TEST(CppadRomberg, SeveralVariables) {
  auto integrand = [](const DVector& x) { return x[0] * x[0] * x[1]; };
  CppAD::RombergMul<decltype(integrand), Sizes, DVector, 2> integrate;
  double e;
  EXPECT_NEAR(integrate(integrand, DVector{0, 0}, DVector{1, 2}, Sizes{4, 4}, Sizes{3, 3}, e), 2.0 / 3,
              1e-12);
}

TEST(CppadRomberg, OfRecordedValues) {
  ADFun<double> f = recorded({2}, [](const AVector& x) -> std::vector<ADouble> {
    auto integrand = [&](const ADouble& t) { return exp(x[0] * t); };
    ADouble e;
    return {CppAD::RombergOne(integrand, ADouble(0), ADouble(1), 6, 4, e)};
  });
  EXPECT_NEAR(f.Jacobian(DVector{2})[0], (std::exp(2.0) * (2 - 1) + 1) / 4, 1e-8);
}

// x_i = t^(i + 1)
struct Powers {
  template <class Float, class Vector>
  void Ode(const Float& t, const Vector& x, Vector& f) {
    f[0] = Float(1);
    for (std::size_t i = 1; i < x.size(); ++i) f[i] = Float(double(i + 1)) * x[i - 1];
    (void)t;
  }
};

TEST(CppadOde, Runge45IsExactToOrderFour) {
  Powers F;
  DVector x(4), e(4);
  x = CppAD::Runge45(F, 5, 0.0, 2.0, x, e);
  expect_near(x, {2, 4, 8, 16}, 1e-12);
}

TEST(CppadOde, Runge45OfRecordedValues) {
  ADFun<double> f = recorded({0.5}, [](const AVector& p) -> std::vector<ADouble> {
    struct {
      ADouble rate;
      void Ode(const ADouble&, const AVector& x, AVector& slope) { slope[0] = -rate * x[0]; }
    } F{p[0]};
    AVector xi(1), e(1);
    xi[0] = 1;
    return {CppAD::Runge45(F, 50, ADouble(0), ADouble(2), xi, e)[0]};
  });
  EXPECT_NEAR(f.Forward(0, DVector{0.5})[0], std::exp(-1.0), 1e-9);
  EXPECT_NEAR(f.Jacobian(DVector{0.5})[0], -2 * std::exp(-1.0), 1e-8);
}

struct Stiff {  // x0' = -a0 x0, x1' = a0 x0 - a1 x1
  double a0 = 1000, a1 = 1;
  void Ode(const double&, const DVector& x, DVector& f) { f[0] = -a0 * x[0], f[1] = a0 * x[0] - a1 * x[1]; }
  void Ode_ind(const double&, const DVector&, DVector& f) { f[0] = f[1] = 0; }
  void Ode_dep(const double&, const DVector&, DVector& f) { f[0] = -a0, f[1] = 0, f[2] = a0, f[3] = -a1; }
};

TEST(CppadOde, Rosen34OfStiffEquations) {
  Stiff F;
  DVector x{1, 0}, e(2);
  x = CppAD::Rosen34(F, 100, 0.0, 1.0, x, e);
  EXPECT_NEAR(x[1], 1000.0 / 999 * (std::exp(-1.0) - std::exp(-1000.0)), 1e-4);
}

TEST(CppadOde, ErrorControlKeepsItsBound) {
  struct {
    void Ode(const double&, const DVector& x, DVector& f) { f[0] = -x[0]; }
  } F;
  struct Method {
    decltype(F)& of;
    void step(double ta, double tb, DVector& xa, DVector& xb, DVector& eb) {
      xb = CppAD::Runge45(of, 1, ta, tb, xa, eb);
    }
    std::size_t order() const { return 4; }
  } method{F};
  DVector xi{1}, eabs{1e-9}, ef(1), maxabs(1);
  double scur = 0.5;
  std::size_t nstep;
  const DVector x =
      CppAD::OdeErrControl(method, 0.0, 1.0, xi, 1e-6, 1.0, scur, eabs, 1e-9, ef, maxabs, nstep);
  EXPECT_NEAR(x[0], std::exp(-1.0), 2e-9);
  EXPECT_GT(nstep, 2u);
  EXPECT_LE(ef[0], 2e-9);
  EXPECT_EQ(maxabs[0], 1);
}

// x0' = -10 x0, x1' = 10 x0 - x1: x0 falls by 4 decades, and the error has to follow the value at the end of each step, not its maximum.
struct DecayChain {
  double rate = 10;
  void Ode(const double&, const DVector& x, DVector& f) const {
    f[0] = -rate * x[0];
    f[1] = rate * x[0] - x[1];
  }
  void step(double ta, double tb, DVector& xa, DVector& xb, DVector& eb) const {
    xb = CppAD::Runge45(*this, 1, ta, tb, xa, eb);
  }
  std::size_t order() const { return 4; }
};

TEST(CppadOde, RelativeErrorIsThatOfTheValueAtTheEndOfAStep) {
  const DecayChain chain;
  const DVector xi{1, 0}, eabs{0, 0};
  DVector ef(2), maxabs(2);
  double scur = 0.5;
  const DVector x = CppAD::OdeErrControl(chain, 0.0, 1.0, xi, 1e-3, 1.0, scur, eabs, 1e-4, ef, maxabs);
  EXPECT_NEAR(x[0], std::exp(-10), 1e-4 * std::exp(-10));
  EXPECT_LE(ef[0], 1e-4 * maxabs[0]);
  EXPECT_NEAR(x[1], 10.0 / 9 * (std::exp(-1.0) - std::exp(-10.0)), 1e-4);
}

TEST(CppadOde, TheLastTwoStepsHaveAtLeastHalfTheSmallestSize) {
  struct Recorder : DecayChain {
    std::vector<double>* sizes;
    void step(double ta, double tb, DVector& xa, DVector& xb, DVector& eb) const {
      sizes->push_back(tb - ta);
      DecayChain::step(ta, tb, xa, xb, eb);
    }
  } chain;
  std::vector<double> sizes;
  chain.sizes = &sizes;
  const DVector xi{1, 0}, eabs{1, 1};
  DVector ef(2);
  double scur = 0.4;
  CppAD::OdeErrControl(chain, 0.0, 1.0, xi, 0.4, 0.4, scur, eabs, 0.0, ef);
  ASSERT_EQ(sizes.size(), 3u);
  EXPECT_NEAR(sizes[0], 0.4, 1e-15);
  EXPECT_NEAR(sizes[1], 0.3, 1e-15);
  EXPECT_NEAR(sizes[2], 0.3, 1e-15);
}

TEST(CppadOde, NanAtTheSmallestStepIsReturned) {
  const DecayChain chain{kNan};
  const DVector xi{1, 0}, eabs{1, 1};
  DVector ef(2);
  double scur = 0.8;
  const DVector x = CppAD::OdeErrControl(chain, 0.0, 0.9, xi, 0.8, 1.0, scur, eabs, 1e-7, ef);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_TRUE(std::isnan(x[i]) && std::isnan(ef[i]));
}

TEST(CppadUtilities, SortsPrintsAndTimes) {
  Sizes places(3);
  CppAD::index_sort(DVector{3, 1, 2}, places);
  EXPECT_EQ(places[0], 1u);
  EXPECT_EQ(places[2], 0u);
  EXPECT_EQ(CppAD::to_string(0.5), "0.5");
  EXPECT_GE(CppAD::elapsed_seconds(), 0);
  CppAD::thread_alloc::hold_memory(true);
  CppAD::parallel_ad<double>();
  EXPECT_EQ(CppAD::thread_alloc::thread_num(), 0u);
}

}  // namespace
