// SPDX-License-Identifier: BSD-3-Clause
//
// The balance of energy: what steps take is said and is no success beyond a tenth of what moved, in each mechanism by itself;
// and of adaptive steps it is as good as they are.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/report/simulation_results.h>
#include <dyntape/interface/system/mechanisms.h>

#include "../source_folder.h"
#include "shipped_scenes.h"

namespace dyntape::energy_balance_test {
namespace {

using Eigen::VectorXd;

// A ball falls from 1 m and comes back to 0.680 m; steps that end lower have taken the difference, and what its dissipation
// has less to take from.
TEST(EnergyBalance, WhatImplicitVelocityTakesIsSaidAndNoSuccess) {
  Scene scene = shipped("bouncing_ball");
  scene.duration = 0.8;
  const SimulatedMotion exact = run(scene);
  EXPECT_LT(exact.balances.front().part(), 1e-4);
  scene.integrator = Integrator::kImplicitVelocity;
  for (const double step : {1e-4, 1e-3, 1e-2}) {
    scene.step = step, scene.sample = 0.01;
    const SimulatedMotion motion = simulate(scene);
    const double lower = exact.energy(exact.samples() - 1) - motion.energy(motion.samples() - 1);
    const MechanismBalance& balance = motion.balances.front();
    EXPECT_GT(balance.taken, lower) << step;
    EXPECT_LT(balance.taken, 3 * lower) << step;
    EXPECT_EQ(motion.warning.empty(), step < 1e-3) << step << " " << balance.part();
    const std::string text = SimulationReport{scene, motion}.text();
    EXPECT_NE(text.find("lost by the steps"), std::string::npos) << text;
  }
}

// Two robots beside each other, of random lengths and masses.
std::string rod(const std::string& name, double length, double mass, const std::string& axis) {
  const std::string l = io::shortest(length), m = io::shortest(mass);
  return "<link name=\"" + name + "_body\"><inertial><origin xyz=\"0 0 -" + l + "\"/><mass value=\"" + m +
         "\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" izz=\"0.1\"/></inertial></link>"
         "<joint name=\"" +
         name + "\" type=\"continuous\"><parent link=\"world\"/><child link=\"" + name +
         "_body\"/><axis xyz=\"" + axis + "\"/></joint>";
}
Scene scene_of(const std::string& parts, const VectorXd& q, const VectorXd& torque) {
  Scene scene;
  scene.robot.model =
      dynamics::load_urdf_text("<robot name=\"parts\"><link name=\"world\"/>" + parts + "</robot>",
                               "parts.urdf", {.continuous = dynamics::ContinuousJoint::kAngle});
  scene.q = q, scene.v = VectorXd::Zero(q.size());
  scene.commands = {{0}, torque};
  scene.evaluation.route = Route::kInterpreter;
  return scene;
}

TEST(EnergyBalance, EachMechanismHasItsOwn) {
  std::mt19937_64 random(3);
  const auto between = [&](double a, double b) { return std::uniform_real_distribution(a, b)(random); };
  int doubted = 0;
  for (int trial = 0; trial < 12; ++trial) {
    const std::string swing = rod("swing", between(0.3, 2), between(0.1, 3), "1 0 0"),
                      wheel = rod("wheel", 0, between(1, 5), "0 0 1");
    const VectorXd from = VectorXd::Constant(1, between(0.5, 3));
    Scene alone = scene_of(swing, from, VectorXd::Zero(1));
    Scene both = scene_of(swing + wheel, VectorXd{{from[0], 0.0}}, VectorXd{{0.0, between(1, 100)}});
    for (Scene* scene : {&alone, &both}) {
      scene->integrator = trial % 3 == 0 ? Integrator::kSemiImplicitEuler : Integrator::kImplicitVelocity;
      scene->step = scene->sample = trial % 2 ? 1e-3 : 1e-2;
      scene->duration = 5;
    }
    const SimulatedMotion a = simulate(alone), b = simulate(both);
    ASSERT_EQ(b.balances.size(), 2u);
    EXPECT_EQ(b.balances[0].name, "swing");
    EXPECT_NEAR(b.balances[0].error, a.balances[0].error, 1e-9 * a.balances[0].moved);
    EXPECT_NEAR(b.balances[0].moved, a.balances[0].moved, 1e-9 * a.balances[0].moved);
    EXPECT_EQ(a.warning.empty(), b.warning.empty()) << a.warning << " | " << b.warning;
    if (!b.warning.empty()) {
      EXPECT_NE(b.warning.find("'swing'"), std::string::npos) << b.warning;
    }
    doubted += !a.warning.empty();
  }
  EXPECT_GT(doubted, 2);
  EXPECT_LT(doubted, 12);
}

TEST(EnergyBalance, WhatTendonsAndLoopsConnectIsOne) {
  Scene scene = scene_of(rod("a", 1, 1, "1 0 0") + rod("b", 1, 1, "1 0 0") + rod("c", 1, 1, "1 0 0"),
                         VectorXd::Zero(3), VectorXd::Zero(3));
  EXPECT_EQ(mechanisms_of(scene.robot).size(), 3u);
  dynamics::Tendon<double> tendon;
  tendon.arms = VectorXd{{0.1, 0.0, -0.1}};
  tendon.stiffness = 100;
  scene.robot.effects.tendons.push_back(tendon);
  const std::vector<Mechanism> joined = mechanisms_of(scene.robot);
  ASSERT_EQ(joined.size(), 2u);
  EXPECT_EQ(joined[0].joints, (std::vector<int>{0, 2}));
  EXPECT_EQ(mechanism_of_joints(joined, 3), (std::vector<int>{0, 1, 0}));
  EXPECT_EQ(mechanisms_of(shipped("four_bar").robot).size(), 1u);
  // Energy goes from one to the other through the tendon, and is accounted for in what both are.
  scene.q[0] = 1;
  scene.duration = 2;
  const SimulatedMotion motion = run(scene);
  EXPECT_LT(motion.energy_error(), 1e-8 * motion.energy_scale());
}

// Of a motion that parts from its neighbours: 4.4e-3 J by the powers at the ends of long steps.
TEST(EnergyBalance, OfAdaptiveStepsIsAsGoodAsTheyAre) {
  for (const Integrator integrator : {Integrator::kAdaptive, Integrator::kAdaptiveStiff}) {
    for (const double step : {1e-3, 0.02, 0.5}) {
      Scene scene = shipped("pendulum");
      scene.robot.model = dynamics::load_urdf(test::source_folder() + "/config/robots/double_pendulum.urdf");
      scene.q = VectorXd{{2.5, 1.0}}, scene.v = VectorXd::Zero(2);
      scene.commands = {{0}, VectorXd::Zero(2)};
      scene.integrator = integrator;
      scene.step = scene.sample = step, scene.duration = 5;
      const SimulatedMotion motion = run(scene);
      double drift = 0;
      for (int k = 0; k < motion.samples(); ++k)
        drift = std::max(drift, std::abs(motion.energy(k) - motion.energy(0)));
      EXPECT_LT(motion.energy_error(), 20 * drift + 1e-9 * motion.energy_scale())
          << to_string(integrator) << " " << step << " " << drift;
    }
  }
}

}  // namespace
}  // namespace dyntape::energy_balance_test
