// SPDX-License-Identifier: BSD-3-Clause
//
// Constrained dynamics as a callee: value and derivatives are those of what is recorded without it, in fewer operations.
#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_callee.h>
#include <dyntape/interface/system/scene_system.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <tuple>

#include "callee_derivatives.h"
#include "dynamics/robot_files.h"
#include "interface/run/shipped_scenes.h"

namespace dyntape::constrained_callee_test {
namespace {

using dynamics::Base;
using dynamics::Joint;
using dynamics::JointType;
using dynamics::Model;
using Constraints = std::vector<dynamics::Constraint<double>>;

Model<double> load(const char* name, Base base = Base::kFixed) {
  return dynamics::load_urdf(dynamics::robot_file(name), {.base = base});
}

// A floating robot whose base moves by six joints of one coordinate.
Model<double> on_lines(const Model<double>& robot) {
  Model<double> model;
  model.name = robot.name;
  model.gravity = robot.gravity;
  for (int k = 0; k < 6; ++k) {
    Joint<double> joint;
    joint.name = "base_" + std::to_string(k);
    joint.type = k < 3 ? JointType::kPrismatic : JointType::kRevolute;
    joint.axis = Eigen::Vector3d::Unit(k % 3);
    model.add_joint(k - 1, joint, {}, k == 5 ? robot.inertias[0] : dynamics::Inertia<double>{});
  }
  for (int i = 1; i < robot.njoints(); ++i) {
    model.add_joint(robot.parent[i] + 5, robot.joints[i], robot.X_PJ[i], robot.inertias[i]);
  }
  for (auto frame : robot.frames) {
    frame.body += 5;
    model.frames.push_back(frame);
  }
  return model;
}

Constraints points(const Model<double>& model, const std::vector<const char*>& frames) {
  Constraints held;
  for (const char* frame : frames) {
    held.push_back(dynamics::point_constraint(model, model.frame_index(frame), {0.3, 0.1, 0.2}));
  }
  return held;
}

struct Case {
  const char* name;
  bool independent, impact;
};

struct HeldRobot {
  Model<double> model;
  Constraints held;
};

HeldRobot robot_of(const std::string& name) {
  if (name == "four_bar") {  // in a plane: one of three rows depends on the others
    const Model<double> bars = load("four_bar");
    return {
        bars,
        {dynamics::loop_constraint(bars, bars.frame_index("rocker_end"), bars.frame_index("ground_pin"), 3)}};
  }
  if (name == "panda") {
    const Model<double> arm = load("panda");
    return {arm, {dynamics::frame_constraint(arm, arm.frame_index("panda_link8"), {})}};
  }
  if (name == "five_link_walker") {
    const Model<double> walker = load("five_link_walker");
    return {walker, points(walker, {"left_foot"})};
  }
  if (name == "ur5") {
    const Model<double> arm = load("ur5");
    return {arm, points(arm, {"tool0"})};
  }
  const Model<double> dog = on_lines(load("solo12", Base::kFloating));
  return {dog, points(dog, {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"})};
}

class ConstrainedCallee : public ::testing::TestWithParam<Case> {
 protected:
  ConstrainedCallee() {
    const auto [model, held] = robot_of(GetParam().name);
    const auto [name, independent, impact] = GetParam();
    callee = impact ? impulse_dynamics_callee(model, held, 0.2, independent)
                    : constrained_dynamics_callee(model, held, independent);
    const auto plain = dissolving_callee(*callee->recorded()->function);
    by_callee = wrapped(callee);
    by_value = dissolved(wrapped(plain));
  }

  // At arguments that depend on the variables nonlinearly, and with a nonlinear function of what comes out.
  static Function wrapped(const std::shared_ptr<const Callee>& dynamics) {
    return record("wrapped", dynamics->n_in, [&](const VectorXad& z) {
      VectorXad x = z;
      for (Eigen::Index i = 1; i < x.size(); ++i) x[i] += 0.1 * z[i - 1] * z[i];
      const VectorXad y = call(dynamics, x);
      VectorXad out(y.size() + 1);
      out << y, sin(y[0]) * z[0];
      return out;
    });
  }

  std::shared_ptr<const Callee> callee;
  Function by_callee, by_value;
};

TEST_P(ConstrainedCallee, ValueAndDerivativesAreThoseOfTheRecordedValue) {
  test::expect_same_derivatives(derive(by_callee, Order::kSecond), derive(by_value, Order::kSecond),
                                Order::kSecond, 3, 5, 1e-9);
}

TEST_P(ConstrainedCallee, TakesFewerOperations) {
  for (Order order : {Order::kFirst, Order::kSecond}) {
    const std::size_t a = total_operations(derive(by_callee, order).function),
                      b = total_operations(derive(by_value, order).function);
    std::printf("%s%s order %d: %zu of %zu\n", GetParam().name, GetParam().impact ? ", impact" : "",
                static_cast<int>(order), a, b);
    EXPECT_LT(a, b);
  }
}

class CompiledConstrainedCallee : public ConstrainedCallee {};

TEST_P(CompiledConstrainedCallee, HasTheBitsOfTheInterpreter) {
  CodegenOptions options;
  options.flags = {"-O1"};
  test::expect_bits_of_interpreter(by_callee, options, 5);
}

std::string name_of(const ::testing::TestParamInfo<Case>& info) {
  return std::string(info.param.name) + (info.param.impact ? "_impact" : "");
}

INSTANTIATE_TEST_SUITE_P(Robots, ConstrainedCallee,
                         ::testing::Values(Case{"four_bar", false, false}, Case{"ur5", true, false},
                                           Case{"panda", true, false}, Case{"solo12", true, false},
                                           Case{"five_link_walker", false, true}, Case{"ur5", true, true}),
                         name_of);
INSTANTIATE_TEST_SUITE_P(Robots, CompiledConstrainedCallee,
                         ::testing::Values(Case{"four_bar", false, false}, Case{"ur5", true, false},
                                           Case{"five_link_walker", false, true}),
                         name_of);

// Where rows may depend on each other forces are not unique, and not among the results.
TEST(ConstrainedCallees, GiveForcesOfIndependentRowsOnly) {
  const auto [arm, held] = robot_of("ur5");
  EXPECT_EQ(constrained_dynamics_callee(arm, held)->n_out, 6u);
  EXPECT_EQ(constrained_dynamics_callee(arm, held, true)->n_out, 9u);
  EXPECT_EQ(impulse_dynamics_callee(arm, held, 0.0)->n_out, 6u);
  EXPECT_EQ(impulse_dynamics_callee(arm, held, 0.0, true)->n_out, 9u);
}

// The accelerations of a scene with loops are such a callee, unless parameters change its robot.
TEST(ConstrainedCallees, AreWhatScenesWithLoopsMoveBy) {
  const RobotScene scene = shipped("four_bar").robot;
  const auto accelerations = [&](const System& system) {
    return record("accelerations", std::size_t(2 * system.model.nv), [&](const VectorXad& x) {
      const Eigen::Index n = system.model.nv;
      return system.acceleration({AD(0), x.head(n), x.tail(n), VectorXad::Constant(system.n_u, AD(0.5)),
                                  VectorXad::Constant(system.n_p, AD(0))});
    });
  };
  const Function f = accelerations(system_of(scene)),
                 plain = accelerations(system_of(scene, 1, [](RecordedScene&, const VectorXad&) {}));
  const Derivatives a = derive(f, Order::kSecond), b = derive(plain, Order::kSecond);
  EXPECT_LT(2 * total_operations(a.function), total_operations(b.function));
  test::expect_same_derivatives(a, b, Order::kSecond, 6, 1, 1e-9);
}

// Quaternions are read by their direction: of any length, also where the derivative is along it.
TEST(ConstrainedCallees, RobotsThatFloatAreHeldByTheEntriesOfTheirQuaternion) {
  for (const auto& [name, feet, order] :
       {std::tuple{"free_body", std::vector<const char*>{"body"}, Order::kSecond},
        std::tuple{"solo12", std::vector<const char*>{"FL_FOOT", "HR_FOOT"}, Order::kFirst}}) {
    const Model<double> robot = load(name, Base::kFloating);
    const auto callee = constrained_dynamics_callee(robot, points(robot, feet), true);
    EXPECT_EQ(callee->n_in, std::size_t(robot.nq + 2 * robot.nv));
    const Function of_callee =
        record("floats", callee->n_in, [&](const VectorXad& x) { return call(callee, x); });
    const Derivatives a = derive(of_callee, order), b = derive(*callee->recorded()->function, order);
    if (order == Order::kFirst) {
      EXPECT_LT(3 * total_operations(a.function), total_operations(b.function));
    }
    test::expect_same_derivatives(a, b, order, 5, 5, 1e-9);
  }
}

TEST(ConstrainedCallees, JointsOfSeveralCoordinatesAreRefused) {
  const Model<double> dog = load("solo12", Base::kFloating);
  EXPECT_THROW(impulse_dynamics_callee(dog, points(dog, {"FL_FOOT"}), 0.0), ArgumentError);
  EXPECT_THROW(inverse_dynamics_callee(dog), ArgumentError);
  Model<double> sled = load("double_pendulum");
  sled.joints[0].type = JointType::kPlanar;
  EXPECT_THROW(constrained_dynamics_callee(sled, {}), ArgumentError);
}

}  // namespace
}  // namespace dyntape::constrained_callee_test
