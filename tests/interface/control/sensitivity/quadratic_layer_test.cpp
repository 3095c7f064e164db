// SPDX-License-Identifier: BSD-3-Clause
//
// Quadratic programs as layers: against differences of solves, all active sets, and OptNet's own system.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/sensitivity/quadratic_layer.h>
#include "interface/message_of.h"
#include "judged_quadratic.h"
#include "random_matrices.h"

namespace dyntape::quadratic_layer_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

using Draw = test::RandomMatrices;

// Feasible: x0 is.  About half of the inequalities are active at the solution, with bound multipliers and distances away from
// zero.
QuadraticProgram random_program(Draw& draw, Eigen::Index n, Eigen::Index of_A, Eigen::Index of_G) {
  QuadraticProgram p;
  const MatrixXd root = draw.matrix(n, n);
  p.Q = root * root.transpose() / double(n) + 0.1 * MatrixXd::Identity(n, n);
  p.A = draw.matrix(of_A, n), p.G = draw.matrix(of_G, n);
  const VectorXd x0 = draw.vector(n);
  VectorXd slack = VectorXd::Zero(of_G), lambda = slack;
  for (Eigen::Index j = 0, active = 0; j < of_G; ++j) {
    const bool holds = draw.below(2) == 0 && active < n - of_A;
    active += holds;
    (holds ? lambda : slack)[j] = 0.1 + std::abs(draw.vector(1)[0]);
  }
  p.b = p.A * x0, p.h = p.G * x0 + slack;
  p.q = -(p.Q * x0 + p.A.transpose() * draw.vector(of_A) + p.G.transpose() * lambda);
  return p;
}

QuadraticProgram random_change(Draw& draw, const QuadraticProgram& p) {
  QuadraticProgram c;
  const MatrixXd root = draw.matrix(p.q.size(), p.q.size());
  c.Q = root + root.transpose(), c.q = draw.vector(p.q.size());
  c.A = draw.matrix(p.A.rows(), p.A.cols()), c.b = draw.vector(p.b.size());
  c.G = draw.matrix(p.G.rows(), p.G.cols()), c.h = draw.vector(p.h.size());
  return c;
}

QuadraticProgram moved(const QuadraticProgram& p, const QuadraticProgram& by, double t) {
  return {p.Q + t * by.Q, p.q + t * by.q, p.A + t * by.A, p.b + t * by.b, p.G + t * by.G, p.h + t * by.h};
}

double dot(const QuadraticProgram& a, const QuadraticProgram& b) {
  return a.Q.cwiseProduct(b.Q).sum() + a.q.dot(b.q) + a.A.cwiseProduct(b.A).sum() + a.b.dot(b.b) +
         a.G.cwiseProduct(b.G).sum() + a.h.dot(b.h);
}

double off(const VectorXd& a, const VectorXd& b) { return (a - b).norm() / (1e-12 + b.norm()); }

struct Sizes {
  Eigen::Index n, of_A, of_G;
};
Sizes random_sizes(Draw& draw) {
  const Eigen::Index n = 1 + draw.below(50);
  return {n, draw.below(int(n)) / 2, draw.below(2 * int(n) + 1)};
}

TEST(QuadraticLayer, SolvesAndFollowsRandomPrograms) {
  double least = 1;
  for (unsigned seed = 1; seed <= 150; ++seed) {
    Draw draw(seed);
    const Sizes sizes = random_sizes(draw);
    const QuadraticProgram p = random_program(draw, sizes.n, sizes.of_A, sizes.of_G);
    QuadraticLayer layer(p);
    ASSERT_TRUE(layer.good()) << "seed " << seed << ": " << layer.why();
    // First-order conditions, to rounding.
    const QuadraticSolution& s = layer.solution();
    const VectorXd slope = p.Q * s.x + p.q + p.A.transpose() * s.nu + p.G.transpose() * s.lambda;
    EXPECT_LT(slope.norm(), 1e-11 * (1 + p.q.norm())) << seed;
    EXPECT_LT((p.A * s.x - p.b).norm(), 1e-11 * (1 + p.b.norm())) << seed;
    for (Eigen::Index j = 0; j < p.h.size(); ++j) {
      const double distance = p.h[j] - p.G.row(j).dot(s.x);
      EXPECT_GT(distance, -1e-10);
      EXPECT_GE(s.lambda[j], 0);
      EXPECT_LT(std::min(distance, s.lambda[j]), 1e-10);
    }
    // Differences of solves; what is quadratic in t cancels.
    const QuadraticProgram change = random_change(draw, p);
    const QuadraticSolution d = layer.forward(change);
    const double t = std::min({1e-6, 0.3 * d.to, -0.3 * d.from});
    ASSERT_GT(t, 0);
    least = std::min(least, t);
    QuadraticLayer up(moved(p, change, t)), down(moved(p, change, -t));
    ASSERT_TRUE(up.good() && down.good()) << seed << ": " << up.why() << down.why();
    EXPECT_LT(off((up.solution().x - down.solution().x) / (2 * t), d.x), 1e-5) << seed;
    EXPECT_LT(off((up.solution().lambda - down.solution().lambda) / (2 * t), d.lambda), 1e-5) << seed;
    EXPECT_LT(off((up.solution().nu - down.solution().nu) / (2 * t), d.nu), 1e-5) << seed;
    // Backward is the transpose of forward.
    const VectorXd seed_of_x = draw.vector(sizes.n);
    EXPECT_NEAR(dot(layer.backward(seed_of_x), change), seed_of_x.dot(d.x),
                1e-9 * (1 + seed_of_x.norm() * d.x.norm()))
        << seed;
  }
  EXPECT_LT(least, 1e-6);  // some are near to a change of what is active
  EXPECT_GT(least, 1e-9);
}

// OptNet, equation 6 to 8: K [dx; dlambda; dnu] = [-slope; 0; 0] with K of all inequalities, bound multipliers and slacks in it.
TEST(QuadraticLayer, GivesWhatOptNetsSystemGives) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Draw draw(seed);
    const Sizes sizes = random_sizes(draw);
    const QuadraticProgram p = random_program(draw, sizes.n, sizes.of_A, sizes.of_G);
    QuadraticLayer layer(p);
    ASSERT_TRUE(layer.good()) << seed;
    const QuadraticSolution& s = layer.solution();
    const Eigen::Index n = sizes.n, of_A = sizes.of_A, of_G = sizes.of_G;
    VectorXd slack = p.h - p.G * s.x;
    for (Eigen::Index j = 0; j < of_G; ++j) {
      if (s.lambda[j] > 0) slack[j] = 0;
    }
    MatrixXd K = MatrixXd::Zero(n + of_G + of_A, n + of_G + of_A);
    K.topLeftCorner(n, n) = p.Q;
    K.block(0, n, n, of_G) = p.G.transpose() * s.lambda.asDiagonal();
    K.block(0, n + of_G, n, of_A) = p.A.transpose();
    K.block(n, 0, of_G, n) = p.G, K.block(n, n, of_G, of_G) = MatrixXd((-slack).asDiagonal());
    K.block(n + of_G, 0, of_A, n) = p.A;
    VectorXd right = VectorXd::Zero(K.rows());
    const VectorXd slope = draw.vector(n);
    right.head(n) = -slope;
    const VectorXd d = K.fullPivLu().solve(right);
    const VectorXd dx = d.head(n), dl = d.segment(n, of_G), dn = d.tail(of_A);
    const QuadraticProgram b = layer.backward(slope);
    const MatrixXd dQ = (dx * s.x.transpose() + s.x * dx.transpose()) / 2,
                   dA = dn * s.x.transpose() + s.nu * dx.transpose(),
                   dG = s.lambda.asDiagonal() * (dl * s.x.transpose()) + s.lambda * dx.transpose();
    const VectorXd db = -dn, dh = -(s.lambda.asDiagonal() * dl);
    const double size = 1e-8 * (1 + d.norm()) * (1 + s.x.norm() + s.lambda.norm() + s.nu.norm());
    EXPECT_LT((b.Q - dQ).norm(), size) << seed;
    EXPECT_LT((b.q - dx).norm(), size) << seed;
    EXPECT_LT((b.A - dA).norm(), size) << seed;
    EXPECT_LT((b.b - db).norm(), size) << seed;
    EXPECT_LT((b.G - dG).norm(), size) << seed;
    EXPECT_LT((b.h - dh).norm(), size) << seed;
  }
}

// The same program in other units has the same solution, whatever they are.
TEST(QuadraticLayer, KnowsNoUnits) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    Draw draw(seed);
    const Sizes sizes = random_sizes(draw);
    const QuadraticProgram p = random_program(draw, sizes.n, sizes.of_A, sizes.of_G);
    const auto scale = [&] { return std::pow(10.0, draw.below(13) - 6); };
    const double of_x = scale(), of_f = scale();
    VectorXd rows_A = VectorXd::NullaryExpr(sizes.of_A, scale),
             rows_G = VectorXd::NullaryExpr(sizes.of_G, scale);
    const QuadraticProgram q{p.Q * (of_f / of_x / of_x),       p.q * (of_f / of_x),
                             rows_A.asDiagonal() * p.A / of_x, rows_A.cwiseProduct(p.b),
                             rows_G.asDiagonal() * p.G / of_x, rows_G.cwiseProduct(p.h)};
    QuadraticLayer layer(p), scaled(q);
    ASSERT_TRUE(layer.good()) << seed << " " << layer.why();
    ASSERT_TRUE(scaled.good()) << seed << " " << scaled.why() << " " << of_x << " " << of_f;
    EXPECT_LT(off(scaled.solution().x / of_x, layer.solution().x), 1e-8) << seed;
    const VectorXd slope = draw.vector(sizes.n);
    EXPECT_LT(off(scaled.backward(slope / of_x).q * (of_f / of_x), layer.backward(slope).q), 1e-7) << seed;
  }
}

TEST(QuadraticLayer, FlagsWhatHasNoSlopes) {
  const MatrixXd I = MatrixXd::Identity(2, 2);
  const VectorXd one = VectorXd::Ones(1);
  const auto status = [](const QuadraticProgram& p) { return QuadraticLayer(p).status(); };
  // x <= 1 where the cost is least at 1: it rests with no bound multiplier.
  const QuadraticProgram weak{.Q = I, .q = VectorXd{{-1, -1}}, .G = MatrixXd{{1, 0}}, .h = one};
  EXPECT_EQ(status(weak), SensitivityStatus::kWeaklyActive);
  EXPECT_EQ(QuadraticLayer(weak).weak(), std::vector<std::size_t>{0});
  EXPECT_EQ(QuadraticLayer(weak).why(), "row 0 of G x <= h is active with multiplier zero");
  // Twice the same constraint, with a bound multiplier.
  const QuadraticProgram twice{
      .Q = I, .q = VectorXd{{-3, -1}}, .G = MatrixXd{{1, 0}, {2, 0}}, .h = VectorXd{{1, 2}}};
  EXPECT_EQ(status(twice), SensitivityStatus::kDependentRows);
  EXPECT_NEAR(QuadraticLayer(twice).solution().x[0], 1, 1e-9);
  const QuadraticProgram equal_twice{
      .Q = I, .q = VectorXd{{-3, -1}}, .A = MatrixXd{{1, 1}, {1, 1}}, .b = VectorXd{{1, 1}}};
  EXPECT_EQ(status(equal_twice), SensitivityStatus::kDependentRows);
  // Three constraints meet in a corner of the plane.
  const QuadraticProgram corner{
      .Q = I, .q = VectorXd{{-3, -3}}, .G = MatrixXd{{1, 0}, {0, 1}, {1, 1}}, .h = VectorXd{{1, 1, 2}}};
  EXPECT_GE(status(corner), SensitivityStatus::kWeaklyActive);
  // The cost does not say where on x_0 = 1.
  const QuadraticProgram flat{
      .Q = MatrixXd{{1, 0}, {0, 0}}, .q = VectorXd{{-3, 0}}, .G = MatrixXd{{1, 0}}, .h = one};
  EXPECT_EQ(status(flat), SensitivityStatus::kNoStrictMinimum);
  EXPECT_TRUE(std::isnan(QuadraticLayer(flat).backward(VectorXd::Ones(2)).q[0]));
  // Infeasible; unbounded.
  QuadraticLayer infeasible(
      {.Q = I, .q = VectorXd{{0, 0}}, .G = MatrixXd{{1, 0}, {-1, 0}}, .h = VectorXd{{-1, -1}}});
  EXPECT_EQ(infeasible.outcome(), QpStatus::kInfeasible);
  EXPECT_EQ(infeasible.status(), SensitivityStatus::kNotASolution);
  EXPECT_TRUE(std::isnan(infeasible.forward({.q = VectorXd::Ones(2)}).x[0]));
  QuadraticLayer unbounded({.Q = MatrixXd::Zero(2, 2), .q = VectorXd{{1, 1}}});
  EXPECT_EQ(unbounded.outcome(), QpStatus::kUnbounded);
  EXPECT_FALSE(unbounded.good());
}

// Infeasible and unbounded programs are told apart, each with a proof that is looked at here; of feasible ones there is none.
TEST(QuadraticLayer, ProvesThatThereIsNoSolution) {
  int solved = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    Draw draw(seed);
    const Eigen::Index n = 2 + draw.below(20), of_A = draw.below(int(n) / 2 + 1),
                       of_G = 1 + draw.below(2 * int(n));
    QuadraticProgram p = random_program(draw, n, of_A, of_G);
    const int kind = int(seed % 3);
    if (kind == 1) {  // sum of some constraints, the other way round and out of reach
      VectorXd lambda = draw.vector(of_G).cwiseAbs(), nu = draw.vector(of_A);
      p.G.conservativeResize(of_G + 1, Eigen::NoChange), p.h.conservativeResize(of_G + 1);
      p.G.row(of_G) = -(p.G.topRows(of_G).transpose() * lambda + p.A.transpose() * nu).transpose();
      p.h[of_G] = -(p.h.head(of_G).dot(lambda) + p.b.dot(nu)) - 0.1 - std::abs(draw.vector(1)[0]);
    }
    if (kind == 2) {  // flat along d, which no constraint ends
      VectorXd d = draw.vector(n).normalized();
      const MatrixXd across = MatrixXd::Identity(n, n) - d * d.transpose();
      const VectorXd x0 = draw.vector(n);
      p.Q = across * p.Q * across, p.A = p.A * across, p.b = p.A * x0;
      for (Eigen::Index j = 0; j < of_G; ++j)
        if (p.G.row(j).dot(d) > 0) p.G.row(j) *= -1;
      p.h = p.G * x0 + VectorXd::Constant(of_G, 0.1);
      if (p.q.dot(d) > 0) p.q *= -1;
      p.q -= 0.1 * d;
    }
    // Other units of rows and variables.
    const double size = std::pow(10., draw.below(7) - 3);
    p.G.row(0) *= size, p.h[0] *= size;
    QuadraticLayer layer(p);
    const QuadraticSolution& proof = layer.certificate();
    if (kind == 0) {
      EXPECT_EQ(layer.outcome(), QpStatus::kSolved) << seed;
      EXPECT_TRUE(layer.good()) << seed;
      solved += layer.good();
    } else if (kind == 1) {
      ASSERT_EQ(layer.outcome(), QpStatus::kInfeasible) << seed << " " << layer.why();
      EXPECT_GE(proof.lambda.minCoeff(), 0) << seed;
      const double length =
          std::max(proof.nu.norm(), (p.G.rowwise().norm().asDiagonal() * proof.lambda).norm());
      EXPECT_LT((p.A.transpose() * proof.nu + p.G.transpose() * proof.lambda).norm(), 1e-7 * length) << seed;
      EXPECT_NEAR(p.b.dot(proof.nu) + p.h.dot(proof.lambda), -1, 1e-9) << seed;
      EXPECT_EQ(proof.x.size(), 0);
      EXPECT_NE(layer.why().find("no x fulfils the constraints"), std::string::npos);
    } else {
      ASSERT_EQ(layer.outcome(), QpStatus::kUnbounded) << seed << " " << layer.why();
      EXPECT_LT((p.Q * proof.x).norm(), 1e-7 * proof.x.norm()) << seed;
      EXPECT_LT((p.A * proof.x).norm(), 1e-7 * proof.x.norm()) << seed;
      EXPECT_LT((p.G * proof.x).maxCoeff(), 1e-7 * p.G.norm() * proof.x.norm()) << seed;
      EXPECT_NEAR(p.q.dot(proof.x), -1, 1e-9) << seed;
      EXPECT_EQ(proof.lambda.size(), 0);
    }
  }
  EXPECT_EQ(solved, 66);
}

// A linear program's corner has derivatives, although Q is zero.
TEST(QuadraticLayer, KnowsCornersWithoutCurvature) {
  QuadraticLayer layer({.Q = MatrixXd::Zero(2, 2),
                        .q = VectorXd{{-1, -2}},
                        .G = MatrixXd{{1, 0}, {0, 1}, {-1, 0}, {0, -1}},
                        .h = VectorXd{{1, 2, 3, HUGE_VAL}}});
  ASSERT_TRUE(layer.good()) << layer.why();
  EXPECT_LT((layer.solution().x - Eigen::Vector2d(1, 2)).norm(), 1e-12);
  EXPECT_LT((layer.forward({.h = VectorXd{{0.5, -1, 7, 7}}}).x - Eigen::Vector2d(0.5, -1)).norm(), 1e-12);
  EXPECT_LT((layer.forward({.q = VectorXd{{0.5, -1}}}).x).norm(), 1e-12);
}

// Singular Q, rows twice, empty interiors, weak rows, by exact arithmetic; tests/full/fuzz/quadratic_programs.cpp takes many more.
TEST(QuadraticLayer, AgreesWithExactArithmetic) {
  int solved = 0;
  for (std::uint64_t seed = 1; seed <= 5000; ++seed) {
    testing::QuadraticJudge judge(seed);
    EXPECT_EQ(judge.complaint(), "") << seed;
    solved += judge.outcome() == QpStatus::kSolved;
  }
  EXPECT_GT(solved, 4000);
}

// min (x - t)^2 / 2 subject to x <= 1 is min(t, 1): at t = 1 the slope is 1 to the left and 0 to the right.
TEST(QuadraticLayer, HasASlopeToEitherSideOfAWeakRow) {
  QuadraticLayer layer({.Q = MatrixXd{{1}}, .q = VectorXd{{-1}}, .G = MatrixXd{{1}}, .h = VectorXd{{1}}});
  ASSERT_EQ(layer.status(), SensitivityStatus::kWeaklyActive);
  const VectorXd up{{-1}}, down{{1}}, one{{1}};  // of q = -t
  EXPECT_NEAR(layer.forward({.q = up}).x[0], 0, 1e-15);
  EXPECT_NEAR(layer.forward({.q = up}).lambda[0], 1, 1e-15);
  EXPECT_NEAR(layer.forward({.q = down}).x[0], -1, 1e-15);
  EXPECT_NEAR(layer.backward(one).q[0], -1, 1e-15);
  EXPECT_NEAR(layer.backward(one, WeakRows::kHeld).q[0], 0, 1e-15);
  EXPECT_NEAR(layer.backward(one, WeakRows::kHeld).h[0], 1, 1e-15);
}

// Where Q is singular the cost may fall without end along v with Q v = 0, however small its slope is beside q.
TEST(QuadraticLayer, FindsSmallDescent) {
  for (double slope : {1e-2, 1e-4, 1e-6}) {
    QuadraticLayer layer({.Q = MatrixXd{{1, 1}, {1, 1}}, .q = VectorXd{{1 + slope, 1 - slope}}});
    ASSERT_EQ(layer.outcome(), QpStatus::kUnbounded) << slope;
    EXPECT_NEAR(layer.certificate().x[0] * slope, -0.5, 1e-6);
    EXPECT_FALSE(layer.good());
  }
}

// Distances and multipliers of all sizes down to 1e-10: the solution is known, and no row is too near to be decided.
TEST(QuadraticLayer, FindsSolutionsBesideNearlyActiveRows) {
  Draw draw(11);
  std::mt19937 engine(12);
  std::uniform_real_distribution<double> exponent(-10, 1), share(0, 1);
  for (int trial = 0; trial < 1000; ++trial) {
    const Eigen::Index n = 1 + trial % 4, rows = 5;
    QuadraticProgram p;
    const MatrixXd root = draw.matrix(n, n);
    p.Q = root * root.transpose() + MatrixXd::Identity(n, n);
    p.A = MatrixXd(0, n), p.b = VectorXd(0), p.G = draw.matrix(rows, n);
    const VectorXd x = draw.vector(n);
    VectorXd slack = VectorXd::Zero(rows), lambda = slack;
    Eigen::Index active = 0;
    for (Eigen::Index j = 0; j < rows; ++j) {
      const bool holds = share(engine) < 0.4 && active < n;
      active += holds;
      (holds ? lambda : slack)[j] = std::pow(10, exponent(engine));
    }
    p.h = p.G * x + slack, p.q = -(p.Q * x + p.G.transpose() * lambda);
    const QuadraticLayer layer(p);
    ASSERT_EQ(layer.outcome(), QpStatus::kSolved) << trial << ": " << layer.why();
    EXPECT_LT((layer.solution().x - x).norm(), 1e-10 * (1 + x.norm())) << trial;
  }
}

TEST(QuadraticLayer, RefusesWhatDoesNotFit) {
  const MatrixXd I = MatrixXd::Identity(2, 2);
  const VectorXd q = VectorXd::Ones(2);
  const auto message = [](const QuadraticProgram& p) {
    return message_of<ArgumentError>([&] { QuadraticLayer layer(p); });
  };
  EXPECT_EQ(message({.Q = I}), "quadratic program: there are no variables");
  EXPECT_EQ(message({.Q = MatrixXd::Ones(2, 3), .q = q}), "quadratic program: Q is 2 x 3, expected 2 x 2");
  EXPECT_EQ(message({.Q = I, .q = q, .A = MatrixXd::Ones(1, 3), .b = VectorXd::Ones(1)}),
            "quadratic program: A is 1 x 3, expected 1 x 2");
  EXPECT_EQ(message({.Q = MatrixXd{{1, 0.5}, {0, 1}}, .q = q}), "quadratic program: Q is not symmetric");
  EXPECT_EQ(message({.Q = MatrixXd{{1, 2}, {2, 1}}, .q = q}),
            "quadratic program: Q is not positive semidefinite, so that minima need not be unique");
  EXPECT_EQ(message({.Q = I, .q = VectorXd{{1, NAN}}}),
            "quadratic program: q has an entry that is no finite number");
  QuadraticLayer layer({.Q = I, .q = q});
  EXPECT_EQ(message_of<ArgumentError>([&] { layer.forward({.q = VectorXd::Ones(3)}); }),
            "quadratic program: a change of q is 3 x 1, expected 2 x 1");
  EXPECT_EQ(message_of<ArgumentError>([&] { layer.backward(VectorXd::Ones(3)); }),
            "quadratic program: the slope is 3 x 1, expected 2 x 1");
}

}  // namespace
}  // namespace dyntape::quadratic_layer_test
