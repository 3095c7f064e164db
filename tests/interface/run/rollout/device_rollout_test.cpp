// SPDX-License-Identifier: BSD-3-Clause
//
// Roll-outs of a scene on a device: against those of the processor with a policy, and scenes that no device takes.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/run/rollout/device_rollout.h>
#include <dyntape/interface/run/rollout/policy_rollout.h>
#include "codegen/device/device_support.h"
#include "interface/message_of.h"
#include "source_folder.h"

namespace dyntape::device_rollout_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Scene pendulum() {
  Scene scene = read_scene(test::source_folder() + "/config/scenes/pendulum.info");
  scene.integrator = Integrator::kSemiImplicitEuler;
  return scene;
}

// The gravity of the pendulum is its own; the law holds it back.
Function law() {
  return record("law", 2, 2, [](const VectorXad& x, const VectorXad& p) {
    return VectorXad::Constant(1, -p[0] * sin(x[0]) - p[1] * x[1]).eval();
  });
}

TEST(DeviceRollout, HasTheBitsOfTheProcessor) {
  DYNTAPE_NEED_DEVICE;
  const Scene scene = pendulum();
  const Function policy = law();
  constexpr Index kWorlds = 150;
  constexpr int kSteps = 60, kEvery = 25;
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> uniform(-2, 2);
  const MatrixXd x0 = MatrixXd::NullaryExpr(2, kWorlds, [&] { return uniform(random); });
  MatrixXd p = MatrixXd::NullaryExpr(2, kWorlds, [&] { return uniform(random) + 3; });
  p(0, 17) = std::nan("");
  const PolicyMotions expected = PolicyRollout(scene, policy).run(x0, p, kSteps);
  const DeviceRollout rollout(scene, {.device = "opencl:0"}, &policy);
  ASSERT_EQ(rollout.n_x(), 2);
  ASSERT_EQ(rollout.n_u(), 1);
  MatrixXd states(2, kWorlds * (kSteps / kEvery));
  rollout.run({.worlds = std::size_t(kWorlds),
               .steps = kSteps,
               .every = kEvery,
               .x0 = x0.data(),
               .p = p.data(),
               .states = states.data(),
               .x_stride = 2,
               .p_stride = 2});
  for (Index world = 0; world < kWorlds; ++world) {
    for (Index k = 0; k < kSteps / kEvery; ++k) {
      const VectorXd found = states.col(world * (kSteps / kEvery) + k),
                     wanted = expected.of_world(world).col((k + 1) * kEvery - 1);
      EXPECT_EQ(wanted.hasNaN(), world == 17);
      EXPECT_TRUE(found == wanted || (found.hasNaN() && wanted.hasNaN())) << world << ": " << found - wanted;
    }
  }
}

TEST(DeviceRollout, ScenesAndPoliciesThatNoDeviceTakes) {
  Scene scene = pendulum();
  scene.integrator = Integrator::kImplicitMidpoint;
  EXPECT_EQ(
      message_of<ArgumentError>([&] { (void)DeviceRollout(scene, {.device = "opencl:0"}); }),
      "roll-out on a device: scene \"pendulum\" has the scheme implicit-midpoint; expected an explicit one, "
      "semi-implicit-euler or runge-kutta-4, or a roll-out on the processor");
  const Scene box = read_scene(test::source_folder() + "/config/scenes/tumbling_box.info");
  EXPECT_EQ(
      message_of<ArgumentError>([&] { (void)DeviceRollout(box, {.device = "opencl:0"}); }),
      "roll-out on a device: scene \"tumbling_box\" has rigid contacts or hard limits, whose steps iterate; "
      "expected compliant contacts, or a roll-out on the processor");
  const Function other = record("other", 3, [](const VectorXad& x) { return x; });
  EXPECT_EQ(
      message_of<ArgumentError>([&] { (void)DeviceRollout(pendulum(), {.device = "opencl:0"}, &other); }),
      "roll-out on a device: policy \"other\" takes 3 values and returns 3; expected 2 of the state, and 1 "
      "commands");
}

}  // namespace
}  // namespace dyntape::device_rollout_test
