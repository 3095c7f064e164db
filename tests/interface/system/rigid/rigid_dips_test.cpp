// SPDX-License-Identifier: BSD-3-Clause
//
// What passes its limit within a step and comes back: found, or not decided and said so.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <dyntape/dynamics/contact/rigid_contacts.h>
#include <dyntape/interface/system/rigid/rigid_dips.h>

#include "interface/run/shipped_scenes.h"

namespace dyntape::rigid_dips_test {
namespace {

TEST(GapCurve, HasTheLowestPlaceOfItsCubic) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  for (int trial = 0; trial < 2000; ++trial) {
    const double h = std::pow(10, 3 * any(random)),
                 g[4] = {any(random), any(random), any(random), any(random)};
    // g0 + g1 s + g2 s^2 + g3 s^3, s = t / h; a third are parabolas.
    const double g3 = trial % 3 ? g[3] : 0;
    const auto at = [&](double s) { return g[0] + s * (g[1] + s * (g[2] + s * g3)); };
    const auto rate = [&](double s) { return (g[1] + s * (2 * g[2] + s * 3 * g3)) / h; };
    const GapCurve curve(at(0), rate(0), at(1), rate(1), h);
    EXPECT_NEAR(curve.middle(), at(0.5), 1e-13);
    double lowest = HUGE_VAL;
    for (int k = 0; k <= 1000; ++k) lowest = std::min(lowest, at(k / 1000.));
    const auto low = curve.lowest();
    if (lowest < std::min(at(0), at(1)) - 1e-9) {
      ASSERT_TRUE(low.has_value()) << trial;
    }
    if (!low) continue;
    EXPECT_LE(low->gap, at(low->at / h) + 1e-12);
    EXPECT_NEAR(rate(low->at / h) * h, 0, 1e-7);
    for (const double beside : {-1e-4, 1e-4}) EXPECT_GE(at(low->at / h + beside), low->gap - 1e-13);
  }
}

Scene swing_against_stop(double from, double limit, double restitution, double step) {
  Scene scene = shipped("pendulum");
  scene.robot.model.joints[0].limits.lower = limit;
  scene.robot.constraints.rigid.stops = dynamics::hard_stops(scene.robot.model, restitution);
  scene.q[0] = from;
  scene.step = scene.sample = step;
  scene.duration = 4;
  return scene;
}

TEST(RigidDips, OfLongStepsAreFoundOrNotDecided) {
  const SimulatedMotion known = simulate(swing_against_stop(1.2, -1.195, 0.5, 1e-3));
  ASSERT_EQ(known.impacts, 2);
  const SimulatedMotion coarse = simulate(swing_against_stop(1.2, -1.195, 0.5, 0.2));
  EXPECT_NE(coarse.warning.find("whether it touches is not decided"), std::string::npos) << coarse.warning;

  std::mt19937_64 random(2);
  const auto between = [&](double a, double b) { return std::uniform_real_distribution(a, b)(random); };
  int refused = 0, touched = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const double from = between(0.3, 2), restitution = between(0, 1);
    const double limit = -from + (trial % 2 ? between(-0.02, 0.02) : between(0, 0.3));
    const SimulatedMotion fine = simulate(swing_against_stop(from, limit, restitution, 1e-3));
    const double step = std::vector<double>{0.2, 0.1, 0.05, 0.02}[std::size_t(trial % 4)];
    const SimulatedMotion motion = simulate(swing_against_stop(from, limit, restitution, step));
    const double off = std::abs(motion.q(0, motion.samples() - 1) - fine.q(0, fine.samples() - 1));
    refused += !motion.warning.empty();
    touched += fine.impacts > 0;
    if (motion.warning.empty() && motion.impacts != fine.impacts && off > 0.05) {
      ADD_FAILURE() << from << " " << limit << " " << restitution << " " << step << ": " << motion.impacts
                    << " of " << fine.impacts << ", off by " << off;
    }
  }
  EXPECT_GT(touched, 20);
  EXPECT_LT(refused, 15);
}

}  // namespace
}  // namespace dyntape::rigid_dips_test
