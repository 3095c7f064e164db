// SPDX-License-Identifier: BSD-3-Clause
//
// Gradients of roll-outs against the reverse sweep of the whole recorded roll-out, differences, closed forms, and
// each other.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/control/sensitivity/rollout.h>
#include <dyntape/interface/control/solve/ddp.h>
#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"

namespace dyntape::rollout_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::kInterpreted;

// A cart-pole with a load and a push over time, which the costs read as well.
Problem loaded_cart_pole() {
  Parameters parameters;
  const Parameter load = parameters.add("load", 0.2), goal = parameters.add("goal", Eigen::Vector2d(0.7, 2));
  const Parameter push =
      parameters.add("push", [](double t) { return VectorXd::Constant(1, 0.5 * std::sin(4 * t)); });
  Problem p("loaded cart-pole", {"p", "th", "pd", "thd"}, {"u"}, 1.2, [=](const auto& s) {
    auto pushed = s;
    pushed.u[0] = (s.u[0] + push(s)[0]) / (1.0 + load(s)[0]);
    return test::cart_pole_rate()(pushed);
  });
  p.parameters = parameters;
  p.add(running_squares("effort", [=](const auto& s) { return (0.3 * s.u * (1.0 + load(s)[0])).eval(); }));
  p.add(running_cost("swing", [](const auto& s) {
    using std::cos;
    return cos(s.x[1]) * s.t;
  }));
  p.add(terminal_squares("near", [=](const auto& s) { return (s.x.head(2) - goal(s)).eval(); }));
  p.start << 0.1, 0.4, -0.2, 0.3;
  p.goal.setConstant(Problem::kFree);
  return p;
}

MatrixXd random_controls(Eigen::Index n_u, Eigen::Index N, unsigned seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(n_u, N, [&] { return 2 * normal(engine); });
}

double cost_of(const Problem& p, const MatrixXd& u, double shift_of_push = 0) {
  Problem q = p;
  if (shift_of_push != 0)
    q.parameters.set("push",
                     [=](double t) { return VectorXd::Constant(1, 0.5 * std::sin(4 * t) + shift_of_push); });
  RolloutAdjoint rollout(q, {.intervals = int(u.cols()), .evaluation = kInterpreted});
  return rollout.continuous(u).cost;
}

double relative(const MatrixXd& a, const MatrixXd& b) { return (a - b).norm() / (1e-300 + b.norm()); }

// (x0, u, load, goal) -> J, all steps on one tape: written once more, from the problem's plain terms.
Function recorded_rollout(const Problem& p, int N) {
  const Eigen::Index n = p.n_x(), m = p.n_u();
  const double h = p.duration / N;
  return record("roll-out", std::size_t(n + m * N + 3), [&, N](const VectorXad& all) {
    VectorXad x = all.head(n);
    AD cost(0);
    const auto stage = [&](double t, const VectorXad& at, int k) {
      VectorXad told(4);
      told << all.tail(3), AD(0.5 * std::sin(4 * t));
      return Stage<AD>{
          AD(t), at, {}, k < 0 ? VectorXad::Zero(m).eval() : all.segment(n + k * m, m).eval(), told};
    };
    const auto costs = [&](Where where, const Stage<AD>& s) {
      AD sum(0);
      for (const Term& term : p.terms) {
        if (term.where != where) continue;
        const VectorXad r = term.function(s);
        sum += term.role == Role::kSquares ? r.squaredNorm() : r[0];
      }
      return sum;
    };
    for (int k = 0; k < N; ++k) {
      const double t = k * h;
      const Stage<AD> s1 = stage(t, x, k);
      const VectorXad k1 = p.rate(s1);
      const Stage<AD> s2 = stage(t + h / 2, (x + h / 2 * k1).eval(), k);
      const VectorXad k2 = p.rate(s2);
      const Stage<AD> s3 = stage(t + h / 2, (x + h / 2 * k2).eval(), k);
      const VectorXad k3 = p.rate(s3);
      const Stage<AD> s4 = stage(t + h, (x + h * k3).eval(), k);
      const VectorXad k4 = p.rate(s4);
      cost += h / 6 *
              (costs(Where::kRunning, s1) + 2 * costs(Where::kRunning, s2) + 2 * costs(Where::kRunning, s3) +
               costs(Where::kRunning, s4));
      x = (x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)).eval();
    }
    cost += costs(Where::kTerminal, stage(p.duration, x, -1));
    return VectorXad(VectorXad::Constant(1, cost));
  });
}

TEST(RollOut, DiscreteAdjointIsTheReverseSweepOfTheRecordedRollOut) {
  const Problem p = loaded_cart_pole();
  for (const int N : {1, 2, 17}) {
    const MatrixXd u = random_controls(1, N, unsigned(N));
    RolloutAdjoint rollout(p, {.intervals = N, .evaluation = kInterpreted});
    const RolloutGradient g = rollout.discrete(u);
    const Function whole = recorded_rollout(p, N);
    std::vector<double> at(p.start.begin(), p.start.end());
    at.insert(at.end(), u.data(), u.data() + u.size());
    at.insert(at.end(), {0.2, 0.7, 2});
    EXPECT_NEAR(g.cost, evaluate(whole, at)[0], 1e-13 * (1 + std::abs(g.cost)));
    const std::vector<double> derivatives = evaluate(vjp(whole), at, {}, {1.0});
    const auto all = VectorXd::Map(derivatives.data(), Eigen::Index(derivatives.size()));
    EXPECT_LT(relative(g.start, all.head(4)), 1e-13) << N;
    EXPECT_LT(relative(g.controls.transpose(), all.segment(4, N)), 1e-13) << N;
    EXPECT_LT(relative(g.parameters.head(3), all.tail(3)), 1e-13) << N;
    EXPECT_EQ(g.start, g.adjoint.col(0));
  }
}

TEST(RollOut, DiscreteAdjointIsWhatDifferencesSay) {
  const Problem p = loaded_cart_pole();
  const int N = 12;
  const MatrixXd u = random_controls(1, N, 5);
  RolloutAdjoint rollout(p, {.intervals = N, .evaluation = kInterpreted});
  const RolloutGradient g = rollout.discrete(u);
  const double h = 1e-5;
  for (int k = 0; k < N; k += 4) {
    MatrixXd up = u, down = u;
    up(0, k) += h, down(0, k) -= h;
    EXPECT_NEAR(g.controls(0, k), (cost_of(p, up) - cost_of(p, down)) / (2 * h), 1e-9 * g.controls.norm())
        << k;
  }
  for (int i = 0; i < 4; ++i) {
    Problem up = p, down = p;
    up.start[i] += h, down.start[i] -= h;
    EXPECT_NEAR(g.start[i], (cost_of(up, u) - cost_of(down, u)) / (2 * h), 1e-8 * g.start.norm()) << i;
  }
  EXPECT_NEAR(g.parameters[3], (cost_of(p, u, h) - cost_of(p, u, -h)) / (2 * h), 1e-8 * g.parameters.norm());
}

TEST(RollOut, SnapshotsChangeNoBit) {
  Problem p = loaded_cart_pole();
  const int N = 40;
  const MatrixXd u = random_controls(1, N, 9);
  RolloutAdjoint all(p, {.intervals = N, .evaluation = kInterpreted});
  const RolloutGradient g = all.discrete(u);
  EXPECT_EQ(g.forward_steps, N);
  for (const long checkpoints : {1L, 2L, 5L, 39L, 1000L}) {
    RolloutAdjoint few(p, {.intervals = N, .checkpoints = checkpoints, .evaluation = kInterpreted});
    const RolloutGradient f = few.discrete(u);
    EXPECT_EQ(f.cost, g.cost);
    EXPECT_EQ(f.start, g.start);
    EXPECT_EQ(f.controls, g.controls);
    EXPECT_EQ(f.parameters, g.parameters);
    EXPECT_EQ(f.adjoint.size(), 0);
    EXPECT_EQ(f.forward_steps > N, checkpoints < N - 1);
  }
  p.start[1] = 1, p.parameters.set("load", 0.4);
  all.set_values(p);
  RolloutAdjoint anew(p, {.intervals = N, .evaluation = kInterpreted});
  EXPECT_EQ(all.discrete(u).controls, anew.discrete(u).controls);
}

// With h^4, by all that it is asked for.
TEST(RollOut, ContinuousAdjointApproachesTheDiscreteOne) {
  const Problem p = loaded_cart_pole();
  double before[4] = {};
  for (const int N : {20, 40, 80, 160}) {
    const MatrixXd u = MatrixXd::NullaryExpr(1, N, [&](Eigen::Index, Eigen::Index k) {
      return 3 * std::cos(2.5 * double(4 * k / N));  // held over a quarter of the motion, on every mesh
    });
    RolloutAdjoint rollout(p, {.intervals = N, .evaluation = kInterpreted});
    const RolloutGradient d = rollout.discrete(u), c = rollout.continuous(u);
    EXPECT_EQ(d.cost, c.cost);
    const double now[] = {relative(c.start, d.start), relative(c.controls, d.controls),
                          relative(c.parameters, d.parameters), relative(c.adjoint, d.adjoint)};
    for (int i = 0; i < 4; ++i) {
      EXPECT_LT(now[i], 1e-3);
      if (before[i] > 1e-9) {
        EXPECT_NEAR(before[i] / now[i], 16, 5) << i << " " << N;
      }
      before[i] = now[i];
    }
  }
  EXPECT_LT(before[0], 1e-6);
}

// x' = theta x, J = x(T)^2 / 2: dJ/dtheta = T x0^2 exp(2 theta T), and mu(t) = x0 exp(theta (2 T - t)).  With a minus
// before the integral the first would be negative.
TEST(RollOut, TheIntegralOfTheAdjointHasAPlus) {
  Parameters parameters;
  const Parameter theta = parameters.add("theta", 0.4);
  Problem p("growth", {"x"}, {"u"}, 1.0, [=](const auto& s) { return vector(theta(s)[0] * s.x[0]); });
  p.parameters = parameters;
  p.add(terminal_cost("half a square", [](const auto& s) { return s.x[0] * s.x[0] / 2.0; }));
  p.start << 1.5;
  p.goal.setConstant(Problem::kFree);
  RolloutAdjoint rollout(p, {.intervals = 100, .evaluation = kInterpreted});
  const double exact = 1.5 * 1.5 * std::exp(0.8);
  for (const RolloutGradient& g :
       {rollout.discrete(MatrixXd::Zero(1, 100)), rollout.continuous(MatrixXd::Zero(1, 100))}) {
    EXPECT_NEAR(g.parameters[0], exact, 1e-8 * exact);
    EXPECT_NEAR(g.adjoint(0, 30), 1.5 * std::exp(0.4 * 1.7), 1e-8);
    EXPECT_EQ(g.controls.cwiseAbs().maxCoeff(), 0);
  }
}

// V_x = Q_x - Q_xu Quu^-1 Q_u is the adjoint where Q_u = 0, and only there.
TEST(RollOut, SlopeOfTheCostToGoIsTheAdjointAtAnOptimumOnly) {
  Problem p = loaded_cart_pole();
  p.terms[1] = running_squares("swing", [](const auto& s) { return s.x; });
  const int N = 40;
  RolloutAdjoint rollout(p, {.intervals = N, .evaluation = kInterpreted});
  const DdpSolution solved =
      solve_with_ddp(p, {.intervals = N, .tolerance = 1e-11, .evaluation = kInterpreted});
  ASSERT_TRUE(solved.success());
  const RolloutGradient at = rollout.discrete(solved.u);
  EXPECT_NEAR(at.cost, solved.cost, 1e-12 * at.cost);
  EXPECT_LT(relative(at.adjoint, solved.slope), 1e-8);
  EXPECT_LT(at.controls.norm(), 1e-8 * at.adjoint.norm());
  const DdpSolution before =
      solve_with_ddp(p, {.intervals = N, .max_iterations = 1, .evaluation = kInterpreted});
  ASSERT_FALSE(before.success());
  EXPECT_GT(relative(rollout.discrete(before.u).adjoint, before.slope), 1e-4);
}

TEST(RollOut, RefusesWhatDoesNotFit) {
  const Problem p = loaded_cart_pole();
  RolloutAdjoint rollout(p, {.intervals = 4, .evaluation = kInterpreted});
  EXPECT_EQ(message_of<ArgumentError>([&] { rollout.discrete(MatrixXd::Zero(1, 5)); }),
            "problem \"loaded cart-pole\": the controls of a roll-out are 1 x 5, expected 1 x 4, a column an "
            "interval");
  Problem ends("ends", {"x"}, {"u"}, 1, [](const auto& s) { return s.u; });
  ends.add(terminal_cost("root", [](const auto& s) {
    using std::sqrt;
    return sqrt(s.x[0]);
  }));
  ends.start << 0;
  ends.goal.setConstant(Problem::kFree);
  EXPECT_EQ(
      message_of<NumericalError>([&] {
        RolloutAdjoint(ends, {.intervals = 4, .evaluation = kInterpreted}).discrete(MatrixXd::Zero(1, 4));
      }),
      "problem \"ends\": the cost of the end, or its slope, is not finite");
  EXPECT_EQ(message_of<NumericalError>([&] { rollout.continuous(MatrixXd::Constant(1, 4, NAN)); }),
            "problem \"loaded cart-pole\": the step from t = 0 s is not finite");
  EXPECT_EQ(
      message_of<ArgumentError>([&] { RolloutAdjoint(p, {.intervals = 0, .evaluation = kInterpreted}); }),
      "problem \"loaded cart-pole\": a roll-out of 0 intervals, expected at least one");
}

}  // namespace
}  // namespace dyntape::rollout_test
