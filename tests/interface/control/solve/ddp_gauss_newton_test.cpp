// SPDX-License-Identifier: BSD-3-Clause
//
// Differential dynamic programming without second derivatives: what it learns of them, and where it ends.
#include <gtest/gtest.h>

#include <dyntape/interface/control/solve/ddp.h>

#include "interface/control/ocp_problems.h"

namespace dyntape::ddp_gauss_newton_test {
namespace {

using test::soft_swing_up;

DdpSolution solved(const Problem& problem, DdpOptions options) {
  options.evaluation = test::kInterpreted;
  DdpSolution s = solve_with_ddp(problem, options);
  EXPECT_EQ(s.status, SolveStatus::kSolved) << problem.name << ": " << to_string(s.status);
  return s;
}

// Of this motion Gauss-Newton's Hessian knows less than half of the curvature, so that whole steps lead too far: by itself it took
// 302 iterations to 1e-4 of the tolerance.
TEST(DdpGaussNewton, LearnsTheCurvatureThatItLacks) {
  for (const double limit : {HUGE_VAL, 9.0}) {
    const Problem p = soft_swing_up(limit);
    const DdpSolution exact = solved(p, {.intervals = 100});
    const DdpSolution s = solved(p, {.intervals = 100, .hessian = DdpHessian::kGaussNewton});
    EXPECT_LT(s.iterations.size(), 80u);
    EXPECT_NEAR(s.cost, exact.cost, 1e-12 * exact.cost);
    EXPECT_LT((s.u - exact.u).cwiseAbs().maxCoeff(), 1e-8 * exact.u.cwiseAbs().maxCoeff());
  }
}

// A pendulum held at an angle by a torque that costs next to nothing: its slopes are small late.  `apart` is a state of its own,
// which costs least at 1 or -1, and at the 0 where it begins has no slope.
Problem held_pendulum(bool with_apart) {
  Problem p("pendulum", {"q", "w", "apart"}, {"u", "b"}, 1, [](const auto& s) {
    using std::sin;
    using T = std::decay_t<decltype(s.t)>;
    return vector(s.x[1], T(8.0 * sin(s.x[0]) + s.u[0]), s.u[1]);
  });
  p.add(running_squares("misses", [](const auto& s) {
    using std::sin;
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(10.0 * (sin(s.x[0]) - 0.5)), T(1e-3 * s.u[0]), T(0.1 * s.u[1]));
  }));
  if (with_apart)
    p.add(running_squares(
        "apart", [](const auto& s) { return vector(std::decay_t<decltype(s.t)>(s.x[2] * s.x[2] - 1.0)); }));
  p.start << 0, 0, 0;
  p.goal.setConstant(Problem::kFree);
  return p;
}

// Steps get shorter by a ratio each, 1/60 here: the next says what all of them would still move.
TEST(DdpGaussNewton, EndsWhereWhatIsLeftIsWithinTheTolerance) {
  const Problem p = held_pendulum(false);
  const DdpSolution exact = solved(p, {.intervals = 50, .tolerance = 1e-13});
  for (const auto& [tolerance, most] : {std::pair(1e-4, 4u), {1e-6, 5u}}) {
    const DdpSolution s =
        solved(p, {.intervals = 50, .hessian = DdpHessian::kGaussNewton, .tolerance = tolerance});
    EXPECT_LE(s.iterations.size(), most);
    EXPECT_LT((s.u - exact.u).cwiseAbs().maxCoeff(), tolerance * exact.u.cwiseAbs().maxCoeff());
  }
}

// The same where steps are what is small, and no slope is looked at.
TEST(DdpGaussNewton, LeavesASaddleHoweverItEnds) {
  const DdpSolution s =
      solved(held_pendulum(true), {.intervals = 50, .hessian = DdpHessian::kGaussNewton, .tolerance = 1e-4});
  EXPECT_GT(std::abs(s.x(2, 50)), 0.5);
}

}  // namespace
}  // namespace dyntape::ddp_gauss_newton_test
