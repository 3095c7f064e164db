// SPDX-License-Identifier: BSD-3-Clause
//
// Receding horizons: what they plan, what a plant does that follows them, what they take.
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/mpc/receding_horizon.h>
#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/motion/robot_terms.h>
#include <dyntape/interface/run/mpc/mpc_task.h>
#include <dyntape/interface/run/solve/pictures.h>
#include "dynamics/robot_files.h"
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"
#include "source_folder.h"

namespace dyntape::mpc_test {
namespace {

using Eigen::VectorXd;
using test::follower;

MpcOptions interpreted(int intervals, int iterations = 0) {
  MpcOptions options;
  options.mesh.intervals = intervals;
  options.mesh.evaluation = test::kInterpreted;
  options.iterations = iterations;
  return options;
}

// A first guess may take a robot's dynamics: later steps know what it said.
TEST(Mpc, AsksForItsFirstGuessOnce) {
  Problem problem = follower(2);
  int asked = 0;
  problem.guess = [&asked, line = straight_line(problem)](double t) { return ++asked, line(t); };
  RecedingHorizon mpc(problem, interpreted(10, 1));
  mpc.step(0, Eigen::Vector2d(0.3, 0));
  const int of_first = asked;
  EXPECT_GT(of_first, 0);
  for (int k = 1; k < 4; ++k) mpc.step(0.05 * k, Eigen::Vector2d(0.3, 0.1 * k));
  EXPECT_EQ(asked, of_first);
}

// Linear dynamics, quadratic costs, no limit in force: a step from a neighbouring state is solved by one iteration, and the plan is the
// optimum that a solve from nowhere finds.
TEST(Mpc, EachPlanIsTheOptimumFromThere) {
  MpcOptions options = interpreted(20);
  options.solver.tolerance = 1e-8;  // its own leaves 1.3e-3
  RecedingHorizon mpc(follower(2), options);
  VectorXd x = Eigen::Vector2d(0.3, 0);
  for (int k = 0; k < 20; ++k) {
    const double t = 0.05 * k;
    const MpcStep& s = mpc.step(t, x);
    ASSERT_TRUE(s.usable) << k;
    ASSERT_EQ(s.status, SolveStatus::kSolved) << k;
    Problem alone = follower(2);
    alone.start = x;
    alone.parameters = alone.parameters.later(t);
    const Solution fresh =
        optimise(alone, {.mesh = {.scheme = trapezoid(), .intervals = 20, .evaluation = test::kInterpreted},
                         .solver = {.tolerance = 1e-10},
                         .verify = false});
    EXPECT_NEAR(s.cost, fresh.cost(), 1e-5 * (1 + fresh.cost())) << k;
    EXPECT_NEAR((s.plan.motion.x - fresh.motion.x).cwiseAbs().maxCoeff(), 0, 1e-3) << k;
    EXPECT_LE(s.iterations, k > 0 ? 8 : 100) << k;
    x = simulate(alone, x, 0, 0.05, [&](double after) { return s.plan.control(t + after); }).x;
  }
}

// One iteration a step converges while the plant moves, and follows nearly as well.
TEST(Mpc, OneIterationAStepFollows) {
  double worst[2] = {0, 0};
  for (int iterations : {0, 1}) {
    RecedingHorizon mpc(follower(1.5), interpreted(15, iterations));
    const Problem plant = follower(1.5);
    VectorXd x = Eigen::Vector2d(0.3, 0);
    for (int k = 0; k < 200; ++k) {
      const double t = 0.02 * k;
      const MpcStep& s = mpc.step(t, x);
      EXPECT_LE(s.iterations, iterations == 1 && k > 0 ? 1 : 100);
      ASSERT_TRUE(s.usable) << k << " " << to_string(s.status);
      x = simulate(plant, x, 0, 0.02, [&](double after) { return s.plan.control(t + after); }).x;
      if (t > 1) worst[iterations] = std::max(worst[iterations], std::abs(x[0] - std::sin(t + 0.02)));
    }
  }
  EXPECT_LT(worst[0], 0.02);
  EXPECT_LT(worst[1], 0.03);
  std::printf("worst distance from the reference: %.4f solved, %.4f with one iteration\n", worst[0],
              worst[1]);
}

// A push, and a state beyond a limit: the plan begins there.
TEST(Mpc, BeginsWhereThePlantIs) {
  Problem p = follower(2);
  p.x.lower[0] = -0.5, p.x.upper[0] = 0.5;
  RecedingHorizon mpc(p, interpreted(20));
  mpc.values().parameters.set("reference", VectorXd::Zero(1).eval());
  EXPECT_TRUE(mpc.step(0, Eigen::Vector2d(0.1, 0)).usable);
  const MpcStep& beyond = mpc.step(0.1, Eigen::Vector2d(0.50001, -1));
  EXPECT_TRUE(beyond.usable);
  EXPECT_EQ(beyond.plan.motion.x(0, 0), 0.50001);
  EXPECT_LE(beyond.plan.motion.x.row(0).tail(20).maxCoeff(), 0.5 + 1e-6);
}

// A push, after which the last plan's linearisation has no way to its end, but the problem has one to the other.
TEST(Mpc, TheVerdictIsTheProblemsAndNotThatOfTheLastPlan) {
  Problem p("either end", {"p"}, {"u"}, 1, [](const auto& s) { return s.u; });
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.add(terminal_equality("at 2 or -2", [](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(s.x[0] * s.x[0] - T(4)));
  }));
  p.start << 1;
  p.u.lower << -3, p.u.upper << 3;
  for (int iterations : {0, 1}) {
    RecedingHorizon mpc(p, interpreted(10, iterations));
    ASSERT_TRUE(mpc.step(0, VectorXd::Constant(1, 1)).usable);
    const MpcStep& other = mpc.step(0.01, VectorXd::Constant(1, -1.5));
    EXPECT_TRUE(other.usable) << to_string(other.status);
    EXPECT_NEAR(other.plan.motion.x(0, 10), -2, 1e-6);
    EXPECT_FALSE(mpc.step(0.02, VectorXd::Constant(1, 6)).usable);
    EXPECT_EQ(mpc.step(0.03, VectorXd::Constant(1, 6)).status, SolveStatus::kLocallyInfeasible);
  }
}

// A double integrator on a rail, its force limited, far from where its plan has it: a new barrier takes the way to limits that the last
// plan did not know in fewer iterations than that plan's own, and finds the optimum that a solve from nowhere finds.
TEST(Mpc, FarFromItsPlanItBeginsAnew) {
  Problem p("rail", {"p", "v"}, {"u"}, 3, [](const auto& s) { return vector(s.x[1], s.u[0]); });
  p.add(running_squares("near", [](const auto& s) { return s.x; }));
  p.add(running_squares("effort", [](const auto& s) { return (0.1 * s.u).eval(); }));
  p.x.lower << -2, -3, p.x.upper << 2, 3;
  p.u.lower << -4, p.u.upper << 4;
  p.start << 0.1, 0;
  for (double push : {0.5, 2.5, -2.5}) {
    RecedingHorizon mpc(p, interpreted(30));
    ASSERT_TRUE(mpc.step(0, p.start).usable);
    const VectorXd x = Eigen::Vector2d(0.1, push);
    const MpcStep& far = mpc.step(0.02, x);
    ASSERT_EQ(far.status, SolveStatus::kSolved) << push;
    Problem alone = p;
    alone.start = x;
    const Solution fresh =
        optimise(alone, {.mesh = {.scheme = trapezoid(), .intervals = 30, .evaluation = test::kInterpreted},
                         .solver = {.tolerance = 1e-10},
                         .verify = false});
    EXPECT_NEAR(far.cost, fresh.cost(), 1e-5 * (1 + fresh.cost())) << push;
    EXPECT_LE(far.iterations, fresh.nlp.iterations() + 5) << push;
    std::printf("push %g: %d iterations, a solve from nowhere %d\n", push, far.iterations,
                fresh.nlp.iterations());
  }
}

// Names whose target is in the picture, one after the other.
std::string targets_in(const io::Plot& plot) {
  std::string names;
  for (const io::Panel& panel : plot.panels)
    for (const io::Series& series : panel.series)
      if (!series.target_of.empty()) names += series.target_of + " ";
  return names;
}

// The task that is shipped, pushed twice, acting 5 ms after it measures: it comes back to its goal.
TEST(Mpc, TheShippedTaskHoldsItsGoal) {
  const Task task = read_task(test::source_folder() + "/config/control/arm_holds.info");
  EXPECT_EQ(task.control.disturbances.size(), 2u);
  const ControlReport report = control_task(task);
  EXPECT_TRUE(report.success()) << report.text();
  EXPECT_GT(report.off_begin, 0.5);
  EXPECT_LT(report.off_end, 0.01);
  // What the gains between plans are worth.
  ASSERT_TRUE(report.feedback);
  EXPECT_EQ(report.feedback->after, 1.2);
  EXPECT_LT(report.feedback->typical_with, 0.8 * report.feedback->typical_without);
  EXPECT_EQ(report.feedback->with.size(), std::size_t(report.loop.motion.points()));
  EXPECT_NE(report.text().find("with feedback between plans"), std::string::npos) << report.text();
  // The picture: the goal of each joint and of its velocity, the distance from it, and when the arm is pushed.
  const io::Plot picture = with_pushes(tracking_plot(task, report.loop.motion), report);
  const std::string targets = targets_in(picture);
  EXPECT_EQ(std::count(targets.begin(), targets.end(), ' '), 14) << targets;
  // Limits of the robot that are exceeded on the way are said, bounded by the task or not.
  ASSERT_TRUE(report.beyond);
  const Trajectory& motion = report.loop.motion;
  const dynamics::Model<double>& model = task.scene.model;
  for (int j = 0; j < model.nv; ++j) {
    const dynamics::Joint<double>& joint = model.joints[std::size_t(j)];
    const double fastest = motion.x.row(model.nq + j).cwiseAbs().maxCoeff();
    const bool is_said =
        std::any_of(report.beyond->begin(), report.beyond->end(), [&](const std::string& said) {
          return said.find("velocity of " + joint.name + " ") != std::string::npos;
        });
    EXPECT_EQ(is_said, fastest > 1.0001 * joint.limits.velocity) << joint.name << " " << fastest;
  }
  EXPECT_EQ(picture.panels.back().title, "distance from the goal");
  EXPECT_EQ(picture.panels.back().series[0].y.front(), report.off_begin);
  for (const io::Panel& panel : picture.panels) EXPECT_EQ(panel.vertical.size(), 2u) << panel.title;
  EXPECT_TRUE(targets_in(trajectory_plot(task, report.loop.motion)).empty());
  // The second push, at 2 s, is in the motion, and in none before.
  const auto fastest = [&](double from, double to) {
    double most = 0;
    for (int k = 0; k < motion.points(); ++k) {
      if (motion.t[k] > from && motion.t[k] < to) most = std::max(most, std::abs(motion.x(7, k)));
    }
    return most;
  };
  EXPECT_LT(fastest(1.7, 2), 0.1);
  EXPECT_GT(fastest(2, 2.2), 0.12);
}

// The report measures to what the task draws to: the place of a frame, the motion that is followed, the goal of joints.
TEST(Mpc, ReportsTellWhatIsMeasuredTo) {
  const std::string folder = "/tmp/dyntape-mpc-test-" + std::to_string(getpid());
  const auto report_of = [&](const std::string& rest) {
    const std::string file = folder + "/task.info";
    write_file_atomically(
        file, "robot\n{\n urdf \"" + test::source_folder() +
                  "/config/robots/arm_2r.urdf\"\n}\nhorizon\n{\n duration 0.4\n intervals 8\n}\n"
                  "transcription\n{\n scheme trapezoid\n hessian gauss_newton\n}\nevaluation\n{\n route "
                  "interpreter\n}\nstart\n{\n q \"0.3 0.4\"\n}\nguess\n{\n control gravity\n}\nmpc\n{\n "
                  "duration 0.1\n period 0.05\n}\n" +
                  rest);
    const Task task = read_task(file);
    const ControlReport report = control_task(task);
    EXPECT_NE(report.text().find(std::string(", ") + to_string(report.loop.steps.front().status) + "\n"),
              std::string::npos)
        << report.text();
    return std::pair(task, report);
  };
  const std::string tracking = "costs\n{\n effort 1e-3\n tracking\n {\n  position 1\n  q 0\n }\n}\n";
  const Eigen::Vector3d place(0.3, 0, 0.6);
  const auto [of_frame, framed] =
      report_of("goal\n{\n frame hand\n {\n  position \"0.3 0 0.6\"\n }\n}\n" + tracking);
  const auto distance = [&, &of_frame = of_frame](const VectorXd& x) {
    const auto& model = of_frame.scene.model;
    dynamics::Data<double> data(model);
    dynamics::forward_kinematics<double>(model, data, VectorXd(x.head(2)));
    return (dynamics::frame_placement(model, data, model.frame_index("hand")).p - place).norm();
  };
  const Trajectory& motion = framed.loop.motion;
  EXPECT_EQ(framed.off_of, "the goal of hand");
  EXPECT_EQ(framed.unit, "m");
  EXPECT_NEAR(framed.off_begin, distance(motion.x.col(0)), 1e-12);
  EXPECT_NEAR(framed.off_end, distance(motion.x.col(motion.points() - 1)), 1e-12);
  EXPECT_GT(framed.off_begin, 0.1);
  EXPECT_NE(framed.text().find("from the goal of hand"), std::string::npos) << framed.text();

  EXPECT_EQ(targets_in(tracking_plot(of_frame, motion)), "x of hand y of hand z of hand ");
  EXPECT_EQ(tracking_plot(of_frame, motion).panels[0].series[5].y.back(), 0.6);

  write_file_atomically(folder + "/wanted.csv", "t,q.shoulder,q.elbow\n0,1,1\n0.1,1.5,1\n");
  const std::string follows = "reference\n{\n file wanted.csv\n q \"10 0\"\n}\ncosts\n{\n effort 1e-3\n}\n";
  for (const std::string goal : {"", "goal\n{\n q \"-1 -1\"\n}\n"}) {
    const auto [task, followed] = report_of(goal + follows);
    EXPECT_EQ(followed.off_of, "the reference");
    EXPECT_NEAR(followed.off_begin, 0.7, 1e-12);  // of the joint that counts
    EXPECT_EQ(targets_in(tracking_plot(task, followed.loop.motion)), "shoulder ");
    const Trajectory& moved = followed.loop.motion;
    EXPECT_NEAR(followed.off_end, std::abs(moved.x(0, moved.points() - 1) - 1.5), 1e-9);
  }
  const auto [joints, drawn] = report_of(
      "goal\n{\n q \"0.6 0.4\"\n free shoulder\n}\ncosts\n{\n effort 1e-3\n tracking\n {\n  q 1\n }\n}\n");
  EXPECT_EQ(drawn.off_of, "the goal");
  EXPECT_NEAR(drawn.off_begin, 0, 1e-12);  // of the elbow
  std::filesystem::remove_all(folder);
}

TEST(Mpc, ATaskThatNothingDrawsIsRefused) {
  Task task = read_task(test::source_folder() + "/config/tasks/arm_reaching.info");
  try {
    control_task(task);
    FAIL() << "nothing thrown";
  } catch (const ArgumentError& e) {
    EXPECT_NE(std::string(e.what()).find("expected weights in costs.tracking"), std::string::npos)
        << e.what();
  }
}

// What is commanded is never read while it is written, and the last one is there in the end.
TEST(Mpc, AnotherThreadReadsPlansWithoutWaiting) {
  TripleBuffer<std::vector<int>> latest;
  std::atomic<bool> ended = false;
  int last = -1;
  std::thread reader([&] {
    for (bool over = false; !over;) {
      over = ended;
      if (!latest.take()) continue;
      const std::vector<int>& v = latest.read();
      ASSERT_EQ(v.size(), 64u);
      for (int entry : v) ASSERT_EQ(entry, v.front());
      ASSERT_GT(v.front(), last);
      last = v.front();
    }
  });
  for (int i = 0; i < 100000; ++i) {
    latest.write().assign(64, i);
    latest.publish();
  }
  ended = true;
  reader.join();
  EXPECT_EQ(last, 99999);
}

TEST(Mpc, RefusesWhatItCannotFollow) {
  const auto message = [](const std::function<void()>& act) { return message_of<ArgumentError>(act); };
  Problem open = follower(1);
  open.start[0] = Problem::kFree;
  EXPECT_NE(message([&] { RecedingHorizon mpc(open, interpreted(5)); }).find("the start of \"p\" is free"),
            std::string::npos);
  RecedingHorizon mpc(follower(1), interpreted(5));
  EXPECT_NE(message([&] { mpc.step(0, VectorXd::Zero(3)); }).find("has 3 entries; expected 2"),
            std::string::npos);
  EXPECT_NE(
      message([&] { mpc.step(0, VectorXd::Constant(2, std::nan(""))); }).find("not all of them numbers"),
      std::string::npos);
  mpc.step(1, VectorXd::Zero(2));
  EXPECT_NE(
      message([&] { mpc.step(0.5, VectorXd::Zero(2)); }).find("expected a time after the last one's, 1 s"),
      std::string::npos);
  // Loops: steps without number, a period that no plan covers, a push that would never happen.
  const auto loop = [&](double seconds, double period, double push) {
    ClosedLoopOptions options{.seconds = seconds, .period = period, .mpc = interpreted(5)};
    if (push >= 0) options.disturbances = {{push, Eigen::Vector2d(0, 1)}};
    return message([&] { close_loop(follower(1), options); });
  };
  EXPECT_NE(loop(4, 1e-9, -1).find("expected at most 1e+07 steps"), std::string::npos) << loop(4, 1e-9, -1);
  EXPECT_NE(loop(4, 1, -1).find("expected less than the horizon of 1 s"), std::string::npos);
  EXPECT_NE(loop(1, 0.1, 1).find("a push at 1 s, expected one before the end at 1 s"), std::string::npos);
  EXPECT_EQ(loop(0.35, 0.1, 0.3), "nothing thrown");
}

// A seven-joint arm whose hand follows a place that moves.
TEST(Mpc, AnArmFollowsAPlaceThatMoves) {
  dynamics::UrdfOptions of_robot;
  of_robot.lock = {"panda_finger_joint1", "panda_finger_joint2"};
  const RobotScene scene{dynamics::load_urdf(dynamics::robot_file("panda"), of_robot)};
  Problem p =
      robot_problem(scene, {.duration = 0.5, .form = DynamicsForm::kInverse, .unit = ControlUnit::kFraction});
  limit_efforts(p, scene, ControlUnit::kFraction);
  limit_positions(p, scene);
  const Parameter place = p.parameters.add("place", [](double t) {
    return VectorXd(Eigen::Vector3d(0.45, 0.2 * std::sin(2 * t), 0.45 + 0.1 * std::cos(2 * t)));
  });
  const StageFunction hand = frame_position(scene, "panda_hand", Eigen::Vector3d::Zero());
  p.add(running_squares("near", [=](const auto& s) { return (30.0 * (hand(s) - place(s))).eval(); }));
  p.add(running_squares("calm", [](const auto& s) { return (0.1 * s.x.tail(7)).eval(); }));
  p.add(running_squares("effort", [](const auto& s) { return (0.1 * s.u).eval(); }));
  p.start << 0, -0.5, 0, -2, 0, 1.5, 0.5, VectorXd::Zero(7);
  MpcOptions options;
  options.mesh.intervals = 10;
  options.mesh.evaluation.lanes = Lanes::kNative;
  options.iterations = 1;
  RecedingHorizon mpc(p, options);
  const BuildReport made = mpc.build();
  VectorXd x = p.start;
  std::vector<double> seconds;
  double off = 0;
  for (int k = 0; k < 150; ++k) {
    const double t = 0.02 * k;
    const MpcStep& s = mpc.step(t, x);
    if (k > 0) seconds.push_back(s.seconds);
    ASSERT_TRUE(s.usable) << k << " " << to_string(s.status) << " " << s.violation;
    x = simulate(p, x, 0, 0.02, [&](double after) { return s.plan.control(t + after); }).x;
    if (t < 1.5) continue;
    Stage<double> now = p.stage(t + 0.02, x, VectorXd::Zero(7), VectorXd::Zero(7));
    off = std::max(off, (hand(now) - place(now)).norm());
  }
  std::sort(seconds.begin(), seconds.end());
  std::printf("step: median %.3f ms, 99 %% %.3f ms; hand off by %.2f mm at most\n",
              1e3 * seconds[seconds.size() / 2], 1e3 * seconds[seconds.size() * 99 / 100], 1e3 * off);
  EXPECT_LT(off, 0.02);
  EXPECT_EQ(mpc.build().compiled, made.compiled);
}

}  // namespace
}  // namespace dyntape::mpc_test
