// SPDX-License-Identifier: BSD-3-Clause
//
// Motions of task files that go on for ever.  The walker is written out once more here, in plain Eigen: its masses by the
// Jacobians of centres of mass, its heel strike by momentum.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>

#include <Eigen/LU>

#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/motion/periodic_gait.h>
#include <dyntape/interface/run/mpc/mpc_task.h>
#include <dyntape/interface/run/solve/solve.h>
#include "interface/files/task/task_text.h"
#include "interface/message_of.h"
#include "source_folder.h"

namespace dyntape::periodic_motion_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;
using Row = Eigen::Matrix<double, 1, 7>;

// q = (x, z, pitch, left hip, left knee, right hip, right knee), angles from x to z.
constexpr double kFemur = 0.4, kTibia = 0.4;

// A point of the plane: dp/dt = J v, d2p/dt2 = J a + bias.
struct PlanePoint {
  Vector2d p, bias;
  Eigen::Matrix<double, 2, 7> J;
};

struct Walker {
  MatrixXd M = MatrixXd::Zero(7, 7);
  VectorXd bias = VectorXd::Zero(7);  // M a + bias = B u + J^T f
  Vector2d momentum_rate{0, 0};       // of all masses, less gravity: what the floor gives
  PlanePoint foot[2];                 // left, right

  Walker(const VectorXd& q, const VectorXd& v, const VectorXd& a) {
    const PlanePoint hip{q.head<2>(), Vector2d::Zero(), Eigen::Matrix<double, 2, 7>::Identity()};
    const Row pitch = Row::Unit(2);
    add(20, 2.22, out(hip, pitch, q, v, -0.2), pitch, a);
    for (int leg = 0; leg < 2; ++leg) {
      const Row femur = pitch + Row::Unit(3 + 2 * leg), tibia = femur + Row::Unit(4 + 2 * leg);
      const PlanePoint knee = out(hip, femur, q, v, kFemur);
      add(6.8, 1.08, out(hip, femur, q, v, 0.163), femur, a);
      add(3.2, 0.93, out(knee, tibia, q, v, 0.128), tibia, a);
      foot[leg] = out(knee, tibia, q, v, kTibia);
    }
  }

  // So far along a link that hangs at the angle of these joints together.
  static PlanePoint out(PlanePoint from, const Row& joints, const VectorXd& q, const VectorXd& v, double l) {
    const double angle = joints * q, rate = joints * v;
    from.p += l * Vector2d(std::sin(angle), -std::cos(angle));
    from.J += l * Vector2d(std::cos(angle), std::sin(angle)) * joints;
    from.bias += l * rate * rate * Vector2d(-std::sin(angle), std::cos(angle));
    return from;
  }
  void add(double m, double inertia, const PlanePoint& c, const Row& joints, const VectorXd& a) {
    const Vector2d lift(0, 9.81);
    M += m * c.J.transpose() * c.J + inertia * joints.transpose() * joints;
    bias += m * c.J.transpose() * (c.bias + lift);
    momentum_rate += m * (c.J * a + c.bias + lift);
  }
};

VectorXd other_leg(VectorXd q) {
  q.segment<2>(3).swap(q.segment<2>(5));
  return q;
}

class ClosedMotion : public test::TaskText {
 protected:
  ClosedMotion() : TaskText("closed") {}
  static SolveReport solved(Task task, int intervals, NlpMethod method) {
    task.parts.front().optimise.mesh.intervals = intervals;
    task.optimise.solver.method = method;
    task.demands.refinements = 0, task.expected.reset();
    SolveReport report = solve_task(task);
    EXPECT_TRUE(report.success()) << report.verdict();
    return report;
  }
};

TEST_F(ClosedMotion, AStepIsFollowedByTheSameStepOfTheOtherLeg) {
  load("five_link_walking");
  const SolveReport report = solved(read(), 20, NlpMethod::kRiccati);
  const Trajectory& motion = report.solution.motion;
  const int last = motion.points() - 1;
  const VectorXd q = motion.x.col(last).head(7), v = motion.x.col(last).tail(7);
  const Walker end(q, v, VectorXd::Zero(7));
  MatrixXd K = MatrixXd::Zero(9, 9);  // M v+ - J^T p = M v,  J v+ = 0
  K.topLeftCorner(7, 7) = end.M;
  K.topRightCorner(7, 2) = -end.foot[1].J.transpose();
  K.bottomLeftCorner(2, 7) = end.foot[1].J;
  VectorXd right = VectorXd::Zero(9);
  right.head(7) = end.M * v;
  const VectorXd after = K.fullPivLu().solve(right);
  VectorXd begins = other_leg(q);
  begins[0] -= 0.5;
  EXPECT_LT((motion.x.col(0).head(7) - begins).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_LT((motion.x.col(0).tail(7) - other_leg(after.head(7))).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_GT(after[8], 0);                             // the floor pushes,
  EXPECT_LT(std::abs(after[7]), 0.8 * after[8]);      // within its cone,
  EXPECT_GT((end.foot[0].J * after.head(7)).y(), 0);  // and the other foot leaves it
  EXPECT_LT((end.foot[1].J * v).norm(), 5);
  EXPECT_GT((end.foot[1].J * v).norm(), 0.1);
  const double lost = (v.dot(end.M * v) - after.head(7).dot(end.M * after.head(7))) / 2;
  EXPECT_GT(lost, 0);
  std::printf("heel strike: %.3f m/s, %.2f N s upwards, %.2f J lost\n", (end.foot[1].J * v).norm(), after[8],
              lost);
}

TEST_F(ClosedMotion, TheWalkIsOneOfTheRobotWrittenOutOnceMore) {
  load("five_link_walking");
  const SolveReport report = solved(read(), 20, NlpMethod::kRiccati);
  const Trajectory& motion = report.solution.motion;
  double cost = 0, highest = 0, lowest = HUGE_VAL, steepest = 0, most = 0;
  const double floor = Walker(motion.x.col(0).head(7), VectorXd::Zero(7), VectorXd::Zero(7)).foot[0].p.y(),
               place = Walker(motion.x.col(0).head(7), VectorXd::Zero(7), VectorXd::Zero(7)).foot[0].p.x();
  for (int p = 0; p < motion.points(); ++p) {
    const VectorXd q = motion.x.col(p).head(7), v = motion.x.col(p).tail(7), a = motion.a.col(p),
                   u = motion.u.col(p);
    const Walker robot(q, v, a);
    const Vector2d f(u[4], u[6]);
    VectorXd forces = robot.foot[0].J.transpose() * f;
    forces.tail(4) += u.head(4);
    EXPECT_LT((robot.M * a + robot.bias - forces).cwiseAbs().maxCoeff(), 1e-6) << motion.t[p];
    EXPECT_LT((robot.momentum_rate - f).norm(), 1e-6) << motion.t[p];
    EXPECT_EQ(u[5], 0);
    EXPECT_EQ(u.tail(3).norm(), 0);
    EXPECT_LT((robot.foot[0].p - Vector2d(place, floor)).norm(), 1e-4) << motion.t[p];
    EXPECT_GT(f.y(), 0);
    steepest = std::max(steepest, std::abs(f.x()) / f.y());
    most = std::max(most, u.head(4).cwiseAbs().maxCoeff());
    EXPECT_LE(std::max(q[4], q[6]), 1e-8);  // knees
    if (p > 0 && p + 1 < motion.points()) lowest = std::min(lowest, robot.foot[1].p.y() - floor);
    highest = std::max(highest, robot.foot[1].p.y() - floor);
    const double weight = p == 0 || p + 1 == motion.points() ? 1 : p % 2 == 1 ? 4 : 2;  // Simpson's
    cost += 0.7 / 20 / 6 * weight * u.head(4).squaredNorm();
  }
  EXPECT_NEAR(cost, report.solution.cost(), 1e-8 * cost);
  EXPECT_GT(lowest, 1e-3);
  EXPECT_LT(steepest, 0.8);
  EXPECT_LT(most, 100);
  std::printf("the foot swings %.1f to %.1f mm above the floor; |fx|/fz <= %.3f, |u| <= %.1f N m\n",
              1e3 * lowest, 1e3 * highest, steepest, most);
}

TEST_F(ClosedMotion, MeshesConvergeAndMethodsAgree) {
  load("five_link_walking");
  const Task task = read();
  double costs[3];
  for (int k = 0; k < 3; ++k) {
    const SolveReport report = solved(task, 20 << k, NlpMethod::kRiccati);
    costs[k] = report.solution.cost();
    std::printf("%d intervals: %.9f, %d iterations\n", 20 << k, costs[k], report.iterations());
    EXPECT_LE(report.iterations(), 60);
  }
  EXPECT_NEAR(costs[0], 390.808789, 1e-5);
  EXPECT_NEAR(costs[1], 390.791715, 1e-5);
  EXPECT_NEAR(costs[2], 390.790613, 1e-5);
  EXPECT_NEAR((costs[0] - costs[1]) / (costs[1] - costs[2]), 16, 3);
  const SolveReport by_ipopt = solved(task, 20, NlpMethod::kIpopt);
  EXPECT_NEAR(by_ipopt.solution.cost(), costs[0], 1e-8 * costs[0]);
}

// The foot is set down; that takes four times the effort.
TEST_F(ClosedMotion, WithoutAnImpactTheFootLandsAtRest) {
  load("five_link_walking");
  replace("  impact on\n", "");
  Task task = read();
  task.demands.limits =
      false;  // parabolas of torques go 0.3 % beyond between points, where these rest on the limit
  const SolveReport report = solved(task, 40, NlpMethod::kRiccati);
  const Trajectory& motion = report.solution.motion;
  const VectorXd first = motion.x.col(0), last = motion.x.rightCols(1), still = VectorXd::Zero(7);
  const Walker begin(first.head(7), first.tail(7), still), end(last.head(7), last.tail(7), still);
  EXPECT_LT((end.foot[1].J * last.tail(7)).norm(), 1e-8);
  EXPECT_NEAR(end.foot[1].p.x() - begin.foot[0].p.x(), 0.5, 1e-8);
  EXPECT_NEAR(end.foot[1].p.y(), begin.foot[0].p.y(), 1e-8);
  EXPECT_LT((other_leg(last.tail(7)) - first.tail(7)).norm(), 1e-8);
  EXPECT_GT(report.solution.cost(), 4 * 390.8);
}

// From other poses, to the same walk.
TEST_F(ClosedMotion, TheStartOnlySaysWhereTheGuessBegins) {
  std::mt19937_64 random(7);
  const auto between = [&](double least, double most) {
    return std::to_string(std::uniform_real_distribution<double>(least, most)(random));
  };
  for (int k = 0; k < 4; ++k) {
    load("five_link_walking");
    replace("base_pitch 0", "base_pitch " + between(-0.3, 0.3));
    replace("left_hip   0.7", "left_hip " + between(0, 0.8));
    replace("left_knee  -1", "left_knee -" + between(0, 1));
    replace("right_hip  -0.5", "right_hip -" + between(0, 0.6));
    const SolveReport report = solved(read(), 20, NlpMethod::kRiccati);
    EXPECT_NEAR(report.solution.cost(), 390.808789, 1e-5) << text_;
  }
}

// A robot that floats, without phases: on and on with the same speed, each rotor carries a quarter of it.
TEST_F(ClosedMotion, AQuadrotorFliesOn) {
  for (const char* method : {"stages", "ipopt"}) {
    load("quadrotor_flight");
    const std::size_t goal = text_.find("goal {"), costs = text_.find("costs {");
    text_.replace(goal, costs - goal, "periodic {\n  advance { base \"1 0 0\" }\n}\n");
    text_.replace(text_.find("expected {"), std::string::npos,
                  std::string("solver { method ") + method + " }\n");
    const SolveReport report = solve_task(read());
    ASSERT_TRUE(report.success()) << report.verdict();
    const double weight = 0.5 * 9.81, known = 2 * weight * weight / 4;
    EXPECT_NEAR(report.solution.cost(), known, 1e-8 * known) << method;
    const Trajectory& motion = report.solution.motion;
    VectorXd gained = motion.x.rightCols(1) - motion.x.col(0);
    gained[0] -= 1;
    EXPECT_LT(gained.cwiseAbs().maxCoeff(), 1e-10);
  }
}

// Feet that hold all along: it stands where the motors have the least to do, and need not be told that the feet stand.
TEST_F(ClosedMotion, AQuadrupedStandsWhereItTakesLeast) {
  double costs[2];
  for (const char* method : {"stages", "ipopt"}) {
    load("quadruped_crouch");
    const std::size_t goal = text_.find("goal {");
    text_.replace(goal, text_.find("costs {") - goal, "periodic {\n}\n");
    text_.erase(text_.find("expected {"));
    replace("intervals 20", "intervals 5");
    text_ += std::string("\nsolver {\n method ") + method + "\n}\n";
    const SolveReport report = solve_task(read());
    ASSERT_TRUE(report.success()) << report.verdict();
    const Trajectory& motion = report.solution.motion;
    EXPECT_LT((motion.x.rightCols(1) - motion.x.col(0)).norm(), 1e-7);
    EXPECT_LT(motion.x.bottomRows(18).cwiseAbs().maxCoeff(), 1e-3);  // at rest
    costs[method[0] == 'i'] = report.solution.cost();
  }
  EXPECT_NEAR(costs[1], costs[0], 1e-8 * costs[0]);
}

TEST_F(ClosedMotion, WhatIsWrongIsSaid) {
  const auto message_with = [&](const std::string& old, const std::string& with) {
    load("five_link_walking");
    replace(old, with);
    return message();
  };
  const auto expect = [](const std::string& message, const std::string& part) {
    EXPECT_NE(message.find(part), std::string::npos) << message;
    EXPECT_NE(message.find("task.info:"), std::string::npos) << message;
  };
  expect(message_with("left_hip right_hip ", "left_hup right_hip "), "left_hip");
  expect(message_with("  left_foot right_foot\"", "  left_foot\""), "has 5 names, expected pairs");
  expect(message_with("  left_foot right_foot\"", "\""),
         "makes contact 'left_foot' that of 'left_foot', but joint 'left_knee'");
  expect(message_with("\"left_hip right_hip  left_knee right_knee  ", "\""),
         "makes contact 'left_foot' that of 'right_foot', but joint 'left_knee', which moves it, that of "
         "'left_knee'");
  expect(message_with("\"left_hip right_hip  left_knee right_knee  left_foot right_foot\"",
                      "\"base_x base_pitch\""),
         "expected two of one type to be swapped");
  expect(message_with("\"left_hip right_hip  left_knee right_knee  left_foot right_foot\"",
                      "\"left_foot left_hip\""),
         "pairs 'left_foot' with 'left_hip', expected two joints or two contacts");
  load("five_link_walking");
  replace("five_link_walker.urdf", "nobody.urdf");
  EXPECT_EQ(message().find("swap"), std::string::npos) << message();
  expect(message_with("base_x 0.5", "base_y 0.5"), "unknown key 'base_y' in 'periodic.advance'");
  expect(message_with("phase step { contacts left_foot }", "phase step {\n  }"),
         "no contact lands at the end of the motion");
  expect(message_with("\ncosts", "\ngoal { q 0 }\ncosts"), "'goal' and 'periodic' both define");
  expect(message_with("start {", "start {\n  free base_x"), "'start.free' and 'periodic' exclude");
  expect(message_with("costs { effort 1e4 }", "costs {\n effort 1e4\n tracking { q 1 }\n }"),
         "'goal.q', which the file does not give");
  expect(message_with("\ncosts", "\nsolver { method ddp }\ncosts"),
         "'periodic' is not supported by the method ddp");
  load("five_link_walking");
  const Task task = read();
  EXPECT_NE(message_of<ArgumentError>([&] { control_task(task); }).find("does not support periodic motions"),
            std::string::npos);
}

// What ends where a step ends begins where it began; mistakes are told.
TEST(NextStepOf, ARobotComesBackToItsStart) {
  const RobotScene scene{
      dynamics::load_urdf(test::source_folder() + "/config/robots/five_link_walker.urdf"), {}, {}};
  std::mt19937_64 random(11);
  PeriodicGait step{.swapped = {{"left_hip", "right_hip"}, {"right_knee", "left_knee"}},
                    .advance = VectorXd::Random(7)};
  for (int k = 0; k < 10; ++k) {
    const VectorXd q = dynamics::random_configuration(scene.model, random), v = VectorXd::Random(7);
    VectorXd x(14);
    x << end_of_step(scene.model, step, q), v;
    const VectorXd next = periodic_gait(scene, step)(Stage<double>{0, x, {}, {}});
    EXPECT_LT((next.head(7) - q).norm(), 1e-14);
    EXPECT_EQ(next.tail(7), other_leg(v));
  }
  const auto told = [&](const PeriodicGait& wrong) {
    return message_of<ArgumentError>([&] { periodic_gait(scene, wrong); });
  };
  EXPECT_NE(told({.swapped = {{"left_hip", "left_hip"}}}).find("\"left_hip\" is swapped twice"),
            std::string::npos);
  EXPECT_NE(told({.swapped = {{"left_hip", "right_hop"}}}).find("right_hip"), std::string::npos);
  EXPECT_NE(told({.advance = VectorXd::Zero(3)}).find("has 3 entries, expected 7"), std::string::npos);
}

}  // namespace
}  // namespace dyntape::periodic_motion_test
