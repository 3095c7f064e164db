// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <dyntape/dynamics/algorithms/inertia_condition.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include <limits>

#include "dynamics/random_robots.h"
#include "dynamics/robot_files.h"

namespace dyntape::dynamics::inertia_condition_test {
namespace {

// A point mass at distance 1 beyond two parallel joints, the second a lever away from the first: at q = 0 the condition is
// M_11 M_22 / det M = 1 + 1 / l^2.
Model<double> two_levers(double lever) {
  Model<double> model;
  Joint<double> joint;
  joint.name = "first";
  model.add_joint(-1, joint, {}, {});
  joint.name = "second";
  Placement<double> away;
  away.p = {lever, 0, 0};
  model.add_joint(0, joint, away, {2, {0, 1, 0}, Matrix3<double>::Zero()});
  return model;
}

TEST(InertiaCondition, OfTwoLeversIsKnown) {
  for (const double lever : {1.0, 0.1, 1e-3, 1e-6, 1e-10}) {
    const Model<double> model = two_levers(lever);
    Data<double> data(model);
    EXPECT_NEAR(inertia_condition(model, data, neutral(model)) / (1 + 1 / (lever * lever)), 1, 1e-12)
        << lever;
    EXPECT_GE(worst_inertia_condition(model), 1 + 1 / (lever * lever)) << lever;
  }
}

TEST(InertiaCondition, IsOneWhereNothingCouples) {
  Model<double> slide;
  Joint<double> joint;
  joint.type = JointType::kPrismatic;
  slide.add_joint(-1, joint, {}, {2, {0, 1, 0}, Matrix3<double>::Zero()});
  EXPECT_DOUBLE_EQ(worst_inertia_condition(slide), 1);
  EXPECT_EQ(worst_inertia_condition(Model<double>()), 1);
}

// No unit of mass or length.
TEST(InertiaCondition, HasNoUnits) {
  Random random(5);
  const Model<double> model = random_tree(random, {.joints = 8, .base = Base::kFloating});
  Model<double> other = model;
  for (int i = 0; i < model.njoints(); ++i) {
    other.inertias[i].mass *= 0x1p-20;
    other.inertias[i].I_c *= 0x1p-20;
    other.joints[i].armature *= 0x1p-20;
  }
  const double condition = worst_inertia_condition(model);
  EXPECT_GT(condition, 1);
  EXPECT_NEAR(worst_inertia_condition(other) / condition, 1, 1e-12);
}

TEST(InertiaCondition, IsInfiniteWithoutInertia) {
  Model<double> model = two_levers(0.5);
  Joint<double> joint;
  joint.name = "third";
  model.add_joint(1, joint, {}, {});
  EXPECT_EQ(worst_inertia_condition(model), std::numeric_limits<double>::infinity());
}

TEST(InertiaCondition, OfShippedRobots) {
  const struct {
    const char* robot;
    Base base;
    double least, most;
  } robots[] = {{"ur5", Base::kFixed, 3, 20},         {"panda", Base::kFixed, 10, 100},
                {"solo12", Base::kFloating, 3, 20},   {"simple_humanoid", Base::kFloating, 10, 50},
                {"talos", Base::kFloating, 100, 500}, {"panda", Base::kFloating, 300, 1000},
                {"g1", Base::kFloating, 3000, 20000}};
  for (const auto& [robot, base, least, most] : robots) {
    const double condition = worst_inertia_condition(load_urdf(robot_file(robot), {.base = base}));
    EXPECT_GE(condition, least) << robot;
    EXPECT_LE(condition, most) << robot;
  }
}

}  // namespace
}  // namespace dyntape::dynamics::inertia_condition_test
