// SPDX-License-Identifier: BSD-3-Clause
//
// Verdicts that were wrong, a test a kind: barriers that are left, saddles, missed goals, bounds between points, switches,
// feet in mid-air, scales from a slope that is rounding, and success that the solver alone declares.
#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/control/riccati/second_order.h>
#include <dyntape/interface/run/mpc/mpc_task.h>
#include <dyntape/interface/run/solve/solve.h>
#include "interface/control/ocp_problems.h"
#include "interface/files/task/task_text.h"
#include "source_folder.h"

namespace dyntape::verdict_kinds_test {
namespace {

using test::kInterpreted;

constexpr double kPi = std::numbers::pi;

class VerdictKinds : public test::TaskText {
 protected:
  VerdictKinds() : TaskText("verdict-kinds") {
    write_file_atomically(
        (folder_ / "pendulum.urdf").string(),
        "<robot name=\"pendulum\"><link name=\"world\"/>"
        "<joint name=\"hinge\" type=\"continuous\"><parent link=\"world\"/><child link=\"rod\"/>"
        "<axis xyz=\"0 -1 0\"/><limit velocity=\"100\" effort=\"100\"/></joint>"
        "<link name=\"rod\"><inertial><origin xyz=\"0 0 -1\"/><mass value=\"1\"/>"
        "<inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/></inertial></link>"
        "<joint name=\"tip_joint\" type=\"fixed\"><parent link=\"rod\"/><child link=\"tip\"/>"
        "<origin xyz=\"0 0 -1\"/></joint><link name=\"tip\"/></robot>");
  }

  // A kilogram on a rail with these ratings.
  void write_cart(double velocity, double effort) const {
    write_file_atomically(
        (folder_ / "cart.urdf").string(),
        "<robot name=\"cart\"><link name=\"floor\"/><link name=\"cart\"><inertial><mass value=\"1\"/>"
        "<inertia ixx=\"0\" ixy=\"0\" ixz=\"0\" iyy=\"0\" iyz=\"0\" izz=\"0\"/></inertial></link>"
        "<joint name=\"slide\" type=\"prismatic\"><parent link=\"floor\"/><child link=\"cart\"/>"
        "<axis xyz=\"1 0 0\"/><limit lower=\"-100\" upper=\"100\" velocity=\"" +
            std::to_string(velocity) + "\" effort=\"" + std::to_string(effort) + "\"/></joint></robot>");
  }

  SolveReport solved(const std::string& text) {
    text_ = text;
    return solve_task(read());
  }

  // The pendulum from an angle to where its tip has this height.
  static std::string tip_to(double from, double height, const std::string& method) {
    return "robot {\n urdf pendulum.urdf\n}\nhorizon {\n duration 1.5\n intervals 30\n}\nstart {\n q " +
           std::to_string(from) +
           "\n}\ngoal {\n q 0\n free hinge\n}\ncosts {\n control 1\n}\nterms {\n term tip {\n what "
           "frame_position\n frame tip\n entries z\n target " +
           std::to_string(height) + "\n role equality\n where end\n }\n}\nsolver {\n method " + method +
           "\n}\n";
  }
};

TEST_F(VerdictKinds, ABarrierThatIsLeftIsNoOptimum) {
  load("two_link_arm_reaching");
  const std::size_t expected = text_.find("expected");
  ASSERT_NE(expected, std::string::npos);
  text_.resize(expected);
  const std::string task = text_;
  const SolveReport right = solved(task);
  EXPECT_TRUE(right.success()) << right.verdict();
  EXPECT_EQ(right.solution.nlp.stationary_point, StationaryPoint::kMinimum);
  for (const char* target : {"1", "1e-2", "1e-4"}) {
    const SolveReport left = solved(task + "solver {\n ipopt {\n mu_target " + target + "\n }\n}\n");
    EXPECT_FALSE(left.success()) << target;
    EXPECT_NE(left.verdict().find("complementarity"), std::string::npos) << left.verdict();
  }
  for (const char* factor : {"-1", "0", "-1e-3"}) {
    text_ = task + "solver {\n ipopt {\n obj_scaling_factor " + factor + "\n }\n}\n";
    EXPECT_NE(message().find("expected a number above 0"), std::string::npos) << message();
  }
}

// Hanging still is stationary for a cost that draws upwards, and a maximum of it.
TEST_F(VerdictKinds, ASaddleIsLeftByEveryMethod) {
  for (const char* method : {"ipopt", "riccati", "ddp"}) {
    const SolveReport report = solved(
        "robot {\n urdf pendulum.urdf\n}\nhorizon {\n duration 3\n intervals 60\n}\nstart {\n q 0\n}\n"
        "goal {\n q 0\n free hinge\n}\ncosts {\n control 0.001\n}\nterms {\n term up {\n what "
        "frame_position\n"
        " frame tip\n target \"0 0 1\"\n }\n}\nsolver {\n method " +
        std::string(method) + "\n}\n");
    EXPECT_TRUE(report.success()) << report.text();
    EXPECT_LT(report.solution.cost(), 7) << method;  // 12 where it hangs
    EXPECT_EQ(report.solution.nlp.stationary_point, StationaryPoint::kMinimum) << method;
    // By approximations of the Hessian it is left, or not called an optimum.
    text_ += "transcription {\n hessian gauss_newton\n}\n";
    const SolveReport approximate = solve_task(read());
    EXPECT_TRUE(!approximate.success() || approximate.solution.cost() < 11.9) << approximate.text();
    if (std::string(method) != "ddp") continue;
    // Gauss-Newton learns the curvature that it leaves out; where rounding lets it no further, Newton's own steps do.
    EXPECT_TRUE(approximate.success()) << approximate.text();
    EXPECT_LT(approximate.solution.cost(), 7);
    EXPECT_FALSE(approximate.solution.nlp.is_by_other_method);
    text_.replace(text_.find("method ddp"), 10, "method ddp\n tolerance 1e-18");
    const SolveReport closer = solve_task(read());
    EXPECT_TRUE(closer.success()) << closer.text();
    EXPECT_NE(closer.meshes.front().status, SolveStatus::kSolved);
    EXPECT_TRUE(closer.solution.nlp.is_by_other_method);
    EXPECT_EQ(closer.solution.nlp.stationary_point, StationaryPoint::kMinimum);
  }
}

// Upright at half a turn all derivatives are rounding, where at zero they are none.
TEST_F(VerdictKinds, DdpLeavesAPoleThatStandsByRounding) {
  for (const double height : {-1.0, -0.5}) {
    const SolveReport report = solved(
        "robot {\n urdf pendulum.urdf\n}\nhorizon {\n duration 3\n intervals 120\n}\nstart {\n q "
        "3.141592653589793\n}\ngoal {\n q 0\n free hinge\n}\ncosts {\n control 0.01\n}\nterms {\n term down "
        "{\n what "
        "frame_position\n frame tip\n target \"0 0 " +
        std::to_string(height) + "\"\n }\n}\nsolver {\n method ddp\n}\n");
    EXPECT_TRUE(report.success()) << report.text();
    EXPECT_LT(report.solution.cost(), 0.7 * 3 * std::pow(1 - height, 2));  // of standing still
    EXPECT_EQ(report.solution.nlp.stationary_point, StationaryPoint::kMinimum);
  }
}

// However little the task allows defects, a control may pass its limits by what is not cut off.
TEST_F(VerdictKinds, ControlsAtTheirLimitsAreKeptWhateverDefectsAreAllowed) {
  for (const char* bounds : {"bounds {\n efforts 12\n}\n", ""}) {
    for (const char* method : {"ipopt", "riccati"}) {
      write_cart(30, *bounds ? 100 : 12);
      const SolveReport report = solved(
          "robot {\n urdf cart.urdf\n}\nhorizon {\n duration 1\n intervals 40\n}\nstart {\n q 0\n}\ngoal {\n "
          "q "
          "2.5\n}\ncosts {\n control 1\n}\nverify {\n integration_error 1e-5\n}\n" +
          std::string(bounds) + "solver {\n method " + method + "\n}\n");
      EXPECT_TRUE(report.success()) << report.text();
    }
  }
}

// Nothing moves along y but by rounding, which a finer mesh takes over; the obstacle is just touched.
TEST_F(VerdictKinds, WhatStandsStillButForRoundingDoesNotDiverge) {
  write_file_atomically(
      (folder_ / "table.urdf").string(),
      "<robot name=\"table\"><link name=\"floor\"/><link name=\"carriage\"/><link name=\"hand\"><inertial>"
      "<mass value=\"1\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" iyy=\"0.1\" iyz=\"0\" "
      "izz=\"0.1\"/></inertial>"
      "</link><joint name=\"x\" type=\"prismatic\"><parent link=\"floor\"/><child link=\"carriage\"/><axis "
      "xyz=\"1 0 "
      "0\"/><limit lower=\"-10\" upper=\"10\" velocity=\"300\" effort=\"200\"/></joint><joint name=\"y\" "
      "type=\"prismatic\"><parent link=\"carriage\"/><child link=\"hand\"/><axis xyz=\"0 1 0\"/><limit "
      "lower=\"-10\" "
      "upper=\"10\" velocity=\"300\" effort=\"100\"/></joint></robot>");
  for (const char* method : {"ipopt", "riccati"}) {
    const SolveReport report = solved(
        "robot {\n urdf table.urdf\n}\nhorizon {\n duration 2\n intervals 2\n}\nstart {\n q \"0 0\"\n}\ngoal "
        "{\n q "
        "\"3 0\"\n}\ncosts {\n control 1\n}\ntranscription {\n scheme trapezoid\n}\nobstacles {\n bar post "
        "{\n from "
        "\"1.37 0.05 -1\"\n to \"1.37 0.05 1\"\n radius 0.02\n }\n}\nbodies {\n sphere hull {\n frame hand\n "
        "center "
        "\"0 0 0\"\n radius 0.03\n }\n}\nsolver {\n method " +
        std::string(method) + "\n}\n");
    EXPECT_TRUE(report.success()) << report.text();
  }
}

// A pendulum that falls freely, as good as: its motion is there, and on eleven trapezoids there is none.
TEST_F(VerdictKinds, AMeshTooCoarseForAnyMotionIsRefined) {
  for (const char* method : {"ipopt", "riccati"}) {
    const SolveReport report = solved(
        "robot {\n urdf pendulum.urdf\n}\nhorizon {\n duration 1.77\n intervals 11\n}\nstart {\n q -2\n}\n"
        "goal {\n q 1.1142945849\n v -4.1004278213\n}\ncosts {\n control 1\n}\nbounds {\n efforts 0.1\n}\n"
        "transcription {\n scheme trapezoid\n}\nsolver {\n method " +
        std::string(method) + "\n}\n");
    EXPECT_TRUE(report.success()) << report.text();
    EXPECT_GT(report.meshes.size(), 1u);
    EXPECT_EQ(report.meshes.front().status, SolveStatus::kLocallyInfeasible);
  }
  // Far from all motions no finer mesh is tried.
  const SolveReport report = solved(
      "robot {\n urdf pendulum.urdf\n}\nhorizon {\n duration 1.77\n intervals 11\n}\nstart {\n q -2\n}\n"
      "goal {\n q 2.5\n v 0\n}\ncosts {\n control 1\n}\nbounds {\n efforts 0.1\n}\ntranscription {\n scheme "
      "trapezoid\n}\n");
  EXPECT_FALSE(report.success());
  EXPECT_EQ(report.meshes.size(), 1u);
}

// A double well from its ridge: x' = u, x(0) = 0, int r u^2 + w (x^2 - s^2)^2.  At rest the cost is w s^4 T.
TEST(Saddles, ARidgeIsLeftForEitherWell) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> decade(-1, 1);
  for (int k = 0; k < 12; ++k) {
    const double r = 0.01 * std::pow(10, decade(random)), w = std::pow(10, decade(random)),
                 s = std::pow(10, decade(random) / 2), T = 3;
    Problem p("ridge", {"x"}, {"u"}, T, [](const auto& at) { return vector(at.u[0]); });
    p.add(running_cost("well", [=](const auto& at) {
      const auto off = at.x[0] * at.x[0] - s * s;
      return vector(std::decay_t<decltype(off)>(r * at.u[0] * at.u[0] + w * off * off));
    }));
    p.start << 0;
    // Rest is a maximum to the second order where 2 w s^2 (2 T / pi)^2 > r.
    if (2 * w * s * s * std::pow(2 * T / kPi, 2) < 2 * r) continue;
    for (const NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
      const Solution solution =
          optimise(p, {.mesh = {.intervals = 40, .evaluation = kInterpreted}, .solver = {.method = method}});
      EXPECT_TRUE(solution.converged()) << k << ": " << to_string(solution.nlp.status);
      EXPECT_LT(solution.cost(), 0.999 * w * std::pow(s, 4) * T) << k;
      EXPECT_EQ(solution.nlp.stationary_point, StationaryPoint::kMinimum) << k;
    }
  }
}

TEST_F(VerdictKinds, WhatIsStationaryAndNoMinimumIsSaidToBe) {
  SolveReport report;
  report.solution.nlp.status = SolveStatus::kSolved;
  EXPECT_TRUE(report.success()) << report.verdict();
  report.solution.nlp.stationary_point = StationaryPoint::kNotMinimum;
  EXPECT_FALSE(report.success());
  EXPECT_NE(report.verdict().find("not a minimum"), std::string::npos) << report.verdict();
}

TEST_F(VerdictKinds, AGoalThatCostsMissIsNotReached) {
  load("cart_pole_ddp");
  replace("q 1e4", "q 1e-3"), replace("v 1e3", "v 1e-3");
  text_.resize(text_.find("expected"));
  const std::string weak = text_;
  const SolveReport missed = solved(weak);
  EXPECT_FALSE(missed.success());
  EXPECT_GT(missed.ddp->goal_miss, 0.01);
  EXPECT_NE(missed.verdict().find("misses the goal"), std::string::npos) << missed.verdict();
  EXPECT_TRUE(solved(weak + "verify {\n goal 1e9\n}\n").success());
  replace("goal {", "goal {\n soft on");
  EXPECT_TRUE(solve_task(read()).success());
  replace("method ddp", "method riccati");
  EXPECT_NE(message().find("goal.soft"), std::string::npos) << message();
}

TEST_F(VerdictKinds, BoundsAreLookedAtBetweenPoints) {
  write_cart(10, 100);
  const std::string task =
      "robot {\n urdf cart.urdf\n}\nhorizon {\n duration 1\n intervals 3\n}\nstart {\n q 0\n}\ngoal {\n q "
      "1\n}\n"
      "costs {\n control 1\n}\ntranscription {\n scheme hermite-simpson-linear\n}\n";
  const std::string as_bound = task + "bounds {\n velocities 1.2\n}\n",
                    as_term =
                        task +
                        "terms {\n term slow {\n type joint_velocity\n role inequality\n lower -1.2\n upper "
                        "1.2\n }\n}\n";
  for (const std::string& text : {as_bound, as_term}) {
    const SolveReport coarse = solved(text + "verify {\n max_refinements 0\n}\n");
    EXPECT_FALSE(coarse.success());
    EXPECT_NE(coarse.verdict().find("between points of the mesh, bounded by 1.2"), std::string::npos)
        << coarse.verdict();
    const SolveReport fine = solved(text);
    EXPECT_TRUE(fine.success()) << fine.verdict();
    EXPECT_GT(fine.meshes.size(), 1u);
    std::vector<double> times;
    for (int k = 0; k <= 1000; ++k) times.push_back(k / 1000.0);
    EXPECT_LE(resampled(read().problem, fine.solution.motion, times).x.row(1).maxCoeff(), 1.2 * 1.003);
  }
}

// T = d / v + v m / F for a distance d that reaches the rated velocity v, 2 sqrt(d m / F) otherwise.
TEST_F(VerdictKinds, SwitchesKeepLimits) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(0.5, 2);
  for (int k = 0; k < 6; ++k) {
    const double v = k == 0 ? 2 : 2 * uniform(random), F = k == 0 ? 1 : uniform(random),
                 d = k == 0 ? 10 : 5 * uniform(random);
    write_cart(v, F);
    const double rated = std::stod(std::to_string(v)), force = std::stod(std::to_string(F));
    const double least = d > rated * rated / force ? d / rated + rated / force : 2 * std::sqrt(d / force);
    for (const char* method : {"ipopt", "riccati"}) {
      const SolveReport report = solved(
          "robot {\n urdf cart.urdf\n}\nhorizon {\n duration 8\n min_duration 0.5\n max_duration 50\n "
          "intervals "
          "28\n}\n"
          "start {\n q 0\n}\ngoal {\n q " +
          std::to_string(d) + "\n}\ncosts {\n time 1\n}\nsolver {\n method " + method + "\n}\n");
      EXPECT_TRUE(report.success()) << report.text();
      EXPECT_NEAR(report.duration(), least, 2e-3 * least);
      const Trajectory& motion = report.solution.motion;
      for (int i = 0; i < motion.intervals(); ++i)
        for (double at = 0; at <= 1; at += 0.05)
          EXPECT_LE(std::abs(motion.control(i, at)[0]), force * (1 + 2e-3));
    }
  }
}

// Solvers widen a bound by a part of it, which is much beside how far the guess moves the state.
TEST_F(VerdictKinds, ABoundThatIsReachedFromNearbyIsKept) {
  write_cart(100, 100);
  for (const std::string method : {"ipopt", "riccati"}) {
    const SolveReport report = solved(
        "robot {\n urdf cart.urdf\n}\nhorizon {\n duration 1\n intervals 20\n}\nstart {\n q 2.95\n v 1\n}\n"
        "goal {\n q 2.951\n}\nbounds {\n positions 3\n}\ncosts {\n control 1\n}\nsolver {\n method " +
        method + "\n}\n");
    EXPECT_TRUE(report.success()) << method << ": " << report.verdict();
    EXPECT_NEAR(report.solution.motion.x.row(0).maxCoeff(), 3, 1e-6) << method;
  }
}

// What the next interval's control does is no slope at the end of one before it: the mesh is fine enough as it is.
TEST_F(VerdictKinds, HeldControlsKeepALimitOfVelocityBetweenPoints) {
  write_cart(1, 100);
  for (const std::string method : {"ipopt", "riccati"}) {
    const SolveReport report = solved(
        "robot {\n urdf cart.urdf\n}\nhorizon {\n duration 1.12\n intervals 10\n}\nstart {\n q 0\n}\n"
        "goal {\n q 1\n}\ncosts {\n control 1\n}\ntranscription {\n scheme runge-kutta-4\n}\n"
        "solver {\n method " +
        method + "\n}\n");
    EXPECT_TRUE(report.success()) << report.verdict();
    EXPECT_EQ(report.meshes.size(), 1u);
    EXPECT_NEAR(report.solution.motion.x.row(1).maxCoeff(), 1, 1e-6);
  }
}

TEST_F(VerdictKinds, FeetInMidAirAreTold) {
  load("quadruped_crouch");
  const Task task = read();
  const auto is_of_floor = [](const std::string& note) {
    return note.find("the floor") != std::string::npos;
  };
  EXPECT_TRUE(std::none_of(task.notes.begin(), task.notes.end(), is_of_floor)) << task.notes.front();
  replace("floor    0.0171", "floor    -0.0829");
  EXPECT_NE(message().find("\"FL_FOOT\" is held 0.100 m above the floor, which is at z = -0.0829 m"),
            std::string::npos)
      << message();
  replace("floor    -0.0829", "");
  const Task silent = read();  // notes are enough where the file does not say where the floor is
  EXPECT_EQ(std::count_if(silent.notes.begin(), silent.notes.end(), is_of_floor), 4);
  // One foot in the air.
  load("quadruped_crouch");
  replace("q \"0 0.8 -1.6", "q \"0 0.5 -1.6");
  EXPECT_NE(message().find("\"FL_FOOT\" is held"), std::string::npos) << message();
  EXPECT_EQ(message().find("\"FR_FOOT\" is held"), std::string::npos) << message();
}

// |u|^2 = 1 from u = 0, where the row has no slope: the violation is largest there.
TEST(Saddles, AViolationIsLeftAtItsLargest) {
  for (const NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
    Problem p("thrust", {"x", "y", "vx", "vy"}, {"ux", "uy"}, 2,
              [](const auto& s) { return vector(s.x[2], s.x[3], s.u[0], s.u[1]); });
    p.add(path_equality("length", [](const auto& s) {
      return vector(std::decay_t<decltype(s.u[0])>(s.u[0] * s.u[0] + s.u[1] * s.u[1] - 1.0));
    }));
    p.add(
        terminal_cost("far", [](const auto& s) { return vector(std::decay_t<decltype(s.x[0])>(-s.x[0])); }));
    p.start << 0, 0, 0, 0;
    const Solution solution =
        optimise(p, {.mesh = {.intervals = 20, .evaluation = kInterpreted}, .solver = {.method = method}});
    EXPECT_TRUE(solution.success()) << to_string(solution.nlp.status);
    EXPECT_NEAR(solution.cost(), -2, 1e-6);  // u = (1, 0) throughout
  }
}

// Of the same program by another tool: 0.0597 from 3.1 rad, 76.02 from 0.1 rad to upright.
TEST_F(VerdictKinds, ScalesHoldAroundTheStart) {
  for (const char* method : {"ipopt", "riccati"}) {
    const SolveReport down = solved(tip_to(3.1, -1, method));
    EXPECT_TRUE(down.success()) << down.verdict();
    EXPECT_NEAR(down.solution.cost(), 0.0597, 5e-4);
    const SolveReport up = solved(tip_to(0.1, 1, method));
    EXPECT_TRUE(up.success()) << up.verdict();
    EXPECT_NEAR(up.solution.cost(), 76.02, 0.01);
    // The slope of the height is rounding there, and zero: no derivative is wrong for that.
    for (const double from : {kPi, 0.0}) {
      const SolveReport flat = solved(tip_to(from, from == 0 ? 1 : -1, method));
      EXPECT_TRUE(flat.success()) << method << " from " << from << ": " << flat.verdict();
      EXPECT_LT(std::abs(flat.solution.motion.x(0, flat.solution.motion.points() - 1) - from), 1.1 * kPi);
    }
  }
}

// An arm stretches towards what it cannot reach, in steps as short as within reach.
TEST_F(VerdictKinds, AGoalOutOfReachIsStretchedTo) {
  for (const char* x : {"1.2", "5"}) {
    text_ =
        "robot {\n urdf " + test::source_folder() +
        "/config/robots/ur5.urdf\n}\nhorizon {\n duration 0.5\n intervals 10\n}\ntranscription {\n scheme "
        "trapezoid\n dynamics inverse\n hessian gauss_newton\n}\nstart {\n q \"0 -1 1 0 0 0\"\n}\ngoal {\n "
        "frame tool0 {\n position \"" +
        std::string(x) +
        " 0.3 0.3\"\n }\n}\ncosts {\n acceleration 1e-3\n tracking {\n position 100\n }\n}\nmpc {\n duration "
        "1\n period 0.02\n late 1\n}\n";
    const ControlReport report = control_task(read());
    EXPECT_TRUE(report.success()) << report.text();
    EXPECT_NE(report.note.find("out of reach"), std::string::npos);
    EXPECT_LT(report.off_end, report.off_begin);
    int iterations = 0;
    for (const ClosedLoop::Step& step : report.loop.steps) iterations += step.iterations;
    EXPECT_LE(iterations, 200) << x;  // of 50 steps
  }
}

// A point moves at a constant speed past two discs; the cost, the square of the speed, is the same for every motion.
// Problem "obstacle" of PSOPT's manual.
TEST(Success, IsFoundWhereTheCostIsConstant) {
  constexpr double kSpeed = 2.138;
  Problem p("obstacle", {"x", "y"}, {"heading"}, 1, [](const auto& s) {
    using std::cos, std::sin;
    using T = std::decay_t<decltype(s.u[0])>;
    return vector(T(kSpeed * cos(s.u[0])), T(kSpeed * sin(s.u[0])));
  });
  p.add(running_squares("speed", [](const auto& s) {
    using std::cos, std::sin;
    using T = std::decay_t<decltype(s.u[0])>;
    return vector(T(kSpeed * cos(s.u[0])), T(kSpeed * sin(s.u[0])));
  }));
  p.add(path_inequality(
      "clear",
      [](const auto& s) {
        using T = std::decay_t<decltype(s.x[0])>;
        const T a = s.x[0] - 0.4, b = s.x[1] - 0.5, c = s.x[0] - 0.8, d = s.x[1] - 1.5;
        return vector(T(a * a + b * b), T(c * c + d * d));
      },
      Eigen::Vector2d::Constant(0.1), Eigen::Vector2d::Constant(HUGE_VAL)));
  p.start << 0, 0;
  p.goal << 1.2, 1.6;
  for (const NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
    for (const Scheme& scheme : {trapezoid(), hermite_simpson(), radau(3), lobatto(4)}) {
      const Solution s = optimise(p, {.mesh = {.scheme = scheme, .intervals = 30, .evaluation = kInterpreted},
                                      .solver = {.method = method}});
      EXPECT_TRUE(s.converged()) << scheme.name << (method == NlpMethod::kIpopt ? " ipopt " : " stages ")
                                 << to_string(s.nlp.status);
      EXPECT_NEAR(s.cost(), kSpeed * kSpeed, 1e-6) << scheme.name;
    }
  }
}

// The command and the library say the same.
TEST(Success, IncludesTheVerification) {
  const Problem swing = test::swing_up();
  const OptimiseOptions coarse{.mesh = {.intervals = 8, .evaluation = kInterpreted}};
  const Solution off = optimise(swing, coarse);
  ASSERT_TRUE(off.converged());
  EXPECT_GT(off.verification.worst_relative, off.demands.integration_error);
  EXPECT_FALSE(off.success());
  OptimiseOptions fine = coarse;
  fine.mesh.intervals = 60;
  EXPECT_TRUE(optimise(swing, fine).success());
  OptimiseOptions lenient = coarse;
  lenient.demands.integration_error = lenient.demands.between = lenient.demands.cost_error = 1;
  EXPECT_TRUE(optimise(swing, lenient).success());
}

}  // namespace
}  // namespace dyntape::verdict_kinds_test
