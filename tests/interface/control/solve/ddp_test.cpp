// SPDX-License-Identifier: BSD-3-Clause
//
// Differential dynamic programming against what does not know it: costs of roll-outs written here, the Riccati recursion,
// collocation.
#include <gtest/gtest.h>

#include <random>
#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/solve/ddp.h>

#include "interface/control/ocp_problems.h"
#include "interface/message_of.h"
#include "interface/temporary_cache.h"

namespace dyntape::ddp_test {
namespace {

using test::soft_swing_up;

using Eigen::MatrixXd;
using Eigen::VectorXd;
using test::cart_pole_rate;
using test::kInterpreted;

DdpSolution solved(const Problem& problem, DdpOptions options) {
  options.evaluation = kInterpreted;
  DdpSolution s = solve_with_ddp(problem, options);
  std::ostringstream last;
  for (std::size_t i = s.iterations.size() < 4 ? 0 : s.iterations.size() - 4; i < s.iterations.size(); ++i) {
    const DdpIteration& at = s.iterations[i];
    last << "\ncost " << at.cost << " gap " << at.gap << " slope " << at.slope << " shift " << at.shift
         << " length " << at.length;
  }
  EXPECT_EQ(s.status, SolveStatus::kSolved) << problem.name << ": " << to_string(s.status) << last.str();
  return s;
}

// The cost of controls, by steps written out once more.
double cost_of(const Problem& problem, const MatrixXd& u) {
  const double h = problem.duration / double(u.cols());
  VectorXd x = problem.start;
  double cost = 0;
  const auto costs = [&](Where where, const Stage<double>& stage) {
    double sum = 0;
    for (const Term& term : problem.terms) {
      if (term.where != where) continue;
      const VectorXd r = term.function(stage);
      sum += term.role == Role::kSquares ? r.squaredNorm() : r[0];
    }
    return sum;
  };
  for (Eigen::Index k = 0; k < u.cols(); ++k) {
    const auto at = [&](double s, const VectorXd& y) {
      return Stage<double>{double(k) * h + s, y, {}, u.col(k)};
    };
    const VectorXd k1 = problem.rate(at(0, x)), x2 = x + h / 2 * k1, k2 = problem.rate(at(h / 2, x2)),
                   x3 = x + h / 2 * k2, k3 = problem.rate(at(h / 2, x3)), x4 = x + h * k3,
                   k4 = problem.rate(at(h, x4));
    cost += h / 6 *
            (costs(Where::kRunning, at(0, x)) + 2 * costs(Where::kRunning, at(h / 2, x2)) +
             2 * costs(Where::kRunning, at(h / 2, x3)) + costs(Where::kRunning, at(h, x4)));
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return cost + costs(Where::kTerminal, {problem.duration, x, {}, VectorXd::Zero(u.rows())});
}

// The same by Euler's steps, positions by the new velocities.
double euler_cost_of(const Problem& problem, const MatrixXd& u) {
  const double h = problem.duration / double(u.cols());
  const Eigen::Index n_q = problem.positions;
  VectorXd x = problem.start;
  double cost = 0;
  for (Eigen::Index k = 0; k < u.cols(); ++k) {
    const Stage<double> stage{double(k) * h, x, {}, u.col(k)};
    for (const Term& term : problem.terms) {
      if (term.where == Where::kRunning) cost += h * term.function(stage).squaredNorm();
    }
    VectorXd next = x + h * problem.rate(stage);
    Stage<double> moved{stage.t, x, {}, u.col(k)};
    moved.x.tail(x.size() - n_q) = next.tail(x.size() - n_q);
    next.head(n_q) = x.head(n_q) + h * problem.rate(moved).head(n_q);
    x = next;
  }
  for (const Term& term : problem.terms) {
    if (term.where == Where::kTerminal)
      cost += term.function(Stage<double>{problem.duration, x, {}, VectorXd::Zero(u.rows())}).squaredNorm();
  }
  return cost;
}

// Linear dynamics and a quadratic cost at random.
Problem random_lqr(unsigned seed) {
  std::mt19937_64 numbers(seed);
  const auto random = [&](int rows, int cols) {
    return MatrixXd(MatrixXd::NullaryExpr(
        rows, cols, [&] { return 2 * (static_cast<double>(numbers() >> 11) * 0x1p-53) - 1; }));
  };
  const MatrixXd A = random(3, 3), B = random(3, 2), C = random(3, 3), D = random(3, 2);
  Problem p("lqr", {"a", "b", "c"}, {"u", "w"}, 1.5, [=](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    return (A.cast<T>() * s.x + B.cast<T>() * s.u).eval();
  });
  p.add(running_squares("mixed", [=](const auto& s) {
    using T = typename std::decay_t<decltype(s.x)>::Scalar;
    return (C.cast<T>() * s.x + D.cast<T>() * s.u).eval();
  }));
  p.add(running_squares("effort", [](const auto& s) { return s.u; }));
  p.add(terminal_squares("end", [](const auto& s) { return s.x; }));
  p.start = random(3, 1);
  p.goal.setConstant(Problem::kFree);
  return p;
}

TEST(Ddp, SolvesLinearQuadraticProblemsInOneIteration) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Problem p = random_lqr(seed);
    for (const DdpHessian hessian : {DdpHessian::kExact, DdpHessian::kGaussNewton}) {
      for (const DdpStart start : {DdpStart::kRollOut, DdpStart::kNodes}) {
        const DdpSolution s =
            solved(p, {.intervals = 15, .hessian = hessian, .start = start, .tolerance = 1e-12});
        ASSERT_EQ(s.iterations.size(), 2u) << seed;  // the second finds nothing left
        EXPECT_NEAR(s.cost, cost_of(p, s.u), 1e-13 * (1 + s.cost));
        // Any other controls cost more.
        MatrixXd other = s.u;
        other(0, 7) += 1e-3, other(1, 3) -= 1e-3;
        EXPECT_GT(cost_of(p, other), s.cost);
      }
    }
  }
}

TEST(Ddp, EulersStepsMoveByTheNewVelocities) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    for (const int positions : {0, 1, 3}) {
      for (const DdpHessian hessian : {DdpHessian::kExact, DdpHessian::kGaussNewton}) {
        Problem p = random_lqr(seed);
        p.positions = positions;
        const DdpSolution s = solved(
            p, {.intervals = 15, .scheme = ShootingScheme::kEuler, .hessian = hessian, .tolerance = 1e-12});
        ASSERT_EQ(s.iterations.size(), 2u) << seed;
        EXPECT_NEAR(s.cost, euler_cost_of(p, s.u), 1e-13 * (1 + s.cost));
        MatrixXd other = s.u;
        other(0, 7) += 1e-3, other(1, 3) -= 1e-3;
        EXPECT_GT(euler_cost_of(p, other), s.cost);
      }
    }
  }
  // Of a curved problem, by exact derivatives and by those of an independent roll-out.
  Problem p = soft_swing_up();
  p.positions = 2;
  const DdpSolution s = solved(p, {.intervals = 60, .scheme = ShootingScheme::kEuler});
  EXPECT_NEAR(s.cost, euler_cost_of(p, s.u), 1e-11 * s.cost);
  for (const Eigen::Index k : {Eigen::Index(0), Eigen::Index(30), Eigen::Index(58)}) {
    const double h = 1e-4;
    MatrixXd up = s.u, down = s.u;
    up(0, k) += h, down(0, k) -= h;
    EXPECT_NEAR((euler_cost_of(p, up) - euler_cost_of(p, down)) / (2 * h), 0, 1e-5) << k;
  }
}

// The true defect may be left out; nothing else changes, and stages in lanes are those one by one.
TEST(Ddp, LanesAndChecksChangeNothing) {
  const Problem p = soft_swing_up();
  const DdpSolution s = solved(p, {.intervals = 37});
  TemporaryCache cache;
  CodegenOptions lanes = {.lanes = Lanes::kNative}, none = {};
  for (CodegenOptions* options : {&lanes, &none}) {
    options->cache_folder = cache.path();
    const DdpSolution other = solve_with_ddp(p, {.intervals = 37, .evaluation = *options, .verify = false});
    EXPECT_EQ(other.u, s.u);
    EXPECT_EQ(other.iterations.size(), s.iterations.size());
    EXPECT_TRUE(std::isnan(other.integration_error));
  }
}

TEST(Ddp, EndsWhereTheCostHasNoSlope) {
  for (const double limit : {HUGE_VAL, 9.0}) {
    const Problem p = soft_swing_up(limit);
    const DdpSolution s = solved(p, {.intervals = 60});
    EXPECT_NEAR(s.cost, cost_of(p, s.u), 1e-11 * s.cost);
    int at_limit = 0;
    for (Eigen::Index k = 0; k < s.u.cols(); ++k) {
      const double h = 1e-4;
      MatrixXd up = s.u, down = s.u;
      up(0, k) += h, down(0, k) -= h;
      const double slope = (cost_of(p, up) - cost_of(p, down)) / (2 * h);
      const double u = s.u(0, k);
      EXPECT_LE(std::abs(u), limit);
      if (std::abs(u) < limit) {
        EXPECT_NEAR(slope, 0, 1e-5) << k;
      } else {
        EXPECT_LE(slope * u, 1e-6) << k;
        ++at_limit;
      }
    }
    EXPECT_EQ(at_limit > 0, limit < HUGE_VAL);
    EXPECT_LT(s.integration_error, 1e-4);
  }
}

// Near a motion, which has several optima around it: its states moved by up to `by` of a radian or metre.
Problem begun_at(Problem p, const DdpSolution& motion, double by) {
  p.guess = [motion, by](double t) {
    const double at = t / motion.t[motion.t.size() - 1] * double(motion.u.cols());
    const auto k = std::min(Eigen::Index(at + 1e-9), motion.u.cols() - 1);
    const double s = at - double(k);
    VectorXd x = (1 - s) * motion.x.col(k) + s * motion.x.col(k + 1);
    for (Eigen::Index i = 0; i < x.size(); ++i) x[i] += by * std::sin(40 * t + double(i));
    return Stage<double>{t, x, {}, motion.u.col(k)};
  };
  return p;
}

TEST(Ddp, AllWaysLeadToOneOptimum) {
  const Problem p = soft_swing_up();
  const DdpSolution exact = solved(p, {.intervals = 80});
  for (const DdpHessian hessian : {DdpHessian::kExact, DdpHessian::kGaussNewton}) {
    const Problem near = begun_at(p, exact, 0.1);
    const double tolerance = hessian == DdpHessian::kExact ? 1e-9 : 2e-6;
    const DdpSolution s = solved(
        near, {.intervals = 80, .hessian = hessian, .start = DdpStart::kNodes, .tolerance = tolerance});
    EXPECT_GT(s.iterations.front().gap, 0.01);
    EXPECT_LT(s.iterations.back().gap, 1e-8);
    EXPECT_NEAR(s.cost, exact.cost, 1e-8 * exact.cost);
    EXPECT_LT((s.u - exact.u).cwiseAbs().maxCoeff(), 1e3 * tolerance);
  }
}

TEST(Ddp, WhatStallsAtRoundingIsNotCalledSolved) {
  const DdpSolution s = solve_with_ddp(
      soft_swing_up(),
      {.intervals = 80, .hessian = DdpHessian::kGaussNewton, .tolerance = 1e-18, .evaluation = kInterpreted});
  EXPECT_FALSE(s.success());
  EXPECT_TRUE(s.status == SolveStatus::kStepTooSmall || s.status == SolveStatus::kAcceptable)
      << to_string(s.status);
  EXPECT_LT(s.iterations.size(), 300u);
}

// Collocation has controls that bend; what it finds is approached in proportion to the square of the step.
TEST(Ddp, ApproachesTheOptimumOfCollocation) {
  const Problem p = soft_swing_up();
  const DdpSolution coarse = solved(p, {.intervals = 50});
  const Problem near = begun_at(p, coarse, 0);
  const Solution reference = optimise(
      near,
      {.mesh = {.scheme = hermite_simpson(), .intervals = 100, .evaluation = kInterpreted}, .verify = false});
  ASSERT_TRUE(reference.success());
  double before = 0;
  for (const int intervals : {50, 100, 200}) {
    const double off = solved(near, {.intervals = intervals}).cost / reference.cost() - 1;
    EXPECT_GT(off, 0);
    if (before > 0) {
      EXPECT_NEAR(before / off, 4, 0.5) << intervals;
    }
    before = off;
  }
}

TEST(Ddp, CurvatureOfTheDynamicsMakesItQuadratic) {
  const Problem p = soft_swing_up();
  const DdpSolution s = solved(p, {.intervals = 60, .tolerance = 1e-11});
  const std::size_t n = s.iterations.size();
  ASSERT_GE(n, 4u);
  // As many digits again, or rounding.
  EXPECT_LT(s.iterations[n - 1].slope, std::max(1e-9, 10 * std::pow(s.iterations[n - 2].slope, 1.5)));
  EXPECT_EQ(s.iterations[n - 2].length, 1);
}

// The slope of the cost to go is the adjoint at a solution, and is not before.
TEST(Ddp, TheSlopeOfTheCostToGoIsTheAdjointInTheEnd) {
  const Problem p = soft_swing_up();
  const DdpSolution s = solved(p, {.intervals = 60, .tolerance = 1e-11});
  const double size = s.adjoint.cwiseAbs().maxCoeff();
  EXPECT_LT((s.slope - s.adjoint).cwiseAbs().maxCoeff(), 1e-8 * size);
  const DdpSolution early =
      solve_with_ddp(p, {.intervals = 60, .max_iterations = 3, .evaluation = kInterpreted});
  EXPECT_EQ(early.status, SolveStatus::kIterationLimit);
  EXPECT_GT((early.slope - early.adjoint).cwiseAbs().maxCoeff(), 1e-3 * early.adjoint.cwiseAbs().maxCoeff());
}

// Near the solution the policy is what a solve from there would do.
TEST(Ddp, ThePolicyAnswersToAnotherStart) {
  Problem p = soft_swing_up();
  const DdpSolution s = solved(p, {.intervals = 60, .tolerance = 1e-11});
  const VectorXd by = 1e-5 * VectorXd::LinSpaced(4, 1, 2);
  p.start += by;
  const DdpSolution moved = solved(p, {.intervals = 60, .tolerance = 1e-11});
  const VectorXd expected = s.u.col(0) + s.policy[0].K * by;
  EXPECT_NEAR(moved.u(0, 0), expected[0], 1e-3 * std::abs(expected[0] - s.u(0, 0)));
  EXPECT_NEAR(moved.cost - s.cost, s.adjoint.col(0).dot(by), 1e-3 * std::abs(moved.cost - s.cost));
}

// One state x' = b from `start`, over a second, cost of a and b and x^2.
template <class Cost>
Problem integrator(double start, const Cost& cost) {
  Problem p("integrator", {"x"}, {"a", "b"}, 1.0, [](const auto& s) { return vector(s.u[1]); });
  p.add(running_cost("cost", cost));
  p.start << start;
  p.goal.setConstant(Problem::kFree);
  return p;
}

// Whatever the units of the cost and of time are, and whatever another control is held by.
TEST(Ddp, WhatIsSolvedDoesNotDependOnUnits) {
  for (const double scale : {1e-10, 1.0, 1e10}) {
    Problem p = integrator(0, [=](const auto& s) {
      return scale * ((s.u[1] - 1.0) * (s.u[1] - 1.0)) + 1e12 * scale * (s.u[0] + 2.0) * (s.u[0] + 2.0);
    });
    p.u.lower[0] = -1, p.u.upper[0] = 1;
    const DdpSolution s = solved(p, {.intervals = 40});
    EXPECT_LT((s.u.row(1).array() - 1).abs().maxCoeff(), 1e-8) << scale;
    EXPECT_EQ(s.u(0, 7), -1);
    EXPECT_TRUE(s.is_minimum);
  }
}

// A control that is held at a limit by a cost without a minimum leaves the gains of the others alone.
TEST(Ddp, WhatIsHeldAtALimitHasNoPartInTheGains) {
  const auto solve = [](double start, bool is_fixed) {
    Problem p = integrator(start, [](const auto& s) {
      return s.x[0] * s.x[0] + s.u[1] * s.u[1] - s.u[0] * s.u[0] + 0.3 * s.u[0] * s.x[0];
    });
    p.u.lower[0] = is_fixed ? 1 : -1, p.u.upper[0] = 1;
    p.guess = [=](double t) {
      return Stage<double>{t, VectorXd::Constant(1, start), {}, Eigen::Vector2d(0.5, 0)};
    };
    return solved(p, {.intervals = 20, .tolerance = 1e-11});
  };
  for (const bool is_fixed : {false, true}) {
    const DdpSolution s = solve(1, is_fixed), moved = solve(1.001, is_fixed);
    EXPECT_EQ(s.u(0, 3), 1);
    EXPECT_NEAR(s.policy[0].K(1, 0), (moved.u(1, 0) - s.u(1, 0)) / 1e-3, 1e-6);
    EXPECT_EQ(s.policy[0].K(0, 0), 0);
    EXPECT_LT(s.iterations.size(), 25u);
    EXPECT_TRUE(s.is_minimum);
  }
}

// It is left, and there is no minimum to be found.
TEST(Ddp, ASaddleIsNoMinimum) {
  Problem p =
      integrator(0, [](const auto& s) { return s.u[0] * s.u[0] + s.u[1] * s.u[1] - 9.0 * s.x[0] * s.x[0]; });
  const DdpSolution s = solve_with_ddp(p, {.intervals = 20, .evaluation = kInterpreted});
  EXPECT_FALSE(s.success());
  EXPECT_LT(s.cost, -1);
  EXPECT_FALSE(s.is_minimum);
}

// To a place L away, from anywhere: the same motion in any unit.
TEST(Ddp, NothingIsSmallByItself) {
  for (const double L : {1.0, 1e-6, 1e-12}) {
    Problem p("bead", {"x"}, {"u"}, 1, [](const auto& s) { return s.u; });
    p.add(running_squares("effort", [L](const auto& s) { return (s.u / L).eval(); }));
    p.add(terminal_squares(
        "missed", [L](const auto& s) { return vector(std::decay_t<decltype(s.t)>(s.x[0] / L - 1.0)); }));
    p.start << 0;
    p.goal.setConstant(Problem::kFree);
    p.guess = [L](double t) {
      return Stage<double>{t, VectorXd::Constant(1, t > 0 ? L : 0), {}, VectorXd::Zero(1)};
    };
    for (const DdpStart start : {DdpStart::kRollOut, DdpStart::kNodes}) {
      for (const DdpHessian hessian : {DdpHessian::kExact, DdpHessian::kGaussNewton}) {
        const DdpSolution s = solved(p, {.intervals = 10, .hessian = hessian, .start = start});
        EXPECT_NEAR(s.cost, 0.5, 1e-12) << L;
        EXPECT_NEAR(s.u(0, 3) / L, 0.5, 1e-9) << L;
        EXPECT_NEAR(s.x(0, 10) / L, 0.5, 1e-9) << L;
      }
    }
  }
}

// A start that runs away makes derivatives of 1e20: what is solved is not measured by them.
TEST(Ddp, WhatIsSolvedDoesNotDependOnTheStart) {
  Problem p("unstable", {"x"}, {"u"}, 1, [](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(20.0 * s.x[0] + 0.3 * s.x[0] * s.x[0] / (1.0 + s.x[0] * s.x[0]) + s.u[0]));
  });
  p.add(running_squares("effort", [](const auto& s) { return (0.1 * s.u).eval(); }));
  p.add(terminal_squares("missed",
                         [](const auto& s) { return vector(std::decay_t<decltype(s.t)>(s.x[0] - 1.0)); }));
  p.start << 1;
  p.goal.setConstant(Problem::kFree);
  const auto from = [&](double u) {
    p.guess = [u](double t) {
      return Stage<double>{t, VectorXd::Constant(1, 1), {}, VectorXd::Constant(1, u)};
    };
    return solve_with_ddp(p, {.intervals = 30, .evaluation = kInterpreted});
  };
  const DdpSolution near = from(-20.2), far = from(100);
  ASSERT_TRUE(near.success());
  ASSERT_GT(far.iterations.front().slope, 1e12);
  ASSERT_TRUE(far.success()) << to_string(far.status);
  EXPECT_NEAR(far.cost, near.cost, 1e-9 * near.cost);
  EXPECT_LT((far.u - near.u).cwiseAbs().maxCoeff(), 1e-6 * near.u.cwiseAbs().maxCoeff());
}

// By first derivatives nobody knows whether 4 cos^2 has a minimum at 0; by second ones its top is left.
TEST(Ddp, GaussNewtonDoesNotKnowMinima) {
  Problem p("top", {"x"}, {"u"}, 1, [](const auto& s) { return s.u; });
  p.add(running_squares("waves", [](const auto& s) {
    using std::cos;
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(2.0 * cos(s.u[0])), T(0.1 * s.u[0]), T(0.1 * s.x[0]));
  }));
  p.start << 0;
  p.goal.setConstant(Problem::kFree);
  EXPECT_FALSE(solved(p, {.intervals = 5, .hessian = DdpHessian::kGaussNewton}).is_minimum);
  const DdpSolution left = solved(p, {.intervals = 5, .hessian = DdpHessian::kExact});
  EXPECT_TRUE(left.is_minimum);
  EXPECT_LT(left.cost, 0.3);  // 4 at the top
}

TEST(Ddp, WhatIsNotFiniteIsNotSolved) {
  Problem p = integrator(-1, [](const auto& s) { return s.u.squaredNorm(); });
  p.add(terminal_cost("end", [](const auto& s) {
    using std::log;
    return log(s.x[0]);
  }));
  EXPECT_THROW(solve_with_ddp(p, {.evaluation = kInterpreted}), NumericalError);
  p = integrator(1, [](const auto& s) {
    using std::sqrt;
    return sqrt(s.u[0] * s.u[0]) + s.u[1] * s.u[1];  // its slope at zero is 0 / 0
  });
  const DdpSolution s = solve_with_ddp(p, {.intervals = 5, .evaluation = kInterpreted});
  EXPECT_EQ(s.status, SolveStatus::kNotFinite) << to_string(s.status);
  EXPECT_EQ(s.policy[2].K.rows(), 2);
  EXPECT_EQ(s.slope.cols(), 6);
  EXPECT_TRUE(std::isnan(s.integration_error));
  p = integrator(1, [](const auto& s) { return s.u.squaredNorm(); });
  p.guess = [](double t) {
    return Stage<double>{t, VectorXd::Constant(1, t == 1 ? std::nan("") : 0), {}, Eigen::Vector2d::Zero()};
  };
  EXPECT_THROW(solve_with_ddp(p, {.start = DdpStart::kNodes, .evaluation = kInterpreted}), NumericalError);
}

TEST(Ddp, SaysWhatItDoesNotKnow) {
  const auto refused = [](const Problem& p, const std::string& expected) {
    try {
      solve_with_ddp(p, {.evaluation = kInterpreted});
      ADD_FAILURE() << "accepted: " << expected;
    } catch (const ArgumentError& e) {
      EXPECT_NE(std::string(e.what()).find(expected), std::string::npos) << e.what();
    }
  };
  refused(test::block_move(), "the end of the state \"p\" is given");
  Problem p = soft_swing_up();
  p.x.lower[1] = -1;
  refused(p, "the state \"th\" has limits");
  p = soft_swing_up();
  p.add(path_equality("track", [](const auto& s) { return s.u; }));
  refused(p, "the term \"track\" is a constraint");
  p = soft_swing_up();
  p.positions = 5;
  refused(p, "5 states are positions, expected 0 to 4");
  p = soft_swing_up();
  p.add(running_cost("heat", [](const auto& s) { return s.u.squaredNorm(); }));
  EXPECT_NE(message_of<ArgumentError>([&] {
              solve_with_ddp(p, {.hessian = DdpHessian::kGaussNewton, .evaluation = kInterpreted});
            }).find("Gauss-Newton needs every cost as squares of residuals, and \"heat\" is a plain cost"),
            std::string::npos);
  p = soft_swing_up();
  p.start[2] = Problem::kFree;
  refused(p, "the start of the state \"pd\" is free");
  EXPECT_THROW(solve_with_ddp(soft_swing_up(), {.intervals = 0}), ArgumentError);
  EXPECT_THROW(solve_with_ddp(soft_swing_up(), {.tolerance = std::nan("")}), ArgumentError);
  EXPECT_THROW(solve_with_ddp(soft_swing_up(), {.max_iterations = -1}), ArgumentError);
  refused(Problem("none", {"x"}, {}, 1, [](const auto& s) { return s.x; }), "there are no controls");
  p = soft_swing_up();
  p.guess = [](double t) {
    return Stage<double>{t, VectorXd::Zero(t > 0 && t < 1 ? 3 : 4), {}, VectorXd::Zero(1)};
  };
  refused(p, "has other sizes than the problem");
  p = soft_swing_up();
  p.start[3] = 1e200;
  EXPECT_THROW(solve_with_ddp(p, {.evaluation = kInterpreted}), NumericalError);
}

}  // namespace
}  // namespace dyntape::ddp_test
