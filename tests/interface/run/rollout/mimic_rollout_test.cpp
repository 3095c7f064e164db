// SPDX-License-Identifier: BSD-3-Clause
//
// Roll-outs of robots with mimic joints: states of the independent joints, against simulations and differences.
#include <gtest/gtest.h>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/run/rollout/policy_rollout.h>
#include <dyntape/interface/run/rollout/scene_rollout.h>
#include <dyntape/interface/run/simulate/simulate.h>

#include "interface/run/tied_robots.h"

namespace dyntape::mimic_rollout_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::Pendulums;
using test::Sliders;
using test::tied_scene;

Scene swinging(const std::string& scheme, const std::string& more = "") {
  return tied_scene(Pendulums().urdf(),
                    "start { q { a 0.8 } v { a -0.5 } }\ncommands { torque { a 0.3 } }\n"
                    "simulation { duration 0.2  step 1e-3  sample 1e-3  integrator " +
                        scheme + " }\n" + more);
}

Function law() {
  return record("law", 2, 2, [](const VectorXad& x, const VectorXad& p) {
    return VectorXad(VectorXad::Constant(1, -p[0] * sin(x[0]) - p[1] * x[1] * x[0]));
  });
}

MatrixXd rolled(const Scene& scene, const VectorXd& x0, const std::vector<double>& u) {
  SceneRollout rollout(scene, false);
  EXPECT_EQ(rollout.n_x(), x0.size());
  MatrixXd states(x0.size(), scene.steps());
  rollout.run(
      {0, 1, x0.data(), 0}, scene.steps(),
      [&](long, const WorldRows&) {
        return CommandRows{u.data(), 0};
      },
      states.data());
  return states;
}

TEST(MimicRollouts, AreTheSimulatedMotion) {
  for (const char* scheme : {"runge-kutta-4", "implicit-midpoint", "semi-implicit-euler"}) {
    const Scene scene = swinging(scheme);
    const SimulatedMotion motion = simulate(scene);
    const MatrixXd states = rolled(scene, VectorXd{{0.8, -0.5}}, {0.3});
    for (Index k = 0; k < states.cols(); ++k) {
      ASSERT_NEAR(states(0, k), motion.q(0, k + 1), 1e-12) << scheme;
      ASSERT_NEAR(states(1, k), motion.v(0, k + 1), 1e-12) << scheme;
    }
  }
}

// One with a motor that lags, whose output follows q and v.
TEST(MimicRollouts, KeepMotorsWithALag) {
  const Scene scene = swinging("runge-kutta-4", "actuators { time_constant { a 0.05 } }");
  const SimulatedMotion motion = simulate(scene);
  const MatrixXd states = rolled(scene, VectorXd{{0.8, -0.5, 0.3}}, {0.3});
  EXPECT_NEAR(states(0, 199), motion.q(0, 200), 1e-12);
  EXPECT_NEAR(states(2, 199), 0.3, 1e-12);
}

TEST(MimicRollouts, OfHardLimitsAreTheSimulatedMotion) {
  Sliders of;
  of.ratio = 2, of.offset = 0, of.limit_b = "lower='-100' upper='0.3'";
  const Scene scene = tied_scene(of.urdf(),
                                 "constraints { limits { restitution 0.5 } }\nstart { v { a 2 } }\n"
                                 "simulation { duration 0.4  step 1e-3  sample 1e-3 }");
  const SimulatedMotion motion = simulate(scene);
  const MatrixXd states = rolled(scene, VectorXd{{0, 2}}, {0});
  EXPECT_LT(motion.v.row(0).minCoeff(), -0.5);  // it came back
  for (Index k = 0; k < states.cols(); ++k) {
    ASSERT_NEAR(states(0, k), motion.q(0, k + 1), 1e-12);
    ASSERT_NEAR(states(1, k), motion.v(0, k + 1), 1e-12);
  }
}

TEST(MimicRollouts, GradientsAreDifferences) {
  for (const char* scheme : {"runge-kutta-4", "implicit-midpoint"}) {
    PolicyRollout rollout(swinging(scheme), law());
    ASSERT_EQ(rollout.n_t(), 2);
    constexpr int kSteps = 60;
    const MatrixXd x0{{0.8, 0.3}, {-0.5, 0.1}}, p{{1.2, 0.4}, {0.3, 0.9}};
    const auto cost = [](const MatrixXd& x) { return x.row(0).squaredNorm() / 2 + x(1, kSteps - 1); };
    const PolicyGradient g = rollout.gradient(x0, p, kSteps, [](Index, const auto& x, MatrixXd& weights) {
      weights.row(0) = x.row(0);
      weights(1, kSteps - 1) = 1;
    });
    for (Index world = 0; world < 2; ++world) {
      const auto at = [&](const VectorXd& x, const VectorXd& with) {
        return cost(rollout.run(x, with, kSteps).x);
      };
      for (Index i = 0; i < 2; ++i) {
        const VectorXd d = 1e-6 * VectorXd::Unit(2, i), x = x0.col(world), with = p.col(world);
        EXPECT_NEAR(g.start(i, world), (at(x + d, with) - at(x - d, with)) / 2e-6, 1e-6) << scheme;
        EXPECT_NEAR(g.parameters(i, world), (at(x, with + d) - at(x, with - d)) / 2e-6, 1e-6) << scheme;
      }
    }
  }
}

}  // namespace
}  // namespace dyntape::mimic_rollout_test
