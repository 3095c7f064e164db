// SPDX-License-Identifier: BSD-3-Clause
//
// Problems of robots whose configuration is no vector of joint values.  The oracles: exact motions on the manifold
// (dynamics::integrate with a constant velocity), what a free body conserves, the same robot with an angle in place of
// (cos, sin), and one form, method or sheet of the quaternion against the other.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/simulation/steps.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/motion/robot_terms.h>
#include "dynamics/robot_files.h"

namespace dyntape::ocp_floating_test {
namespace {

using dynamics::JointType;
using dynamics::Model;
using Eigen::Vector3d;
using Eigen::VectorXd;

dynamics::Inertia<double> some_inertia() {
  return {0.7, Vector3d(0.02, -0.01, 0.03), Eigen::Vector3d(0.004, 0.006, 0.008).asDiagonal()};
}

// A chain with a joint of every kind.
Model<double> every_joint() {
  Model<double> model;
  model.name = "every joint";
  int parent = -1;
  for (JointType type : {JointType::kFreeFlyer, JointType::kRevolute, JointType::kContinuous,
                         JointType::kSpherical, JointType::kPlanar, JointType::kPrismatic}) {
    dynamics::Joint<double> joint;
    joint.name = std::string(dynamics::to_string(type));
    joint.type = type;
    dynamics::Placement<double> X;
    X.p = Vector3d(0.1, 0.2, -0.1);
    parent = model.add_joint(parent, joint, X, some_inertia());
    model.frames.push_back({joint.name, parent, {}});
  }
  return model;
}

struct At {
  VectorXd q, v;
};
At drawn(const Model<double>& model, unsigned seed) {
  std::mt19937_64 random(seed);
  At at{dynamics::random_configuration(model, random), VectorXd(model.nv)};
  for (double& v : at.v) v = std::uniform_real_distribution<double>(-1, 1)(random);
  return at;
}

// Directions of q times a factor.
VectorXd stretched(const Model<double>& model, VectorXd q, double factor) {
  for (const auto& joint : model.joints) {
    const auto [first, count] = direction_entries(joint);
    q.segment(first, count) *= factor;
  }
  return q;
}

VectorXd rate_of(const Model<double>& model, const VectorXd& q, const VectorXd& v) {
  return configuration_rate<double>(model, q, v);
}

VectorXd stepped(const Model<double>& model, VectorXd q, const VectorXd& v, double h, int steps) {
  for (int k = 0; k < steps; ++k) {
    const VectorXd a = rate_of(model, q, v), b = rate_of(model, q + h / 2 * a, v),
                   c = rate_of(model, q + h / 2 * b, v), d = rate_of(model, q + h * c, v);
    q += h / 6 * (a + 2 * b + 2 * c + d);
  }
  return q;
}

TEST(Configurations, TheRateIsThatOfTheMotionOnTheManifold) {
  const Model<double> model = every_joint();
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const auto [q, v] = drawn(model, seed);
    const auto moved = [&, q = q, v = v](double h) { return dynamics::integrate<double>(model, q, v * h); };
    const double h = 1e-3;
    const VectorXd slope = (8 * (moved(h) - moved(-h)) - (moved(2 * h) - moved(-2 * h))) / (12 * h);
    EXPECT_LT((rate_of(model, q, v) - slope).cwiseAbs().maxCoeff(), 1e-11) << "seed " << seed;
  }
}

TEST(Configurations, StepsApproachTheMotionOnTheManifoldWithTheirOrder) {
  const Model<double> model = every_joint();
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const auto [q, v] = drawn(model, seed);
    const VectorXd exact = dynamics::integrate<double>(model, q, v);
    const double coarse = (stepped(model, q, v, 1. / 16, 16) - exact).norm(),
                 fine = (stepped(model, q, v, 1. / 32, 32) - exact).norm();
    EXPECT_NEAR(coarse / fine, 16, 2) << "seed " << seed;
    EXPECT_LT(fine, 1e-5);
  }
}

// The length of a quaternion: within (error of a step) / (2 k h) of one, on a motion ten times as long as well; and the
// error of a step is of fifth order.
TEST(Configurations, TheLengthStaysNearOneHoweverLongTheMotion) {
  Model<double> model;
  dynamics::Joint<double> joint;
  joint.name = "ball";
  joint.type = JointType::kSpherical;
  model.add_joint(-1, joint, {}, some_inertia());
  const VectorXd v = Vector3d(2, -1, 4);
  const auto off = [&](double h, double seconds) {
    VectorXd q = dynamics::neutral(model);
    double most = 0;
    for (int k = 0; k < seconds / h; ++k) {
      q = stepped(model, q, v, h, 1);
      most = std::max(most, std::abs(q.squaredNorm() - 1));
    }
    return most;
  };
  const double h = 0.05, of_step = off(h, 1.5 * h), shorter = off(h, 20), longer = off(h, 200);
  EXPECT_GT(of_step, 1e-9);  // there is something to bring back
  EXPECT_NEAR(longer / shorter, 1, 1e-3);
  EXPECT_LT(longer, of_step / (2 * kNormReturn * h) * 1.1);
  EXPECT_GT(off(h, 20) / off(h / 2, 20), 16);
}

// What reads a direction does not read its length.
TEST(Configurations, TheLengthChangesNothingElse) {
  const RobotScene scene{every_joint(), {}, {}};
  const int nq = scene.model.nq, nv = scene.model.nv;
  const Problem p = robot_problem(scene, {.duration = 1});
  const StageFunction frame =
      frame_error(scene, {"prismatic", Vector3d(1, 0, 0), rotation_of(0.1, 0.2, 0.3)});
  const auto [q, v] = drawn(scene.model, 4);
  const VectorXd other = drawn(scene.model, 5).q;
  const StageFunction error = configuration_error(scene, other);
  const auto stage = [&, q = q, v = v](double factor) {
    VectorXd x(nq + nv);
    x << stretched(scene.model, q, factor), v;
    return p.stage(0, x, {}, VectorXd::Constant(p.n_u(), 0.3));
  };
  const Stage<double> one = stage(1), longer = stage(1.2);
  EXPECT_LT((p.rate(one) - p.rate(longer)).tail(nv).norm(), 1e-11 * p.rate(one).tail(nv).norm());
  EXPECT_LT((frame(one) - frame(longer)).norm(), 1e-13);
  EXPECT_LT((error(one) - error(longer)).norm(), 1e-13);
  // Its own rate is along itself and back; what is across it grows with it.
  const VectorXd u = longer.x.segment<4>(3), rate = p.rate(longer).segment<4>(3);
  EXPECT_NEAR(rate.dot(u), kNormReturn * (1 - 1.44) * 1.44, 1e-12);
  const VectorXd across = rate - u * (rate.dot(u) / u.squaredNorm());
  EXPECT_LT((across - 1.2 * p.rate(one).segment<4>(3)).norm(), 1e-13);
}

TEST(Configurations, DifferencesAndWaysBetween) {
  const Model<double> model = every_joint();
  const auto [q0, v] = drawn(model, 7);
  const VectorXd d = 0.8 * v;
  EXPECT_LT(configuration_error<double>(model, q0, q0).norm(), 1e-14);
  const VectorXd q1 = drawn(model, 8).q;
  EXPECT_LT(configuration_error<double>(model, q1, between(model, q0, q1, 1)).norm(), 1e-12);
  EXPECT_EQ(between(model, q0, q1, 0), q0);
  // Half way is half of the difference; the quaternion's sign does not matter.
  VectorXd flipped = q1;
  flipped.segment<4>(3) *= -1;
  EXPECT_LT((between(model, q0, q1, 0.3) - between(model, q0, flipped, 0.3)).norm(), 1e-12);
  const VectorXd whole = configuration_error<double>(model, q0, q1),
                 half = configuration_error<double>(model, q0, between(model, q0, q1, 0.5));
  EXPECT_LT((half - whole / 2).norm(), 1e-12);
  const double h = 1e-4, s = 0.4;
  const VectorXd slope = (between(model, q0, q1, s + h) - between(model, q0, q1, s - h)) / (2 * h);
  const VectorXd q = between(model, q0, q1, s);
  EXPECT_LT((rate_of(model, q, velocity_between(model, q0, q1, s)) - slope).norm(), 1e-6);
}

TEST(Configurations, StatesAreNamedByEntry) {
  const Problem p = robot_problem({every_joint(), {}, {}}, {.duration = 1, .form = DynamicsForm::kInverse});
  EXPECT_EQ(p.states[0], "q.free-flyer[0]");
  EXPECT_EQ(p.states[7], "q.revolute");
  EXPECT_EQ(p.states[9], "q.continuous[1]");
  EXPECT_EQ(p.states[std::size_t(every_joint().nq)], "v.free-flyer[0]");
  EXPECT_EQ(p.accelerations[6], "a.revolute");
  EXPECT_EQ(p.controls, (std::vector<std::string>{"u.revolute", "u.continuous", "u.prismatic"}));
}

OptimiseOptions options_with(int intervals, NlpMethod method = NlpMethod::kIpopt) {
  OptimiseOptions options;
  options.mesh.intervals = intervals;
  options.mesh.evaluation.route = Route::kInterpreter;
  options.solver.method = method;
  return options;
}

// Two bodies, one of them driven against the other, fly without gravity: momentum of the whole stays what it was although
// the orientation of the base is to be another one at the end.
TEST(FloatingProblems, AFreeRobotKeepsItsMomentum) {
  Model<double> model;
  model.name = "satellite";
  model.gravity.setZero();
  dynamics::Joint<double> base, wheel;
  base.name = "base", base.type = JointType::kFreeFlyer;
  wheel.name = "wheel", wheel.axis = Vector3d(0, 0.6, 0.8);
  model.add_joint(-1, base, {}, some_inertia());
  model.add_joint(0, wheel, {}, some_inertia());
  for (DynamicsForm form : {DynamicsForm::kForward, DynamicsForm::kInverse}) {
    const RobotScene scene{model, {}, {}};
    Problem p = robot_problem(scene, {.duration = 1.5, .form = form});
    p.add(squared_controls(1));
    VectorXd q0 = dynamics::neutral(model), v0 = VectorXd::Zero(7);
    v0 << 0.3, -0.2, 0.1, 0.5, 1.2, -0.4, 2;
    start_at(p, scene, q0, v0);
    p.add(terminal_equality("wheel", [](const auto& s) { return vector(s.x[7] - 4.0, s.x[14] - 1.0); }));
    p.guess = [&](double) {
      Stage<double> s{0, VectorXd(15), VectorXd::Zero(p.n_a()), VectorXd::Zero(1)};
      s.x << q0, v0;
      return s;
    };
    const Solution s = optimise(p, options_with(60));
    ASSERT_TRUE(s.success()) << describe(s.nlp.status);
    EXPECT_GT(s.cost(), 1e-4);  // the wheel is driven
    EXPECT_LT(s.verification.worst_defect, 1e-4);
    dynamics::Data<double> data(model);
    dynamics::Centroidal<double> whole(model);
    const auto momentum = [&](int k) {
      const VectorXd q = s.motion.x.col(k).head(8), v = s.motion.x.col(k).tail(7);
      dynamics::forward_kinematics<double>(model, data, q, v);
      Eigen::Matrix<double, 6, 1> h = Eigen::Matrix<double, 6, 1>::Zero();
      for (std::size_t i = 0; i < 2; ++i) {
        const auto& I = model.inertias[i];
        const auto& X = data.X_WB[i];
        const auto& V = data.v[i];
        const Vector3d c = X.p + X.R * I.com, vc = X.R * (V.linear + V.angular.cross(I.com));
        h.head<3>() += I.mass * vc;
        h.tail<3>() += X.R * (I.I_c * V.angular) + c.cross(Vector3d(I.mass * vc));
      }
      return h;
    };
    const auto before = momentum(0);
    for (int k = 1; k < s.motion.points(); ++k)
      EXPECT_LT((momentum(k) - before).norm(), 1e-5 * before.norm()) << "point " << k;
    double most = 0;
    for (int k = 0; k < s.motion.points(); ++k)
      most = std::max(most, std::abs(s.motion.x.col(k).segment<4>(3).norm() - 1));
    EXPECT_LT(most, 1e-6);
    EXPECT_GT((s.motion.x.col(0) - s.motion.x.col(s.motion.points() - 1)).segment<4>(3).norm(), 0.5);
  }
}

Model<double> swing(JointType type) {
  Model<double> model;
  model.name = "swing";
  dynamics::Joint<double> joint;
  joint.name = "pivot";
  joint.type = type;
  joint.axis = Vector3d::UnitY();
  model.add_joint(-1, joint, {}, {1.0, Vector3d(0, 0, -0.5), Eigen::Matrix3d::Identity() * 0.01});
  return model;
}

// The same pendulum, once with an angle, once with (cos, sin); tracking, goal and all.
TEST(FloatingProblems, ACosineAndASineAreAnAngle) {
  double cost[2];
  for (JointType type : {JointType::kRevolute, JointType::kContinuous}) {
    const RobotScene scene{swing(type), {}, {}};
    const auto at = [&](double angle) {
      return dynamics::integrate<double>(scene.model, dynamics::neutral(scene.model),
                                         VectorXd::Constant(1, angle));
    };
    Problem p = robot_problem(scene, {.duration = 1});
    const VectorXd one = VectorXd::Ones(1), none = VectorXd::Zero(1);
    p.add(squared_controls(0.1));
    p.add(squared_accelerations(p, 1e-3));
    p.add(joint_tracking(scene, 3 * one, at(1), one, none));
    start_at(p, scene, at(-0.5), none);
    end_at(p, scene, at(2), none);
    p.guess = [&, n_x = p.n_x()](double t) {
      Stage<double> s{t, VectorXd::Zero(n_x), {}, VectorXd::Zero(1)};
      s.x.head(scene.model.nq) = between(scene.model, at(-0.5), at(2), t);
      return s;
    };
    const Solution s = optimise(p, options_with(80));
    ASSERT_TRUE(s.success()) << describe(s.nlp.status);
    cost[type == JointType::kContinuous] = s.cost();
  }
  EXPECT_NEAR(cost[1] / cost[0], 1, 1e-6);
}

struct Quadrotor {
  RobotScene scene{
      dynamics::load_urdf(dynamics::robot_file("quadrotor"), {.base = dynamics::Base::kFloating}), {}, {}};
  RobotProblemOptions options;
  VectorXd from, to, rest = VectorXd::Zero(6);

  Quadrotor() {
    options.duration = 1.5;
    for (int k = 1; k <= 4; ++k) {
      const std::string name = "rotor_" + std::to_string(k);
      options.thrusters.push_back(
          {.name = name, .frame = name, .lower = 0, .upper = 3, .moment = k % 2 ? 0.016 : -0.016});
    }
    from = to = dynamics::neutral(scene.model);
    to.head<3>() << 1, -0.5, 0.5;
    to.segment<4>(3) << 0, 0, std::sin(1.0), std::cos(1.0);  // two radians of yaw
  }
  Problem problem() const {
    Problem p = robot_problem(scene, options);
    p.add(squared_controls(1));
    start_at(p, scene, from, rest);
    p.guess = [this, n_a = p.n_a()](double t) {
      Stage<double> s{t, VectorXd::Zero(13), VectorXd::Zero(n_a), VectorXd::Zero(4)};
      s.x.head(7) = between(scene.model, from, to, t / options.duration);
      s.u = holding_controls(scene, options, s.x.head(7));
      return s;
    };
    return p;
  }
};

TEST(FloatingProblems, AQuadrotorFliesAndTurnsByEveryFormMethodAndSheet) {
  std::vector<double> costs;
  for (DynamicsForm form : {DynamicsForm::kForward, DynamicsForm::kInverse}) {
    for (NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
      for (double sheet : {1.0, -2.0}) {  // of any sign and length
        Quadrotor robot;
        robot.options.form = form;
        VectorXd goal = robot.to;
        goal.segment<4>(3) *= sheet;
        Problem p = robot.problem();
        end_at(p, robot.scene, goal, robot.rest);
        const Solution s = optimise(p, options_with(30, method));
        ASSERT_TRUE(s.success()) << describe(s.nlp.status);
        EXPECT_LT(s.nlp.iterations(), 60);
        EXPECT_LT(s.verification.violation, 1e-6);
        EXPECT_LT(s.verification.worst_relative, 1e-3);
        const VectorXd end = s.motion.x.col(s.motion.points() - 1);
        EXPECT_LT(configuration_error<double>(robot.scene.model, robot.to, end.head(7)).norm(), 1e-7);
        EXPECT_LT(end.tail(6).norm(), 1e-8);
        costs.push_back(s.cost());
      }
    }
  }
  for (double cost : costs) EXPECT_NEAR(cost / costs[0], 1, 1e-5);
}

// Rolls over once: start and goal are one orientation, and the guess says that the way leads around.
TEST(FloatingProblems, AQuadrotorRollsOver) {
  Quadrotor robot;
  robot.to.tail(4) = robot.from.tail(4);
  Problem p = robot.problem();
  end_at(p, robot.scene, robot.to, robot.rest);
  const double full = 2 * std::acos(-1.0), duration = robot.options.duration;
  p.guess = [&](double t) {
    Stage<double> s{t, VectorXd::Zero(13), {}, VectorXd::Constant(4, 1.2)};
    const double turned = full * t / duration;
    s.x.head(7) = between(robot.scene.model, robot.from, robot.to, t / duration);
    s.x.segment<4>(3) << std::sin(turned / 2), 0, 0, std::cos(turned / 2);
    s.x[10] = full / duration;
    return s;
  };
  const Solution s = optimise(p, options_with(60));
  ASSERT_TRUE(s.converged()) << describe(s.nlp.status);
  // Its rotors go from limit to limit, where these cut the polynomials.
  EXPECT_LT(s.verification.worst_relative, 2e-2);
  const VectorXd end = s.motion.x.col(s.motion.points() - 1);
  EXPECT_NEAR(end[6], -1, 1e-3);  // the other sheet: once around
  EXPECT_LT(configuration_error<double>(robot.scene.model, robot.to, end.head(7)).norm(), 1e-7);
  double lowest = 1;  // upside down on the way: z of the axis that points up
  for (int k = 0; k < s.motion.points(); ++k) {
    const dynamics::Vector4<double> u = s.motion.x.col(k).segment<4>(3);
    lowest = std::min(lowest, dynamics::rotation(u)(2, 2));
  }
  EXPECT_LT(lowest, -0.99);
}

TEST(FloatingProblems, ThrustersPushAlongTheirAxes) {
  const Quadrotor robot;
  const Problem p = robot.problem();
  VectorXd x = VectorXd::Zero(13);
  x.head(7) = robot.from;
  const VectorXd a = p.rate(p.stage(0, x, {}, Eigen::Vector4d(1, 0, 0, 0))).tail(6);
  // 1 N up at 0.17 m along x and 0.02 m up: falls less, nods by 0.17 / 0.0023, turns by 0.016 / 0.004.
  EXPECT_NEAR(a[2], 1 / 0.5 - 9.81, 1e-12);
  EXPECT_NEAR(a[3], 0, 1e-12);
  EXPECT_NEAR(a[4], -0.17 / 0.0023, 1e-10);
  EXPECT_NEAR(a[5], 0.016 / 0.004, 1e-12);
  const VectorXd u = holding_controls(robot.scene, robot.options, robot.from);
  EXPECT_LT((u - VectorXd::Constant(4, 0.5 * 9.81 / 4)).norm(), 1e-12);
  EXPECT_LT(p.rate(p.stage(0, x, {}, u)).norm(), 1e-12);
}

TEST(FloatingProblems, DdpFliesIt) {
  const Quadrotor robot;
  Problem p = robot.problem();
  p.add(terminal_squares("place", weighted(configuration_error(robot.scene, robot.to), 1e3)));
  p.add(terminal_squares("rest", [](const auto& s) { return (s.x.tail(6) * 10.).eval(); }));
  DdpOptions options{.intervals = 60};
  options.evaluation = {.route = Route::kInterpreter};
  const DdpSolution s = solve_with_ddp(p, options);
  ASSERT_TRUE(s.success());
  const VectorXd end = s.x.col(s.x.cols() - 1);
  EXPECT_LT(configuration_error<double>(robot.scene.model, robot.to, end.head(7)).norm(), 0.1);
  EXPECT_NEAR(end.segment<4>(3).norm(), 1, 1e-4);
  // Collocation of the same problem.
  const Solution c = optimise(p, options_with(60));
  ASSERT_TRUE(c.success());
  EXPECT_NEAR(s.cost / c.cost(), 1, 2e-3);
}

TEST(FloatingProblems, WhatCannotBeIsSaid) {
  const Quadrotor robot;
  const auto message = [](const auto& f) {
    try {
      f();
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("nothing thrown");
  };
  const auto of_thruster = [&](const Thruster& thruster) {
    return message([&] { robot_problem(robot.scene, {.duration = 1, .thrusters = {thruster}}); });
  };
  EXPECT_NE(of_thruster({.name = "a", .frame = "rotr_1"}).find("rotor_1"), std::string::npos);
  EXPECT_NE(of_thruster({.name = "a", .frame = "rotor_1", .axis = Vector3d::Zero()}).find("no direction"),
            std::string::npos);
  EXPECT_NE(of_thruster({.name = "a", .frame = "rotor_1", .lower = 2, .upper = 1}).find("smaller one first"),
            std::string::npos);
  Problem p = robot.problem();
  VectorXd q = robot.from;
  q.segment<4>(3).setZero();
  EXPECT_NE(message([&] { end_at(p, robot.scene, q, robot.rest); }).find("of length zero"),
            std::string::npos);
  q.segment<4>(3) << 0, 0, Problem::kFree, 1;
  EXPECT_NE(message([&] { end_at(p, robot.scene, q, robot.rest); }).find("or all of it free"),
            std::string::npos);
  q.segment<4>(3).setConstant(Problem::kFree);
  EXPECT_EQ(message([&] { end_at(p, robot.scene, q, robot.rest); }), "nothing thrown");
  EXPECT_NE(message([&] { start_at(p, robot.scene, q, robot.rest); }).find("expected a quaternion"),
            std::string::npos);
}

}  // namespace
}  // namespace dyntape::ocp_floating_test
