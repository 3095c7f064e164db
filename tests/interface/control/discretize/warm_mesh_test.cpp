// SPDX-License-Identifier: BSD-3-Clause
//
// The multipliers of one mesh as a start on another (with_multipliers_of() in resampled.h).
#include <gtest/gtest.h>

#include <numeric>

#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/control/solve/solve.h>
#include "interface/control/ocp_problems.h"

namespace dyntape::warm_mesh_test {
namespace {

using test::kInterpreted;

// Least effort over a distance of one from rest to rest in a second: |u| <= 6, and as a row v <= 1.4.
Problem limited_speed() {
  Problem p("limited speed", {"x", "v"}, {"u"}, 1, [](const auto& s) { return vector(s.x[1], s.u[0]); });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.u.lower[0] = -6, p.u.upper[0] = 6;
  p.add(path_inequality(
      "speed", [](const auto& s) { return s.x[1]; }, Eigen::VectorXd::Constant(1, -HUGE_VAL),
      Eigen::VectorXd::Constant(1, 1.4)));
  p.start << 0, 0;
  p.goal << 1, 0;
  return p;
}

StagedNlp on_mesh(const std::string& scheme, int intervals) {
  MeshOptions mesh{.scheme = scheme_by_name(scheme), .intervals = intervals};
  mesh.evaluation = kInterpreted;
  return discretize(limited_speed(), mesh);
}

NlpSolution solved(StagedNlp& nlp) {
  NlpSolution s = solve_nlp(nlp, nlp.start(), {.method = NlpMethod::kRiccati});
  EXPECT_EQ(s.status, SolveStatus::kSolved);
  return s;
}

std::vector<double> of_rows(const StagedNlp& nlp, const std::vector<double>& lambda, RowBlock::Kind kind) {
  std::vector<double> all;
  for (const RowBlock& block : nlp.program().rows)
    if (block.kind == kind) all.insert(all.end(), &lambda[block.row], &lambda[block.row] + block.size);
  return all;
}

double sum(const std::vector<double>& v) { return std::accumulate(v.begin(), v.end(), 0.0); }

class WarmMesh : public ::testing::TestWithParam<const char*> {};

TEST_P(WarmMesh, TheSameMeshHasTheSameMultipliers) {
  StagedNlp nlp = on_mesh(GetParam(), 10);
  const NlpSolution s = solved(nlp), warm = with_multipliers_of(nlp, s, nlp, s.x);
  const auto expect_equal = [](const std::vector<double>& a, const std::vector<double>& b) {
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-12 * (1 + std::abs(b[i]))) << i;
  };
  EXPECT_EQ(warm.x, s.x);
  for (const RowBlock::Kind kind : {RowBlock::Kind::kPath, RowBlock::Kind::kInstant})
    expect_equal(of_rows(nlp, warm.lambda, kind), of_rows(nlp, s.lambda, kind));
  for (const double lambda : of_rows(nlp, warm.lambda, RowBlock::Kind::kDefect))
    EXPECT_TRUE(std::isnan(lambda));
  const StagedPhase& phase = nlp.phase();
  for (std::size_t p = phase.first_used; p < phase.first_used + phase.used; ++p) {
    for (std::size_t i = phase.variable_of(p); i < phase.variable_of(p + 1); ++i) {
      EXPECT_NEAR(warm.lower_multiplier[i], s.lower_multiplier[i], 1e-12 * (1 + s.lower_multiplier[i])) << i;
      EXPECT_NEAR(warm.upper_multiplier[i], s.upper_multiplier[i], 1e-12 * (1 + s.upper_multiplier[i])) << i;
    }
  }
}

// The integral over time is nearly that of the coarse mesh.  Without the weights of the quadrature, twice as many points would have twice
// the sum.
TEST_P(WarmMesh, AFinerMeshSharesThem) {
  StagedNlp coarse = on_mesh(GetParam(), 20), fine = on_mesh(GetParam(), 40);
  const NlpSolution before = solved(coarse), after = solved(fine);
  const NlpSolution warm = with_multipliers_of(coarse, before, fine, after.x);
  const double of_coarse = sum(of_rows(coarse, before.lambda, RowBlock::Kind::kPath));
  EXPECT_GT(of_coarse, 0.1);
  EXPECT_NEAR(sum(of_rows(fine, warm.lambda, RowBlock::Kind::kPath)), of_coarse, 0.4 * of_coarse);
  EXPECT_NEAR(sum(of_rows(fine, after.lambda, RowBlock::Kind::kPath)), of_coarse, 0.1 * of_coarse);
  EXPECT_NEAR(sum(warm.upper_multiplier), sum(before.upper_multiplier), 0.4 * sum(before.upper_multiplier));
}

TEST_P(WarmMesh, ASolveFromThemIsShortAndEndsAtTheSameOptimum) {
  StagedNlp coarse = on_mesh(GetParam(), 20), fine = on_mesh(GetParam(), 40);
  const NlpSolution before = solved(coarse), cold = solved(fine);
  const std::vector<double> x = warm_start({coarse.trajectory(before.x)}, fine);
  SolverOptions options{.method = NlpMethod::kRiccati, .try_other_method = false};
  options.warm = std::make_shared<const NlpSolution>(with_multipliers_of(coarse, before, fine, x));
  const NlpSolution s = solve_nlp(fine, x, options);
  EXPECT_EQ(s.status, SolveStatus::kSolved);
  EXPECT_EQ(s.attempts.size(), 1u);
  EXPECT_NEAR(s.objective, cold.objective, 1e-6);
  EXPECT_LT(s.iterations(), 0.7 * cold.iterations()) << s.iterations() << " of " << cold.iterations();
}

INSTANTIATE_TEST_SUITE_P(By, WarmMesh,
                         ::testing::Values("hermite-simpson", "trapezoid", "lobatto-4", "radau-2"));

// From one phase to the next.
TEST(WarmMeshOfPhases, LinksKeepTheirMultipliers) {
  Problem first = limited_speed(), second = limited_speed();
  first.goal << Problem::kFree, Problem::kFree;
  second.start << Problem::kFree, Problem::kFree;
  second.goal << 2, 0;
  Phases phases("there");
  phases.add("first", first);
  phases.add("second", second);
  MeshOptions mesh{.intervals = 10};
  mesh.evaluation = kInterpreted;
  StagedNlp coarse = discretize(phases, {mesh});
  mesh.intervals = 20;
  StagedNlp fine = discretize(phases, {mesh});
  const NlpSolution s = solve_nlp(coarse, coarse.start(), {.method = NlpMethod::kRiccati});
  ASSERT_EQ(s.status, SolveStatus::kSolved);
  const NlpSolution warm = with_multipliers_of(coarse, s, fine, fine.start());
  EXPECT_EQ(of_rows(fine, warm.lambda, RowBlock::Kind::kLink),
            of_rows(coarse, s.lambda, RowBlock::Kind::kLink));
  EXPECT_EQ(of_rows(fine, warm.lambda, RowBlock::Kind::kPath).size(),
            of_rows(fine, std::vector<double>(fine.shape().m()), RowBlock::Kind::kPath).size());
}

}  // namespace
}  // namespace dyntape::warm_mesh_test
