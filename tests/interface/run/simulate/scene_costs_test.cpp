// SPDX-License-Identifier: BSD-3-Clause
//
// What each effect costs on a seven-joint arm: operations of forward dynamics and of its Jacobian, with the effect less
// without.  The table is what `simulate --explain` prints of a scene; a change of it is a change of what users pay.
#include <gtest/gtest.h>

#include <functional>

#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/run/simulate/effect_costs.h>

#include "source_folder.h"

namespace dyntape::scene_costs_test {
namespace {

using dynamics::Effects;
using Eigen::VectorXd;

RobotScene arm() {
  return {dynamics::load_urdf(test::source_folder() + "/config/robots/panda.urdf",
                              {.lock = {"panda_finger_joint1", "panda_finger_joint2"}})};
}
VectorXd all(double value) { return VectorXd::Constant(7, value); }

FunctionCost counted(const RobotScene& scene) { return scene_cost(scene, {}, false); }

struct Row {
  const char* name;
  std::function<void(RobotScene&)> add;
  long value, jacobian;  // operations it adds
};

template <class Item>
Item at_hand(const RobotScene& scene, Item item) {
  dynamics::place_at_frame(scene.model, "panda_hand", item);
  return item;
}

const Row kRows[] = {
    {"gravity", [](RobotScene& s) { s.effects.gravity = true; }, 60, 398},
    {"velocity products", [](RobotScene& s) { s.effects.coriolis = true; }, 771, 10752},
    {"damping", [](RobotScene& s) { s.effects.damping = all(0.3); }, 14, 15},
    {"springs",
     [](RobotScene& s) {
       s.effects.springs = dynamics::Springs<double>{all(3), all(0.1)};
     },
     21, 168},
    {"Coulomb",
     [](RobotScene& s) {
       s.effects.friction = dynamics::CoulombFriction<double>{all(0.3), 0.01};
     },
     28, 91},
    {"Stribeck",
     [](RobotScene& s) {
       s.effects.friction = dynamics::CoulombFriction<double>{all(0.3), 0.01, all(0.5), 0.1};
     },
     70, 175},
    {"armature", [](RobotScene& s) { s.effects.armature = all(0.1); }, 178, 1101},
    {"smooth saturation",
     [](RobotScene& s) {
       s.effects.saturation = dynamics::Saturation<double>{all(20), dynamics::SaturationKind::kSmooth};
     },
     21, 110},
    {"soft limits",
     [](RobotScene& s) {
       s.effects.limits = dynamics::SoftLimits<double>{all(100), all(1), all(0.1)};
     },
     231, 625},
    {"wrench at the hand",
     [](RobotScene& s) {
       dynamics::Wrench<double> push;
       push.value = {{1, 2, 3}, {0.1, 0.2, 0.3}};
       s.effects.wrenches.push_back(at_hand(s, push));
     },
     90, 280},
    {"added mass at the hand",
     [](RobotScene& s) {
       dynamics::AddedBody<double> hull;
       hull.mass = {1, 2, 3}, hull.inertia = {0.1, 0.2, 0.3};
       s.effects.added_mass.push_back(at_hand(s, hull));
     },
     141, 1507},
    {"contact at the hand",
     [](RobotScene& s) {
       dynamics::ContactBody<double> body;
       body.stiffness = 1e4, body.dissipation = 0.5, body.friction = 0.7;
       s.effects.contacts.push_back(at_hand(s, body));
     },
     261, 3176},
};

TEST(EffectCosts, OfASevenJointArmAreWhatTheyWere) {
  RobotScene bare = arm();
  bare.effects.gravity = false;
  bare.effects.coriolis = false;
  for (const Row& row : kRows) {
    RobotScene scene = arm();
    const bool is_own = std::string(row.name) == "gravity" || std::string(row.name) == "velocity products";
    if (is_own) scene = bare;
    const FunctionCost without = counted(scene);
    row.add(scene);
    const FunctionCost with = counted(scene);
    EXPECT_EQ(with.value.operations - without.value.operations, row.value) << row.name;
    EXPECT_EQ(with.jacobian.operations - without.jacobian.operations, row.jacobian) << row.name;
  }
}

// What acts at one joint costs the same on each, however many there are.
TEST(EffectCosts, OfJointEffectsAreLocal) {
  const auto cost_a_joint = [](const char* robot, const auto& add) {
    RobotScene scene{dynamics::load_urdf(std::string(test::source_folder() + "/config/robots/") + robot)};
    const long without = counted(scene).value.operations;
    add(scene);
    return double(counted(scene).value.operations - without) / scene.model.nv;
  };
  const auto damping = [](RobotScene& s) { s.effects.damping = VectorXd::Constant(s.model.nv, 0.3); };
  const auto friction = [](RobotScene& s) {
    s.effects.friction = dynamics::CoulombFriction<double>{VectorXd::Constant(s.model.nv, 0.3), 0.01};
  };
  for (const char* robot : {"double_pendulum.urdf", "arm_2r.urdf", "ur5.urdf", "iiwa14.urdf"}) {
    EXPECT_EQ(cost_a_joint(robot, damping), 2) << robot;
    EXPECT_EQ(cost_a_joint(robot, friction), 4) << robot;
  }
}

}  // namespace
}  // namespace dyntape::scene_costs_test
