// SPDX-License-Identifier: BSD-3-Clause
//
// Feedback gains of plans: against Riccati's recursion, a closed form, differences of solves, and by what they are worth in a loop.
#include <gtest/gtest.h>

#include <atomic>
#include <random>
#include <thread>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/mpc/closed_loop.h>
#include <dyntape/interface/control/riccati/riccati.h>
#include <dyntape/interface/control/sensitivity/motion_sensitivities.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/motion/robot_terms.h>
#include "dynamics/robot_files.h"
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"

namespace dyntape::mpc_gains_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr unsigned kSeed = 20;

MpcOptions with_gain(const Scheme& scheme, int intervals) {
  MpcOptions options;
  options.mesh = {.scheme = scheme,
                  .intervals = intervals,
                  .hessian = HessianKind::kExact,
                  .evaluation = test::kInterpreted};
  options.solver.tolerance = 1e-10;
  options.gains = true;
  return options;
}

// x' = A x + B u, int |r|^2 with r = C x + D u, |E x(T)|^2.
struct Lq {
  MatrixXd A, B, C, D, E;
  Problem problem(double horizon) const {
    std::vector<std::string> states, controls;
    for (Eigen::Index i = 0; i < A.rows(); ++i) states.push_back("x" + std::to_string(i));
    for (Eigen::Index i = 0; i < B.cols(); ++i) controls.push_back("u" + std::to_string(i));
    const auto linear = [](const MatrixXd& of_x, const MatrixXd& of_u) {
      return [of_x, of_u](const auto& s) {
        using T = typename std::decay_t<decltype(s.x)>::Scalar;
        return (of_x.cast<T>() * s.x + of_u.cast<T>() * s.u).eval();
      };
    };
    Problem p("random", states, controls, horizon, linear(A, B));
    p.add(running_squares("cost", linear(C, D)));
    p.add(terminal_squares("end", linear(E, MatrixXd::Zero(E.rows(), B.cols()))));
    p.start.setZero();
    return p;
  }
};

// With Euler's steps the program is a linear-quadratic problem of discrete time, whose first gain is Riccati's.
TEST(MpcGains, AreRiccatis) {
  std::mt19937_64 numbers(kSeed);
  std::uniform_real_distribution<double> any(-1, 1);
  const auto matrix = [&](Eigen::Index rows, Eigen::Index cols) {
    return MatrixXd(MatrixXd::NullaryExpr(rows, cols, [&] { return any(numbers); }));
  };
  double worst = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Index n = 1 + trial % 4, m = 1 + trial % 3;
    const Lq lq{matrix(n, n), matrix(n, m), matrix(n + m, n), matrix(n + m, m), matrix(n, n)};
    Problem p = lq.problem(1.5);
    p.start = matrix(n, 1);
    constexpr int kIntervals = 15;
    RecedingHorizon mpc(p, with_gain(euler(), kIntervals));
    const MpcStep& s = mpc.step(0, p.start);
    ASSERT_EQ(s.status, SolveStatus::kSolved);
    const double h = 1.5 / kIntervals;
    MatrixXd H(n + m, n + m), CD(n + m, n + m);
    CD << lq.C, lq.D;
    H = 2 * h * CD.transpose() * CD;
    const LqrStage stage{
        MatrixXd::Identity(n, n) + h * lq.A, h * lq.B, VectorXd::Zero(n), H, VectorXd::Zero(n + m), {}, {}};
    Riccati riccati;
    riccati.begin(2 * lq.E.transpose() * lq.E, VectorXd::Zero(n));
    for (int k = kIntervals - 1; k >= 0; --k) ASSERT_TRUE(riccati.push(stage, 0));
    const MatrixXd& K = riccati.policy().K;
    worst = std::max(worst, (K - s.plan.gain).cwiseAbs().maxCoeff() / (1 + K.cwiseAbs().maxCoeff()));
  }
  std::printf("seed %u: gains off by %.1e at most\n", kSeed, worst);
  EXPECT_LT(worst, 1e-9);
}

// x' = u, int x^2 + u^2: K = -tanh(T).  What Euler's steps are off by is a series in their length, whose terms go one by one.
TEST(MpcGains, MeetTheClosedForm) {
  const MatrixXd one = MatrixXd::Identity(1, 1), none = MatrixXd::Zero(1, 1);
  MatrixXd C(2, 1), D(2, 1);
  C << 1, 0;
  D << 0, 1;
  for (double T : {0.3, 1.0, 3.0}) {
    Problem p = Lq{none, one, C, D, none}.problem(T);
    p.start[0] = 1;
    std::vector<double> K;
    for (int intervals = 16; intervals <= 1024; intervals *= 2) {
      RecedingHorizon mpc(p, with_gain(euler(), intervals));
      K.push_back(mpc.step(3, p.start).plan.gain(0, 0));
    }
    EXPECT_NEAR((K[5] + std::tanh(T)) / (K[6] + std::tanh(T)), 2, 0.02);
    for (double power = 2; K.size() > 1; power *= 2, K.pop_back()) {
      for (std::size_t i = 0; i + 1 < K.size(); ++i) K[i] = (power * K[i + 1] - K[i]) / (power - 1);
    }
    EXPECT_NEAR(K[0], -std::tanh(T), 1e-9) << T;
  }
}

// Of what solves from neighbouring states give; a limit of the control is reached on the way.
TEST(MpcGains, AreDifferencesOfSolves) {
  for (const Scheme& scheme : {trapezoid(), hermite_simpson()}) {
    for (double limit : {1e3, 8.0}) {
      Problem p = test::swing_up(10, limit);
      p.goal.setConstant(Problem::kFree);
      p.start << 0.8, std::numbers::pi - 0.3, 0, 0;
      MpcOptions options = with_gain(scheme, 30);
      options.solver.bound_relaxation = 0;
      const auto plan_from = [&](const VectorXd& x) {
        Problem there = p;
        there.start = x;
        const Eigen::VectorXd end = Eigen::Vector4d(1, std::numbers::pi, 0, 0);
        there.guess = [x, end](double t) {
          return Stage<double>{t, x + t / 2 * (end - x), {}, VectorXd::Zero(1)};
        };
        RecedingHorizon mpc(there, options);
        const MpcStep& s = mpc.step(0, x);
        EXPECT_EQ(s.status, SolveStatus::kSolved);
        return s.plan;
      };
      const Plan plan = plan_from(p.start);
      ASSERT_GT(plan.gain.size(), 0);
      double worst = 0;
      const double d = 1e-5;
      for (Eigen::Index i = 0; i < 4; ++i) {
        const Plan up = plan_from(p.start + d * VectorXd::Unit(4, i)),
                   down = plan_from(p.start - d * VectorXd::Unit(4, i));
        const double du = (up.motion.u(0, 0) - down.motion.u(0, 0)) / (2 * d);
        worst = std::max(worst, std::abs(plan.gain(0, i) - du) / (1 + std::abs(du)));
      }
      std::printf("%s, limit %g, reached %g: off by %.1e\n", scheme.name.c_str(), limit,
                  plan.motion.u.cwiseAbs().maxCoeff(), worst);
      EXPECT_LT(worst, 1e-4) << scheme.name << " " << limit;
      EXPECT_LE(plan.control(0, p.start + VectorXd::Constant(4, 10)).cwiseAbs().maxCoeff(), limit);
    }
  }
}

// Derivatives of the whole plan, from what the controller holds: its gain is one of them, and differences of solves the others.  The
// last case measures a cart beyond its limit, on its way back.
TEST(MpcGains, AreAmongTheDerivativesOfThePlan) {
  const double at_limit[] = {1e3, 8.0, 1e3};
  for (int trial = 0; trial < 3; ++trial) {
    Problem p = test::swing_up(10, at_limit[trial]);
    p.goal.setConstant(Problem::kFree);
    VectorXd x(4);
    x << 0.8, std::numbers::pi - 0.3, trial == 2 ? -1 : 0, 0;
    if (trial == 2) p.x.upper[0] = x[0] - 1e-3;
    p.start << 0.7, std::numbers::pi - 0.3, 0, 0;
    const MpcOptions options = with_gain(trapezoid(), 30);
    MotionSensitivity sensitivity(p, options.mesh);
    const auto plan_from = [&](RecedingHorizon& mpc, const VectorXd& at) {
      const MpcStep& step = mpc.step(0, at);
      EXPECT_EQ(step.status, SolveStatus::kSolved) << trial;
      return step.plan;
    };
    RecedingHorizon mpc(p, options);
    EXPECT_NE(message_of<ArgumentError>([&] { mpc.solution(); }).find("no plan yet"), std::string::npos);
    const Plan plan = plan_from(mpc, x);
    EXPECT_EQ(mpc.problem().start, x);
    const MotionSensitivities by = sensitivity.at(mpc.problem(), mpc.solution());
    ASSERT_TRUE(by.good()) << trial << ": " << by.why;
    EXPECT_LT((by.gain - plan.gain).norm(), 1e-5 * (1 + plan.gain.norm())) << trial;
    const double d = 1e-5;
    for (Eigen::Index i = 0; i < 4; ++i) {
      RecedingHorizon up(p, options), down(p, options);
      plan_from(up, x + d * VectorXd::Unit(4, i)), plan_from(down, x - d * VectorXd::Unit(4, i));
      const std::vector<double> more = up.solution().x, less = down.solution().x;
      double worst = 0;
      for (std::size_t k = 0; k < more.size(); ++k) {
        const double difference = (more[k] - less[k]) / (2 * d);
        worst = std::max(worst,
                         std::abs(by.start.x(Eigen::Index(k), i) - difference) / (1 + std::abs(difference)));
      }
      EXPECT_LT(worst, 1e-3) << trial << ", state " << i;
    }
  }
}

// A free flyer: turned a little, and written with the other sign of its quaternion.
TEST(MpcGains, OrientationsDifferByRotations) {
  const RobotScene scene{
      dynamics::load_urdf(dynamics::robot_file("quadrotor"), {.base = dynamics::Base::kFloating})};
  Problem p = robot_problem(
      scene, {.duration = 1,
              .thrusters = {{.name = "1", .frame = "rotor_1", .lower = -8, .upper = 8, .moment = 0.016},
                            {.name = "2", .frame = "rotor_2", .lower = -8, .upper = 8, .moment = -0.016},
                            {.name = "3", .frame = "rotor_3", .lower = -8, .upper = 8, .moment = 0.016},
                            {.name = "4", .frame = "rotor_4", .lower = -8, .upper = 8, .moment = -0.016}}});
  VectorXd q = dynamics::neutral(scene.model);
  p.add(running_squares("place", weighted(configuration_error(scene, q), 20)));
  p.add(running_squares("calm", [](const auto& s) { return (0.5 * s.x.tail(6)).eval(); }));
  p.add(running_squares("effort", [](const auto& s) { return (0.1 * s.u).eval(); }));
  q.segment<4>(3) =
      Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized())).coeffs();
  start_at(p, scene, q, VectorXd::Zero(6));
  const auto plan_from = [&](const VectorXd& x) {
    RecedingHorizon mpc(p, with_gain(trapezoid(), 20));
    const MpcStep& s = mpc.step(0, x);
    EXPECT_EQ(s.status, SolveStatus::kSolved);
    return s.plan;
  };
  const Plan plan = plan_from(p.start);
  ASSERT_GT(plan.gain.size(), 0);
  const Eigen::Quaterniond turned =
      Eigen::Quaterniond(Eigen::Vector4d(p.start.segment<4>(3))) *
      Eigen::Quaterniond(Eigen::AngleAxisd(1e-3, Eigen::Vector3d(-1, 1, 0.5).normalized()));
  VectorXd x = p.start;
  x.segment<4>(3) = turned.coeffs();
  x[0] += 1e-3, x[9] -= 2e-3;
  const VectorXd change = plan_from(x).control(0) - plan.control(0);
  EXPECT_NEAR((plan.correction(0, x) - change).norm() / change.norm(), 0, 1e-2);
  EXPECT_GT(change.norm(), 1e-3);
  VectorXd other = x;
  other.segment<4>(3) *= -1;
  EXPECT_NEAR((plan.correction(0, other) - plan.correction(0, x)).norm(), 0, 1e-12 * (1 + change.norm()));
}

// A cart-pole is hit between two plans: what answers at once keeps it nearer.
TEST(MpcGains, AnswerAPushBeforeTheNextPlan) {
  Problem p = test::swing_up(10, 30);
  p.goal.setConstant(Problem::kFree);
  p.start << 1, std::numbers::pi, 0, 0;
  p.guess = [start = p.start](double t) { return Stage<double>{t, start, {}, VectorXd::Zero(1)}; };
  double most[2];
  for (bool feeds_back : {false, true}) {
    ClosedLoopOptions options{.seconds = 3,
                              .period = 0.15,
                              .feedback = feeds_back ? 0.005 : 0.0,
                              .mpc = with_gain(trapezoid(), 40),
                              .disturbances = {{0.46, Eigen::Vector4d(0, 0, 0, 2)}}};
    const ClosedLoop loop = close_loop(p, options);
    ASSERT_EQ(loop.trouble, "");
    EXPECT_EQ(loop.unusable(), 0);
    most[feeds_back] = (loop.motion.x.row(1).array() - std::numbers::pi).abs().maxCoeff();
    EXPECT_LT(std::abs(loop.motion.x(1, loop.motion.points() - 1) - std::numbers::pi), 0.05);
  }
  std::printf("angle off by %.3f rad with feedback between plans, %.3f without\n", most[1], most[0]);
  EXPECT_LT(most[1], 0.7 * most[0]);
}

// The policy is read by a thread of its own while plans are made.
TEST(MpcGains, AnotherThreadFollowsThePolicy) {
  Problem p = test::swing_up(10, 30);
  p.goal.setConstant(Problem::kFree);
  p.start << 1, std::numbers::pi, 0, 0;
  RecedingHorizon mpc(p, with_gain(trapezoid(), 20));
  std::atomic<bool> ended = false;
  int taken = 0;
  std::thread controller([&] {
    const VectorXd off = VectorXd::Constant(4, 1e-3);
    for (bool over = false; !over;) {
      over = ended;
      if (!mpc.latest().take()) continue;
      const Plan& plan = mpc.latest().read();
      const double t = plan.begin + 0.01;
      const VectorXd u = plan.control(t, plan.state(t) + off);
      ASSERT_NEAR(u[0], (plan.control(t) + plan.gain * off)[0], 1e-12);
      ++taken;
    }
  });
  VectorXd x = p.start;
  for (int k = 0; k < 20; ++k) {
    x[3] = 0.1 * std::sin(k);
    ASSERT_TRUE(mpc.step(0.05 * k, x).usable);
  }
  ended = true;
  controller.join();
  EXPECT_GT(taken, 0);
}

TEST(MpcGains, RefusesFeedbackThatIsNone) {
  const Problem p = test::swing_up(10);
  const auto message = [](const std::function<void()>& act) { return message_of<ArgumentError>(act); };
  const ClosedLoopOptions slow{
      .seconds = 1, .period = 0.1, .feedback = 0.1, .mpc = with_gain(trapezoid(), 10)};
  EXPECT_NE(message([&] {
              close_loop(p, slow);
            }).find("feedback every 0.1 s, expected 0 (none) or less than the period of 0.1 s"),
            std::string::npos);
}

}  // namespace
}  // namespace dyntape::mpc_gains_test
