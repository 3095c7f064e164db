// SPDX-License-Identifier: BSD-3-Clause
//
// Boxes that come to rest on four corners, which depend on each other.
#include <gtest/gtest.h>

#include <algorithm>

#include "interface/run/shipped_scenes.h"

namespace dyntape::rigid_box_test {
namespace {

constexpr double kGravity = 9.81;

TEST(RigidBoxes, ABoxThatFallsComesToRestOnItsCorners) {
  for (const double roll : {0.0, 0.3}) {
    for (const double restitution : {0.0, 0.5}) {
      Scene scene = shipped("tumbling_box");
      for (auto& contact : scene.robot.constraints.rigid.contacts) contact.restitution = restitution;
      scene.v.setZero();
      scene.q << 0, 0, 0.3, std::sin(roll / 2), 0, 0, std::cos(roll / 2);
      scene.duration = 3;
      scene.name = "box from " + std::to_string(roll) + " with " + std::to_string(restitution);
      const SimulatedMotion motion = run(scene);
      const int last = motion.samples() - 1;
      EXPECT_LT(motion.v.col(last).norm(), 1e-9) << roll << " " << restitution;
      EXPECT_NEAR(motion.q(2, last), 0.05, 1e-8) << roll << " " << restitution;
      EXPECT_NEAR(upward_force(scene, motion.reactions.col(last)), 2 * kGravity, 1e-8);
      EXPECT_LT(motion.energy_error(), 1e-6 * motion.energy_scale()) << roll << " " << restitution;
      EXPECT_GT(motion.impacts, 0);
    }
  }
}

// By every scheme, in short steps and in long ones: on its corners, at rest, and without an impact any more.
TEST(RigidBoxes, ATumblingBoxComesToRestByEveryScheme) {
  for (const Integrator integrator : kIntegrators) {
    if (is_adaptive(integrator)) continue;
    for (const double step : {1e-3, 1e-2}) {
      for (const double restitution : {0.0, 0.3}) {
        Scene scene = shipped("tumbling_box");
        for (auto& contact : scene.robot.constraints.rigid.contacts) contact.restitution = restitution;
        scene.integrator = integrator;
        scene.step = scene.sample = step;
        scene.name = std::string(to_string(integrator)) + " by " + std::to_string(step);
        const SimulatedMotion motion = simulate(scene);
        ASSERT_EQ(motion.trouble, "") << scene.name;
        if (step < 5e-3) {  // long ones pass the ground, and say so
          EXPECT_EQ(motion.warning, "") << scene.name;
        }
        const int last = motion.samples() - 1;
        EXPECT_LT(motion.v.col(last).norm(), 1e-9) << scene.name;
        EXPECT_NEAR(motion.q(2, last), 0.05, 1e-8) << scene.name;
        EXPECT_NEAR(upward_force(scene, motion.reactions.col(last)), 2 * kGravity, 1e-7) << scene.name;
        EXPECT_LT(motion.impacts, 100) << scene.name;
      }
    }
  }
}

// How often a box hits the ground before it rests depends on its start, but not by much: what contacts keep of velocities when they
// close was lifted over a long step, 1e-8 m of a fall to 1e-6 m, and some starts rattled four times as long as others.
TEST(RigidBoxes, ImpactsOfNearbyStartsAreAsMany) {
  std::vector<long> counts;
  for (int start = 0; start < 12; ++start) {
    Scene scene = shipped("tumbling_box");
    scene.integrator = Integrator::kRungeKutta4;
    scene.step = scene.sample = 1e-2;
    scene.q[2] += 1e-3 * start;
    const SimulatedMotion motion = simulate(scene);
    ASSERT_EQ(motion.trouble, "") << start;
    EXPECT_LT(motion.v.col(motion.samples() - 1).norm(), 1e-9) << start;
    counts.push_back(motion.impacts);
  }
  const auto [fewest, most] = std::minmax_element(counts.begin(), counts.end());
  EXPECT_LT(*most, 2 * *fewest);
}

// A ball on the ground, with less velocity than a fall through 1e-8 m gives: it rests there, neither lifted nor sunk by u h / 2 =
// 1.5e-6 m, and what it loses is what it had, 1 kg (3e-4 m/s)^2 / 2.
TEST(RigidBoxes, WhatRestsIsWhereItTouched) {
  for (const double velocity : {3e-4, -3e-4}) {
    Scene scene = shipped("rigid_bounce");
    scene.q[2] = 0.1, scene.v.setZero(), scene.v[2] = velocity;
    scene.step = scene.sample = scene.duration = 1e-2;
    const SimulatedMotion motion = run(scene);
    const int last = motion.samples() - 1;
    EXPECT_NEAR(motion.q(2, last), 0.1, 1e-13) << velocity;
    EXPECT_NEAR(motion.v(2, last), 0, 1e-15) << velocity;
    EXPECT_LT(motion.energy_error(), 1e-15) << velocity;
    EXPECT_EQ(motion.impacts, 0) << velocity;
  }
}

// All but at rest on its corners it must not rattle: it did, for ever, fed by what closed contacts do to tiny gaps.
TEST(RigidBoxes, ABoxThatAllButRestsDoesNotRattle) {
  for (const double tilt : {2e-10, 1e-7, 1e-5}) {
    for (const double friction : {0.5, 1.0}) {
      Scene scene = shipped("tumbling_box");
      for (auto& contact : scene.robot.constraints.rigid.contacts) contact.friction = friction;
      scene.v.setZero();
      scene.q << 0, 0, 0.05 + tilt, 0, std::sin(tilt / 2), 0, std::cos(tilt / 2);
      scene.step = scene.sample = 2e-3;
      const SimulatedMotion motion = run(scene);
      EXPECT_LT(motion.impacts, 200) << tilt << " " << friction;
      EXPECT_LT(motion.v.col(motion.samples() - 1).norm(), 1e-9) << tilt << " " << friction;
    }
  }
}

}  // namespace
}  // namespace dyntape::rigid_box_test
