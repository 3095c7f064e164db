// SPDX-License-Identifier: BSD-3-Clause
// Bases beside double: complex numbers, long double, recorded floats, and classes of the user.
#include "bases.h"
#include "interface/cppad/programs.h"

namespace {

using Complex = std::complex<double>;
using ComplexVector = CPPAD_TESTVECTOR(Complex);

template <class Base, class Code>
ADFun<Base> recorded_over(const std::vector<Base>& x, Code&& code) {
  CppAD::vector<AD<Base>> ax(x.size()), ay(1);
  for (std::size_t j = 0; j < x.size(); ++j) ax[j] = x[j];
  Independent(ax);
  ay[0] = code(ax);
  return ADFun<Base>(ax, ay);
}

void expect_near(Complex got, Complex expected, const char* what) {
  EXPECT_LE(std::abs(got - expected), 1e-13 * (1 + std::abs(expected))) << what;
}

TEST(CppadComplex, SlopesOfFunctions) {
  using A = AD<Complex>;
  const Complex z(0.4, -0.7), i(0, 1), one(1);
  const auto slope = [&](const char* what, auto code, Complex expected) {
    ADFun<Complex> f = recorded_over<Complex>({Complex(0.1, 0.2)}, [&](auto& x) { return A(code(x[0])); });
    const ComplexVector at{z}, w{one};
    expect_near(f.Jacobian(at)[0], expected, what);
    expect_near(f.Reverse(1, w)[0], expected, what);
    // An analytic function has the same slope along the imaginary axis.
    f.Forward(0, at);
    expect_near(f.Forward(1, ComplexVector{i})[0], i * expected, what);
  };
  slope(
      "sin", [](A x) { return sin(x); }, std::cos(z));
  slope(
      "cos", [](A x) { return cos(x); }, -std::sin(z));
  slope(
      "tan", [](A x) { return tan(x); }, one / (std::cos(z) * std::cos(z)));
  slope(
      "asin", [](A x) { return asin(x); }, one / std::sqrt(one - z * z));
  slope(
      "acos", [](A x) { return acos(x); }, -one / std::sqrt(one - z * z));
  slope(
      "atan", [](A x) { return atan(x); }, one / (one + z * z));
  slope(
      "sinh", [](A x) { return sinh(x); }, std::cosh(z));
  slope(
      "cosh", [](A x) { return cosh(x); }, std::sinh(z));
  slope(
      "tanh", [](A x) { return tanh(x); }, one / (std::cosh(z) * std::cosh(z)));
  slope(
      "asinh", [](A x) { return asinh(x); }, one / std::sqrt(one + z * z));
  slope(
      "acosh", [](A x) { return acosh(x); }, one / (std::sqrt(z - one) * std::sqrt(z + one)));
  slope(
      "atanh", [](A x) { return atanh(x); }, one / (one - z * z));
  slope(
      "exp", [](A x) { return exp(x); }, std::exp(z));
  slope(
      "log", [](A x) { return log(x); }, one / z);
  slope(
      "log10", [](A x) { return log10(x); }, one / (z * std::log(10.0)));
  slope(
      "log2", [](A x) { return log2(x); }, one / (z * std::log(2.0)));
  slope(
      "exp2", [](A x) { return exp2(x); }, std::exp(z * std::log(2.0)) * std::log(2.0));
  slope(
      "sqrt", [](A x) { return sqrt(x); }, 0.5 / std::sqrt(z));
  slope(
      "pow", [](A x) { return pow(x, A(3.0)); }, 3.0 * z * z);
  const Complex p(0.3, 1.1);
  slope(
      "power", [&](A x) { return pow(x, A(p)); }, p * std::pow(z, p - one));
  slope(
      "exponential", [&](A x) { return pow(A(p), x); }, std::log(p) * std::pow(p, z));
  slope(
      "azmul", [&](A x) { return azmul(x, A(p)) / x * x; }, p);
  slope(
      "constants", [&](A x) { return A(i) * x + A(-0.0) + i * i; }, i);
}

TEST(CppadComplex, TanhWhereTheHyperbolicCosineOverflows) {
  ADFun<Complex> f = recorded_over<Complex>({Complex(1)}, [](auto& x) { return tanh(x[0]); });
  EXPECT_EQ(f.Jacobian(ComplexVector{Complex(800, 0.1)})[0], Complex(0));
  const Complex z(0.2, 400);  // far along the imaginary axis it does not
  expect_near(f.Jacobian(ComplexVector{z})[0], 1.0 / (std::cosh(z) * std::cosh(z)), "tanh");
}

TEST(CppadComplex, HessianOfAProduct) {
  ADFun<Complex> f =
      recorded_over<Complex>({1, 1}, [](auto& x) { return x[0] * x[0] * x[1] * Complex(0, 2); });
  const Complex a(1, 2), b(-3, 0.5), k(0, 2);
  const ComplexVector H = f.Hessian(ComplexVector{a, b}, 0);
  expect_near(H[0], 2.0 * b * k, "xx");
  expect_near(H[1], 2.0 * a * k, "xy");
  expect_near(H[2], 2.0 * a * k, "yx");
  EXPECT_EQ(H[3], Complex(0));
}

TEST(CppadComplex, DynamicParametersBranchesAndSparsity) {
  CppAD::vector<AD<Complex>> ax{Complex(1), Complex(2)}, ap{Complex(0, 1)}, ay(2);
  CppAD::Independent(ax, 0, true, ap);
  ay[0] = ap[0] * ax[0];
  ay[1] = CondExpEq(ax[1], AD<Complex>(2.0), ax[1] * ax[1], AD<Complex>(0.0));
  if (ax[0] == AD<Complex>(1.0)) ay[1] += 1.0;
  ADFun<Complex> f(ax, ay);
  f.new_dynamic(ComplexVector{Complex(3, 4)});
  const ComplexVector y = f.Forward(0, ComplexVector{Complex(0, 1), Complex(2)});
  EXPECT_EQ(y[0], Complex(-4, 3));
  EXPECT_EQ(y[1], Complex(5));
  EXPECT_EQ(f.compare_change_number(), 1u);  // x[0] is 1 no longer
  EXPECT_EQ(f.Forward(0, ComplexVector{Complex(1), Complex(2, 1)})[1], Complex(1));
  CppAD::vector<bool> identity{true, false, false, true};
  const auto pattern = f.ForSparseJac(2, identity);
  EXPECT_TRUE(pattern[0] && !pattern[1] && !pattern[2] && pattern[3]);
}

TEST(CppadComplex, HasNoOrder) {
  const AD<Complex> x(Complex(1, 2));
  const auto says = [](auto code) { return sentence_of<dyntape::ArgumentError>(code); };
  for (const std::string& sentence :
       {says([&] { abs(x); }), says([&] { sign(x); }), says([&] { (void)(x < x); }), says([&] { max(x, x); }),
        says([&] { CondExpLt(x, x, x, x); }), says([&] { CppAD::GreaterThanZero(x); })})
    EXPECT_NE(sentence.find("the base is std::complex, whose numbers have no order"), std::string::npos)
        << sentence;
  EXPECT_NE(says([&] { floor(x); }).find("floor: the base of AD<Base> has no such function"),
            std::string::npos);
}

TEST(CppadComplex, Utilities) {
  EXPECT_EQ(Integer(AD<Complex>(Complex(3.7, 9))), 3);
  EXPECT_TRUE(CppAD::abs_geq(AD<Complex>(Complex(3, 4)), AD<Complex>(Complex(4.9, 0))));
  EXPECT_TRUE(CppAD::isnan(CppAD::numeric_limits<AD<Complex>>::quiet_NaN()));
  EXPECT_TRUE(CppAD::IdenticalOne(AD<Complex>(1.0)) && !CppAD::IdenticalZero(AD<Complex>(Complex(0, 1))));
  EXPECT_TRUE(NearEqual(AD<Complex>(Complex(1, 1)), Complex(1, 1 + 1e-12), 1e-10, 1e-10));
  EXPECT_EQ(CppAD::to_string(AD<Complex>(Complex(0.25, -1))), "(0.25,-1)");
}

// 1/3 in 64 bits is no double, so a constant of the graph would lose digits.
TEST(CppadLongDouble, KeepsItsDigits) {
  const long double third = 1 / 3.0L, x = 0.7L;
  ADFun<long double> f = recorded_over<long double>(
      {0.1L}, [&](auto& ax) { return ax[0] * ax[0] * third + log10(ax[0]) + log2(ax[0]) + exp2(ax[0]); });
  const CppAD::vector<long double> at{x};
  const long double slope =
      2 * x * third + 1 / (x * std::log(10.0L)) + 1 / (x * std::log(2.0L)) + std::exp2(x) * std::log(2.0L);
  EXPECT_NEAR(static_cast<double>((f.Jacobian(at)[0] - slope) / slope), 0, 4e-19);
  const long double second = 2 * third - (1 / std::log(10.0L) + 1 / std::log(2.0L)) / (x * x) +
                             std::exp2(x) * std::log(2.0L) * std::log(2.0L);
  EXPECT_NEAR(static_cast<double>((f.Hessian(at, 0)[0] - second) / second), 0, 1e-18);
}

template <class Base>
void expect_program_of_many_functions(const char* name, double (*value)(const Base&)) {
  SCOPED_TRACE(name);
  const auto program = [](const auto& x) {
    using S = std::remove_cvref_t<decltype(x[0])>;
    const S bounded =
        tanh(x[0]) + asinh(x[1]) * atan(x[0]) + erf(x[1]) + expm1(x[0] * S(0.5)) + log1p(x[1] * x[1]);
    const S branch = CondExpLt(x[0], x[1], x[0] * x[1], sqrt(abs(x[1]) + S(1)));
    return S(pow(x[0] * x[0] + S(1.5), x[1]) + branch * bounded +
             acosh(cosh(x[1]) + S(1)) / (S(2) + sign(x[0])));
  };
  const std::vector<double> x{0.6, -0.4}, other{-0.5, 0.3};
  ADFun<double> plain = recorded_over<double>(x, program);
  ADFun<Base> f = recorded_over<Base>({Base(x[0]), Base(x[1])}, program);
  for (const auto& at : {x, other}) {
    const DVector px(at.begin(), at.end());
    const CppAD::vector<Base> bx{Base(at[0]), Base(at[1])};
    const DVector H = plain.Hessian(px, 0), J = plain.Jacobian(px);
    const auto BH = f.Hessian(bx, 0), BJ = f.Jacobian(bx);
    for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(value(BH[k]), H[k], 1e-12 * (1 + std::abs(H[k])));
    for (std::size_t k = 0; k < 2; ++k) EXPECT_NEAR(value(BJ[k]), J[k], 1e-13 * (1 + std::abs(J[k])));
  }
}

TEST(CppadUserBase, AgreesWithDouble) {
  expect_program_of_many_functions<units::Number>("functions in a namespace",
                                                  [](const units::Number& n) { return n.value; });
  expect_program_of_many_functions<Triple>("functions in CppAD", [](const Triple& t) { return t.v[2]; });
}

// Each element has its own branch.
TEST(CppadUserBase, ElementsTakeTheirOwnBranches) {
  ADFun<Triple> f = recorded_over<Triple>(
      {Triple(1)}, [](auto& x) { return CondExpGt(x[0], AD<Triple>(0.0), sqrt(x[0]), x[0] * x[0]); });
  const CppAD::vector<Triple> x{Triple(4, -3, 0)};
  const Triple y = f.Forward(0, x)[0], slope = f.Reverse(1, CppAD::vector<Triple>{Triple(1)})[0];
  EXPECT_EQ(y, Triple(2, 9, 0));
  EXPECT_EQ(slope, Triple(0.25, -6,
                          0));  // the root that is not taken has an infinite slope at 0, which does not count
  EXPECT_EQ(f.Jacobian(x)[0], slope);
}

TEST(CppadUserBase, PrintsComparesAndRefuses) {
  std::ostringstream out;
  out << AD<units::Number>(2.0) << ' ' << AD<Triple>(Triple(1, 2, 3));
  EXPECT_EQ(out.str(), "2 units (1 2 3)");
  EXPECT_EQ(CppAD::to_string(AD<Triple>(Triple(1, 2, 3))), "(1 2 3)");
  EXPECT_TRUE(AD<units::Number>(1.0) < AD<units::Number>(2.0));
  EXPECT_TRUE(NearEqual(units::Number(1), units::Number(1 + 1e-12), units::Number(1e-10), units::Number(0)));
  EXPECT_EQ(sentence_of<dyntape::ArgumentError>([] { (void)(AD<Triple>(1.0) < AD<Triple>(2.0)); }),
            "operator <: the base of AD<Base> has no such function; CppAD's base_require lists those that it "
            "needs");
  EXPECT_EQ(sentence_of<dyntape::ArgumentError>([] {
              hypot(AD<Triple>(3.0), AD<Triple>(4.0)), cbrt(AD<Triple>(8.0));
            }).substr(0, 5),
            "cbrt:");
}

// y = x^2, whose coefficients the user gives.
template <class Base>
class Square : public CppAD::atomic_four<Base> {
 public:
  Square() : CppAD::atomic_four<Base>("square") {}

 private:
  using Bools = CppAD::vector<bool>;
  template <class S>
  static bool squares(std::size_t low, std::size_t up, const CppAD::vector<S>& tx, CppAD::vector<S>& ty) {
    for (std::size_t k = low; k <= up; ++k) {
      ty[k] = S(0);
      for (std::size_t j = 0; j <= k; ++j) ty[k] += tx[j] * tx[k - j];
    }
    return true;
  }
  template <class S>
  static bool adjoints(std::size_t up, const CppAD::vector<S>& tx, CppAD::vector<S>& px,
                       const CppAD::vector<S>& py) {
    for (std::size_t k = 0; k <= up; ++k) {
      px[k] = S(0);
      for (std::size_t j = k; j <= up; ++j) px[k] += S(2) * py[j] * tx[j - k];
    }
    return true;
  }
  bool forward(std::size_t, const Bools&, std::size_t low, std::size_t up, const CppAD::vector<Base>& tx,
               CppAD::vector<Base>& ty) override {
    return squares(low, up, tx, ty);
  }
  bool forward(std::size_t, const Bools&, std::size_t low, std::size_t up, const CppAD::vector<AD<Base>>& tx,
               CppAD::vector<AD<Base>>& ty) override {
    return squares(low, up, tx, ty);
  }
  bool reverse(std::size_t, const Bools&, std::size_t up, const CppAD::vector<Base>& tx,
               const CppAD::vector<Base>&, CppAD::vector<Base>& px, const CppAD::vector<Base>& py) override {
    return adjoints(up, tx, px, py);
  }
  bool reverse(std::size_t, const Bools&, std::size_t up, const CppAD::vector<AD<Base>>& tx,
               const CppAD::vector<AD<Base>>&, CppAD::vector<AD<Base>>& px,
               const CppAD::vector<AD<Base>>& py) override {
    return adjoints(up, tx, px, py);
  }
};

template <class Base>
void expect_square(const Base& x, const Base& twice_x) {
  Square<Base> square;
  ADFun<Base> f = recorded_over<Base>({Base(1)}, [&](auto& ax) {
    CppAD::vector<AD<Base>> y(1);
    square(ax, y);
    return y[0];
  });
  const CppAD::vector<Base> at{x};
  EXPECT_EQ(f.Forward(0, at)[0], x * x);
  EXPECT_EQ(f.Reverse(1, CppAD::vector<Base>{Base(1)})[0], twice_x);
  EXPECT_EQ(f.Hessian(at, 0)[0], Base(2));
  // And recorded once more.
  auto af = f.base2ad();
  CppAD::vector<AD<Base>> ax{Base(1)};
  Independent(ax);
  af.Forward(0, ax);
  const auto gradient = af.Reverse(1, CppAD::vector<AD<Base>>{AD<Base>(Base(1))});
  ADFun<Base> g(ax, gradient);
  EXPECT_EQ(g.Forward(0, at)[0], twice_x);
  EXPECT_EQ(g.Jacobian(at)[0], Base(2));
}

TEST(CppadBasesOfAtomics, AreCalled) {
  expect_square<Complex>(Complex(1, 2), Complex(2, 4));
  expect_square<Triple>(Triple(1, 2, 3), Triple(2, 4, 6));
  expect_square<long double>(1 / 4.0L, 1 / 2.0L);
}

}  // namespace
