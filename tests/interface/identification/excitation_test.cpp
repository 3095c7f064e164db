// SPDX-License-Identifier: BSD-3-Clause
//
// Excitation: series and their derivatives, limits kept, and a clear gain over chance.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/identification/estimator.h>
#include <dyntape/interface/identification/excitation.h>
#include <dyntape/interface/identification/excitation_problem.h>

#include "source_folder.h"

namespace dyntape::excitation_test {
namespace {

using dynamics::Model;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Model<double> load(const std::string& name) {
  const auto root = std::filesystem::path(test::source_folder()) / "config" / "robots" / (name + ".urdf");
  return dynamics::load_urdf(root.string(), {});
}

TEST(FourierSeries, VelocitiesAndAccelerationsAreSlopes) {
  const FourierSeries series{3.0, MatrixXd::Random(2, 9)};
  const VectorXd t = VectorXd::LinSpaced(20, -1, 5);
  const double h = 1e-5;
  const VectorXd up = t.array() + h, down = t.array() - h;
  const MatrixXd v = (series.positions(up) - series.positions(down)) / (2 * h);
  const MatrixXd a = (series.velocities(up) - series.velocities(down)) / (2 * h);
  EXPECT_LE((v - series.velocities(t)).cwiseAbs().maxCoeff(), 1e-8);
  EXPECT_LE((a - series.accelerations(t)).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_LE((series.positions(t) - series.positions(t.array() + 3.0)).cwiseAbs().maxCoeff(), 1e-13);
}

// Largest share of its limit that a joint uses anywhere in the period.
double use_of_limits(const Model<double>& model, const FourierSeries& series, const ExcitationOptions& o) {
  const VectorXd fine = times_of_period(o.period, 2000);
  const MatrixXd q = series.positions(fine), v = series.velocities(fine), a = series.accelerations(fine);
  double most = 0;
  for (const auto& joint : model.joints) {
    const double lower = std::isfinite(joint.limits.lower) ? joint.limits.lower : -o.position;
    const double upper = std::isfinite(joint.limits.upper) ? joint.limits.upper : o.position;
    const double velocity = std::isfinite(joint.limits.velocity) ? joint.limits.velocity : o.velocity;
    const VectorXd from_middle = q.row(joint.idx_v).array() - 0.5 * (lower + upper);
    most = std::max({most, 2 * from_middle.cwiseAbs().maxCoeff() / (upper - lower),
                     v.row(joint.idx_v).cwiseAbs().maxCoeff() / velocity,
                     a.row(joint.idx_v).cwiseAbs().maxCoeff() / o.acceleration});
  }
  return most;
}

TEST(Excitation, RandomSeriesKeepTheLimitsAndRest) {
  const Model<double> model = load("ur5");
  const ExcitationOptions options;
  for (unsigned long seed = 1; seed < 6; ++seed) {
    const FourierSeries series = random_series(model, options, seed);
    EXPECT_LE(use_of_limits(model, series, options), 1);
    EXPECT_GE(use_of_limits(model, series, options), 0.94);
    const VectorXd start = VectorXd::Zero(1);
    EXPECT_LE(series.velocities(start).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_LE(series.accelerations(start).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Excitation, GradientsAreExact) {
  const Model<double> model = load("ur5");
  const BaseParameters base = base_parameters(model);
  for (const auto criterion : {ExcitationCriterion::kLogDet, ExcitationCriterion::kCondition}) {
    ExcitationOptions options;
    options.criterion = criterion;
    options.samples = 20;
    options.harmonics = 3;
    ExcitationProblem problem(model, base, options);
    std::vector<double> x = ExcitationProblem::flat(random_series(model, options, 3)), gradient(x.size());
    ASSERT_TRUE(problem.gradient(x.data(), gradient.data()));
    const double size =
        Eigen::Map<VectorXd>(gradient.data(), static_cast<long>(x.size())).cwiseAbs().maxCoeff();
    for (std::size_t k = 0; k < x.size(); k += 5) {
      const double at = x[k], h = 1e-4;
      double values[4];
      for (int i = 0; i < 4; ++i) {
        x[k] = at + h * (i < 2 ? i - 2 : i - 1);
        ASSERT_TRUE(problem.objective(x.data(), values[i]));
      }
      x[k] = at;
      const double slope = (values[0] - 8 * values[1] + 8 * values[2] - values[3]) / (12 * h);
      EXPECT_NEAR(gradient[k], slope, 1e-7 * size) << k;
    }
  }
}

// A UR5 within a few seconds: a coarse series is enough to be far from chance.
ExcitationOptions coarse() {
  ExcitationOptions options;
  options.samples = 30;
  options.harmonics = 3;
  options.max_iterations = 25;
  return options;
}

TEST(Excitation, HalvesTheErrorsWithinTheLimits) {
  const Model<double> model = load("ur5");
  const BaseParameters base = base_parameters(model);
  const ExcitationOptions options = coarse();
  const Excitation e = optimal_excitation(model, base, options);
  EXPECT_LE(use_of_limits(model, e.series, options), 1.01);
  EXPECT_NEAR(condition(model, base, e.samples), e.condition, 1e-9 * e.condition);
  // The bound on the errors of all base parameters, geometric mean.
  const VectorXd sigma = VectorXd::Ones(model.nv), times = times_of_period(options.period, options.samples);
  const auto mean_error = [&](const Samples& samples) {
    const VectorXd error = BaseEstimator(model, base, samples, sigma).standard_deviation();
    return std::exp(error.array().log().mean());
  };
  std::vector<double> by_chance;
  for (unsigned long seed = 1; seed <= 9; ++seed) {
    by_chance.push_back(mean_error(sample(model, random_series(model, options, seed), times)));
  }
  std::sort(by_chance.begin(), by_chance.end());
  EXPECT_LT(mean_error(e.samples), 0.6 * by_chance[4]);
  EXPECT_LT(mean_error(e.samples), 0.8 * by_chance[0]);
  EXPECT_GT(e.log_det, e.random_log_det + 10);
}

TEST(Excitation, LowersTheConditionNumber) {
  const Model<double> model = load("ur5");
  const BaseParameters base = base_parameters(model);
  ExcitationOptions options = coarse();
  options.criterion = ExcitationCriterion::kCondition;
  const Excitation e = optimal_excitation(model, base, options);
  EXPECT_LT(e.condition, 0.65 * e.random_condition) << e.condition << " " << e.random_condition;
  EXPECT_LE(use_of_limits(model, e.series, options), 1.01);
}

TEST(Excitation, FaultsAreNamed) {
  Model<double> model = load("arm_2r");
  const BaseParameters base = base_parameters(model);
  EXPECT_THROW(optimal_excitation(model, base, {.harmonics = 1}), ArgumentError);
  EXPECT_THROW(optimal_excitation(model, base, {.margin = 2}), ArgumentError);
  model.joints[0].limits.velocity = 0;
  EXPECT_THROW(optimal_excitation(model, base), ArgumentError);
  dynamics::UrdfOptions floating;
  floating.base = dynamics::Base::kFloating;
  const auto root = std::filesystem::path(test::source_folder()) / "config" / "robots" / "arm_2r.urdf";
  const Model<double> free = dynamics::load_urdf(root.string(), floating);
  EXPECT_THROW(optimal_excitation(free, base_parameters(free)), ArgumentError);
}

}  // namespace
}  // namespace dyntape::excitation_test
