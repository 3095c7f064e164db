// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/check_forward_dynamics.h>

#include <memory>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::check_forward_dynamics_test {
namespace {

using Matrix3d = Matrix3<double>;
using Vector3d = Vector3<double>;

Joint<double> joint(const std::string& name, JointType type = JointType::kRevolute,
                    const Vector3d& axis = Vector3d::UnitZ()) {
  Joint<double> j;
  j.name = name;
  j.type = type;
  j.axis = axis;
  return j;
}

Inertia<double> point_mass(double mass, const Vector3d& at) { return {mass, at, Matrix3d::Zero()}; }
Inertia<double> solid() { return {2, Vector3d(0.1, 0, 0.2), Matrix3d::Identity() * 0.3}; }
Placement<double> along(double x, double z) { return {Matrix3d::Identity(), Vector3d(x, 0, z)}; }

// The message of the error, empty if there is none.
std::string complaint(const Model<double>& model, const DynamicsTerms<double>& acting = {}) {
  try {
    check_forward_dynamics(model, acting);
    return "";
  } catch (const NumericalError& e) {
    return e.what();
  }
}

TEST(CheckForwardDynamics, RandomTreesAreFine) {
  for (unsigned long seed = 1; seed <= 30; ++seed) {
    Random random(seed);
    Model<double> model = random_tree(random, {8, seed % 2 ? Base::kFloating : Base::kFixed});
    for (auto& j : model.joints) j.armature = 0;
    EXPECT_EQ(complaint(model), "") << "seed " << seed;
  }
}

TEST(CheckForwardDynamics, MasslessLeafIsNamed) {
  Model<double> model;
  model.add_joint(-1, joint("shoulder"), {}, solid());
  model.add_joint(0, joint("wrist"), along(1, 0), {});
  EXPECT_NE(complaint(model).find("\"wrist\""), std::string::npos) << complaint(model);
  model.joints[1].armature = 1e-3;
  EXPECT_EQ(complaint(model), "");
  EXPECT_NEAR(minverse(model, *std::make_unique<Data<double>>(model), neutral(model))(1, 1), 1000, 1e-9);
  DynamicsTerms<double> off;
  off.armature = false;
  EXPECT_NE(complaint(model, off), "");
}

TEST(CheckForwardDynamics, PointMassOnItsAxisIsNamedAndOffItIsFine) {
  Model<double> model;
  model.add_joint(-1, joint("spin"), {exp(Vector3d(0.3, 0.2, 0.1)), Vector3d(1, 2, 3)},
                  point_mass(1, Vector3d(1e-17, 0, 0.7)));
  EXPECT_NE(complaint(model).find("\"spin\""), std::string::npos);
  model.inertias[0] = point_mass(1, Vector3d(0.1, 0, 0.7));
  EXPECT_EQ(complaint(model), "");
}

// A rod about its own axis, its inertia turned to general axes: what is left about the joint is rounding.
TEST(CheckForwardDynamics, RodTurnedAboutItselfIsNamed) {
  const Matrix3d R = exp(Vector3d(0.3, -1.2, 0.7));
  const Matrix3d rod = Vector3d(0.1, 0.1, 0).asDiagonal();
  Model<double> model;
  model.add_joint(-1, joint("roll", JointType::kContinuous, R.col(2).normalized()), {},
                  {1, R.col(2) * 0.5, rotate_symmetric(R, rod)});
  EXPECT_NE(complaint(model).find("\"roll\""), std::string::npos);
}

TEST(CheckForwardDynamics, MasslessIntermediateLinksAreFine) {
  Model<double> model;
  model.add_joint(-1, joint("yaw"), {}, {});
  model.add_joint(0, joint("pitch", JointType::kRevolute, Vector3d::UnitY()), {}, {});
  model.add_joint(1, joint("roll", JointType::kRevolute, Vector3d::UnitX()), {}, solid());
  EXPECT_EQ(complaint(model), "");
  Data<double> data(model);
  const Vector3<double> q(0.3, 0.4, 0.5), v(1, 2, 3), a(4, 5, 6), tau = rnea(model, data, q, v, a);
  EXPECT_LE((aba(model, data, q, v, tau) - a).norm(), 1e-12);
}

// Two joints on one axis with nothing between them share a body: only their sum is determined.
TEST(CheckForwardDynamics, TwoJointsOnOneAxisAreNamed) {
  Model<double> model;
  const Placement<double> turned{exp(Vector3d(0.3, -1.2, 0.7)), Vector3d(0.1, 0.2, 0.3)};
  model.add_joint(-1, joint("inner"), turned, {});
  model.add_joint(0, joint("outer"), along(0, 0.4), solid());
  EXPECT_NE(complaint(model).find("\"inner\""), std::string::npos) << complaint(model);
}

TEST(CheckForwardDynamics, SlidersNeedMassAndFloatingBasesABody) {
  Model<double> slider;
  slider.add_joint(-1, joint("slide", JointType::kPrismatic), {}, {});
  EXPECT_NE(complaint(slider).find("prismatic joint \"slide\""), std::string::npos);
  slider.inertias[0] = point_mass(1, Vector3d::Zero());
  EXPECT_EQ(complaint(slider), "");

  Model<double> floating;
  floating.add_joint(-1, joint("base", JointType::kFreeFlyer), {}, point_mass(1, Vector3d(1.1, 2.3, 3.7)));
  EXPECT_NE(complaint(floating).find("\"base\""), std::string::npos);
  floating.inertias[0] = solid();
  EXPECT_EQ(complaint(floating), "");
}

// Light links under heavy ones are hard, not wrong.
TEST(CheckForwardDynamics, MassRatiosAreFine) {
  for (const double ratio : {1e-12, 1e-9, 1e9, 1e12}) {
    Model<double> model;
    for (int i = 0; i < 6; ++i) {
      Inertia<double> body = solid();
      const double scale = i == 5 ? ratio : 1;
      body.mass *= scale;
      body.I_c *= scale;
      model.add_joint(i - 1, joint("j" + std::to_string(i), JointType::kRevolute, Vector3d::Unit(i % 3)),
                      along(0.5, 0.1), body);
    }
    EXPECT_EQ(complaint(model), "") << ratio;
  }
}

}  // namespace
}  // namespace dyntape::dynamics::check_forward_dynamics_test
