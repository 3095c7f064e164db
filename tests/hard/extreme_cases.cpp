// SPDX-License-Identifier: BSD-3-Clause
//
// Functions at extremes: very large and very small arguments, the ends of their ranges, zeros of both signs.
#include <cmath>
#include <limits>

#include <dyntape/dynamics/algebra/float128.h>

#include "edge_cases.h"

namespace dyntape::testing {
namespace extreme {
namespace {

using V = VectorXad;
using Cases = std::vector<EdgeCase>;
using Quad = dynamics::Float128;
using std::cos, std::sin, std::tan;  // of `long double`
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr double kLeast = std::numeric_limits<double>::denorm_min();
const double kPi = std::acos(-1.0);

void add_angles(Cases& c) {
  for (const double t : {1e8, -1e15, 1e22, 1e300}) {
    const double s = double(sin(Quad(t))), k = double(cos(Quad(t)));
    const std::string at = " at " + std::to_string(int(std::log10(std::abs(t)))) + " digits";
    c.push_back({"sin" + at, [](const V& x) { return sin(x[0]); }, {t}, s, {k}, {-s}});
    c.push_back({"cos" + at, [](const V& x) { return cos(x[0]); }, {t}, k, {-s}, {-k}});
    const double r = double(tan(Quad(t)));
    c.push_back(
        {"tan" + at, [](const V& x) { return tan(x[0]); }, {t}, r, {1 + r * r}, {2 * r * (1 + r * r)}});
  }
  const double below = 1 - kEps, slope = 1 / std::sqrt(kEps * (1 + below));
  c.push_back({"acos at -1", [](const V& x) { return acos(x[0]); }, {-1}, kPi, {-kInf}, {}});
  c.push_back({"asin at -1", [](const V& x) { return asin(x[0]); }, {-1}, -kPi / 2, {kInf}, {}});
  c.push_back(
      {"acos just below 1", [](const V& x) { return acos(x[0]); }, {below}, std::acos(below), {-slope}, {}});
  c.push_back(
      {"asin just below 1", [](const V& x) { return asin(x[0]); }, {below}, std::asin(below), {slope}, {}});
  c.push_back({"acos beyond 1", [](const V& x) { return acos(x[0]); }, {1 + 2 * kEps}, kNan, {kNan}, {}});
  c.push_back({"the angle of equal unit vectors through atan2",
               [](const V& x) { return atan2(x[1], x[0]); },
               {1 + 2 * kEps, 0},
               0,
               {0, 1 / (1 + 2 * kEps)},
               {}});
  const auto angle = [](const V& x) { return atan2(x[0], x[1]); };
  c.push_back({"atan2(0, -0)", angle, {0.0, -0.0}, kPi, {kNan, kNan}, {}});
  c.push_back({"atan2(-0, -0)", angle, {-0.0, -0.0}, -kPi, {kNan, kNan}, {}});
  c.push_back({"atan2(-0, 1)", angle, {-0.0, 1}, 0, {1, 0}, {0, -1, -1, 0}});
  c.push_back({"atan of a large number", [](const V& x) { return atan(x[0]); }, {1e200}, kPi / 2, {0}, {0}});
  c.push_back({"fmod of a large number",
               [](const V& x) { return fmod(x[0], x[1]); },
               {1e300, 3},
               std::fmod(1e300, 3),
               {1, -std::trunc(1e300 / 3)},
               {}});
}

void add_powers(Cases& c) {
  const auto power = [](double p) { return [p](const V& x) { return pow(x[0], p); }; };
  c.push_back({"pow(x, 1.875) at 0", power(1.875), {0}, 0, {0}, {kInf}});
  c.push_back({"pow(x, -0.5) at 0", power(-0.5), {0}, kInf, {-kInf}, {kInf}});
  c.push_back({"pow(x, 1/3) at -8", power(1 / 3.0), {-8}, kNan, {kNan}, {kNan}});
  c.push_back({"pow(x, 2) at -1e-200", power(2), {-1e-200}, 0, {-2e-200}, {2}});
  c.push_back({"pow(x, 17) at -2", power(17), {-2}, -131072, {1114112}, {-8912896}});
  c.push_back({"x^0.3 y^0.7 at (0, 1)",
               [](const V& x) { return pow(x[0], 0.3) * pow(x[1], 0.7); },
               {0, 1},
               0,
               {kInf, 0},
               {}});
  c.push_back({"cbrt of a negative number",
               [](const V& x) { return cbrt(x[0]); },
               {-8},
               -2,
               {1 / 12.0},
               {1 / 144.0}});
  c.push_back({"sqrt of the smallest number",
               [](const V& x) { return sqrt(x[0]); },
               {kLeast},
               std::sqrt(kLeast),
               {0.5 / std::sqrt(kLeast)},
               {}});
  c.push_back({"sqrt of infinity", [](const V& x) { return sqrt(x[0]); }, {kInf}, kInf, {0}, {}});
  c.push_back({"hypot of large numbers",
               [](const V& x) { return hypot(x[0], x[1]); },
               {3e200, -4e200},
               5e200,
               {0.6, -0.8},
               {}});
  c.push_back({"hypot of small numbers",
               [](const V& x) { return hypot(x[0], x[1]); },
               {3e-200, 4e-200},
               5e-200,
               {0.6, 0.8},
               {}});
  c.push_back({"sqrt(x x + y y) at the origin is no norm",
               [](const V& x) { return sqrt(x[0] * x[0] + x[1] * x[1]); },
               {0, 0},
               0,
               {kNan, kNan},
               {}});
  c.push_back({"x . x does not go through a root",
               [](const V& x) { return x.squaredNorm(); },
               {0, 0, 0},
               0,
               {0, 0, 0},
               {2, 0, 0, 0, 2, 0, 0, 0, 2}});
  c.push_back({"x |x| at 0", [](const V& x) { return x[0] * abs(x[0]); }, {0}, 0, {0}, {0}});
}

void add_saturation(Cases& c) {
  const auto softplus = [](const V& x) { return max(x[0], 0.0) + log1p(exp(-abs(x[0]))); };
  c.push_back({"softplus at 800", softplus, {800}, 800, {1}, {0}});
  c.push_back({"softplus at -800", softplus, {-800}, 0, {0}, {0}});
  c.push_back(
      {"softplus at 30", softplus, {30}, 30 + std::log1p(std::exp(-30.0)), {1 / (1 + std::exp(-30.0))}, {}});
  const auto logistic = [](const V& x) { return 0.5 + 0.5 * tanh(0.5 * x[0]); };
  c.push_back({"logistic at 800", logistic, {800}, 1, {0}, {0}});
  c.push_back({"logistic at -800", logistic, {-800}, 0, {0}, {0}});
  const auto sharp = [](const V& x) { return tanh(x[0] / 1e-9); };
  const double t = std::tanh(1.0);
  c.push_back({"tanh(v / 1e-9) at 1", sharp, {1}, 1, {0}, {0}});
  c.push_back({"tanh(v / 1e-9) at its width", sharp, {1e-9}, t, {(1 - t * t) / 1e-9}, {}});
  c.push_back({"exp underflows", [](const V& x) { return exp(x[0]); }, {-746}, 0, {0}, {0}});
  c.push_back({"exp overflows", [](const V& x) { return exp(x[0]); }, {710}, kInf, {kInf}, {kInf}});
  c.push_back({"expm1 far below", [](const V& x) { return expm1(x[0]); }, {-1000}, -1, {0}, {0}});
  c.push_back(
      {"expm1 of next to nothing", [](const V& x) { return expm1(x[0]); }, {1e-300}, 1e-300, {1}, {1}});
  c.push_back({"log1p at -1", [](const V& x) { return log1p(x[0]); }, {-1}, -kInf, {kInf}, {-kInf}});
  c.push_back({"log10 at 0", [](const V& x) { return log10(x[0]); }, {0}, -kInf, {kInf}, {}});
  c.push_back({"log of the smallest number",
               [](const V& x) { return log(x[0]); },
               {kLeast},
               std::log(kLeast),
               {kInf},
               {}});  // 1 / x overflows
  c.push_back({"sinh overflows", [](const V& x) { return sinh(x[0]); }, {-711}, -kInf, {kInf}, {-kInf}});
  c.push_back({"cosh just below overflow",
               [](const V& x) { return cosh(x[0]); },
               {710},
               std::cosh(710.0),
               {std::sinh(710.0)},
               {std::cosh(710.0)}});
  c.push_back({"asinh of a large number",
               [](const V& x) { return asinh(x[0]); },
               {1e200},
               std::asinh(1e200),
               {1e-200},
               {}});
  c.push_back(
      {"asinh of next to nothing", [](const V& x) { return asinh(x[0]); }, {1e-200}, 1e-200, {1}, {}});
  c.push_back({"acosh at 1", [](const V& x) { return acosh(x[0]); }, {1}, 0, {kInf}, {}});
  c.push_back({"atanh at -1", [](const V& x) { return atanh(x[0]); }, {-1}, -kInf, {kInf}, {}});
  c.push_back({"erf at 0", [](const V& x) { return erf(x[0]); }, {0}, 0, {2 / std::sqrt(kPi)}, {0}});
  c.push_back({"erfc far to the left", [](const V& x) { return erfc(x[0]); }, {-40}, 2, {0}, {0}});
}

void add_steps(Cases& c) {
  c.push_back({"round of the number below a half",
               [](const V& x) { return round(x[0]); },
               {0.49999999999999994},
               0,
               {0},
               {0}});
  c.push_back({"round at a half", [](const V& x) { return round(x[0]); }, {0.5}, 1, {0}, {0}});
  c.push_back({"floor at a whole number", [](const V& x) { return floor(x[0]); }, {3}, 3, {0}, {0}});
  c.push_back({"ceil at a whole number", [](const V& x) { return ceil(x[0]); }, {-3}, -3, {0}, {0}});
  c.push_back(
      {"trunc of a large number", [](const V& x) { return trunc(x[0]); }, {-1e300}, -1e300, {0}, {0}});
  c.push_back({"sign at -0", [](const V& x) { return sign(x[0]); }, {-0.0}, 0, {0}, {0}});
  c.push_back(
      {"sign of the smallest number", [](const V& x) { return sign(x[0]); }, {-kLeast}, -1, {0}, {0}});
  c.push_back({"max of -0 and 0: the first",
               [](const V& x) { return max(x[0], x[1]); },
               {-0.0, 0.0},
               0,
               {1, 0},
               {0, 0, 0, 0}});
  c.push_back(
      {"max(NaN, 1) keeps the NaN", [](const V& x) { return max(x[0], x[1]); }, {kNan, 1}, kNan, {}, {}});
  c.push_back({"min of three equal numbers: the first",
               [](const V& x) { return min(x[0], min(x[1], x[2])); },
               {2, 2, 2},
               2,
               {1, 0, 0},
               {}});
}

void add_rounding(Cases& c) {
  c.push_back({"the error of a sum",
               [](const V& x) {
                 const AD s = x[0] + x[1], b = s - x[0];
                 return (x[0] - (s - b)) + (x[1] - b);
               },
               {1, 1e-17},
               1e-17,
               {0, 0},
               {0, 0, 0, 0}});
  c.push_back({"the error of a product",
               [](const V& x) {
                 const AD p = x[0] * x[1];
                 return fma(x[0], x[1], -p);
               },
               {1 + 0x1p-30, 1 - 0x1p-30},
               -0x1p-60,
               {0, 0},
               {}});
  c.push_back({"a compensated sum",
               [](const V& x) {
                 AD sum = x[0], rest = 0;
                 for (int k = 1; k < 3; ++k) {
                   const AD y = x[k] - rest, t = sum + y;
                   rest = (t - sum) - y;
                   sum = t;
                 }
                 return sum - rest;
               },
               {1, 0x1p-53, 0x1p-53},
               1 + kEps,
               {1, 1, 1},
               {}});
  c.push_back({"1 / x next to overflow", [](const V& x) { return 1 / x[0]; }, {1e-310}, kInf, {-kInf}, {}});
  c.push_back({"x / y of numbers next to nothing",
               [](const V& x) { return x[0] / x[1]; },
               {3e-310, 1e-310},
               3e-310 / 1e-310,
               {kInf, -kInf},
               {}});
  c.push_back({"(x - y)(x + y) where x x - y y loses all",
               [](const V& x) { return (x[0] - x[1]) * (x[0] + x[1]); },
               {1 + kEps, 1},
               kEps * (2 + kEps),
               {2 * (1 + kEps), -2},
               {2, 0, 0, -2}});
}

}  // namespace
}  // namespace extreme

std::vector<EdgeCase> extreme_cases() {
  extreme::Cases cases;
  for (auto add : {extreme::add_angles, extreme::add_powers, extreme::add_saturation, extreme::add_steps,
                   extreme::add_rounding}) {
    add(cases);
  }
  return cases;
}

}  // namespace dyntape::testing
