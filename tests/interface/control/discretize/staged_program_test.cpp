// SPDX-License-Identifier: BSD-3-Clause
//
// The staged program as a value: blocks are all its rows, stages are those of its rows, copies and other meshes mean the same.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include <dyntape/interface/control/solve/optimise.h>
#include "interface/control/evaluated.h"
#include "interface/control/ocp_problems.h"

namespace dyntape::staged_program_test {
namespace {

using Eigen::VectorXd;

// Two phases with an impact between them, closed by a link: every kind of row.
Phases bouncing() {
  Problem fall = test::swing_up(1.0), rise = fall;
  fall.goal.setConstant(Problem::kFree), rise.start.setConstant(Problem::kFree);
  fall.add(path_inequality(
      "power", [](const auto& s) { return s.u[0] * s.x[2]; }, VectorXd::Constant(1, -40.),
      VectorXd::Constant(1, 40.)));
  rise.add(at_fraction(0.5, path_equality("via", [](const auto& s) { return s.x[0] - 0.5; })));
  Phases phases("bouncing");
  phases.add("fall", fall);
  phases.add("rise", rise, [](const auto& s) {
    auto next = s.x;
    next[2] = next[2] * (-0.5);
    return next;
  });
  phases.close();
  return phases;
}

std::vector<MeshOptions> meshes(const std::string& scheme) {
  const Scheme own = scheme_by_name(scheme);
  return {{.scheme = own, .intervals = own.spans_all ? 1 : 4, .evaluation = test::kInterpreted},
          {.scheme = own,
           .nodes = own.spans_all ? std::vector<double>{0, 2} : std::vector<double>{0, .6, 1, 2},
           .evaluation = test::kInterpreted}};
}

std::vector<double> random_point(const StagedNlp& nlp, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> near(-0.3, 0.3);
  std::vector<double> x = nlp.start();
  for (double& value : x) value += near(random);
  return x;
}

class Staged : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(Scheme, Staged,
                         ::testing::Values("euler", "trapezoid", "hermite-simpson", "lobatto-4", "radau-3"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST_P(Staged, BlocksAreAllRowsInTheirOrderEachOfItsStages) {
  const StagedNlp nlp = discretize(bouncing(), meshes(GetParam()));
  const StagedProgram& program = nlp.program();
  const NlpShape& shape = nlp.shape();
  std::vector<std::size_t> first(shape.m(), SIZE_MAX), last(shape.m(), 0);
  for (std::size_t e = 0; e < shape.jacobian.nnz(); ++e) {
    const auto behind = std::upper_bound(shape.stages.begin(), shape.stages.end(), shape.jacobian.col[e]);
    const auto stage = std::size_t(behind - shape.stages.begin()) - 1;
    std::size_t& low = first[shape.jacobian.row[e]];
    low = std::min(low, stage), last[shape.jacobian.row[e]] = std::max(last[shape.jacobian.row[e]], stage);
  }
  std::size_t row = 0, kinds = 0;
  for (const RowBlock& block : program.rows) {
    ASSERT_EQ(block.row, row);
    ASSERT_GT(block.size, 0u);
    ASSERT_LT(block.first_term, block.last_term);
    kinds |= std::size_t{1} << std::size_t(block.kind);
    for (std::size_t i = 0; i < block.size; ++i, ++row) {
      const bool closes = block.kind == RowBlock::Kind::kLink && program.links[block.place].to == 0;
      const bool is_of_interval =
          block.kind == RowBlock::Kind::kDefect || block.kind == RowBlock::Kind::kControl;
      if (!closes) {
        EXPECT_LE(last[row] - first[row], is_of_interval || block.kind == RowBlock::Kind::kLink ? 1u : 0u)
            << nlp.constraint_name(row);
      }
      EXPECT_FALSE(nlp.constraint_name(row).empty());
    }
  }
  EXPECT_EQ(row, shape.m());
  const bool has_control_rows = program.phases.front().scheme().held.rows() > 0;
  EXPECT_EQ(kinds, has_control_rows ? 0b11111u : 0b11101u);
}

// g from blocks and what plain functions give at every point.
TEST_P(Staged, RowsAreWhatTheirTermsSayOfPlainFunctions) {
  StagedNlp nlp = discretize(bouncing(), meshes(GetParam()));
  const StagedProgram& program = nlp.program();
  const std::vector<double> x = random_point(nlp, 5);
  const Evaluated found = evaluated(nlp, x);
  for (const RowBlock& block : program.rows) {
    if (block.kind != RowBlock::Kind::kDefect) continue;
    const StagedPhase& phase = program.phases[block.phase];
    const Scheme& scheme = phase.scheme();
    VectorXd sum = VectorXd::Zero(Eigen::Index(phase.n_x));
    for (std::size_t j = 0; j <= phase.stride; ++j) {
      const std::size_t point = block.place * phase.stride + j;
      const auto z = VectorXd::Map(x.data() + phase.variable_of(point), Eigen::Index(phase.n_z));
      const VectorXd state = z.head(phase.problem.n_x()), u = z.tail(phase.problem.n_u());
      sum += scheme.alpha(long(block.part), long(j)) * state;
      const double beta = phase.step(block.place) * scheme.beta(long(block.part), long(j));
      if (beta != 0) sum += beta * phase.problem.rate(phase.problem.stage(phase.t[point], state, {}, u));
    }
    for (Eigen::Index i = 0; i < sum.size(); ++i)
      EXPECT_NEAR(found.g[block.row + std::size_t(i)], sum[i], 1e-12 * (1 + std::abs(sum[i])))
          << nlp.constraint_name(block.row + std::size_t(i));
  }
}

TEST_P(Staged, ACopyAndTheSameNodesMeanTheSame) {
  const StagedProgram program = discretize(bouncing(), meshes(GetParam()));
  StagedNlp nlp = program, copy = program;
  std::vector<std::vector<double>> nodes;
  for (const StagedPhase& phase : program.phases) {
    nodes.emplace_back();
    for (std::size_t k = 0; k <= phase.intervals; ++k) nodes.back().push_back(phase.t[k * phase.stride]);
  }
  StagedNlp again = discretize(program, nodes);
  const std::vector<double> x = random_point(nlp, 9);
  const Evaluated found = evaluated(nlp, x);
  EXPECT_EQ(evaluated(copy, x), found);
  EXPECT_EQ(evaluated(again, x), found);
  EXPECT_EQ(again.shape().jacobian, nlp.shape().jacobian);
  for (std::size_t j = 0; j < nlp.shape().m(); ++j)
    EXPECT_EQ(again.constraint_name(j), nlp.constraint_name(j));
  const NlpScaling scaling = nlp.scaling(x), of_again = again.scaling(x);
  EXPECT_EQ(scaling.x, of_again.x);
  EXPECT_EQ(scaling.g, of_again.g);
}

// What a link's function reads changes with the phase before it, and stays changed on other nodes.
TEST(StagedLinks, ReadTheParametersOfNow) {
  Parameters parameters;
  const Parameter bounce = parameters.add("bounce", 0.5);
  Problem before = test::block_move(), after = before;
  before.parameters = parameters;
  before.goal << 1, Problem::kFree;
  after.start.setConstant(Problem::kFree);
  after.goal << 2, 0;
  Phases phases("bouncing");
  phases.add("before", before);
  phases.add("after", after, [bounce](const auto& s) { return vector(s.x[0], bounce(s)[0] * s.x[1]); });
  StagedNlp nlp = discretize(phases, {{.intervals = 6, .evaluation = test::kInterpreted}});
  Problem now = nlp.problem();
  now.parameters.set("bounce", 0.9);
  nlp.set_values(now);
  StagedNlp finer = discretize(nlp.program(), {{0, 0.25, 0.5, 1}, {0, 0.5, 0.75, 1}});
  for (StagedNlp* each : {&nlp, &finer}) {
    const Solution s = optimise(*each, each->start(), {});
    EXPECT_TRUE(s.success()) << describe(s.nlp.status);
    const Trajectory &first = s.phases[0].motion, &second = s.phases[1].motion;
    EXPECT_NEAR(second.x(1, 0), 0.9 * first.x(1, first.points() - 1), 1e-7);
  }
}

// A violation that is no number is no success, whatever phases and links before and behind it say.
TEST(WholeVerification, NothingIsWorseThanWhatIsNoNumber) {
  const double nan = std::nan("");
  const auto phases = [](std::initializer_list<double> violations) {
    std::vector<SolvedPhase> all;
    for (double violation : violations) {
      all.push_back({"p", 0, {}, {}});
      all.back().verification.violation = all.back().verification.worst_relative = violation;
      all.back().verification.worst_defect = all.back().verification.miss = violation;
    }
    return all;
  };
  EXPECT_TRUE(std::isnan(whole_verification(phases({nan}), 0).violation));
  EXPECT_TRUE(std::isnan(whole_verification(phases({0, 0}), nan).violation));
  for (const auto& some : {phases({nan, 0}), phases({0, nan}), phases({1, nan, 2})}) {
    const Verification v = whole_verification(some, 0);
    EXPECT_TRUE(std::isnan(v.violation) && std::isnan(v.worst_relative) && std::isnan(v.worst_defect) &&
                std::isnan(v.miss));
  }
  Problem p = test::block_move();
  p.add(path_inequality(
      "odd",
      [](const auto& s) {
        using S = std::decay_t<decltype(s.t)>;
        if constexpr (std::is_same_v<S, double>)
          return vector(s.t > 0.4 && s.t < 0.6 ? std::nan("") : 0.);
        else
          return vector(S(s.x[0]));
      },
      VectorXd::Constant(1, -10.), VectorXd::Constant(1, 10.)));
  EXPECT_FALSE(optimise(p, {.mesh = {.intervals = 10, .evaluation = test::kInterpreted}}).success());
}

// Steps are as long as the intervals of the mesh, whatever rounding its nodes have.
TEST(MultipleShooting, NodesThatMissTheDurationByRoundingMeanTheSame) {
  const auto cost = [](double end) {
    const Solution s = optimise(test::block_move(1, 2), {.mesh = {.scheme = scheme_by_name("runge-kutta-4"),
                                                                  .nodes = {0, 0.3, 0.9, 1.1, end},
                                                                  .evaluation = test::kInterpreted}});
    EXPECT_TRUE(s.success()) << s.verification.violation;
    return s.cost();
  };
  EXPECT_NEAR(cost(2 - 1e-12), cost(2), 1e-9);
  Problem free = test::block_move(1, 1.1);
  free.free_duration(1.1 / 3, 3.3);
  free.add(at_fraction(1. / 3, path_inequality(
                                   "via", [](const auto& s) { return vector(s.x[0]); },
                                   VectorXd::Constant(1, -9.), VectorXd::Constant(1, 9.))));
  const Solution s = optimise(free, {.mesh = {.scheme = scheme_by_name("runge-kutta-4"),
                                              .intervals = 5,
                                              .evaluation = test::kInterpreted}});
  EXPECT_LT(s.verification.violation, 1e-7);
}

}  // namespace
}  // namespace dyntape::staged_program_test
