// SPDX-License-Identifier: BSD-3-Clause
//
// Hard cases of rigid bodies through what users run: the interpreter, and generated C at -O0 and at -O3, with
// derivatives of first and second order.  The same cases in plain double are in tests/dynamics.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include <dyntape/dynamics/algebra/lie.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_functions.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "every_route.h"
#include "source_folder.h"

namespace dyntape::dynamics_hard_test {
namespace {

using dynamics::Model;
using testing::EveryRoute;
using testing::same_bits;
using ::testing::Values;

Model<double> quadruped() {
  return dynamics::load_urdf(test::source_folder() + "/config/robots/solo12.urdf",
                             {.base = dynamics::Base::kFloating});
}

Values standing(const Model<double>& model, const RobotFunction& function) {
  Values state(input_names(model, function).size());
  for (std::size_t i = 0; i < state.size(); ++i) state[i] = std::sin(1.0 + 2.0 * static_cast<double>(i));
  return state;
}

class HardBase : public ::testing::TestWithParam<RobotFunction> {};

// H30, H07 | naive: recursions in world axes lose all digits at 1e8 m; a tape knows one sheet of quaternions | holds:
// bit-equal at 1e8 m and for q and -q, for torques, accelerations, inertias and their derivatives | routes: all
TEST_P(HardBase, FarAwayAndOnBothSheetsTheBitsAreTheSame) {
  const Model<double> model = quadruped();
  const Function f = record_robot_function(model, GetParam());
  const EveryRoute routes(f, Order::kValue, {.near = 1e-10});
  Values state = standing(model, GetParam());
  const Values here = routes(state);
  for (double distance : {1e2, 1e4, 1e8}) {
    Values there = state;
    for (int i = 0; i < 3; ++i) there[i] += distance;
    EXPECT_TRUE(same_bits(routes(there), here)) << distance;
  }
  for (int i = 3; i < 7; ++i) state[i] = -state[i];
  EXPECT_TRUE(same_bits(routes(state), here));
}

INSTANTIATE_TEST_SUITE_P(Functions, HardBase, ::testing::ValuesIn(kCoreFunctions), [](const auto& info) {
  std::string name = to_string(info.param);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

// A chain of revolute joints about alternating axes; body i has the given mass.
Model<double> chain(const std::vector<double>& masses) {
  Model<double> model;
  model.name = "chain";
  for (std::size_t i = 0; i < masses.size(); ++i) {
    dynamics::Joint<double> joint;
    joint.name = "joint_" + std::to_string(i);
    joint.axis = Eigen::Vector3d::Unit(static_cast<int>(i) % 3);
    const dynamics::Placement<double> link{Eigen::Matrix3d::Identity(), {0.3, 0.1, i ? -0.2 : 0.0}};
    model.add_joint(static_cast<int>(i) - 1, joint, link,
                    {masses[i], {0.1, 0.05, -0.1}, 0.01 * masses[i] * Eigen::Matrix3d::Identity()});
  }
  return model;
}

// Largest error against 113 bits over the largest entry.
double error_against_quad(const Model<double>& model, const RobotFunction& function, const Values& state,
                          const Values& got) {
  using Quad = dynamics::Float128;
  const Model<Quad> exact = model.cast<Quad>();
  detail::RobotWorkspace<Quad> work(exact, function);
  const dynamics::VectorX<Quad> x =
      Eigen::Map<const Eigen::VectorXd>(state.data(), static_cast<long>(state.size())).cast<Quad>();
  std::vector<Quad> expected(got.size());
  work.evaluate(x.data(), expected.data());
  double error = 0, scale = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    error = std::max(error, std::abs(static_cast<double>(Quad(got[i]) - expected[i])));
    scale = std::max(scale, std::abs(static_cast<double>(expected[i])));
  }
  return error / scale;
}

// H35 | naive: text of a chain grows with the square of its length, or its compiler gives up | holds: accelerations
// of three hundred joints to 1e-12 of 113 bits | routes: all
TEST(HardChains, ThreeHundredJoints) {
  const Model<double> model = chain(Values(300, 1.0));
  const Values state = standing(model, RobotFunction::kAba);
  const EveryRoute routes(record_robot_function(model, RobotFunction::kAba), Order::kValue,
                          {.lanes = false, .near = 1e-9});
  EXPECT_LE(error_against_quad(model, RobotFunction::kAba, state, routes(state)), 1e-12);
}

}  // namespace
}  // namespace dyntape::dynamics_hard_test
