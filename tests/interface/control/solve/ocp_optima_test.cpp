// SPDX-License-Identifier: BSD-3-Clause
//
// Known optima of problems written by hand.
#include <gtest/gtest.h>

#include <dyntape/interface/control/discretize/staged_nlp.h>
#include "interface/control/known_problems.h"

namespace dyntape::ocp_optima_test {
namespace {

using test::tight;

NlpSolution solve_on(const Problem& problem, const Scheme& scheme, int intervals,
                     const SolverOptions& options, HessianKind hessian = HessianKind::kExact) {
  StagedNlp nlp = discretize(
      problem,
      {.scheme = scheme, .intervals = intervals, .hessian = hessian, .evaluation = test::kInterpreted});
  return solve_nlp(nlp, nlp.start(), options);
}

class Optima : public ::testing::TestWithParam<NlpMethod> {};
INSTANTIATE_TEST_SUITE_P(By, Optima, ::testing::Values(NlpMethod::kIpopt, NlpMethod::kRiccati),
                         [](const auto& info) {
                           return info.param == NlpMethod::kIpopt ? "ipopt" : "riccati";
                         });

TEST_P(Optima, BlockMoveHermiteSimpsonIsExactAtAnyMesh) {
  for (int n : {1, 2, 3, 5, 10, 40}) {
    const NlpSolution s = solve_on(test::block_move(), hermite_simpson(), n, tight(GetParam()));
    EXPECT_EQ(s.status, SolveStatus::kSolved) << n;
    EXPECT_NEAR(s.objective, 12.0, 1e-10) << n;
  }
}

TEST_P(Optima, BlockMoveTrapezoidAndEulerHaveClosedForms) {
  for (int n : {2, 5, 10, 20}) {
    const NlpSolution t = solve_on(test::block_move(), trapezoid(), n, tight(GetParam()));
    EXPECT_EQ(t.status, SolveStatus::kSolved) << n;
    EXPECT_NEAR(t.objective, 12.0 * n * n * n / ((n - 1.0) * (n * n + n - 3.0)), 1e-9) << n;
    const NlpSolution e = solve_on(test::block_move(), euler(), n, tight(GetParam()));
    EXPECT_EQ(e.status, SolveStatus::kSolved) << n;
    EXPECT_NEAR(e.objective, 12.0 * n * n / (n * n - 1.0), 1e-9) << n;
  }
}

TEST_P(Optima, CartPoleSwingUpFromTheStraightLine) {
  const NlpSolution coarse = solve_on(test::swing_up(), hermite_simpson(), 40, {.method = GetParam()});
  EXPECT_EQ(coarse.status, SolveStatus::kSolved);
  EXPECT_LE(coarse.iterations(), 16);
  EXPECT_NEAR(coarse.objective, 58.8075758975, 1e-7);
  const std::pair<int, double> known[] = {{160, 58.8076672550}, {320, 58.8076674456}, {640, 58.8076674574}};
  for (const auto& [n, cost] : known) {
    const NlpSolution s = solve_on(test::swing_up(), hermite_simpson(), n, tight(GetParam()));
    EXPECT_EQ(s.status, SolveStatus::kSolved) << n;
    EXPECT_NEAR(s.objective, cost, 1e-9) << n;
    std::printf("N = %d: %.10f, %d iterations, %.3f s, functions %.3f s, J %.3f s, H %.3f s\n", n,
                s.objective, s.iterations(), s.times.total, s.times.functions, s.times.jacobian,
                s.times.hessian);
  }
}

}  // namespace
}  // namespace dyntape::ocp_optima_test
