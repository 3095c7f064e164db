// SPDX-License-Identifier: BSD-3-Clause
//
// What torques can tell about masses: known ranks, invariance, and noise as Cramer and Rao say.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <filesystem>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/identification/estimator.h>
#include <dyntape/interface/identification/rank_revealing_qr.h>
#include <dyntape/interface/identification/staircase.h>

#include "interface/message_of.h"
#include "source_folder.h"

namespace dyntape::base_parameters_test {
namespace {

using dynamics::Base;
using dynamics::Data;
using dynamics::Model;
using dynamics::RegressorData;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Model<double> load(const std::string& name, Base base = Base::kFixed, std::vector<std::string> lock = {}) {
  const auto root = std::filesystem::path(test::source_folder()) / "config" / "robots" / (name + ".urdf");
  dynamics::UrdfOptions options;
  options.base = base;
  options.lock = std::move(lock);
  return dynamics::load_urdf(root.string(), options);
}

const std::vector<std::string> kFingers = {"panda_finger_joint1", "panda_finger_joint2"};

struct Case {
  const char* robot;
  Base base;
  bool lock;
  int rank;
};

class BaseParametersOf : public ::testing::TestWithParam<Case> {
 protected:
  BaseParametersOf()
      : model(load(GetParam().robot, GetParam().base,
                   GetParam().lock ? kFingers : std::vector<std::string>())) {}
  Model<double> model;
};

// Errata E23: the ranks are known, and the gap leaves no doubt.
TEST_P(BaseParametersOf, HaveTheKnownRank) {
  for (unsigned long seed : {1UL, 2UL, 3UL}) {
    const BaseParameters base = base_parameters(model, {.columns = {}, .seed = seed});
    EXPECT_EQ(base.rank(), GetParam().rank);
    EXPECT_GT(base.least_kept, 1e-4);
    EXPECT_LT(base.most_dropped, 1e-13);
  }
}

TEST_P(BaseParametersOf, ReproduceTheTorques) {
  const BaseParameters base = base_parameters(model);
  const VectorXd beta = base.regrouping * dynamics::inertial_parameters(model);
  Data<double> data(model);
  dynamics::DynamicsTerms<double> acting;
  acting.armature = false;
  const Samples samples = random_samples(model, 20, 17);  // none of those that the columns were found on
  const VectorXd tau = stacked_base_regressor(model, base, samples) * beta;
  VectorXd expected(tau.size());
  for (int i = 0; i < 20; ++i) {
    expected.segment(i * model.nv, model.nv) =
        dynamics::rnea(model, data, samples.q.col(i), samples.v.col(i), samples.a.col(i), acting);
  }
  EXPECT_LE((tau - expected).cwiseAbs().maxCoeff(), 1e-12 * expected.cwiseAbs().maxCoeff());
}

// Other masses with the same base parameters make the same torques: theta is not determined, beta is.
TEST_P(BaseParametersOf, AreAllThatTheTorquesDependOn) {
  const BaseParameters base = base_parameters(model);
  const VectorXd theta = dynamics::inertial_parameters(model);
  std::mt19937_64 random(5);
  VectorXd other = VectorXd::NullaryExpr(
      theta.size(), [&] { return std::uniform_real_distribution<double>(-1, 1)(random); });
  const MatrixXd& G = base.regrouping;
  other += G.transpose() * (G * G.transpose()).ldlt().solve(G * (theta - other));
  EXPECT_GT((other - theta).norm(), 0.1);
  Data<double> data(model);
  RegressorData<double> regressor(model);
  const Samples s = random_samples(model, 5, 23);
  for (int i = 0; i < 5; ++i) {
    const MatrixXd& Y =
        dynamics::torque_regressor(model, data, regressor, s.q.col(i), s.v.col(i), s.a.col(i));
    const VectorXd tau = Y * theta, again = Y * other;
    EXPECT_LE((again - tau).cwiseAbs().maxCoeff(), 1e-12 * (Y.cwiseAbs() * other.cwiseAbs()).maxCoeff());
  }
}

// The choice and the combinations come from the robot, not from the states they were found on.
TEST_P(BaseParametersOf, DoNotDependOnTheStates) {
  const BaseParameters a = base_parameters(model, {.columns = {}, .seed = 1});
  const BaseParameters b = base_parameters(model, {.columns = {}, .seed = 99});
  EXPECT_EQ(a.independent, b.independent);
  EXPECT_LE((a.regrouping - b.regrouping).cwiseAbs().maxCoeff(), 1e-10);
}

INSTANTIATE_TEST_SUITE_P(Robots, BaseParametersOf,
                         ::testing::Values(Case{"ur5", Base::kFixed, false, 36},
                                           Case{"panda", Base::kFixed, true, 43},
                                           Case{"panda", Base::kFixed, false, 51},
                                           Case{"solo12", Base::kFloating, false, 94}));

// Another choice of columns is another basis of the same space: one linear map takes beta to beta.
TEST(BaseParameters, OfAnotherChoiceOfColumnsAreALinearMap) {
  const Model<double> model = load("ur5");
  const BaseParameters base = base_parameters(model);
  Data<double> data(model);
  RegressorData<double> regressor(model);
  const Samples s = random_samples(model, 40, 3);
  MatrixXd W(40 * model.nv, 60);
  for (int i = 0; i < 40; ++i) {
    W.middleRows(i * model.nv, model.nv) =
        dynamics::torque_regressor(model, data, regressor, s.q.col(i), s.v.col(i), s.a.col(i));
  }
  const ColumnSpace space = column_space(W.rowwise().reverse());  // from the hand to the base
  ASSERT_EQ(space.rank(), base.rank());
  MatrixXd regrouping = MatrixXd::Zero(space.rank(), 60);
  for (int i = 0; i < space.rank(); ++i) {
    regrouping(i, 59 - space.independent[static_cast<std::size_t>(i)]) = 1;
    for (std::size_t j = 0; j < space.dependent.size(); ++j) {
      regrouping(i, 59 - space.dependent[j]) = space.combination(i, static_cast<Eigen::Index>(j));
    }
  }
  // Rows of one are combinations of rows of the other.
  const MatrixXd map = regrouping(Eigen::all, base.independent);
  EXPECT_LE((map * base.regrouping - regrouping).cwiseAbs().maxCoeff(), 1e-11);
  EXPECT_GT(map.fullPivLu().rcond(), 1e-8);
}

// Two links in the horizontal plane: Izz1 + l^2 m2, mcx2, mcy2, Izz2, as every textbook has it.
TEST(BaseParameters, OfAHorizontalArmAreThoseOfTheTextbook) {
  Model<double> arm;
  arm.name = "horizontal arm";
  dynamics::Joint<double> joint;
  joint.axis = Eigen::Vector3d::UnitZ();
  dynamics::Inertia<double> link{1, {0.2, 0, 0}, Eigen::Matrix3d::Identity() * 0.1};
  joint.name = "shoulder";
  arm.add_joint(-1, joint, {}, link);
  joint.name = "elbow";
  dynamics::Placement<double> at_elbow;
  at_elbow.p[0] = 0.5;
  arm.add_joint(0, joint, at_elbow, link);
  const BaseParameters base = base_parameters(arm);
  EXPECT_EQ(base.names, (std::vector<std::string>{"Izz1 + 0.25 m2", "mcx2", "mcy2", "Izz2"}));
  EXPECT_EQ(base.unidentifiable.size(), 15u);  // of link 1 all but Izz1, of link 2 all but these four
}

TEST(BaseParameters, ArmatureAndFrictionJoinThem) {
  const Model<double> model = load("panda", Base::kFixed, kFingers);
  const int bare = base_parameters(model).rank();
  // Link 1 turns about z only and link 2 about a perpendicular axis besides: their rotors turn as Izz1 and
  // Izz2 do.
  EXPECT_EQ(base_parameters(model, {.columns = {.armature = true}}).rank(), bare + 5);
  EXPECT_EQ(base_parameters(model, {.columns = {.viscous = true, .coulomb = true}}).rank(), bare + 14);
}

class Noisy : public ::testing::Test {
 protected:
  Noisy() : model(load("double_pendulum")), base(base_parameters(model)) {
    samples = random_samples(model, 60, 11);
    sigma = VectorXd::LinSpaced(model.nv, 0.05, 0.4);
    beta = base.regrouping * dynamics::inertial_parameters(model);
    const VectorXd tau = stacked_base_regressor(model, base, samples) * beta;
    samples.tau = tau.reshaped(model.nv, samples.count());
  }

  MatrixXd noise(std::mt19937_64& random) const {
    std::normal_distribution<double> normal;
    MatrixXd e(model.nv, samples.count());
    for (double& x : e.reshaped()) x = normal(random);
    return sigma.asDiagonal() * e;
  }

  Model<double> model;
  BaseParameters base;
  Samples samples;
  VectorXd sigma, beta;
};

TEST_F(Noisy, EstimateIsExactWithoutNoise) {
  const BaseEstimator estimator(model, base, samples, sigma);
  EXPECT_LE((estimator.estimate(samples.tau) - beta).cwiseAbs().maxCoeff(),
            1e-12 * beta.cwiseAbs().maxCoeff());
  EXPECT_LE((identify(model, base, samples).beta - beta).cwiseAbs().maxCoeff(),
            1e-12 * beta.cwiseAbs().maxCoeff());
}

// NaN among the torques made estimates of NaN; NaN among the positions was said to be a motion that excites too little.
TEST_F(Noisy, SamplesAreNumbers) {
  const auto message = [&](MatrixXd Samples::*part) {
    Samples wrong = samples;
    (wrong.*part)(0, 1) = std::nan("");
    return message_of<ArgumentError>([&] { identify(model, base, wrong); });
  };
  for (MatrixXd Samples::*part : {&Samples::q, &Samples::v, &Samples::a})
    EXPECT_EQ(message(part),
              "estimator: the regressor of q, v and a is not finite, expected samples of numbers");
  EXPECT_EQ(message(&Samples::tau), "estimate: tau has an entry that is not finite, expected numbers");
}

TEST_F(Noisy, CovarianceReachesTheCramerRaoBound) {
  const BaseEstimator estimator(model, base, samples, sigma);
  const MatrixXd bound = estimator.covariance();
  MatrixXd W = stacked_base_regressor(model, base, samples);
  for (Eigen::Index t = 0; t < samples.count(); ++t)
    W.middleRows(t * model.nv, model.nv).array().colwise() /= sigma.array();
  const MatrixXd product = bound * (W.transpose() * W);
  EXPECT_LE((product - MatrixXd::Identity(base.rank(), base.rank())).cwiseAbs().maxCoeff(), 1e-10);
  constexpr int kDraws = 10000;
  constexpr unsigned long kSeed = 2024;
  RecordProperty("seed", static_cast<int>(kSeed));
  std::mt19937_64 random(kSeed);
  MatrixXd sum = MatrixXd::Zero(base.rank(), base.rank());
  VectorXd mean = VectorXd::Zero(base.rank());
  for (int k = 0; k < kDraws; ++k) {
    const VectorXd error = estimator.estimate(samples.tau + noise(random)) - beta;
    sum += error * error.transpose();
    mean += error;
  }
  const VectorXd d = estimator.standard_deviation();
  const auto scaled = [&](const MatrixXd& c) -> MatrixXd {
    return d.cwiseInverse().asDiagonal() * c * d.cwiseInverse().asDiagonal();
  };
  // All entries in units of the bound's standard deviations; on the diagonal that is the ratio itself.
  EXPECT_LE((scaled(sum / kDraws) - scaled(bound)).cwiseAbs().maxCoeff(), 0.1) << "seed " << kSeed;
  EXPECT_LE((mean / kDraws).cwiseQuotient(d).cwiseAbs().maxCoeff(), 0.05) << "seed " << kSeed;
  // A test that can fail: without the weights the bound is missed.
  const BaseEstimator unweighted(model, base, samples, VectorXd::Ones(model.nv));
  MatrixXd worse = MatrixXd::Zero(base.rank(), base.rank());
  for (int k = 0; k < kDraws; ++k) {
    const VectorXd error = unweighted.estimate(samples.tau + noise(random)) - beta;
    worse += error * error.transpose();
  }
  EXPECT_GT(scaled(worse / kDraws).diagonal().maxCoeff(), 1.2);
}

TEST_F(Noisy, NoiseIsEstimatedFromTheResiduals) {
  std::mt19937_64 random(8);
  samples = random_samples(model, 4000, 12);
  const VectorXd tau = stacked_base_regressor(model, base, samples) * beta;
  samples.tau = tau.reshaped(model.nv, samples.count());
  samples.tau += noise(random);
  const Identification found = identify(model, base, samples);
  EXPECT_LE((found.sigma.cwiseQuotient(sigma) - VectorXd::Ones(model.nv)).cwiseAbs().maxCoeff(), 0.1);
  EXPECT_LE((found.beta - beta).cwiseQuotient(found.standard_deviation).cwiseAbs().maxCoeff(), 4);
}

TEST_F(Noisy, FaultsAreNamed) {
  EXPECT_THROW(BaseEstimator(model, base, samples, VectorXd::Zero(model.nv)), ArgumentError);
  EXPECT_THROW(BaseEstimator(model, base, random_samples(model, 1, 1), sigma), ArgumentError);
  Samples still = samples;
  still.v.setZero();
  still.a.setZero();
  EXPECT_THROW(BaseEstimator(model, base, still, sigma), NumericalError);
  EXPECT_THROW(BaseEstimator(model, base, samples, sigma).estimate(samples.tau.leftCols(3)), ArgumentError);
}

// With and without SuiteSparse: the same steps, but for signs of rows.
TEST(BaseParameters, StaircasesAreTheSameByReflections) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (const auto& [rows, cols] : {std::pair(30, 12), {12, 12}, {7, 12}, {1, 3}}) {
    MatrixXd A(rows, cols);
    for (double& x : A.reshaped()) x = normal(random);
    for (int j = 2; j < cols; j += 3) A.col(j) = A.leftCols(j) * VectorXd::LinSpaced(j, -1, 1);
    const MatrixXd one = detail::staircase(A, 1e-9), other = detail::staircase_by_reflections(A, 1e-9);
    ASSERT_EQ(other.rows(), cols);
    EXPECT_LT((one.cwiseAbs() - other.cwiseAbs()).norm(), 1e-12 * (1 + A.norm())) << rows << " x " << cols;
    EXPECT_LT((A.transpose() * A - other.transpose() * other).norm(), 1e-12 * (1 + A.squaredNorm()));
  }
}

}  // namespace
}  // namespace dyntape::base_parameters_test
