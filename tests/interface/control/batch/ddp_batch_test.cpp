// SPDX-License-Identifier: BSD-3-Clause
//
// Many solves side by side against each alone, and against DdpSolver.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/batch/ddp_batch.h>

#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"
#include "interface/temporary_cache.h"

namespace dyntape::ddp_batch_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::soft_swing_up;

MatrixXd random_starts(int count) {
  std::mt19937_64 numbers(7);
  return MatrixXd::NullaryExpr(4, count, [&] { return double(numbers() >> 11) * 0x1p-53 - 0.5; });
}

DdpOptions options_of(DdpHessian hessian) {
  return {.intervals = 25, .hessian = hessian, .evaluation = test::kInterpreted, .verify = false};
}

void expect_same_bits(const DdpSolution& a, const DdpSolution& b) {
  EXPECT_EQ(a.status, b.status);
  EXPECT_EQ(a.iterations.size(), b.iterations.size());
  EXPECT_EQ(a.cost, b.cost);
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.u, b.u);
  for (std::size_t k = 0; k < a.policy.size(); ++k) EXPECT_EQ(a.policy[k].K, b.policy[k].K) << k;
}

TEST(DdpBatch, EachTakesTheCourseOfDdpSolver) {
  constexpr int kCount = 11;
  const MatrixXd starts = random_starts(kCount);
  for (const double limit : {HUGE_VAL, 12.0}) {
    for (const DdpHessian hessian : {DdpHessian::kExact, DdpHessian::kGaussNewton}) {
      for (const DdpStart start : {DdpStart::kRollOut, DdpStart::kNodes}) {
        const Problem p = soft_swing_up(limit);
        DdpOptions options = options_of(hessian);
        options.start = start;
        const std::vector<DdpSolution> all = DdpBatch(p, options).solve({.starts = starts});
        DdpSolver solver(p, options);
        int same_minima = 0;
        for (int i = 0; i < kCount; ++i) {
          Problem now = p;
          now.start = starts.col(i);
          solver.set_values(now);
          const DdpSolution alone = solver.solve();
          EXPECT_EQ(all[std::size_t(i)].status, alone.status) << i;
          // Rounding leads a long search to another minimum now and then.
          const double off = (all[std::size_t(i)].u - alone.u).cwiseAbs().maxCoeff();
          same_minima += off < 1e-5;
          if (off < 1e-5) {
            EXPECT_NEAR(all[std::size_t(i)].cost, alone.cost, 1e-8 * alone.cost) << i;
          }
        }
        EXPECT_GE(same_minima, kCount - 1);
      }
    }
  }
}

TEST(DdpBatch, SameBitsInAnyCompanyAndAnyNumberOfThreads) {
  constexpr int kCount = 19;
  const MatrixXd starts = random_starts(kCount);
  for (const DdpHessian hessian : {DdpHessian::kExact, DdpHessian::kGaussNewton}) {
    const Problem p = soft_swing_up(12);
    const DdpBatch batch(p, options_of(hessian)), threads(p, options_of(hessian), 3);
    const std::vector<DdpSolution> all = batch.solve({.starts = starts});
    const std::vector<DdpSolution> shared = threads.solve({.starts = starts});
    const std::vector<DdpSolution> turned = batch.solve({.starts = starts.rowwise().reverse()});
    for (int i = 0; i < kCount; ++i) {
      const DdpSolution& s = all[std::size_t(i)];
      expect_same_bits(s, batch.solve({.starts = starts.col(i)})[0]);
      expect_same_bits(s, shared[std::size_t(i)]);
      expect_same_bits(s, turned[std::size_t(kCount - 1 - i)]);
    }
  }
}

// Functions of as many lanes as the processor has.
TEST(DdpBatch, CompiledLanesHaveTheBitsOfOneAlone) {
  const TemporaryCache cache;
  const MatrixXd starts = random_starts(10);
  DdpOptions options = options_of(DdpHessian::kExact);
  options.evaluation = {
      .functions = Functions::kPortable, .lanes = Lanes::kNative, .cache_folder = cache.path()};
  const DdpBatch batch(soft_swing_up(12), options);
  const std::vector<DdpSolution> all = batch.solve({.starts = starts});
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(all[std::size_t(i)].success());
    expect_same_bits(all[std::size_t(i)], batch.solve({.starts = starts.col(i)})[0]);
  }
}

TEST(DdpBatch, AFailureIsItsOwn) {
  MatrixXd starts = random_starts(10);
  starts(3, 4) = 1e300;
  const DdpBatch batch(soft_swing_up(12), options_of(DdpHessian::kExact));
  const std::vector<DdpSolution> all = batch.solve({.starts = starts});
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(all[std::size_t(i)].status, i == 4 ? SolveStatus::kNotFinite : SolveStatus::kSolved) << i;
    expect_same_bits(all[std::size_t(i)], batch.solve({.starts = starts.col(i)})[0]);
  }
}

TEST(DdpBatch, GainsAreSlopesOfTheSolutions) {
  constexpr double kStep = 1e-4;
  const MatrixXd at = random_starts(3);
  MatrixXd starts(4, 27);
  for (int i = 0; i < 3; ++i) {
    starts.middleCols(9 * i, 9).colwise() = VectorXd(at.col(i));
    for (int j = 0; j < 4; ++j) starts(j, 9 * i + 1 + j) += kStep, starts(j, 9 * i + 5 + j) -= kStep;
  }
  const std::vector<DdpSolution> all =
      DdpBatch(soft_swing_up(), options_of(DdpHessian::kExact)).solve({.starts = starts});
  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_TRUE(all[9 * i].is_minimum);
    const Eigen::MatrixXd& gain = all[9 * i].policy[0].K;
    for (std::size_t j = 0; j < 4; ++j) {
      const double slope = (all[9 * i + 1 + j].u(0, 0) - all[9 * i + 5 + j].u(0, 0)) / (2 * kStep);
      EXPECT_NEAR(gain(0, Eigen::Index(j)), slope, 1e-4 * gain.norm()) << i << " " << j;
    }
  }
}

// A mass that is led to a place, which is the parameter.
Problem led() {
  Problem p("led", {"p", "v"}, {"u"}, 1, [](const auto& s) { return vector(s.x[1], s.u[0]); });
  const Parameter place = p.parameters.add("place", 1.0);
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.add(terminal_squares("off", [place](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(10.0 * (s.x[0] - place(s)[0])), T(s.x[1]));
  }));
  p.start << 0, 0;
  return p;
}

TEST(DdpBatch, EachHasItsOwnParametersAndGuess) {
  const Problem p = led();
  const DdpOptions options = options_of(DdpHessian::kGaussNewton);
  const DdpBatch batch(p, options);
  const Eigen::RowVectorXd places = Eigen::RowVectorXd::LinSpaced(9, -1, 3);
  const std::vector<DdpSolution> all =
      batch.solve({.parameters = places, .controls = MatrixXd::Random(25, 9)});
  DdpSolver solver(p, options);
  for (int i = 0; i < 9; ++i) {
    Problem now = p;
    now.parameters.set("place", places[i]);
    solver.set_values(now);
    const DdpSolution alone = solver.solve();
    EXPECT_EQ(all[std::size_t(i)].status, SolveStatus::kSolved);
    EXPECT_LT((all[std::size_t(i)].u - alone.u).cwiseAbs().maxCoeff(), 1e-9) << i;
  }
}

TEST(DdpBatch, SaysWhatDoesNotFit) {
  const DdpBatch batch(led(), options_of(DdpHessian::kExact));
  const auto refused = [&](const DdpBatchValues& values) {
    return message_of<ArgumentError>([&] { batch.solve(values); });
  };
  EXPECT_EQ(refused({.starts = MatrixXd::Zero(3, 2)}), "problem \"led\": starts of 3 rows, expected 2");
  EXPECT_EQ(refused({.starts = MatrixXd::Zero(2, 2), .parameters = MatrixXd::Zero(1, 3)}),
            "problem \"led\": parameters of 3 columns, expected 2, one a problem");
  MatrixXd starts = MatrixXd::Zero(2, 3);
  starts(1, 2) = std::nan("");
  EXPECT_EQ(refused({.starts = starts}), "problem \"led\": starts: column 2 is not finite");
  EXPECT_TRUE(batch.solve({}).empty());
}

}  // namespace
}  // namespace dyntape::ddp_batch_test
