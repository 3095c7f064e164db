// SPDX-License-Identifier: BSD-3-Clause
//
// Motions that are found from what a robot does by itself, where the line from the start to the goal leads nowhere.
#include <gtest/gtest.h>

#include <cmath>

#include <dyntape/interface/control/solve/free_motion.h>
#include <dyntape/interface/control/solve/optimise.h>

namespace dyntape::free_motion_test {
namespace {

using Eigen::VectorXd;

// A cart of 1 kg with a pole of 0.3 kg at 0.5 m that hangs at zero; the cart is pushed by at most 20 N.
Problem cart_pole(double duration, const VectorXd& goal) {
  Problem p("cart_pole", {"q.cart", "q.pole", "v.cart", "v.pole"}, {"push"}, duration, [](const auto& at) {
    using std::cos, std::sin;
    using T = std::decay_t<decltype(at.u[0])>;
    const T s = sin(at.x[1]), c = cos(at.x[1]);
    const T cart = (at.u[0] + 0.15 * s * at.x[3] * at.x[3] + 0.3 * 9.81 * s * c) / (1 + 0.3 * s * s);
    return vector(at.x[2], at.x[3], cart, T(-(cart * c + 9.81 * s) / 0.5));
  });
  p.positions = 2;
  p.start = VectorXd{{0, -2, 0, 0}};
  p.goal = goal;
  p.u.lower << -20, p.u.upper << 20;
  p.add(running_squares("push", [](const auto& at) { return vector(at.u[0]); }));
  return p;
}
OptimiseOptions by(NlpMethod method) {
  return {.mesh = {.intervals = 30, .evaluation = {.route = Route::kInterpreter}},
          .solver = {.method = method}};
}

// The pole swings through and is back where it was; to hold it there on the line takes 30 N.
TEST(FreeMotion, APoleThatFallsAndComesBackIsFound) {
  const VectorXd goals[] = {VectorXd{{0, -2, 0, 0}}, VectorXd{{0.98, -1.95, 1, -1.1}},
                            VectorXd{{-0.93, -2.2, -0.35, -4.26}}, VectorXd{{-1.2, -1.9, -1, -1}}};
  for (const VectorXd& goal : goals) {
    for (const NlpMethod method : {NlpMethod::kIpopt, NlpMethod::kRiccati}) {
      const Solution solution = optimise(cart_pole(1.78, goal), by(method));
      EXPECT_TRUE(solution.success()) << goal.transpose() << ": " << to_string(solution.nlp.status);
      EXPECT_GT(solution.motion.x.row(1).maxCoeff(), 0);  // it is through
    }
  }
}

TEST(FreeMotion, FollowsTheGuessedControlsToTheGoal) {
  Problem p("mass", {"q", "v"}, {"push"}, 2, [](const auto& at) { return vector(at.x[1], at.u[0]); });
  p.positions = 1;
  p.start = VectorXd{{1, 0}};
  p.goal = VectorXd{{4, Problem::kFree}};
  p.u.lower << -0.5, p.u.upper << 0.5;
  p.guess = [](double t) { return Stage<double>{t, VectorXd::Zero(2), {}, VectorXd::Constant(1, 3)}; };
  const StagedNlp program = discretize(p, by(NlpMethod::kRiccati).mesh);
  const std::optional<Trajectory> motion = free_motion(program);
  ASSERT_TRUE(motion);
  for (int k = 0; k < motion->points(); ++k) {
    const double t = motion->t[k];
    EXPECT_NEAR(motion->x(0, k), 1 + 0.25 * t * t + t, 1e-6);  // 2 m, and a metre of each second to the goal
    EXPECT_NEAR(motion->x(1, k), 0.5 * t, 1e-6);
    EXPECT_EQ(motion->u(0, k), 0.5);
  }
}

TEST(FreeMotion, ThereIsNoneWithoutAStartOrWhereItBreaksOff) {
  Problem p("growth", {"x"}, {"u"}, 2, [](const auto& at) { return vector(at.x[0] * at.x[0] + at.u[0]); });
  p.start << 1;  // without end at t = 1
  EXPECT_FALSE(free_motion(StagedNlp(discretize(p, by(NlpMethod::kRiccati).mesh))));
  p.start << Problem::kFree;
  EXPECT_FALSE(free_motion(StagedNlp(discretize(p, by(NlpMethod::kRiccati).mesh))));
}

}  // namespace
}  // namespace dyntape::free_motion_test
