// SPDX-License-Identifier: BSD-3-Clause
//
// Problems whose duration is free: known optima, real time in everything that comes out, refusals.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/control/discretize/resampled.h>
#include <dyntape/interface/control/problem/scaled_time.h>
#include <dyntape/interface/control/solve/ddp.h>
#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/motion/robot_problem.h>
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"
#include "source_folder.h"

namespace dyntape::ocp_free_time_test {
namespace {

using Eigen::VectorXd;

OptimiseOptions on_mesh(int intervals, const Scheme& scheme = hermite_simpson(),
                        HessianKind hessian = HessianKind::kExact) {
  return {.mesh = {.scheme = scheme,
                   .intervals = intervals,
                   .hessian = hessian,
                   .evaluation = test::kInterpreted},
          .solver = {.tolerance = 1e-10}};
}

// Least int u^2 + w T over a distance, rest to rest: 12 d^2 / T^3 + w T is least at T^4 = 36 d^2 / w.
Problem timed_block(double distance, double weight, bool inverse = false) {
  Problem p = test::block_move(distance);
  if (inverse) {
    p.rate = [](const auto& s) { return vector(s.x[1], s.a[0]); };
    p.use_accelerations(
        {"a"}, [](const auto& s) { return s.u[0] - s.a[0]; }, p.ode);
  }
  p.add(minimum_time(weight));
  p.free_duration(0.2, 10);
  return p;
}

double best_time(double distance, double weight) { return std::pow(36 * distance * distance / weight, 0.25); }

TEST(FreeTime, BlockMoveTakesTheTimeThatIsBest) {
  for (const bool inverse : {false, true}) {
    for (const HessianKind hessian :
         {HessianKind::kExact, HessianKind::kGaussNewton, HessianKind::kLimitedMemory}) {
      for (const double weight : {0.5, 36., 200.}) {
        if (hessian == HessianKind::kLimitedMemory && weight < 1) continue;  // a thousand iterations
        const Solution s =
            optimise(timed_block(1.5, weight, inverse), on_mesh(6, hermite_simpson(), hessian));
        ASSERT_TRUE(s.success()) << weight << " " << int(hessian);
        const double T = best_time(1.5, weight), cost = 12 * 1.5 * 1.5 / (T * T * T) + weight * T;
        EXPECT_NEAR(s.motion.t[s.motion.points() - 1], T, 1e-6 * T) << int(hessian);
        EXPECT_NEAR(s.cost(), cost, 1e-8 * cost);
        EXPECT_NEAR(s.verification.cost, cost, 1e-7 * cost);  // the plain terms, over real time
        EXPECT_LT(s.verification.violation, 1e-7);
        EXPECT_LT(s.verification.worst_defect, 1e-9);
        EXPECT_LT(s.verification.miss, 1e-9);
        EXPECT_EQ(s.motion.x.rows(), 2);
      }
    }
  }
}

// Schemes of the first and second order come near with the step and its square.
TEST(FreeTime, EverySchemeComesNearWithItsOrder) {
  const double T = best_time(1, 4);
  for (const auto& [scheme, ratio] : {std::pair(euler(), 2.0), std::pair(trapezoid(), 4.0)}) {
    double before = 0;
    for (const int n : {20, 40}) {
      const Solution s = optimise(timed_block(1, 4), on_mesh(n, scheme));
      ASSERT_TRUE(s.converged()) << scheme.name;
      EXPECT_LT(s.verification.violation, 1e-7);
      const double error = std::abs(s.motion.t[s.motion.points() - 1] - T);
      if (before > 0) {
        EXPECT_GT(before / error, 0.85 * ratio) << scheme.name;
      }
      before = error;
      EXPECT_LT(error, 0.05 * T);
      EXPECT_GT(error, 0);
    }
  }
}

// Rest to rest with |u| <= a: full speed ahead, full brake, T = 2 sqrt(d / a).
TEST(FreeTime, DoubleIntegratorIsBangBang) {
  const double d = 2, a = 3, T = 2 * std::sqrt(d / a);
  Problem p("bang", {"p", "v"}, {"u"}, 1.0, [](const auto& s) { return vector(s.x[1], s.u[0]); });
  p.add(minimum_time(1));
  p.free_duration(0.1, 20);
  p.start << 0, 0;
  p.goal << d, 0;
  p.u.lower[0] = -a, p.u.upper[0] = a;
  // Euler's controls are held: its best is exactly n (n - 2) / 4 steps and those of the same length, for even n.
  for (const int n : {10, 40}) {
    const Solution s = optimise(p, on_mesh(n, euler()));
    ASSERT_TRUE(s.converged());
    EXPECT_NEAR(s.motion.t[n], T, 1e-5);  // sum over the nodes of a triangle: the same area
    for (int k = 0; k < n; ++k) EXPECT_NEAR(s.motion.u(0, k), k < n / 2 ? a : -a, 1e-3) << k;
    EXPECT_NEAR(s.cost(), T, 1e-5);
  }
  for (const Scheme& scheme : {trapezoid(), hermite_simpson()}) {  // the switch takes an interval
    double last = 0;
    for (const int n : {20, 40}) {
      const Solution s = optimise(p, on_mesh(n, scheme));
      ASSERT_TRUE(s.converged()) << scheme.name;
      const double late = s.motion.t[s.motion.points() - 1] - T;
      EXPECT_GT(late, -1e-6) << scheme.name;
      EXPECT_LT(late, 0.01 * T);
      if (last > 0) {
        EXPECT_LT(late, 0.6 * last);
      }
      last = late;
    }
  }
}

// Two joints against limits of their torques: at every instant one of them is at its limit, and no given time that
// is shorter will do.
TEST(FreeTime, AnArmInLeastTimeUsesItsMotorsToTheLimit) {
  RobotScene scene{dynamics::load_urdf(test::source_folder() + "/config/robots/arm_2r.urdf"), {}, {}};
  for (const DynamicsForm form : {DynamicsForm::kForward, DynamicsForm::kInverse}) {
    Problem p = robot_problem(scene, {.duration = 1, .form = form});
    p.start << 0, 0, 0, 0;
    p.goal << 1, -0.6, 0, 0;
    p.u.lower.setConstant(-20), p.u.upper.setConstant(20);
    Problem given = p;
    p.free_duration(0.05, 10);
    p.add(minimum_time(1));
    const Solution s = optimise(p, on_mesh(30));
    ASSERT_TRUE(s.converged()) << to_string(s.nlp.status);
    const double T = s.motion.t[s.motion.points() - 1];
    EXPECT_LT(s.verification.violation, 1e-6);
    // Limits cut the polynomials where motors switch, which the mesh does not resolve.
    EXPECT_LT(s.verification.worst_relative, 5e-3);
    EXPECT_NEAR(T, 0.28, 1e-3);  // both forms find the same
    int at_limits = 0;
    for (int k = 0; k < s.motion.points(); ++k) at_limits += s.motion.u.col(k).cwiseAbs().maxCoeff() > 19.99;
    EXPECT_GT(at_limits, s.motion.points() - 4);
    given.add(running_squares("effort", [](const auto& st) { return st.u; }));
    given.duration = 1.02 * T;
    EXPECT_TRUE(optimise(given, on_mesh(30)).success());
    given.duration = 0.98 * T;
    EXPECT_FALSE(optimise(given, on_mesh(30)).success());
  }
}

// Terms read real seconds, whatever the first guess of the duration was.
TEST(FreeTime, TermsSeeRealTime) {
  for (const double guess : {0.6, 1.0, 4.0}) {
    Problem p = test::block_move(1);
    p.add(running_cost("late", [](const auto& s) { return s.t * s.t; }));  // T^3 / 3
    p.add(path_inequality(
        "not later", [](const auto& s) { return s.t; }, VectorXd::Constant(1, -1),
        VectorXd::Constant(1, 1.3)));
    p.duration = guess;
    p.free_duration(0.2, 10);
    const Solution s = optimise(p, on_mesh(8));
    ASSERT_TRUE(s.success());
    EXPECT_NEAR(s.motion.t[s.motion.points() - 1], 1.3, 1e-7);  // T^6 = 36 without the limit: 1.817
    EXPECT_NEAR(s.cost(), 12 / std::pow(1.3, 3) + std::pow(1.3, 3) / 3, 1e-6);
    EXPECT_NEAR(s.verification.cost, s.cost(), 1e-8);
    Problem open = p;
    open.terms.pop_back();
    EXPECT_NEAR(optimise(open, on_mesh(8)).motion.t.tail(1)[0], std::pow(36, 1. / 6), 1e-6);
  }
}

TEST(FreeTime, ItsRangeHolds) {
  Problem p = timed_block(1, 4);  // T = 1.732
  p.free_duration(0.5, 1.2);
  const Solution s = optimise(p, on_mesh(5));
  ASSERT_TRUE(s.success());
  EXPECT_NEAR(s.motion.t.tail(1)[0], 1.2, 1e-7);
  EXPECT_NEAR(s.cost(), 12 / std::pow(1.2, 3) + 4 * 1.2, 1e-6);
  Trajectory slow = s.motion;
  slow.t *= 1.1;
  EXPECT_NEAR(verify(p, slow).violation, (1.32 - 1.2) / p.duration, 1e-6);  // of the first guess
  EXPECT_EQ(verify(p, slow).worst_row.substr(0, 12), "the duration");
}

// Values change in place here as well: start, parameters, range.
TEST(FreeTime, ValuesChangeInPlace) {
  Problem p = test::block_move(1);
  const Parameter load = p.parameters.add("load", 1.0);
  p.rate = p.ode = [load](const auto& s) {
    return vector(s.x[1], typename std::decay_t<decltype(s.x)>::Scalar(s.u[0] / load(s)[0]));
  };
  p.add(minimum_time(4));
  p.free_duration(0.2, 10);
  StagedNlp nlp = discretize(p, on_mesh(6).mesh);
  Problem now = nlp.problem();
  now.start[0] = -0.5;
  now.parameters.set("load", 2.0);
  nlp.set_values(now);
  const Solution s = optimise(nlp, nlp.start(), on_mesh(6));
  ASSERT_TRUE(s.success());
  EXPECT_NEAR(s.motion.t.tail(1)[0], best_time(2 * 1.5, 4), 1e-6);
  now.free_duration(0.2, 2);
  nlp.set_values(now);
  EXPECT_NEAR(optimise(nlp, nlp.start(), on_mesh(6)).motion.t.tail(1)[0], 2, 1e-6);
}

// A finer mesh begins with the motion found, in its own seconds, and is all but solved.
TEST(FreeTime, FinerMeshesBeginWithTheMotion) {
  Problem p = test::swing_up(0, 12);
  p.add(minimum_time(40));
  p.free_duration(0.5, 6);
  StagedNlp coarse = discretize(p, on_mesh(20).mesh);
  const Solution first = optimise(coarse, coarse.start(), on_mesh(20));
  ASSERT_TRUE(first.converged());
  const double T = first.motion.t.tail(1)[0];
  EXPECT_GT(std::abs(T - p.duration), 0.05);
  StagedNlp finer = discretize(coarse, halved(first.motion));
  EXPECT_EQ(finer.times().size(), 81u);
  EXPECT_NEAR(finer.times().back(), T, 1e-12);
  EXPECT_EQ(finer.build().compiled, 0);
  const std::vector<double> start = finer.variables(resampled(p, first.motion, finer.times()));
  const Trajectory same = finer.trajectory(start);
  EXPECT_NEAR(same.t[40], first.motion.t[20], 1e-12);
  EXPECT_LT((same.x.col(40) - first.motion.x.col(20)).norm(), 1e-9);
  const Solution second = optimise(finer, start, on_mesh(20));
  ASSERT_TRUE(second.success());
  EXPECT_LT(second.nlp.iterations(), first.nlp.iterations());
  EXPECT_NEAR(second.cost(), first.cost(), 0.02 * first.cost());
  EXPECT_LT(second.verification.worst_relative, first.verification.worst_relative);
}

// In milliseconds the same iterations lead to the same motion.
TEST(FreeTime, UnitsOfTimeChangeNothing) {
  const auto in_units = [](double second) {
    Problem p = timed_block(1.5, 7 / second / (second * second * second));  // [u^2 T] goes with T^-3
    p.duration = 1.1 * second;
    p.free_duration(0.2 * second, 10 * second);
    return optimise(p, on_mesh(8));
  };
  const Solution s = in_units(1), ms = in_units(1000);
  ASSERT_TRUE(s.success() && ms.success());
  EXPECT_EQ(s.nlp.iterations(), ms.nlp.iterations());
  EXPECT_NEAR(ms.motion.t.tail(1)[0] / 1000, s.motion.t.tail(1)[0], 1e-9);
}

TEST(FreeTime, DerivativesAreThoseOfTheFunctions) {
  Problem p = test::swing_up(1.0);
  p.add(running_cost("timed", [](const auto& s) { return s.t * s.x[0] * s.u[0]; }));
  p.add(path_inequality(
      "power", [](const auto& s) { return s.u[0] * s.x[2] * s.t; }, VectorXd::Constant(1, -40.),
      VectorXd::Constant(1, 40.)));
  p.add(terminal_squares("rest", [](const auto& s) { return (s.x.tail(2) * s.t).eval(); }));
  p.add(minimum_time(3));
  p.free_duration(0.5, 6);
  for (const Scheme& scheme : test::every_scheme()) {
    StagedNlp nlp =
        discretize(p, on_mesh(scheme.step ? 20 : 4, scheme).mesh);  // differences do not resolve long steps
    std::vector<double> x = nlp.start();
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += 0.2 * std::sin(3.0 * double(i));
    const DerivativeCheck check = check_derivatives(nlp, x);
    EXPECT_TRUE(check.good()) << scheme.name;
    EXPECT_LT(check.worst_second, 1e-8);
  }
}

TEST(FreeTime, MistakesAreOneSentence) {
  const auto told = [](const std::function<void(Problem&)>& change) {
    Problem p = timed_block(1, 4);
    change(p);
    return message_of<ArgumentError>([&] { discretize(p, on_mesh(4).mesh); });
  };
  EXPECT_EQ(told([](Problem&) {}), "nothing thrown");
  EXPECT_EQ(
      told([](Problem& p) { p.free_duration(2, 1); }),
      "problem \"block move\": the duration lies between 2.000000 and 1.000000 s, expected two positive "
      "numbers, the shorter one first");
  EXPECT_NE(told([](Problem& p) { p.free_duration(0, 1); }).find("expected two positive numbers"),
            std::string::npos);
  EXPECT_NE(told([](Problem& p) { p.free_duration(2, 3); }).find("first guess of the duration is 1.000000 s"),
            std::string::npos);
  EXPECT_NE(told([](Problem& p) {
              p.parameters.add("reference", [](double t) { return VectorXd::Constant(1, t); });
            }).find("the parameter \"reference\" varies with time"),
            std::string::npos);
  Problem soft = timed_block(1, 4);
  soft.goal.setConstant(Problem::kFree);
  EXPECT_NE(message_of<ArgumentError>([&] {
              solve_with_ddp(soft);
            }).find("the duration is free, which steps from stage to stage do not"),
            std::string::npos);
  EXPECT_THROW(minimum_time(-1), ArgumentError);
  Problem fixed = test::block_move();
  StagedNlp nlp = discretize(fixed, on_mesh(4).mesh);
  EXPECT_NE(message_of<ArgumentError>([&] {
              nlp.set_values(timed_block(1, 4));
            }).find("another one than was recorded"),
            std::string::npos);
}

}  // namespace
}  // namespace dyntape::ocp_free_time_test
