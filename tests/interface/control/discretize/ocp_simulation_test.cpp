// SPDX-License-Identifier: BSD-3-Clause
//
// The integrator of the verification against motions that are known.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <dyntape/interface/control/discretize/verify.h>
#include <dyntape/interface/control/problem/dormand_prince.h>
#include "interface/control/ocp_problems.h"

namespace dyntape::ocp_simulation_test {
namespace {

using Eigen::VectorXd;
namespace dp = dormand_prince;

Simulation run(const StageFunction& rate, const VectorXd& from, double begin, double end,
               double tolerance = 1e-12) {
  std::vector<std::string> states;
  for (Eigen::Index i = 0; i < from.size(); ++i) states.push_back("x" + std::to_string(i));
  const Problem p("known", states, {"u"}, 1.0, rate);
  return simulate(
      p, from, begin, end, [](double) { return VectorXd(VectorXd::Zero(1)); }, tolerance);
}

VectorXd of(double x) { return VectorXd::Constant(1, x); }

// sum_i w_i v_i
double dot(const dp::Row& w, const dp::Row& v) {
  double sum = 0;
  for (int i = 0; i < dp::kStages; ++i) sum += w[i] * v[i];
  return sum;
}

dp::Row times(const dp::Row& v) {
  dp::Row result;
  for (int i = 0; i < dp::kStages; ++i) result[i] = dot(dp::a[i], v);
  return result;
}

dp::Row power(int k) {
  dp::Row result;
  for (int i = 0; i < dp::kStages; ++i) result[i] = k == 0 ? 1 : std::pow(dp::c[i], k);
  return result;
}

TEST(DormandPrince, ConditionsOfOrderHold) {
  for (int i = 0; i < dp::kStages; ++i) EXPECT_NEAR(dot(dp::a[i], power(0)), dp::c[i], 1e-14) << i;
  for (int k = 0; k < 8; ++k) EXPECT_NEAR(dot(dp::b, power(k)), 1.0 / (k + 1), 1e-14) << "c^" << k;
  // Trees with a bend: b c^j A c^k, and A twice.
  for (int k = 1; k <= 6; ++k) {
    for (int j = 0; j + k <= 6; ++j) {
      dp::Row weighted = times(power(k));
      for (int i = 0; i < dp::kStages; ++i) weighted[i] *= power(j)[i];
      EXPECT_NEAR(dot(dp::b, weighted), 1.0 / ((k + 1) * (j + k + 2)), 1e-13) << j << " " << k;
    }
    if (k < 6) {
      EXPECT_NEAR(dot(dp::b, times(times(power(k)))), 1.0 / ((k + 1) * (k + 2) * (k + 3)), 1e-13) << k;
    }
  }
  // The estimates vanish up to their own order and not beyond.
  for (int k = 0; k < 5; ++k) EXPECT_NEAR(dot(dp::e5, power(k)), 0, 1e-14) << k;
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(dot(dp::e3, power(k)), 0, 1e-14) << k;
  EXPECT_GT(std::abs(dot(dp::e5, power(5))), 1e-5);
  EXPECT_GT(std::abs(dot(dp::e3, power(3))), 1e-4);
}

// Rates of time alone: the estimate of Fehlberg's pair does not see them.
TEST(Simulation, SeesTime) {
  for (int k = 1; k <= 300; ++k) {
    const double w = 0.7 * k;
    const Simulation s = run(
        [=](const auto& s) {
          using std::cos;
          return vector(cos(w * s.t) + 0.0 * s.x[0]);
        },
        of(0), 0, 1);
    EXPECT_NEAR(s.x[0], std::sin(w) / w, 2e-12) << "frequency " << w;
    EXPECT_EQ(s.trouble, "");
  }
  const Simulation steep =
      run([](const auto& s) { return vector(1.0 / (1e-4 + s.t * s.t) + 0.0 * s.x[0]); }, of(0), -1, 1);
  EXPECT_NEAR(steep.x[0], 200 * std::atan(100.0), 1e-8);
}

TEST(Simulation, FindsKnownMotions) {
  const Simulation stiff = run(
      [](const auto& s) {
        using std::cos;
        return vector(-1000.0 * (s.x[0] - cos(s.t)));
      },
      of(0), 0, 2);
  const double a = 1000, known = (a * a * std::cos(2.0) + a * std::sin(2.0)) / (a * a + 1);
  EXPECT_NEAR(stiff.x[0], known, 1e-10);
  const Simulation circle =
      run([](const auto& s) { return vector(s.x[1], -s.x[0]); }, Eigen::Vector2d(1, 0), 0, 100);
  EXPECT_NEAR(circle.x[0], std::cos(100.0), 1e-9);
  // Short and late: no step is lost to rounding.
  const Simulation brief = run([](const auto& s) { return s.x; }, of(1), 1e3, 1e3 + 1e-9);
  EXPECT_NEAR(brief.x[0], std::exp((1e3 + 1e-9) - 1e3), 1e-15);
  EXPECT_EQ(run([](const auto& s) { return s.x; }, of(1), 1, 1).x[0], 1);
}

// A pulse that is short beside the time: the first steps look past it unless they are kept short.
TEST(Simulation, SeesWhatIsShort) {
  for (double width : {1e-2, 3e-3, 1e-3}) {
    const Simulation s = run(
        [=](const auto& s) {
          using std::exp;
          const auto z = (s.t - 0.437) / width;
          return vector(exp(-z * z) + 0.0 * s.x[0]);
        },
        of(0), 0, 1);
    EXPECT_NEAR(s.x[0], width * std::sqrt(std::numbers::pi), 1e-11) << width;
  }
}

// Steps are what the time can take: t + h of a late t is rounded.
TEST(Simulation, IsTrueAtLateTimes) {
  const double late = 1e9;
  const Simulation s = run(
      [=](const auto& s) {
        using std::cos;
        return vector(cos(s.t - late) + 0.0 * s.x[0]);
      },
      of(0), late, late + 1);
  EXPECT_NEAR(s.x[0], std::sin(1.0), 1e-7);
}

// The error is what is asked for, through ten decades.
TEST(Simulation, KeepsItsTolerance) {
  for (double tolerance : {1e-4, 1e-6, 1e-8, 1e-10, 1e-12}) {
    const Simulation s = run(
        [](const auto& s) {
          using std::cos;
          return vector(s.x[0] * cos(s.t));
        },
        of(1), 0, 10, tolerance);
    EXPECT_NEAR(s.x[0], std::exp(std::sin(10.0)), 100 * tolerance) << tolerance;
  }
}

TEST(Simulation, SaysWhereItEnds) {
  const Simulation pole = run([](const auto& s) { return vector(s.x[0] * s.x[0], s.x[1], s.x[2]); },
                              Eigen::Vector3d(1, 1, 1), 0, 2);
  EXPECT_TRUE(pole.x.array().isNaN().all());
  EXPECT_NE(pole.trouble.find("t = 1"), std::string::npos) << pole.trouble;
  // An entry in the middle, which is neither the first nor the last.
  const Simulation root = run(
      [](const auto& s) {
        using std::sqrt;
        return vector(s.x[0], sqrt(s.x[1] - 2.0), s.x[2]);
      },
      Eigen::Vector3d(1, 1, 1), 0, 2);
  EXPECT_NE(root.trouble.find("the rate of \"x1\" is"), std::string::npos) << root.trouble;
  EXPECT_NE(root.trouble.find("t = 0 s"), std::string::npos) << root.trouble;
  const Simulation start = run([](const auto& s) { return s.x; }, of(std::nan("")), 0, 1);
  EXPECT_NE(start.trouble.find("\"x0\" is nan"), std::string::npos) << start.trouble;
  for (double end : {std::nan(""), HUGE_VAL}) {
    const Simulation never = run([](const auto& s) { return s.x; }, of(1), 0, end);
    EXPECT_TRUE(never.x.hasNaN());
    EXPECT_NE(never.trouble.find("an end is at t = "), std::string::npos) << never.trouble;
    EXPECT_TRUE(run([](const auto& s) { return s.x; }, of(1), end, 1).x.hasNaN());
  }
}

TEST(Verification, SaysWhichIntervalCannotBeSimulated) {
  Problem p = test::block_move();
  p.ode = [](const auto& s) {
    using std::log;
    return vector(s.x[1], s.u[0] + log(0.5 - s.t));
  };
  StagedNlp nlp = discretize(p, {.intervals = 4, .evaluation = test::kInterpreted});
  const Verification v = verify(p, nlp.trajectory(nlp.start()));
  EXPECT_TRUE(std::isnan(v.worst_defect));
  EXPECT_TRUE(std::isnan(v.miss));
  EXPECT_NE(v.trouble.find("interval 1: "), std::string::npos) << v.trouble;
}

// The other block is moved by rounding, and so is its nominal value.
TEST(Violations, OfWhatStandsStillAreMeasuredByTheKind) {
  const auto violation = [](std::vector<std::string> states, double off) {
    const int points = 17;
    Problem p("two blocks", std::move(states), {"u", "w"}, 2,
              [](const auto& s) { return vector(s.x[2], s.x[3], s.u[0], s.u[1]); });
    Trajectory motion{VectorXd::LinSpaced(points, 0, 2), Eigen::MatrixXd::Zero(4, points),
                      Eigen::MatrixXd::Zero(0, points), Eigen::MatrixXd::Zero(2, points), hermite_simpson()};
    motion.x(1, 8) += off;
    NlpScaling units{1, std::vector<double>(points * 6, 1.), std::vector<double>(8 * 2 * 4, 1.)};
    for (std::size_t k = 1; k < units.x.size(); k += 6) units.x[k] = 1e-9;
    for (std::size_t k = 1; k < units.g.size(); k += 4) units.g[k] = 1e-9;
    return verify(p, motion, units).violation;
  };
  EXPECT_NEAR(violation({"q.a", "q.b", "v.a", "v.b"}, 5e-12), 5e-8, 1e-12);
  EXPECT_NEAR(violation({"q.a", "q.b", "v.a", "v.b"}, 5e-8), 5e-4, 1e-8);
  EXPECT_NEAR(violation({"a", "b", "da", "db"}, 5e-12), 5e-3, 1e-7);
}

// What an error is a part of: of a joint that stands still beside others of its kind, of what those move; a joint of no kind, or
// an error that is more than a ten-millionth of their movement, has no such excuse.
TEST(RelativeDefects, AreMeasuredByTheKind) {
  const auto relative = [](std::vector<std::string> states, double off, double unit) {
    const double T = 2;
    Problem p("two blocks", std::move(states), {"u", "w"}, T,
              [](const auto& s) { return vector(s.x[2], s.x[3], s.u[0], s.u[1]); });
    p.start.setZero(), p.goal << 1, 0, 0, 0;
    const Scheme scheme = hermite_simpson();
    const int intervals = 8, points = 2 * intervals + 1;
    Trajectory motion{VectorXd::LinSpaced(points, 0, T), Eigen::MatrixXd::Zero(4, points),
                      Eigen::MatrixXd::Zero(0, points), Eigen::MatrixXd::Zero(2, points), scheme};
    for (int k = 0; k < points; ++k) {  // a cubic from rest to rest, the other one still
      const double s = motion.t[k] / T;
      motion.x(0, k) = s * s * (3 - 2 * s), motion.x(2, k) = 6 * s * (1 - s) / T,
                  motion.u(0, k) = (6 - 12 * s) / T / T;
    }
    motion.x(1, motion.node(4)) += off;
    const auto n = std::size_t(points * 6), m = std::size_t(intervals * 2 * 4);
    NlpScaling units{1, std::vector<double>(n, 1.), std::vector<double>(m, 1.)};
    for (std::size_t k = 0; k < n; k += 6) units.x[k + 1] = unit;
    const Verification v = verify(p, motion, units);
    EXPECT_NEAR(v.worst_defect, off, 1e-11);
    EXPECT_TRUE(off == 0 || v.worst_state == p.states[1]) << v.worst_state;
    return v.worst_relative;
  };
  const std::vector<std::string> joints{"q.a", "q.b", "v.a", "v.b"}, plain{"a", "b", "da", "db"};
  EXPECT_NEAR(relative(joints, 5e-8, 1e-9), 5e-4, 1e-6);
  EXPECT_NEAR(relative(joints, 5e-7, 1e-9), 5e-3, 1e-5);
  EXPECT_NEAR(relative(plain, 5e-8, 1e-9), 1, 1e-3);     // of what it moves
  EXPECT_NEAR(relative(plain, 5e-8, 1e-2), 5e-4, 1e-6);  // of a hundredth of its unit
  EXPECT_NEAR(relative(joints, 1e-3, 1e-9), 1, 1e-6);    // a movement of its own
  EXPECT_LT(relative(joints, 0, 1e-9), 1e-9);
}

}  // namespace
}  // namespace dyntape::ocp_simulation_test
