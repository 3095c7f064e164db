// SPDX-License-Identifier: BSD-3-Clause
//
// Rigid bodies at extremes: masses over decades, long chains, other units, fast motions, axes in line.
#include <gtest/gtest.h>

#include <cfenv>
#include <cmath>
#include <numbers>

#include <dyntape/dynamics/algorithms/check_forward_dynamics.h>
#include <dyntape/dynamics/algorithms/inertia_condition.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_functions.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "dynamics/random_robots.h"
#include "every_route.h"
#include "source_folder.h"

namespace dyntape::robots_hard_test {
namespace {

using dynamics::JointType;
using dynamics::Model;
using dynamics::Random;
using dynamics::State;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::EveryRoute;
using testing::Float128;
using ::testing::Values;

Values state_of(const Model<double>& model, const RobotFunction& function, const State& s) {
  Values x(s.q.begin(), s.q.end());
  const std::size_t n = input_names(model, function).size();
  for (const VectorXd* part : {&s.v, is_forward(function) ? &s.tau : &s.a})
    x.insert(x.end(), part->begin(), part->end());
  x.resize(n);
  return x;
}

Values in_quad(const Model<double>& model, const RobotFunction& function, const Values& state,
               std::size_t size) {
  const Model<Float128> exact = model.cast<Float128>();
  detail::RobotWorkspace<Float128> work(exact, function);
  const std::vector<Float128> x(state.begin(), state.end());
  std::vector<Float128> y(size);
  work.evaluate(x.data(), y.data());
  Values rounded;
  for (const Float128& number : y) rounded.push_back(static_cast<double>(number));
  return rounded;
}

// By every route, held to 113 bits.
void expect_exact(const Model<double>& model, const RobotFunction& function, const Values& x, double within,
                  const testing::RouteOptions& options = {.near = 1e-11}) {
  const EveryRoute routes(record_robot_function(model, function), Order::kValue, options);
  const Values got = routes(x), expected = in_quad(model, function, x, got.size());
  EXPECT_LE(testing::error_of(got, expected), within) << to_string(function) << " recorded";
  const VectorXd direct =
      evaluate_analytic(model, function, Eigen::Map<const VectorXd>(x.data(), long(x.size())));
  EXPECT_LE(testing::error_of({direct.begin(), direct.end()}, expected), within)
      << to_string(function) << " in double";
}

// Revolute joints about alternating axes; body i has the mass, its links the lengths.
Model<double> chain(const std::vector<double>& masses) {
  Model<double> model;
  model.name = "chain";
  for (std::size_t i = 0; i < masses.size(); ++i) {
    dynamics::Joint<double> joint;
    joint.name = "joint_" + std::to_string(i);
    joint.axis = Vector3d::Unit(static_cast<int>(i) % 3);
    const dynamics::Placement<double> link{Matrix3d::Identity(), {0.3, 0.1, i ? -0.2 : 0.0}};
    model.add_joint(static_cast<int>(i) - 1, joint, link,
                    {masses[i], {0.1, 0.05, -0.1}, 0.01 * masses[i] * Matrix3d::Identity()});
  }
  return model;
}

// --- Masses --------------------------------------------------------------------------------------------------

struct Masses {
  const char* name;
  std::vector<double> values;
};

class MassesOver : public ::testing::TestWithParam<Masses> {};

// H34, X04 | naive: the residual of inverse dynamics reads 1.5e-6 at a ratio of 1e9 and says nothing of the error; a
// heavy leaf takes nine digits from a factorisation of M | holds: torques, accelerations and their derivatives to
// 1e-12 of 113 bits, masses over 18 decades up and down the chain among them | routes: template in double, all of C
// and the interpreter
TEST_P(MassesOver, LoseNothing) {
  const Model<double> model = chain(GetParam().values);
  Random random(11);
  const State s = random_state(model, random);
  for (const RobotFunction& function :
       {RobotFunction::kRnea, RobotFunction::kAba, RobotFunction::kFdDerivatives})
    expect_exact(model, function, state_of(model, function, s), 1e-12, {.lanes = false, .near = 1e-9});
}

INSTANTIATE_TEST_SUITE_P(Decades, MassesOver,
                         ::testing::Values(Masses{"heavy_leaf", {1, 1, 1, 1e6}},
                                           Masses{"very_heavy_leaf", {1, 1, 1, 1e9}},
                                           Masses{"light_leaf", {1, 1, 1, 1e-12}},
                                           Masses{"alternating", {1e6, 1, 1e6, 1}},
                                           Masses{"heavy_in_the_middle", {1, 1e9, 1}},
                                           Masses{"eighteen_decades_down", {1e9, 1e3, 1e-3, 1e-9}},
                                           Masses{"eighteen_decades_up", {1e-9, 1e-3, 1e3, 1e9}},
                                           Masses{"grains", {1e-18, 1e-18, 1e-18}}),
                         [](const auto& info) { return info.param.name; });

// H32 | naive: a link without mass in the middle of a chain is refused, or is divided by | holds: accelerations as
// exact as ever, for all that moves something | routes: template in double, all of C and the interpreter
TEST(Massless, LinksBetweenOthersAreFine) {
  Model<double> model = chain({1, 0, 0, 2});
  model.inertias[1] = model.inertias[2] = {};
  Random random(12);
  const State s = random_state(model, random);
  EXPECT_NO_THROW(dynamics::check_forward_dynamics(model));
  for (const RobotFunction& function : {RobotFunction::kAba, RobotFunction::kFdDerivatives})
    expect_exact(model, function, state_of(model, function, s), 1e-12, {.near = 1e-10});
}

// H31 | naive: a point mass on its own axis gives NaN, or 3e17 in the inverse inertia | holds: refused with the
// joint's name, and with an armature of 1e-3 the acceleration is tau / armature = 100 | routes: template in double,
// all of C and the interpreter
TEST(Massless, APointOnItsAxisMovesByItsArmature) {
  Model<double> model;
  model.name = "reel";
  dynamics::Joint<double> joint;
  joint.name = "drum";
  model.add_joint(-1, joint, {}, {1, {0, 0, 0.3}, Matrix3d::Zero()});
  try {
    record_robot_function(model, RobotFunction::kAba);
    ADD_FAILURE() << "recorded";
  } catch (const NumericalError& e) {
    EXPECT_NE(std::string(e.what()).find("\"drum\""), std::string::npos) << e.what();
  }
  model.joints[0].armature = 1e-3;
  const EveryRoute routes(record_robot_function(model, RobotFunction::kAba), Order::kFirst);
  EXPECT_NEAR(routes({0.7, 3, 0.1})[0], 100, 1e-12);
}

// H39 | naive: the rotor counts n times, not n^2 times, or swallows the link | holds: M = link + n^2 I_r to the last
// digit | routes: template in double, all of C and the interpreter
TEST(Gears, RotorsCountWithTheSquareBesideTheirLinks) {
  Model<double> model;
  dynamics::Joint<double> joint;
  model.add_joint(-1, joint, {}, {1e-3, {0, 0, 0}, 1e-3 * Matrix3d::Identity()});
  dynamics::Effects<double> effects;
  effects.armature = dynamics::Armature<double>{};
  effects.armature->inertia = VectorXd::Zero(1);
  effects.armature->rotor_inertia = VectorXd::Constant(1, 1e-6),
  effects.armature->gear_ratio = VectorXd::Constant(1, 1e3);
  const EveryRoute routes(record_inverse_dynamics(model, effects), Order::kFirst);
  EXPECT_NEAR(routes({0.2, -1, 1})[0], 1.001, 4e-16);
}

// H29 | naive: a rotational inertia kept about the frame loses (|c| / r)^2 digits: all of them at 1e8 | holds:
// torques of a body whose frame is 1e4 m from it to 1e-11; its accelerations to eps (|c| / r)^2 = 1e-7, since a joint
// there has that condition | routes: template in double, all of C and the interpreter
TEST(FarFrames, TurnABodyAsAnyOther) {
  Model<double> model;
  dynamics::Joint<double> joint;
  joint.type = JointType::kSpherical;
  dynamics::Joint<double> hinge;
  hinge.axis = Vector3d::UnitY();
  model.add_joint(-1, hinge, {Matrix3d::Identity(), {1e4, 0, 0}}, {1, {0.1, 0, 0}, Matrix3d::Identity()});
  model.add_joint(0, joint, {Matrix3d::Identity(), {-1e4, 3e3, 0}},
                  {2, {1e4, -3e3, 1}, Vector3d(0.3, 0.4, 0.5).asDiagonal()});
  Random random(13);
  const State s = random_state(model, random);
  expect_exact(model, RobotFunction::kRnea, state_of(model, RobotFunction::kRnea, s), 1e-11, {.near = 1e-10});
  expect_exact(model, RobotFunction::kAba, state_of(model, RobotFunction::kAba, s), 1e-7, {.near = 1e-6});
}

// --- Long, fast, turned --------------------------------------------------------------------------------------

// H35 | naive: recursion over the tree ends the stack, a dense inertia matrix of a thousand joints loses four digits
// | holds: accelerations of a thousand joints to 1e-11 | routes: template in double, interpreter
TEST(LongChains, OfAThousandJoints) {
  const Model<double> model = chain(std::vector<double>(1000, 1.0));
  Random random(14);
  const State s = random_state(model, random);
  const Values x = state_of(model, RobotFunction::kAba, s);
  const Values got = evaluate(record_robot_function(model, RobotFunction::kAba), x);
  const Values expected = in_quad(model, RobotFunction::kAba, x, got.size());
  EXPECT_LE(testing::error_of(got, expected), 1e-11);
  const VectorXd direct =
      evaluate_analytic(model, RobotFunction::kAba, Eigen::Map<const VectorXd>(x.data(), long(x.size())));
  EXPECT_LE(testing::error_of({direct.begin(), direct.end()}, expected), 1e-11);
}

// H36 | naive: copies of subtrees make tapes of chains quadratic | holds: operations of torques and accelerations
// grow with the number of joints to the power 1.00 +- 0.05 from 16 to 512 joints, those of derivatives of torques
// with that of 2.0 +- 0.2 | routes: tape
TEST(LongChains, TapesGrowLinearly) {
  const auto power = [](const RobotFunction& function, int few, int many) {
    const auto operations = [&](int n) {
      return double(total_operations(record_robot_function(chain(std::vector<double>(std::size_t(n), 1.0)),
                                                           function, RobotSource::kAnalytic)));
    };
    return std::log(operations(many) / operations(few)) / std::log(double(many) / few);
  };
  EXPECT_NEAR(power(RobotFunction::kRnea, 16, 512), 1, 0.05);
  EXPECT_NEAR(power(RobotFunction::kAba, 16, 512), 1, 0.05);
  EXPECT_NEAR(power(RobotFunction::kIdDerivatives, 16, 96), 2, 0.2);
}

// H40 | naive: products of velocities overflow in single precision and drown the rest | holds: torques and
// accelerations at 1e6 rad/s to 1e-12 | routes: template in double, all of C and the interpreter
TEST(Fast, AMillionRadiansASecond) {
  Random random(15);
  const Model<double> model = random_tree(random, {6, dynamics::Base::kFloating});
  State s = random_state(model, random);
  s.v *= 1e6;
  for (const RobotFunction& function : {RobotFunction::kRnea, RobotFunction::kAba})
    expect_exact(model, function, state_of(model, function, s), 1e-12);
}

// H22 | naive: fmod(q, 2 pi) with a rounded pi is off by 1.4e-9 at 1e8 rad and by 2e-2 at 1e15 rad | holds: torques
// and accelerations of joints that have turned so far are those of 113 bits at the same number to 1e-13 | routes:
// template in double, all of C and the interpreter
TEST(Turned, ByHundredsOfMillionsOfRadians) {
  const Model<double> model = chain({1, 2, 1});
  Random random(16);
  State s = random_state(model, random);
  s.q << 1e8 + 0.3, -1e15, 123456789.125;
  for (const RobotFunction& function :
       {RobotFunction::kRnea, RobotFunction::kAba, RobotFunction::kFdDerivatives})
    expect_exact(model, function, state_of(model, function, s), 1e-13);
}

// H38, X05 | naive: three angles of a floating base have no derivative at a pitch of a quarter turn, and nobody says
// so | holds: a free-flyer at that pitch is as exact as anywhere; a wrist of three hinges has accelerations as exact
// as its condition allows, and inertia_condition says how bad it is | routes: template in double, all of C and the
// interpreter
TEST(Gimbal, HurtsAnglesOnly) {
  const double pitch = std::numbers::pi / 2 - 1e-8;
  const Vector3d inertia(0.3, 0.4, 0.5);
  Model<double> free, wrist;
  dynamics::Joint<double> joint;
  joint.type = JointType::kFreeFlyer;
  free.add_joint(-1, joint, {}, {2, {0.1, 0.2, -0.1}, inertia.asDiagonal()});
  const char* names[] = {"yaw", "pitch", "roll"};
  for (int k = 0; k < 3; ++k) {
    dynamics::Joint<double> hinge;
    hinge.name = names[k];
    hinge.axis = Vector3d::Unit(2 - k);
    wrist.add_joint(
        k - 1, hinge, {},
        k < 2 ? dynamics::Inertia<double>{} : dynamics::Inertia<double>{2, {0, 0, 0}, inertia.asDiagonal()});
  }
  Random random(17);
  State s = random_state(free, random), t = random_state(wrist, random);
  s.q.tail<4>() << 0, std::sin(pitch / 2), 0, std::cos(pitch / 2);
  t.q << 0.4, pitch, -0.3;
  for (const RobotFunction& function : {RobotFunction::kAba, RobotFunction::kFdDerivatives})
    expect_exact(free, function, state_of(free, function, s), 1e-12);
  dynamics::Data<double> data(wrist);
  const double condition = dynamics::inertia_condition(wrist, data, t.q);
  EXPECT_GE(condition, 1e14);
  const Values x = state_of(wrist, RobotFunction::kRnea, t);
  expect_exact(wrist, RobotFunction::kRnea, x, 1e-13);
  EXPECT_GE(dynamics::worst_inertia_condition(wrist), 1e8);
}

// H41 | naive: one of a hundred thousand configurations divides by zero or takes the root of a negative number |
// holds: no invalid operation, no division by zero, no overflow in the accelerations of a humanoid and their
// derivatives | routes: template in double, interpreter
TEST(Configurations, NoneOfAHundredThousandTraps) {
  const Model<double> model = dynamics::load_urdf(test::source_folder() + "/config/robots/talos.urdf",
                                                  {.base = dynamics::Base::kFloating});
  Random random(18);
  dynamics::Data<double> data(model);
  const Interpreter tape(record_robot_function(model, RobotFunction::kAba));
  Interpreter::Workspace workspace(tape);
  Values y(tape.function().n_y());
  for (int n = 0; n < 100000; ++n) {
    State s{
        random_configuration(model, random.engine), random.vector(model.nv), {}, random.vector(model.nv, 50)};
    if (n % 3 == 0) s.q.segment<4>(3) << random.vector3(), 0;         // half a turn
    if (n % 3 == 1) s.q.tail(model.nq - 7).setZero(), s.v.setZero();  // axes in line, at rest
    std::feclearexcept(FE_ALL_EXCEPT);
    aba(model, data, s.q, s.v, s.tau);
    if (n % 100 == 0) fd_derivatives(model, data, s.q, s.v, s.tau);
    if (n % 20 == 0) {
      const Values x = state_of(model, RobotFunction::kAba, s);
      tape(x.data(), nullptr, nullptr, y.data(), workspace);
    }
    ASSERT_EQ(std::fetestexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW), 0) << "configuration " << n;
    ASSERT_TRUE(data.ddq.allFinite()) << "configuration " << n;
  }
}

// --- Units ---------------------------------------------------------------------------------------------------

struct Units {
  const char* name;
  double length, mass, time;  // numbers of a quantity are so many times larger
};

// Whether direction k of the tangent is a displacement.
std::vector<bool> displacements(const Model<double>& model) {
  std::vector<bool> is;
  for (const auto& joint : model.joints) {
    for (const dynamics::Dof& dof : dynamics::joint_dofs(joint, 0)) is.push_back(!dof.angular);
  }
  return is;
}

// Of a number of so many lengths, masses and times.
double factor(const Units& u, double lengths, double masses, double times) {
  return std::pow(u.length, lengths) * std::pow(u.mass, masses) * std::pow(u.time, times);
}

Model<double> converted(const Units& u, Model<double> model) {
  const std::vector<bool> moves = displacements(model);
  for (int i = 0; i < model.njoints(); ++i) {
    dynamics::Joint<double>& joint = model.joints[std::size_t(i)];
    joint.armature *= factor(u, moves[std::size_t(joint.idx_v)] ? 0 : 2, 1, 0);
    joint.pitch *= u.length;
    model.X_PJ[std::size_t(i)].p *= u.length;
    dynamics::Inertia<double>& body = model.inertias[std::size_t(i)];
    body.mass *= u.mass, body.com *= u.length, body.I_c *= factor(u, 2, 1, 0);
  }
  model.gravity *= factor(u, 1, 0, -2);
  return model;
}

State converted(const Units& u, const Model<double>& model, State s) {
  for (const auto& joint : model.joints) {
    if (joint.type == JointType::kPrismatic) s.q[joint.idx_q] *= u.length;
    if (joint.type == JointType::kPlanar) s.q.segment(joint.idx_q, 2) *= u.length;
    if (joint.type == JointType::kFreeFlyer) s.q.segment(joint.idx_q, 3) *= u.length;
  }
  const std::vector<bool> moves = displacements(model);
  for (int k = 0; k < model.nv; ++k) {
    const bool along = moves[std::size_t(k)];
    s.v[k] *= factor(u, along, 0, -1), s.a[k] *= factor(u, along, 0, -2);
    s.tau[k] *= factor(u, along ? 1 : 2, 1, -2);
  }
  return s;
}

// Torques, accelerations and their derivatives, with the units taken out again.
Values without_units(const Units& u, const Model<double>& model, const State& s, bool recorded) {
  const std::vector<bool> moves = displacements(model);
  const auto along = [&](int k) { return moves[std::size_t(k)] ? 1.0 : 0.0; };
  const auto result = [&](const RobotFunction& function) {
    const Values x = state_of(model, function, s);
    if (recorded) return evaluate(record_robot_function(model, function, RobotSource::kAnalytic), x);
    const VectorXd y =
        evaluate_analytic(model, function, Eigen::Map<const VectorXd>(x.data(), long(x.size())));
    return Values(y.begin(), y.end());
  };
  const Values tau = result(RobotFunction::kRnea), a = result(RobotFunction::kAba),
               derivatives = result(RobotFunction::kFdDerivatives);
  const int n = model.nv;
  Values all;
  for (int k = 0; k < n; ++k) {
    all.push_back(tau[std::size_t(k)] / factor(u, 2 - along(k), 1, -2));
    all.push_back(a[std::size_t(k)] / factor(u, along(k), 0, -2));
  }
  for (int block = 0; block < 3; ++block) {  // by q, by v, by tau
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        const double by = block == 2 ? factor(u, 2 - along(j), 1, -2) : factor(u, along(j), 0, -block);
        all.push_back(derivatives[std::size_t((block * n + i) * n + j)] * by / factor(u, along(i), 0, -2));
      }
    }
  }
  return all;
}

class InUnits : public ::testing::TestWithParam<Units> {};

// X06 | naive: a threshold with a unit in it, as 1e-12 of an inertia, makes a robot in millimetres or grams another
// robot | holds: torques, accelerations and derivatives in other units are the same: bit for bit where the factors
// are powers of two, to 1e-11 where they are of ten | routes: template in double, tape
TEST_P(InUnits, ARobotIsTheSame) {
  for (unsigned long seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    Model<double> model =
        random_tree(random, {6, seed % 2 ? dynamics::Base::kFloating : dynamics::Base::kFixed});
    const State s = random_state(model, random);
    const Model<double> other = converted(GetParam(), model);
    const State moved = converted(GetParam(), model, s);
    int exponent = 0;
    const bool of_two = std::frexp(factor(GetParam(), 1, 1, 1), &exponent) == 0.5;
    for (const bool recorded : {false, true}) {
      const Values here = without_units({"", 1, 1, 1}, model, s, recorded),
                   there = without_units(GetParam(), other, moved, recorded);
      if (of_two) {
        EXPECT_TRUE(testing::same_bits(there, here)) << "seed " << seed << (recorded ? ", recorded" : "");
      } else {
        EXPECT_LE(testing::error_of(there, here), 1e-11) << "seed " << seed << (recorded ? ", recorded" : "");
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, InUnits,
                         ::testing::Values(Units{"binary_millimetres", 0x1p10, 1, 1},
                                           Units{"binary_tonnes", 1, 0x1p-10, 1},
                                           Units{"binary_milliseconds", 1, 1, 0x1p10},
                                           Units{"of_everything", 0x1p30, 0x1p-40, 0x1p-20},
                                           Units{"millimetres", 1e3, 1, 1},
                                           Units{"grams_and_hours", 1, 1e3, 1 / 3600.0}),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace dyntape::robots_hard_test
