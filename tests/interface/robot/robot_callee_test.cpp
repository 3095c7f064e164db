// SPDX-License-Identifier: BSD-3-Clause
//
// Dynamics as callees: the value and derivatives of what is recorded without them, in fewer operations.
#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_callee.h>
#include <dyntape/interface/robot/robot_functions.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <iostream>

#include "callee_derivatives.h"
#include "source_folder.h"

namespace dyntape::robot_callee_test {
namespace {

using dynamics::Model;

Model<double> robot(const std::string& name, dynamics::Base base = dynamics::Base::kFixed) {
  const auto file = std::filesystem::path(test::source_folder()) / "config" / "robots" / (name + ".urdf");
  return dynamics::load_urdf(file.string(), {.base = base});
}

using Dynamics = std::function<VectorXad(const VectorXad&)>;

// Dynamics at arguments that depend on the variables nonlinearly, and nonlinear functions of what comes out.
Function wrapped(std::size_t n, const Dynamics& dynamics) {
  return record("wrapped", n, [&](const VectorXad& z) {
    VectorXad x = z;
    for (Eigen::Index i = 1; i < x.size(); ++i) x[i] += 0.1 * z[i - 1] * z[i];
    const VectorXad y = dynamics(x);
    VectorXad out(y.size() + 2);
    out << y, y.squaredNorm(), sin(y[0]) * z[0];
    return out;
  });
}

struct Case {
  const char* robot;
  bool forward;
};

class RobotCallee : public ::testing::TestWithParam<Case> {
 protected:
  RobotCallee() : model(robot(GetParam().robot)) {
    callee = GetParam().forward ? forward_dynamics_callee(model) : inverse_dynamics_callee(model);
    const RobotFunction value = GetParam().forward ? RobotFunction::kAba : RobotFunction::kRnea;
    const Function recorded = record_robot_function(model, value);
    by_callee = wrapped(callee->n_in, [&](const VectorXad& x) { return call(callee, x); });
    by_value = wrapped(callee->n_in, [&](const VectorXad& x) { return inlined(recorded, x); });
  }

  // The recorded value, spliced into the recording at hand: what one gets who calls dynamics::rnea there.
  static VectorXad inlined(const Function& f, const VectorXad& x) { return call(dissolving_callee(f), x); }

  Model<double> model;
  std::shared_ptr<const Callee> callee;
  Function by_callee, by_value;
};

TEST_P(RobotCallee, ValueAndDerivativesAreThoseOfTheRecordedValue) {
  test::expect_same_derivatives(derive(by_callee, Order::kSecond),
                                derive(dissolved(by_value), Order::kSecond), Order::kSecond, 3, 20, 1e-10);
}

TEST_P(RobotCallee, TakesFewerOperations) {
  for (Order order : {Order::kFirst, Order::kSecond}) {
    const std::size_t a = total_operations(derive(by_callee, order).function),
                      b = total_operations(derive(dissolved(by_value), order).function);
    std::cout << GetParam().robot << (GetParam().forward ? " forward" : " inverse") << " order "
              << static_cast<int>(order) << ": " << a << " of " << b << "\n";
    EXPECT_LT(static_cast<double>(a), 0.75 * static_cast<double>(b));
  }
}

// Poles of the inverse inertia: what masks the weights of its derivatives is a small part of them.
TEST_P(RobotCallee, TakesFewGates) {
  for (const Function& function : {by_callee, dissolved(by_value)}) {
    const Derivatives d = derive(function, Order::kSecond);
    std::size_t gates = 0;
    for (const OperationCount& count : count_operations(d.function))
      gates += count.op == Op::Gate ? count.count : 0;
    EXPECT_LT(static_cast<double>(gates), 0.06 * static_cast<double>(total_operations(d.function)));
    EXPECT_EQ(gates > 0, GetParam().forward);
  }
}

class CompiledRobotCallee : public RobotCallee {};

TEST_P(CompiledRobotCallee, HasTheBitsOfTheInterpreter) {
  test::expect_bits_of_interpreter(by_callee, {}, 20);
}

std::string name_of(const ::testing::TestParamInfo<Case>& info) {
  return std::string(info.param.robot) + (info.param.forward ? "_forward" : "_inverse");
}

INSTANTIATE_TEST_SUITE_P(Robots, RobotCallee,
                         ::testing::Values(Case{"ur5", false}, Case{"ur5", true}, Case{"panda", false},
                                           Case{"iiwa14", true}),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Robots, CompiledRobotCallee,
                         ::testing::Values(Case{"ur5", false}, Case{"ur5", true}), name_of);

TEST(RobotCallees, WhatTheDerivativesAreEntersTheKey) {
  const Model<double> arm = robot("arm_2r");
  const auto known = inverse_dynamics_callee(arm), plain = recorded_callee(*known->recorded()->function);
  const auto f = [&](const std::shared_ptr<const Callee>& callee) {
    return record("f", callee->n_in, [&](const VectorXad& x) { return call(callee, x); });
  };
  EXPECT_EQ(content_hash(f(known)), content_hash(f(plain)));
  EXPECT_NE(content_hash(f(known), 2), content_hash(f(plain), 2));
  EXPECT_EQ(content_hash(f(known), 2), content_hash(f(inverse_dynamics_callee(arm)), 2));
}

TEST(RobotCallees, FunctionsToBeDerivedUseThem) {
  const Model<double> arm = robot("ur5");
  const RobotFunction rnea = RobotFunction::kRnea;
  const Function f = record_differentiable(arm, rnea), plain = record_robot_function(arm, rnea);
  EXPECT_EQ(f.name, plain.name);
  EXPECT_EQ(f.input_names, plain.input_names);
  EXPECT_EQ(f.output_names, plain.output_names);
  EXPECT_EQ(content_hash(dissolved(f)), content_hash(plain));
  EXPECT_LT(2 * total_operations(derive(f, Order::kSecond).function),
            total_operations(derive(plain, Order::kSecond).function));
  // Two joints, joints of several coordinates, other functions: recorded as they are.
  EXPECT_EQ(content_hash(record_differentiable(robot("arm_2r"), rnea)),
            content_hash(record_robot_function(robot("arm_2r"), rnea)));
  const Model<double> afloat = robot("solo12", dynamics::Base::kFloating);
  EXPECT_TRUE(record_differentiable(afloat, rnea).graph.callees().empty());
  EXPECT_TRUE(record_differentiable(arm, RobotFunction::kCrba).graph.callees().empty());
}

TEST(RobotCallees, JointsOfSeveralCoordinatesAreRefused) {
  try {
    inverse_dynamics_callee(robot("solo12", dynamics::Base::kFloating));
    FAIL();
  } catch (const ArgumentError& e) {
    EXPECT_NE(std::string(e.what()).find("joints of one coordinate"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace dyntape::robot_callee_test
