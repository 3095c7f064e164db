// SPDX-License-Identifier: BSD-3-Clause
//
// <cmath> on a tape, beyond what the operator sheet holds every row to: the edges, against std:: in double, by the
// interpreter, jets and packs; and what is not there, which says what to write instead.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/autodiff/scalars/jet.h>
#include <dyntape/autodiff/scalars/pack.h>

namespace dyntape::cmath_test {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kMost = std::numeric_limits<double>::max();
constexpr double kTiny = std::numeric_limits<double>::denorm_min();

// The same number, zeros with their sign; any NaN is a NaN.
bool same(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b) ||
         (std::isnan(a) && std::isnan(b));
}

const std::vector<double> kEdges = {
    0.0,   -0.0,   0.5,   -0.5,   1.5,   -1.5,   2.5,  -2.5,  0.49999999999999994,
    1,     -1,     3.5,   -3.5,   4.75,  -6.25,  1e15, -1e15, 4503599627370497.5,
    kTiny, -kTiny, kMost, -kMost, 1e308, 1e-310, kInf, -kInf, kNan};

using Function1 = AD (*)(const AD&);
using Function2 = AD (*)(const AD&, const AD&);

Function recorded(Function1 f) {
  return record("f", 1, [&](const VectorXad& x) { return VectorXad::Constant(1, f(x[0])); });
}
Function recorded(Function2 f) {
  return record("f", 2, [&](const VectorXad& x) { return VectorXad::Constant(1, f(x[0], x[1])); });
}

TEST(Cmath, RoundsAsTheProcessorDoesOnEveryEdge) {
  const Function r = recorded([](const AD& x) { return rint(x); });
  const Function n = recorded([](const AD& x) { return nearbyint(x); });
  EXPECT_EQ(content_hash(r), content_hash(n));
  for (double x : kEdges) {
    EXPECT_TRUE(same(evaluate(r, {x})[0], std::rint(x))) << x;
    EXPECT_TRUE(same(evaluate(n, {x})[0], std::nearbyint(x))) << x;
    EXPECT_TRUE(same(rint(Pack4(x))[2], std::rint(x))) << x;
    EXPECT_TRUE(same((nearbyint(Jet<double, 1>(x)).value()), std::rint(x))) << x;
    EXPECT_EQ(evaluate(vjp(r), {x}, {}, {1})[0], 0);
  }
  EXPECT_TRUE(same(evaluate(r, {-0.5})[0], -0.0));
}

// Bits of a NaN are not defined: the sign of one that comes is either, of one that is written is refused.
TEST(Cmath, TheSignOfANaNIsNotRecorded) {
  const Function f = recorded([](const AD& x) { return copysign(AD(2.0), log(x)); });
  EXPECT_EQ(std::abs(evaluate(f, {-1.0})[0]), 2);
  EXPECT_EQ(evaluate(f, {0.5})[0], -2);
  EXPECT_THROW(recorded([](const AD& x) { return x + copysign(AD(1.0), AD(kNan)); }), RecordingError);
  try {
    recorded([](const AD& x) { return copysign(x, log(AD(-1.0))); });
    FAIL();
  } catch (const RecordingError& error) {
    EXPECT_NE(
        std::string(error.what()).find("copysign: the second argument is NaN, whose sign is not defined"),
        std::string::npos);
  }
}

TEST(Cmath, PowersOfTwoOnEveryEdge) {
  const Function e = recorded([](const AD& x) { return exp2(x); });
  const Function l = recorded([](const AD& x) { return log2(x); });
  for (double x : kEdges) {
    EXPECT_TRUE(same(evaluate(e, {x})[0], std::exp2(x))) << x;
    EXPECT_TRUE(same(evaluate(l, {x})[0], std::log2(x))) << x;
  }
  for (int n = -1074; n <= 1023; ++n) {  // exactly
    EXPECT_EQ(evaluate(e, {double(n)})[0], std::ldexp(1, n));
    EXPECT_EQ(evaluate(l, {std::ldexp(1, n)})[0], n);
    EXPECT_EQ(exp2(Pack4(n))[1], std::ldexp(1, n));
  }
  const double ln2 = std::log(2.0);
  EXPECT_NEAR(evaluate(vjp(e), {3.0}, {}, {1})[0], 8 * ln2, 1e-14);
  EXPECT_NEAR(evaluate(vjp(l), {8.0}, {}, {1})[0], 1 / (8 * ln2), 1e-16);
  EXPECT_EQ(evaluate(vjp(l), {0.0}, {}, {1})[0], kInf);
}

TEST(Cmath, RemainderTakesTheEvenQuotientAtATie) {
  const Function f = recorded([](const AD&x, const AD&y) { return remainder(x, y); }), slopes = vjp(f);
  for (double x : kEdges) {
    for (double y : kEdges) {
      EXPECT_TRUE(same(evaluate(f, {x, y})[0], std::remainder(x, y))) << x << " " << y;
      EXPECT_TRUE(same(remainder(Pack4(x), Pack4(y))[3], std::remainder(x, y))) << x << " " << y;
    }
  }
  for (double x : {5.0, 7.0, -5.0, -7.0, 5.3, 6.9, 1e9}) {  // 5 / 2 and 7 / 2 are ties: to 2 and 4
    const std::vector<double> g = evaluate(slopes, {x, 2}, {}, {1});
    EXPECT_EQ(g[0], 1);
    EXPECT_EQ(g[1], -std::nearbyint(x / 2)) << x;
  }
}

TEST(Cmath, PositiveDifferenceOnEveryEdge) {
  const Function f = recorded([](const AD&x, const AD&y) { return fdim(x, y); }), slopes = vjp(f);
  for (double x : kEdges) {
    for (double y : kEdges) {
      EXPECT_TRUE(same(evaluate(f, {x, y})[0], std::fdim(x, y))) << x << " " << y;
      EXPECT_TRUE(same(fdim(Pack4(x), Pack4(y))[0], std::fdim(x, y))) << x << " " << y;
      EXPECT_TRUE(same((fdim(Jet<double, 1>(x), Jet<double, 1>(y)).value()), std::fdim(x, y)));
    }
  }
  EXPECT_EQ(evaluate(slopes, {3, 1}, {}, {1}), (std::vector<double>{1, -1}));
  EXPECT_EQ(evaluate(slopes, {1, 3}, {}, {1}), (std::vector<double>{0, 0}));
  EXPECT_EQ(evaluate(slopes, {2, 2}, {}, {1}), (std::vector<double>{0, 0}));
}

Function length() {
  return record("length", 3,
                [](const VectorXad& x) { return VectorXad::Constant(1, hypot(x[0], x[1], x[2])); });
}

TEST(Cmath, LengthOfThreeOverAllSizes) {
  const Function f = length();
  const std::vector<double> sizes = {0.0, -0.0, 1, -3, 1e-160, 1e160, 4e-320, 1e308, -kInf, kNan};
  for (double x : sizes) {
    for (double y : sizes) {
      for (double z : sizes) {
        SCOPED_TRACE(std::to_string(x) + " " + std::to_string(y) + " " + std::to_string(z));
        const double expected = std::hypot(std::hypot(x, y), z), got = evaluate(f, {x, y, z})[0];
        EXPECT_TRUE(same(got, expected) || std::abs(got - expected) <= 4e-16 * expected + kTiny) << got;
        EXPECT_TRUE(same(hypot(Pack4(x), Pack4(y), Pack4(z))[1], got));
        using J = Jet<double, 1>;
        EXPECT_TRUE(same((hypot(J(x), J(y), J(z)).value()), got));
      }
    }
  }
}

TEST(Cmath, LengthOfThreeHasItsSlopesAndCurvature) {
  const Function f = length(), gradient = vjp(f), curvature = jvp(gradient);
  const std::vector<std::vector<double>> points = {
      {3, 4, 12}, {0, 0, 2}, {0, -2, 0}, {1e-180, 0, 0}, {1e200, 2e200, 1e200}, {1, 1, 1}};
  for (const std::vector<double>& x : points) {
    const double r = evaluate(f, x)[0];
    const std::vector<double> g = evaluate(gradient, x, {}, {1});
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_NEAR(g[j], x[j] / r, 1e-15);
      std::vector<double> weights = {1, 0, 0, 0};
      weights[1 + j] = 1;
      const std::vector<double> h = evaluate(curvature, x, {}, weights);
      for (std::size_t i = 0; i < 3; ++i)
        EXPECT_NEAR(h[i] * r, double(i == j) - (x[i] / r) * (x[j] / r), 4e-15) << r;
    }
  }
  EXPECT_EQ(evaluate(gradient, {0, 0, 0}, {}, {1}), (std::vector<double>{0, 0, 0}));
}

// --- what is not there ---

struct Missing {
  std::string call, says;
};
const std::vector<Missing> kMissing = {
    {"lround(x)", "write round(x)"},
    {"lrint(x)", "write rint(x)"},
    {"llround(x)", "write round(x)"},
    {"llrint(x)", "write rint(x)"},
    {"ilogb(x)", "floor(log2(abs(x)))"},
    {"logb(x)", "floor(log2(abs(x)))"},
    {"frexp(x, &n)", "exp2(-e)"},
    {"ldexp(x, n)", "x * exp2(n)"},
    {"scalbn(x, n)", "x * exp2(n)"},
    {"modf(x, &x)", "trunc(x)"},
    {"remquo(x, x, &n)", "remainder(x, y)"},
    {"nextafter(1.0, x)", "neighbour of x.value()"},
    {"lerp(1.0, 2.0, x)", "a + t * (b - a)"},
    {"signbit(x)", "copysign(1.0, x)"},
    {"isunordered(x, x)", "x != x"},
    {"isnormal(x)", "isnormal(x.value())"},
    {"fpclassify(x)", "fpclassify(x.value())"},
    {"tgamma(x)", "call a Kernel"},
    {"lgamma(x)", "call a Kernel"},
    {"cyl_bessel_j(1.0, x)", "call a Kernel"},
};

TEST(Cmath, WhatIsMissingSaysWhatToWrite) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir());
  const std::string source = (folder / "dyntape_missing.cpp").string();
  {
    std::ofstream text(source);
    text << "#include <dyntape/autodiff/record/scalar.h>\nvoid f(dyntape::AD x, int n) {\n  (void)n;\n";
    for (const Missing& missing : kMissing) text << "  " << missing.call << ";\n";
    text << "}\n";
  }
  const std::string command =
      std::string(DYNTAPE_CXX) + " -std=c++20 -fsyntax-only -I" + DYNTAPE_INCLUDE + " " + source + " 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  ASSERT_TRUE(pipe);
  std::string said;
  std::array<char, 4096> buffer;
  while (const std::size_t n = fread(buffer.data(), 1, buffer.size(), pipe)) said.append(buffer.data(), n);
  EXPECT_NE(pclose(pipe), 0);
  std::filesystem::remove(source);
  for (const Missing& missing : kMissing) {
    const std::string function = missing.call.substr(0, missing.call.find('('));
    const std::size_t at = said.find(function + " of a recorded value: ");
    ASSERT_NE(at, std::string::npos) << function << "\n" << said;
    EXPECT_NE(said.substr(at, said.find('\n', at) - at).find(missing.says), std::string::npos)
        << missing.call << "\n"
        << said.substr(at, 200);
  }
}

}  // namespace
}  // namespace dyntape::cmath_test
