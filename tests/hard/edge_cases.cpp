// SPDX-License-Identifier: BSD-3-Clause
#include "edge_cases.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace dyntape::testing {
namespace {

using V = VectorXad;
using Cases = std::vector<EdgeCase>;
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = 3.14159265358979323846;
const double kTwoOverRootPi = 2 / std::sqrt(kPi);

void add_exponentials(Cases& c) {
  c.push_back({"expm1 near zero",
               [](const V& x) { return expm1(x[0]); },
               {1e-12},
               1.0000000000005e-12,
               {1.000000000001},
               {1.000000000001}});
  c.push_back({"log1p near zero",
               [](const V& x) { return log1p(x[0]); },
               {1e-15},
               9.999999999999995e-16,
               {1 / (1 + 1e-15)},
               {-1}});
  const double d = kTwoOverRootPi * std::exp(-0.25);
  c.push_back({"erf", [](const V& x) { return erf(x[0]); }, {0.5}, std::erf(0.5), {d}, {-d}});
  const double e = -kTwoOverRootPi * std::exp(-676.0);
  c.push_back({"erfc far out",
               [](const V& x) { return erfc(x[0]); },
               {26},
               5.663192408856142846e-296,
               {e},
               {-52 * e}});
  c.push_back({"erfc vanishes", [](const V& x) { return erfc(x[0]); }, {40}, 0, {0}, {0}});
  c.push_back({"erf saturates", [](const V& x) { return erf(x[0]); }, {40}, 1, {0}, {0}});
  c.push_back({"log2 at 0", [](const V& x) { return log2(x[0]); }, {0}, -kInf, {kInf}, {-kInf}});
  const double ln2 = std::log(2.0);
  c.push_back(
      {"exp2", [](const V& x) { return exp2(x[0]); }, {-3}, 0.125, {0.125 * ln2}, {0.125 * ln2 * ln2}});
  c.push_back({"log at 0", [](const V& x) { return log(x[0]); }, {0}, -kInf, {kInf}, {-kInf}});
  c.push_back({"log of a negative number", [](const V& x) { return log(x[0]); }, {-1}, kNan, {}, {}});
  c.push_back({"sum of log|x| with one zero",
               [](const V& x) { return log(abs(x[0])) + log(abs(x[1])); },
               {0, -2},
               -kInf,
               {kNan, -0.5},
               {}});  // 1/0 times sign(0)
  c.push_back({"tanh saturates", [](const V& x) { return tanh(x[0]); }, {1000}, 1, {0}, {0}});
  c.push_back({"tanh saturates below", [](const V& x) { return tanh(x[0]); }, {-1000}, -1, {0}, {0}});
  c.push_back({"exp(x) - exp(x) beyond the largest number",
               [](const V& x) { return exp(x[0]) - exp(x[0]); },
               {710},
               kNan,
               {},
               {}});
  c.push_back({"exp(x) exp(-x) beyond the largest number",
               [](const V& x) { return exp(x[0]) * exp(-x[0]); },
               {710},
               kInf,
               {},
               {}});
}

void add_roots(Cases& c) {
  c.push_back({"sqrt at 0", [](const V& x) { return sqrt(x[0]); }, {0}, 0, {kInf}, {-kInf}});
  c.push_back(
      {"sqrt of a negative number", [](const V& x) { return sqrt(x[0]); }, {-1}, kNan, {kNan}, {kNan}});
  c.push_back({"sqrt of a square", [](const V& x) { return sqrt(x[0] * x[0]); }, {0.5}, 0.5, {1}, {0}});
  c.push_back({"cbrt at 0", [](const V& x) { return cbrt(x[0]); }, {0}, 0, {kInf}, {}});
  c.push_back(
      {"hypot at the origin", [](const V& x) { return hypot(x[0], x[1]); }, {0, 0}, 0, {0, 0}, {0, 0, 0, 0}});
  c.push_back({"hypot on an axis",
               [](const V& x) { return hypot(x[0], x[1]); },
               {3, 0},
               3,
               {1, 0},
               {0, 0, 0, 1.0 / 3}});
  c.push_back({"asin at 1", [](const V& x) { return asin(x[0]); }, {1}, kPi / 2, {kInf}, {}});
  c.push_back({"acos at 1", [](const V& x) { return acos(x[0]); }, {1}, 0, {-kInf}, {}});
  const double above = 1 + 1e-12, off = above - 1, slope = 1 / std::sqrt(off * (above + 1));
  c.push_back(
      {"acosh above 1", [](const V& x) { return acosh(x[0]); }, {above}, std::acosh(above), {slope}, {}});
  const double below = 1 - 1e-15, steep = 1 / ((1 - below) * (1 + below));
  c.push_back({"atanh below 1",
               [](const V& x) { return atanh(x[0]); },
               {below},
               std::atanh(below),
               {steep},
               {2 * below * steep * steep}});
}

void add_steps(Cases& c) {
  c.push_back({"abs at 0", [](const V& x) { return abs(x[0]); }, {0}, 0, {0}, {0}});
  c.push_back({"abs at -0", [](const V& x) { return abs(x[0]); }, {-0.0}, 0, {0}, {0}});
  c.push_back({"abs of a negative number", [](const V& x) { return abs(x[0]); }, {-3}, 3, {-1}, {0}});
  c.push_back({"abs of NaN", [](const V& x) { return abs(x[0]); }, {kNan}, kNan, {}, {}});
  c.push_back({"sign at 0", [](const V& x) { return sign(x[0]); }, {0}, 0, {0}, {0}});
  c.push_back({"floor", [](const V& x) { return floor(x[0]); }, {-1.5}, -2, {0}, {0}});
  c.push_back({"ceil", [](const V& x) { return ceil(x[0]); }, {-1.5}, -1, {0}, {0}});
  c.push_back({"round half away from zero", [](const V& x) { return round(x[0]); }, {-2.5}, -3, {0}, {0}});
  c.push_back({"rint of a tie: to even", [](const V& x) { return rint(x[0]); }, {-2.5}, -2, {0}, {0}});
  c.push_back({"remainder of a tie: the even quotient",
               [](const V& x) { return remainder(x[0], x[1]); },
               {7, 2},
               -1,
               {1, -4},
               {0, 0, 0, 0}});
  c.push_back(
      {"fdim at a tie", [](const V& x) { return fdim(x[0], x[1]); }, {2, 2}, 0, {0, 0}, {0, 0, 0, 0}});
  c.push_back({"hypot of three on an axis",
               [](const V& x) { return hypot(x[0], x[1], x[2]); },
               {0, 0, -4},
               4,
               {0, 0, -1},
               {0.25, 0, 0, 0, 0.25, 0, 0, 0, 0}});
  c.push_back({"hypot of three at the origin",
               [](const V& x) { return hypot(x[0], x[1], x[2]); },
               {0, 0, 0},
               0,
               {0, 0, 0},
               {}});
  c.push_back({"fmod", [](const V& x) { return fmod(x[0], x[1]); }, {-7.5, 2}, -1.5, {1, 3}, {0, 0, 0, 0}});
  c.push_back({"fmod where the quotient rounds to a whole number",
               [](const V& x) { return fmod(x[0], x[1]); },
               {3.9, 1.3},
               std::fmod(3.9, 1.3),  // 1.2999999999999998
               {1, -2},
               {0, 0, 0, 0}});
  c.push_back({"min at a tie: the first",
               [](const V& x) { return min(x[0], x[1]); },
               {2, 2},
               2,
               {1, 0},
               {0, 0, 0, 0}});
  c.push_back({"max at a tie: the first",
               [](const V& x) { return max(x[0], x[1]); },
               {2, 2},
               2,
               {1, 0},
               {0, 0, 0, 0}});
  c.push_back({"fmax with a NaN", [](const V& x) { return fmax(x[0], x[1]); }, {kNan, 1}, 1, {0, 1}, {}});
  c.push_back({"fmin with a NaN", [](const V& x) { return fmin(x[0], x[1]); }, {1, kNan}, 1, {1, 0}, {}});
  c.push_back({"copysign from -0",
               [](const V& x) { return copysign(x[0], x[1]); },
               {3, -0.0},
               -3,
               {-1, 0},
               {0, 0, 0, 0}});
}

void add_powers(Cases& c) {
  const auto power = [](double p) { return [p](const V& x) { return pow(x[0], p); }; };
  const auto general = [](const V& x) { return pow(x[0], x[1]); };
  c.push_back({"pow(x, 2) at 0", power(2), {0}, 0, {0}, {2}});
  c.push_back({"pow(x, 1) at 0", power(1), {0}, 0, {1}, {0}});
  c.push_back({"pow(x, 0) at 0", power(0), {0}, 1, {0}, {0}});
  c.push_back({"pow(x, 0) at NaN", power(0), {kNan}, 1, {0}, {0}});
  c.push_back({"pow(x, 0.5) at 0", power(0.5), {0}, 0, {kInf}, {-kInf}});
  c.push_back({"pow(x, -1) at 0", power(-1), {0}, kInf, {-kInf}, {kInf}});
  c.push_back({"pow(x, 3) at -2", power(3), {-2}, -8, {12}, {-12}});
  c.push_back({"pow(x, -2) at -2", power(-2), {-2}, 0.25, {0.25}, {0.375}});
  c.push_back({"pow(x, 2.5) at 0", power(2.5), {0}, 0, {0}, {0}});
  c.push_back({"pow(x, 2.5) at 1", power(2.5), {1}, 1, {2.5}, {3.75}});
  c.push_back({"pow(x, 1.5) at -1", power(1.5), {-1}, kNan, {kNan}, {kNan}});
  c.push_back(
      {"pow(x, 2) - 7 x at 0", [](const V& x) { return pow(x[0], 2.0) - 7 * x[0]; }, {0}, 0, {-7}, {2}});
  c.push_back({"pow(x, y) at (0, 2)", general, {0, 2}, 0, {0, 0}, {}});
  c.push_back({"pow(x, y) at (0, 1)", general, {0, 1}, 0, {1, 0}, {}});
  c.push_back({"pow(x, y) at (0, 0)", general, {0, 0}, 1, {0, -kInf}, {}});
  c.push_back({"pow(2, y)",
               [](const V& x) { return pow(2.0, x[0]); },
               {3},
               8,
               {8 * std::log(2.0)},
               {8 * std::log(2.0) * std::log(2.0)}});
  for (int n = -8; n <= 8; ++n) {
    for (double t : {-1.5, 0.0, 2.0}) {
      const double first = n == 0 ? 0 : n * std::pow(t, n - 1);
      const double second = n == 0 || n == 1 ? 0 : n * (n - 1) * std::pow(t, n - 2);
      // At the pole of a negative power the sign of an infinity is the sign of a zero: not claimed.
      const bool pole = n < 0 && t == 0;
      c.push_back({"pow(x, " + std::to_string(n) + ") at " + std::to_string(t),
                   power(n),
                   {t},
                   std::pow(t, n),
                   pole ? std::vector<double>{} : std::vector{first},
                   pole ? std::vector<double>{} : std::vector{second}});
    }
  }
}

void add_angles(Cases& c) {
  const auto f = [](const V& x) { return atan2(x[0], x[1]); };
  for (int k = 0; k < 8; ++k) {  // axes and diagonals
    const double y = std::round(std::sin(k * kPi / 4)), x = std::round(std::cos(k * kPi / 4)),
                 r2 = x * x + y * y;
    const double xy = 2 * x * y / (r2 * r2), xx = (y * y - x * x) / (r2 * r2);
    c.push_back({"atan2 at direction " + std::to_string(k),
                 f,
                 {y, x},
                 std::atan2(y, x),
                 {x / r2, -y / r2},
                 {-xy, xx, xx, xy}});
  }
  c.push_back({"atan2(0, -1)", f, {0.0, -1}, kPi, {-1, 0}, {}});
  c.push_back({"atan2(-0, -1)", f, {-0.0, -1}, -kPi, {-1, 0}, {}});
  c.push_back({"atan2(0, 0)", f, {0, 0}, 0, {kNan, kNan}, {}});
  c.push_back({"atan2 of large arguments", f, {1e200, 1e200}, kPi / 4, {5e-201, -5e-201}, {}});
  c.push_back({"atan2 of small arguments", f, {1e-200, 1e-200}, kPi / 4, {5e199, -5e199}, {}});
}

void add_zeros(Cases& c) {
  c.push_back({"azmul(0, inf)", [](const V& x) { return azmul(x[0], x[1]); }, {0, kInf}, 0, {kInf, 0}, {}});
  c.push_back({"azmul(0, NaN)", [](const V& x) { return azmul(x[0], x[1]); }, {0, kNan}, 0, {kNan, 0}, {}});
  c.push_back({"azmul(inf, 0)", [](const V& x) { return azmul(x[0], x[1]); }, {kInf, 0}, kNan, {}, {}});
  c.push_back({"x times a constant 0, at NaN", [](const V& x) { return x[0] * 0.0; }, {kNan}, 0, {0}, {0}});
  c.push_back({"a constant 0 over x, at 0", [](const V& x) { return 0.0 / x[0]; }, {0}, 0, {0}, {0}});
  c.push_back({"x - x at inf", [](const V& x) { return x[0] - x[0]; }, {kInf}, kNan, {0}, {0}});
  c.push_back({"x / x at 0", [](const V& x) { return x[0] / x[0]; }, {0}, kNan, {}, {}});
  c.push_back({"(1 + x) - 1 is not x", [](const V& x) { return (1.0 + x[0]) - 1.0; }, {1e-17}, 0, {1}, {0}});
}

void add_selections(Cases& c) {
  for (double t : {0.0, -1.0}) {
    c.push_back({"select(x > 0, sqrt(x), 0) at " + std::to_string(t),
                 [](const V& x) { return select(x[0] > 0, sqrt(x[0]), 0); },
                 {t},
                 0,
                 {0},
                 {0}});
    c.push_back({"select(x > 0, log(x) * x, 0) at " + std::to_string(t),
                 [](const V& x) { return select(x[0] > 0, log(x[0]) * x[0], 0); },
                 {t},
                 0,
                 {0},
                 {0}});
  }
  c.push_back({"select(x == 0, 1, sin(x)/x) at 0",
               [](const V& x) { return select(x[0] == 0, 1, sin(x[0]) / x[0]); },
               {0},
               1,
               {0},
               {0}});
  c.push_back({"select(x == 0, 0, 1/x) at 0",
               [](const V& x) { return select(x[0] == 0, 0, 1 / x[0]); },
               {0},
               0,
               {0},
               {0}});
  c.push_back({"series below, exact above: (1 - cos t)/t^2 of t = sqrt(x) at 0",
               [](const V& x) {
                 const AD t = sqrt(x[0]);
                 return select(x[0] < 1e-8, 0.5 - x[0] / 24 + x[0] * x[0] / 720, (1 - cos(t)) / (t * t));
               },
               {0},
               0.5,
               {-1.0 / 24},
               {1.0 / 360}});
  c.push_back(
      {"a dead branch of a dead branch",
       [](const V& x) { return select(x[0] > 0, select(x[0] > 1, log(x[0] - 1), sqrt(x[0])), x[0] * x[0]); },
       {0},
       0,
       {0},
       {2}});
  c.push_back({"dead and live users of one pole",
               [](const V& x) {
                 const AD s = sqrt(x[0]);
                 return select(x[0] > 0, s, 0) + select(x[0] > 0, s * x[1], x[1] * x[1]);
               },
               {0, 3},
               9,
               {0, 6},
               {0, 0, 0, 2}});
  c.push_back({"comparison with NaN takes the other branch",
               [](const V& x) { return select(x[0] < 1, x[0], 2 * x[1]); },
               {kNan, 1},
               2,
               {0, 2},
               {0, 0, 0, 0}});
  c.push_back({"0 == -0",
               [](const V& x) { return select(x[0] == x[1], x[0] + 1, x[1]); },
               {0.0, -0.0},
               1,
               {1, 0},
               {0, 0, 0, 0}});
  c.push_back({"comparison of infinities",
               [](const V& x) { return select(x[0] <= x[1], x[2], -x[2]); },
               {-kInf, kInf, 5},
               5,
               {0, 0, 1},
               {}});
}

}  // namespace

Function EdgeCase::recorded() const {
  return record(name, x.size(), [this](const V& v) { return V::Constant(1, f(v)); });
}

std::vector<EdgeCase> edge_cases() {
  Cases cases;
  for (auto add :
       {add_exponentials, add_roots, add_steps, add_powers, add_angles, add_zeros, add_selections}) {
    add(cases);
  }
  for (const EdgeCase& extreme : extreme_cases()) cases.push_back(extreme);
  return cases;
}

bool agrees(double got, double expected, double scale) {
  if (std::isnan(expected)) return std::isnan(got);
  if (std::isinf(expected)) return got == expected;
  return std::abs(got - expected) <= std::max(1e-14 * std::abs(expected), 1e-15 * scale);
}

}  // namespace dyntape::testing
