// SPDX-License-Identifier: BSD-3-Clause
//
// The swing-up of an acrobot, which has very many local optima: three of them by their digits.  Finer meshes and a
// multi-start are in tests/full/solves/known_optima.cpp.
#include "interface/control/known_problems.h"

namespace dyntape::known_acrobot_test {
namespace {

using test::has_digits;
using test::solve_on;
using test::Solved;

SolverOptions sharp(NlpMethod method) { return {.method = method, .tolerance = 1e-11}; }

class KnownAcrobot : public ::testing::TestWithParam<NlpMethod> {};
INSTANTIATE_TEST_SUITE_P(By, KnownAcrobot, ::testing::Values(NlpMethod::kIpopt, NlpMethod::kRiccati),
                         test::method_name);

TEST_P(KnownAcrobot, ThreeBasinsFromTheirStarts) {
  struct Row {
    int intervals;
    const char *c, *d, *e;
  };
  for (const auto& [n, c, d, e] : {Row{40, "34.87434450", "18.50413331", "17.17967370"},
                                   {80, "34.91826825", "18.54182494", "17.69043123"}}) {
    for (const auto& [problem, cost, most] :
         {std::tuple(test::acrobot_c(), c, 12), {test::acrobot_d(), d, 85}, {test::acrobot_e(n), e, 30}}) {
      const Solved s = solve_on(problem, {.intervals = n}, sharp(GetParam()));
      EXPECT_TRUE(s.success()) << n << " " << to_string(s.nlp.status);
      EXPECT_TRUE(has_digits(s.cost(), cost)) << n;
      EXPECT_LE(s.nlp.iterations(), most) << cost;
    }
  }
}

// From each mesh to the next: 4, 3, 2 iterations in basin C.
TEST_P(KnownAcrobot, WarmMeshes) {
  Solved c = solve_on(test::acrobot_c(), {.intervals = 40}, sharp(GetParam()));
  for (const auto& [n, cost, most] :
       {std::tuple(80, "34.91826825", 5), {160, "34.91868376", 4}, {320, "34.91877836", 3}}) {
    c = solve_on(test::acrobot_c(), {.intervals = n}, sharp(GetParam()), &c.motion);
    EXPECT_TRUE(c.success() && has_digits(c.cost(), cost)) << n << " " << c.cost();
    EXPECT_LE(c.nlp.iterations(), most) << n;
  }
}

// The straight line, as start, is led to a swing-up that costs more than twice as much.
TEST_P(KnownAcrobot, FromTheLine) {
  const auto line =
      test::acrobot([](double t) -> Eigen::Vector2d { return Eigen::Vector2d::Constant(test::kPi * t / 2); },
                    [](double) -> Eigen::Vector2d { return Eigen::Vector2d::Zero(); });
  for (const auto& [n, cost] : {std::pair(40, "77.8175"), {80, "77.8509"}}) {
    const Solved s = solve_on(line, {.intervals = n}, sharp(GetParam()));
    EXPECT_TRUE(s.success() && has_digits(s.cost(), cost)) << n << " " << s.cost();
    EXPECT_LE(s.nlp.iterations(), 130);
  }
}

}  // namespace
}  // namespace dyntape::known_acrobot_test
