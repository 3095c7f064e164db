// SPDX-License-Identifier: BSD-3-Clause
//
// Secants of stages whose true curvature is known.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/interface/control/riccati/riccati.h>
#include <dyntape/interface/control/solve/stage_secants.h>

namespace dyntape::stage_secants_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// Stages of a cost z.T z / 2 of z = (x, u) by linear dynamics, with H in place of T.
class StageSecantsOf : public ::testing::Test {
 protected:
  static constexpr int kN = 3, kStates = 2, kControls = 1, kAll = kStates + kControls;

  void set(const MatrixXd& truth, const MatrixXd& known) {
    truth_ = truth;
    const LqrStage stage{MatrixXd::Ones(kStates, kStates),
                         MatrixXd::Ones(kStates, kControls),
                         VectorXd::Zero(kStates),
                         known,
                         VectorXd::Zero(kAll),
                         {},
                         {}};
    stages_.assign(kN, StageColumns(stage));
    before_.assign(stages_.begin(), stages_.end());
  }
  void learn_at(const MatrixXd& z) {
    for (std::size_t k = 0; k < kN; ++k) {
      before_[k] = stages_[k];
      stages_[k].g.head(kAll) = truth_ * z.col(Eigen::Index(k));
    }
    MatrixXd x(kStates, kN + 1);
    x << z.topRows(kStates), VectorXd::Zero(kStates);
    secants_.learn(stages_, before_, x, z.bottomRows(kControls), MatrixXd::Ones(kStates, kN + 1));
  }
  MatrixXd hessian(std::size_t k) const { return (stages_[k].H + secants_.of_stage(k)).topRows(kAll); }
  MatrixXd random(int rows, int cols) {
    std::normal_distribution<double> normal;
    return MatrixXd::NullaryExpr(rows, cols, [&] { return normal(numbers_); });
  }

  StageSecants secants_;
  MatrixXd truth_;
  std::vector<StageColumns> stages_;
  std::vector<StageSlopes> before_;
  std::mt19937_64 numbers_{1};
};

// A step in a new direction each; some are skipped.
TEST_F(StageSecantsOf, AreTheMissingCurvatureAfterStepsInAllDirections) {
  const MatrixXd known = MatrixXd::Identity(kAll, kAll), half = random(kAll, kAll);
  set(known + half + half.transpose(), known);
  for (int step = 0; step < 20; ++step) learn_at(random(kAll, kN));
  EXPECT_TRUE(secants_.help());
  for (std::size_t k = 0; k < kN; ++k) {
    EXPECT_LT((hessian(k) - truth_).cwiseAbs().maxCoeff(), 1e-9) << k;
  }
}

TEST_F(StageSecantsOf, DoNotHelpWhereLittleIsMissing) {
  const MatrixXd known = MatrixXd::Identity(kAll, kAll);
  set(1.1 * known, known);
  for (int step = 0; step < 6; ++step) {
    learn_at(random(kAll, kN));
    EXPECT_FALSE(secants_.help());
  }
}

// What they learnt of a curvature that is gone foretells worse than nothing: they begin anew.
TEST_F(StageSecantsOf, AreForgottenWhereTheyMislead) {
  const MatrixXd known = MatrixXd::Identity(kAll, kAll);
  set(1e6 * known, known);
  for (int step = 0; step < 5; ++step) learn_at(random(kAll, kN));
  truth_ = known;
  const MatrixXd z = random(kAll, kN);
  learn_at(z);
  learn_at(z + random(kAll, kN));
  EXPECT_FALSE(secants_.help());
  for (std::size_t k = 0; k < kN; ++k) EXPECT_LT((hessian(k) - known).cwiseAbs().maxCoeff(), 1e-6) << k;
}

}  // namespace
}  // namespace dyntape::stage_secants_test
