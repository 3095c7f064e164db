// SPDX-License-Identifier: BSD-3-Clause
//
// Only what the scene calls for: all 32 choices of effects, and what each leaves in the generated C.
#include <gtest/gtest.h>

#include <set>

#include <dyntape/codegen/pipeline.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_functions.h>

#include "source_folder.h"

namespace dyntape::effects_in_c_test {
namespace {

using dynamics::Effects;
using dynamics::Model;

enum Choice { kGravity = 1, kArmature = 2, kDamping = 4, kFriction = 8, kSprings = 16, kAll = 32 };

// Strengths that no other constant of the recording equals, so that each can be looked for in the text.
constexpr double kStrength[] = {9.8125, 0.3779296875, 0.7138671875, 0.6435546875, 5.8388671875};

Model<double> arm() {
  auto model = dynamics::load_urdf(test::source_folder() + "/config/robots/arm_2r.urdf");
  model.gravity = {0, 0, -kStrength[0]};
  return model;
}

Effects<double> chosen(const Model<double>& model, int choice) {
  const auto all = [&](double value) { return Eigen::VectorXd::Constant(model.nv, value).eval(); };
  Effects<double> effects;
  effects.gravity = choice & kGravity;
  if (choice & kArmature) effects.armature = all(kStrength[1]);
  if (choice & kDamping) effects.damping = all(kStrength[2]);
  if (choice & kFriction) effects.friction = dynamics::CoulombFriction<double>{all(kStrength[3]), 0.015625};
  if (choice & kSprings)
    effects.springs = dynamics::Springs<double>{all(kStrength[4]), Eigen::VectorXd::Zero(model.nq)};
  return effects;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(EffectsInC, LeaveATraceOnlyWhereChosen) {
  const Model<double> model = arm();
  std::set<std::string> hashes;
  for (int choice = 0; choice < kAll; ++choice) {
    SCOPED_TRACE(choice);
    const Function f = record_inverse_dynamics(model, chosen(model, choice));
    hashes.insert(content_hash(f));
    CodegenOptions options;
    options.order = Order::kFirst;
    const std::string text = generate_source(f, options).text;
    EXPECT_EQ(contains(text, "tanh("), bool(choice & kFriction));
    EXPECT_EQ(contains(text, "9.8125"), bool(choice & kGravity));
    EXPECT_EQ(contains(text, "0.3779296875"), bool(choice & kArmature));
    EXPECT_EQ(contains(text, "0.7138671875"), bool(choice & kDamping));
    EXPECT_EQ(contains(text, "0.6435546875"), bool(choice & kFriction));
    EXPECT_EQ(contains(text, "5.8388671875"), bool(choice & kSprings));
  }
  EXPECT_EQ(hashes.size(), static_cast<std::size_t>(kAll));  // and each choice is a function of its own
}

// An effect that acts at a joint alone costs the same in every company, but for a negation a joint: a sum that
// ends in one absorbs it where a further term follows.
TEST(EffectsInC, JointEffectsCostTheSameInEveryCompany) {
  const Model<double> model = arm();
  const auto operations = [&](int choice) {
    return static_cast<int>(total_operations(record_inverse_dynamics(model, chosen(model, choice))));
  };
  for (int effect : {int(kDamping), int(kFriction), int(kSprings)}) {
    const int alone = operations(effect | kGravity) - operations(kGravity);
    EXPECT_GT(alone, 0);
    for (int others = 0; others < kAll; ++others) {
      if (others & effect || !(others & kGravity)) continue;
      EXPECT_NEAR(operations(others | effect) - operations(others), alone, model.nv)
          << effect << " with " << others;
    }
  }
}

}  // namespace
}  // namespace dyntape::effects_in_c_test
