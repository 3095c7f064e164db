// SPDX-License-Identifier: BSD-3-Clause
// The scalar: arithmetic, functions, conditions, what a value is.
#include <sstream>

#include "programs.h"

namespace {

struct Unary {
  const char* name;
  ADouble (*code)(const ADouble&);
  double (*value)(double);
  double (*slope)(double);
  double x;
};

double one(double) { return 1; }
const double kRootPi = std::sqrt(std::acos(-1.0));

const Unary kUnary[] = {
    {"plus", [](const ADouble& x) { return +x; }, [](double x) { return x; }, one, 0.3},
    {"minus", [](const ADouble& x) { return -x; }, [](double x) { return -x; }, [](double) { return -1.0; },
     0.3},
    {"abs", [](const ADouble& x) { return abs(x); }, [](double x) { return std::abs(x); },
     [](double) { return -1.0; }, -0.3},
    {"fabs", [](const ADouble& x) { return fabs(x); }, [](double x) { return std::abs(x); }, one, 0.3},
    {"acos", [](const ADouble& x) { return acos(x); }, [](double x) { return std::acos(x); },
     [](double x) { return -1 / std::sqrt(1 - x * x); }, 0.3},
    {"acosh", [](const ADouble& x) { return acosh(x); }, [](double x) { return std::acosh(x); },
     [](double x) { return 1 / std::sqrt(x * x - 1); }, 1.3},
    {"asin", [](const ADouble& x) { return asin(x); }, [](double x) { return std::asin(x); },
     [](double x) { return 1 / std::sqrt(1 - x * x); }, 0.3},
    {"asinh", [](const ADouble& x) { return asinh(x); }, [](double x) { return std::asinh(x); },
     [](double x) { return 1 / std::sqrt(1 + x * x); }, 0.3},
    {"atan", [](const ADouble& x) { return atan(x); }, [](double x) { return std::atan(x); },
     [](double x) { return 1 / (1 + x * x); }, 0.3},
    {"atanh", [](const ADouble& x) { return atanh(x); }, [](double x) { return std::atanh(x); },
     [](double x) { return 1 / (1 - x * x); }, 0.3},
    {"cos", [](const ADouble& x) { return cos(x); }, [](double x) { return std::cos(x); },
     [](double x) { return -std::sin(x); }, 0.3},
    {"cosh", [](const ADouble& x) { return cosh(x); }, [](double x) { return std::cosh(x); },
     [](double x) { return std::sinh(x); }, 0.3},
    {"erf", [](const ADouble& x) { return erf(x); }, [](double x) { return std::erf(x); },
     [](double x) { return 2 / kRootPi * std::exp(-x * x); }, 0.3},
    {"erfc", [](const ADouble& x) { return erfc(x); }, [](double x) { return std::erfc(x); },
     [](double x) { return -2 / kRootPi * std::exp(-x * x); }, 0.3},
    {"exp", [](const ADouble& x) { return exp(x); }, [](double x) { return std::exp(x); },
     [](double x) { return std::exp(x); }, 0.3},
    {"expm1", [](const ADouble& x) { return expm1(x); }, [](double x) { return std::expm1(x); },
     [](double x) { return std::exp(x); }, 0.3},
    {"log", [](const ADouble& x) { return log(x); }, [](double x) { return std::log(x); },
     [](double x) { return 1 / x; }, 0.3},
    {"log10", [](const ADouble& x) { return log10(x); }, [](double x) { return std::log10(x); },
     [](double x) { return 1 / (x * std::log(10.0)); }, 0.3},
    {"log1p", [](const ADouble& x) { return log1p(x); }, [](double x) { return std::log1p(x); },
     [](double x) { return 1 / (1 + x); }, 0.3},
    {"sign", [](const ADouble& x) { return sign(x); }, [](double) { return -1.0; },
     [](double) { return 0.0; }, -0.3},
    {"sin", [](const ADouble& x) { return sin(x); }, [](double x) { return std::sin(x); },
     [](double x) { return std::cos(x); }, 0.3},
    {"sinh", [](const ADouble& x) { return sinh(x); }, [](double x) { return std::sinh(x); },
     [](double x) { return std::cosh(x); }, 0.3},
    {"sqrt", [](const ADouble& x) { return sqrt(x); }, [](double x) { return std::sqrt(x); },
     [](double x) { return 0.5 / std::sqrt(x); }, 0.3},
    {"tan", [](const ADouble& x) { return tan(x); }, [](double x) { return std::tan(x); },
     [](double x) { return 1 + std::tan(x) * std::tan(x); }, 0.3},
    {"tanh", [](const ADouble& x) { return tanh(x); }, [](double x) { return std::tanh(x); },
     [](double x) { return 1 - std::tanh(x) * std::tanh(x); }, 0.3},
    {"cbrt", [](const ADouble& x) { return cbrt(x); }, [](double x) { return std::cbrt(x); },
     [](double x) { return 1 / (3 * std::cbrt(x) * std::cbrt(x)); }, 0.3},
    {"floor", [](const ADouble& x) { return floor(x); }, [](double x) { return std::floor(x); },
     [](double) { return 0.0; }, 0.3},
    {"exp2", [](const ADouble& x) { return exp2(x); }, [](double x) { return std::exp2(x); },
     [](double x) { return std::log(2.0) * std::exp2(x); }, 0.3},
};

class UnaryProgram : public ::testing::TestWithParam<Unary> {};

TEST_P(UnaryProgram, HasValueAndSlopeInBothModes) {
  const Unary& row = GetParam();
  AVector ax(1), ay(1);
  ax[0] = row.x;
  Independent(ax);
  ay[0] = row.code(ax[0]);
  EXPECT_EQ(ay[0], row.value(row.x));
  ADFun<double> f(ax, ay);
  DVector x(1), dx(1), w(1);
  x[0] = row.x, dx[0] = 1, w[0] = 1;
  EXPECT_TRUE(NearEqual(f.Forward(0, x)[0], row.value(row.x), 1e-15, 1e-15));
  EXPECT_TRUE(NearEqual(f.Forward(1, dx)[0], row.slope(row.x), 1e-14, 1e-14));
  EXPECT_TRUE(NearEqual(f.Reverse(1, w)[0], row.slope(row.x), 1e-14, 1e-14));
}

INSTANTIATE_TEST_SUITE_P(Functions, UnaryProgram, ::testing::ValuesIn(kUnary),
                         [](const auto& info) { return info.param.name; });

// Every operand a variable, a constant of the base or an integer.
TEST(CppadScalar, ArithmeticMixesWithNumbers) {
  ADFun<double> f = recorded({3, 0.5}, [](const AVector& x) -> std::vector<ADouble> {
    ADouble compound = x[0];
    compound += x[1], compound -= 1, compound *= 2.0, compound /= x[1];
    return {x[0] + x[1], x[0] - 1, 2 * x[0],   1.0 / x[1], x[0] / 4,
            1 - x[1],    compound, x[0] * 0.0, 0.0 / x[1]};
  });
  expect_near(f.Forward(0, DVector{3, 0.5}), {3.5, 2, 6, 2, 0.75, 0.5, 10, 0, 0});
  expect_near(f.Jacobian(DVector{3, 0.5}), {1, 1, 1, 0, 2, 0, 0, -4, 0.25, 0, 0, -1, 4, -16, 0, 0, 0, 0});
  EXPECT_TRUE(f.Parameter(7));
  EXPECT_TRUE(f.Parameter(8));
  EXPECT_FALSE(f.Parameter(0));
}

TEST(CppadScalar, PowersOfEveryKindOfOperand) {
  ADFun<double> f = recorded({3, 2}, [](const AVector& x) -> std::vector<ADouble> {
    return {pow(x[0], x[1]), pow(x[0], 2.0), pow(x[0], 2), pow(2.0, x[1]),
            pow(2, x[1]),    pow(x[0], -1),  pow(x[0], 0)};
  });
  expect_near(f.Forward(0, DVector{3, 2}), {9, 9, 9, 4, 4, 1.0 / 3, 1});
  const double l3 = std::log(3.0), l2 = std::log(2.0);
  expect_near(f.Jacobian(DVector{3, 2}), {6, 9 * l3, 6, 0, 6, 0, 0, 4 * l2, 0, 4 * l2, -1.0 / 9, 0, 0, 0});
}

TEST(CppadScalar, Atan2InFourQuadrants) {
  ADFun<double> f =
      recorded({1, 1}, [](const AVector& x) -> std::vector<ADouble> { return {atan2(x[0], x[1])}; });
  for (double y : {-2.0, 0.5}) {
    for (double x : {-1.5, 3.0}) {
      expect_near(f.Forward(0, DVector{y, x}), {std::atan2(y, x)});
      expect_near(f.Jacobian(DVector{y, x}), {x / (x * x + y * y), -y / (x * x + y * y)});
    }
  }
}

TEST(CppadScalar, AbsoluteZeroOutweighsInfinity) {
  ADFun<double> f = recorded({1, 1}, [](const AVector& x) -> std::vector<ADouble> {
    return {azmul(x[0], x[1]), azmul(x[0], 2.0), azmul(3.0, x[1])};
  });
  expect_near(f.Forward(0, DVector{0, kInf}), {0, 0, kInf});
  expect_near(f.Forward(0, DVector{2, 3}), {6, 4, 9});
  expect_near(f.Jacobian(DVector{2, 3}), {3, 2, 2, 0, 0, 3});
  EXPECT_EQ(CppAD::azmul(0.0, kNan), 0);
}

TEST(CppadScalar, MinMaxHypotFmodLeaveNoGuard) {
  ADFun<double> f = recorded({3, 4}, [](const AVector& x) -> std::vector<ADouble> {
    return {min(x[0], x[1]), max(x[0], x[1]), hypot(x[0], x[1]), fmod(x[1], x[0]), copysign(x[0], -x[1])};
  });
  expect_near(f.Forward(0, DVector{7, 2}), {2, 7, std::hypot(7, 2), 2, -7});
  EXPECT_EQ(f.compare_change_number(), 0u);
}

// Only a recording refuses the sign of a constant NaN: numbers have one, and so may a value of the other level.
TEST(CppadScalar, CopysignOfNanOutsideOfTheRecording) {
  EXPECT_EQ(Value(copysign(ADouble(2), ADouble(-kNan))), std::copysign(2, -kNan));
  AVector x{0.5}, y(1);
  Independent(x);
  EXPECT_EQ(Value(copysign(ADouble(2), ADouble(kNan))), 2);
  EXPECT_EQ(std::abs(Value(Var2Par(copysign(ADouble(2), log(x[0] - 1))))), 2);
  std::vector<AD<ADouble>> outer{AD<ADouble>(3)}, result(1);
  Independent(outer);
  result[0] = copysign(outer[0], AD<ADouble>(log(x[0] - 1)));  // NaN here, a variable of the inner recording
  ADFun<ADouble> g(outer, result);
  y[0] = g.Forward(0, AVector{ADouble(3)})[0];
  ADFun<double> f(x, y);
  expect_near(f.Forward(0, DVector{1.5}), {-3});
  expect_near(f.Forward(0, DVector{4}), {3});
}

// l, r, t, f are each a variable, a dynamic parameter and a constant.
TEST(CppadConditions, AllRelationsOfAllKindsOfOperands) {
  for (int kinds = 0; kinds < 81; ++kinds) {
    AVector ax(4), ap(4), ay(6);
    for (int i = 0; i < 4; ++i) ax[i] = i + 1, ap[i] = i + 1;
    Independent(ax, ap);
    ADouble of[4];
    int code = kinds;
    bool varies[4], moves[4];
    for (int i = 0; i < 4; ++i, code /= 3) {
      const int kind = code % 3;
      of[i] = kind == 0 ? ax[i] : kind == 1 ? ap[i] : ADouble(i + 1);
      varies[i] = kind == 0, moves[i] = kind != 2;
    }
    ay[0] = CondExpLt(of[0], of[1], of[2], of[3]);
    ay[1] = CondExpLe(of[0], of[1], of[2], of[3]);
    ay[2] = CondExpEq(of[0], of[1], of[2], of[3]);
    ay[3] = CondExpGe(of[0], of[1], of[2], of[3]);
    ay[4] = CondExpGt(of[0], of[1], of[2], of[3]);
    ay[5] = CondExpOp(CppAD::CompareNe, of[0], of[1], of[2], of[3]);
    ADFun<double> f(ax, ay);
    for (const double left : {1.0, 2.0, 5.0}) {
      DVector x{left, 2, 30, 40}, p{left, 2, 30, 40};
      f.new_dynamic(p);
      const double l = moves[0] ? left : 1, r = 2, t = moves[2] ? 30 : 3, e = moves[3] ? 40 : 4;
      const bool truth[] = {l<r, l <= r, l == r, l >= r, l> r, l != r};
      const DVector y = f.Forward(0, x), J = f.Jacobian(x);
      for (std::size_t i = 0; i < 6; ++i) {
        EXPECT_EQ(y[i], truth[i] ? t : e);
        EXPECT_EQ(J[i * 4 + 2], truth[i] && varies[2] ? 1 : 0);
        EXPECT_EQ(J[i * 4 + 3], !truth[i] && varies[3] ? 1 : 0);
        EXPECT_EQ(J[i * 4], 0);
      }
    }
  }
}

TEST(CppadConditions, NanComparesFalse) {
  ADFun<double> f = recorded({1}, [](const AVector& x) -> std::vector<ADouble> {
    const ADouble zero = 0, yes = 1, no = 2;
    return {CondExpLt(x[0], zero, yes, no), CondExpGe(x[0], zero, yes, no), CondExpEq(x[0], x[0], yes, no)};
  });
  expect_near(f.Forward(0, DVector{kNan}), {2, 2, 2});
}

TEST(CppadConditions, WhatIsNotTakenGivesNothing) {
  ADFun<double> f = recorded({1}, [](const AVector& x) -> std::vector<ADouble> {
    return {CondExpGt(x[0], ADouble(0), sqrt(x[0]), ADouble(0)), CondExp(x[0], log(x[0]), 3 * x[0])};
  });
  for (const double x : {0.0, -1.0}) {
    expect_near(f.Forward(0, DVector{x}), {0, 3 * x});
    expect_near(f.Forward(1, DVector{1}), {0, 3});
    expect_near(f.Reverse(1, DVector{1, 0}), {0});
    expect_near(f.Hessian(DVector{x}, DVector{1, 1}), {0});
  }
}

TEST(CppadConditions, OfNumbers) {
  EXPECT_EQ(CppAD::CondExpLt(1.0, 2.0, 3.0, 4.0), 3);
  EXPECT_EQ(CppAD::CondExpGt(1.0f, 2.0f, 3.0f, 4.0f), 4);
  EXPECT_EQ(CppAD::CondExpOp(CppAD::CompareGe, 2.0, 2.0, 3.0, 4.0), 3);
}

TEST(CppadValues, KindsOfAValue) {
  AVector ax(1), ap(1), ay(1);
  ax[0] = 1, ap[0] = 2;
  EXPECT_TRUE(CppAD::Constant(ax[0]));
  Independent(ax, ap);
  const ADouble c = 3, d = ap[0] * 2, v = d * ax[0], folded = ax[0] * 0.0;
  EXPECT_TRUE(Constant(c) && Parameter(c) && !Dynamic(c) && !Variable(c));
  EXPECT_TRUE(Dynamic(d) && Parameter(d) && !Constant(d) && !Variable(d));
  EXPECT_TRUE(Variable(v) && !Parameter(v));
  EXPECT_TRUE(Constant(folded));
  ay[0] = v;
  ADFun<double> f(ax, ay);
  EXPECT_TRUE(Constant(v)) << "after its recording";
}

TEST(CppadValues, ValueVar2ParInteger) {
  AVector ax(1), ay(1);
  ax[0] = 2.75;
  Independent(ax);
  const ADouble square = ax[0] * ax[0];
  EXPECT_EQ(CppAD::Integer(square), 7);
  EXPECT_EQ(CppAD::Integer(-3.9), -3);
  const ADouble kept = Var2Par(square);
  EXPECT_TRUE(Parameter(kept));
  EXPECT_EQ(CppAD::Value(kept), 7.5625);
  ay[0] = kept * ax[0];
  ADFun<double> f(ax, ay);
  expect_near(f.Jacobian(DVector{1}), {7.5625});
  EXPECT_EQ(CppAD::Value(square), 7.5625) << "no variable any more";
}

TEST(CppadValues, StreamsPrintAndReadTheValue) {
  std::ostringstream out;
  out << ADouble(2.5);
  EXPECT_EQ(out.str(), "2.5");
  std::istringstream in("3.25");
  ADouble x;
  in >> x;
  EXPECT_EQ(CppAD::Value(x), 3.25);
}

TEST(CppadValues, LimitsAndNan) {
  EXPECT_EQ(CppAD::numeric_limits<ADouble>::epsilon(), ADouble(std::numeric_limits<double>::epsilon()));
  EXPECT_EQ(std::numeric_limits<ADouble>::max(), ADouble(std::numeric_limits<double>::max()));
  EXPECT_EQ(CppAD::numeric_limits<double>::digits10, std::numeric_limits<double>::digits10);
  EXPECT_TRUE(CppAD::isnan(CppAD::nan(ADouble(0))));
  EXPECT_TRUE(CppAD::isnan(CppAD::numeric_limits<ADouble>::quiet_NaN()));
  EXPECT_FALSE(isnan(ADouble(1)));
  EXPECT_TRUE(CppAD::hasnan(DVector{1, kNan}));
  EXPECT_FALSE(CppAD::hasnan(DVector{1, 2}));
}

TEST(CppadValues, IdenticalQuestions) {
  AVector ax(1);
  ax[0] = 0;
  Independent(ax);
  EXPECT_TRUE(IdenticalZero(ADouble(0)) && IdenticalOne(ADouble(1)) && IdenticalCon(ADouble(2)));
  EXPECT_FALSE(IdenticalZero(ax[0]));
  EXPECT_TRUE(IdenticalEqualCon(ADouble(2), ADouble(2)));
  EXPECT_TRUE(EqualOpSeq(ax[0], ax[0]));
  EXPECT_FALSE(EqualOpSeq(ax[0], ADouble(0)));
  EXPECT_TRUE(GreaterThanOrZero(ax[0]) && LessThanOrZero(ax[0]) && !GreaterThanZero(ax[0]) &&
              !LessThanZero(ax[0]));
  EXPECT_TRUE(abs_geq(ADouble(-3), ADouble(2)));
  ADouble::abort_recording();
}

TEST(CppadValues, FloatIsABase) {
  std::vector<AD<float>> ax{2.0f}, ay(1);
  Independent(ax);
  ay[0] = ax[0] * ax[0] * 0.5f + sin(ax[0]);
  ADFun<float> f(ax, ay);
  const std::vector<float> J = f.Jacobian(std::vector<float>{2.0f});
  EXPECT_NEAR(J[0], 2 + std::cos(2.0f), 1e-6);
}

}  // namespace
