// SPDX-License-Identifier: BSD-3-Clause
//
// The Riccati recursion against the whole linear system at once, and minima within limits against all active sets.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include <dyntape/interface/control/riccati/riccati.h>

namespace dyntape::riccati_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr unsigned kSeed = 31;

struct Random {
  std::mt19937_64 numbers{kSeed};
  double operator()(double low, double high) {
    return low + (high - low) * (static_cast<double>(numbers() >> 11) * 0x1p-53);
  }
  MatrixXd matrix(Eigen::Index rows, Eigen::Index cols) {
    return MatrixXd::NullaryExpr(rows, cols, [&] { return (*this)(-1, 1); });
  }
  MatrixXd symmetric(Eigen::Index n, double least) {
    const MatrixXd root = matrix(n, n);
    return root * root.transpose() / double(n) + least * MatrixXd::Identity(n, n);
  }
};

struct Lq {
  std::vector<LqrStage> stages;
  MatrixXd H;
  VectorXd g, start;
};

// least: what is added to the eigenvalues of the curvatures, which may make them negative.
Lq random_problem(Random& random, int N, int n, int m, double least) {
  Lq lq;
  for (int k = 0; k < N; ++k) {
    lq.stages.push_back({random.matrix(n, n),
                         random.matrix(n, m),
                         random.matrix(n, 1),
                         random.symmetric(n + m, least),
                         random.matrix(n + m, 1),
                         {},
                         {}});
  }
  lq.H = random.symmetric(n, least);
  lq.g = random.matrix(n, 1), lq.start = random.matrix(n, 1);
  return lq;
}

// All inputs as one vector: x_k = M_k u + d_k, and the cost 1/2 u.H u + g.u.
struct Condensed {
  explicit Condensed(const Lq& lq) {
    const auto N = Eigen::Index(lq.stages.size()), n = lq.start.size(), m = lq.stages[0].B.cols();
    H = MatrixXd::Zero(N * m, N * m), g = VectorXd::Zero(N * m);
    MatrixXd M = MatrixXd::Zero(n, N * m);
    VectorXd d = lq.start;
    for (Eigen::Index k = 0; k < N; ++k) {
      const LqrStage& s = lq.stages[std::size_t(k)];
      MatrixXd Z = MatrixXd::Zero(n + m, N * m);
      Z.topRows(n) = M;
      Z.block(n, k * m, m, m).setIdentity();
      VectorXd z = VectorXd::Zero(n + m);
      z.head(n) = d;
      H += Z.transpose() * s.H * Z, g += Z.transpose() * (s.H * z + s.g);
      M = (s.A * M).eval();
      M.middleCols(k * m, m) += s.B;
      d = (s.A * d + s.c).eval();
    }
    H += M.transpose() * lq.H * M, g += M.transpose() * (lq.H * d + lq.g);
  }
  MatrixXd H;
  VectorXd g;
};

// The inputs by the recursion, and the slope of the cost by the start; empty where it says that there is no minimum.
VectorXd by_stages(const Lq& lq, double shift, VectorXd* slope = nullptr) {
  Riccati riccati;
  riccati.begin(lq.H, lq.g);
  std::vector<LqrPolicy> policy(lq.stages.size());
  for (std::size_t k = lq.stages.size(); k-- > 0;) {
    if (!riccati.push(lq.stages[k], shift)) return {};
    policy[k] = riccati.policy();
  }
  if (slope) *slope = riccati.P() * lq.start + riccati.p();
  const Eigen::Index m = lq.stages[0].B.cols();
  VectorXd u(m * Eigen::Index(lq.stages.size())), x = lq.start;
  for (std::size_t k = 0; k < lq.stages.size(); ++k) {
    const VectorXd now = policy[k].k + policy[k].K * x;
    u.segment(Eigen::Index(k) * m, m) = now;
    x = (lq.stages[k].A * x + lq.stages[k].B * now + lq.stages[k].c).eval();
  }
  return u;
}

TEST(Riccati, FindsWhatTheWholeSystemFinds) {
  Random random;
  for (int i = 0; i < 300; ++i) {
    // Also more entries than a register holds.
    const int wide = i % 10 == 0 ? 6 : 0;
    const Lq lq = random_problem(random, 1 + i % 9, 1 + i % 5 + 2 * wide, 1 + i % 4 + wide, 0.1);
    const Condensed all(lq);
    const VectorXd expected = -all.H.llt().solve(all.g);
    VectorXd slope;
    const VectorXd u = by_stages(lq, 0, &slope);
    ASSERT_EQ(u.size(), expected.size());
    EXPECT_LT((u - expected).norm(), 1e-10 * (1 + expected.norm())) << i;
    // The slope of the least cost by the start, by differences of a function that is quadratic: exact but for rounding.
    const double h = 1e-3;
    for (Eigen::Index j = 0; j < lq.start.size(); ++j) {
      const auto least = [&](double by) {
        Lq moved = lq;
        moved.start[j] += by;
        const VectorXd v = by_stages(moved, 0);
        VectorXd x = moved.start, z(lq.start.size() + lq.stages[0].B.cols());
        double cost = 0;
        for (std::size_t k = 0; k < moved.stages.size(); ++k) {
          const LqrStage& s = moved.stages[k];
          z << x, v.segment(Eigen::Index(k) * s.B.cols(), s.B.cols());
          cost += z.dot(s.H * z) / 2 + s.g.dot(z);
          x = (s.A * x + s.B * z.tail(s.B.cols()) + s.c).eval();
        }
        return cost + x.dot(lq.H * x) / 2 + lq.g.dot(x);
      };
      const double up = least(h), down = least(-h);
      EXPECT_NEAR(slope[j], (up - down) / (2 * h), 1e-9 * (1 + std::abs(up)) / h) << i;
    }
  }
}

// Curvatures that are not positive may add up to a minimum all the same; it is found if and only if there is one.
TEST(Riccati, KnowsWhetherThereIsAMinimum) {
  Random random;
  int with = 0, without = 0;
  for (int i = 0; i < 600; ++i) {
    const Lq lq = random_problem(random, 2 + i % 5, 1 + i % 3, 1 + i % 3, random(-0.4, 0.1));
    const Condensed all(lq);
    const double least = Eigen::SelfAdjointEigenSolver<MatrixXd>(all.H).eigenvalues()[0];
    if (std::abs(least) < 1e-6) continue;
    const VectorXd u = by_stages(lq, 0);
    EXPECT_EQ(u.size() > 0, least > 0) << i << " " << least;
    (least > 0 ? with : without) += 1;
    EXPECT_GT(by_stages(lq, 1e6).size(), 0);
  }
  EXPECT_GT(with, 50);
  EXPECT_GT(without, 50);
}

TEST(Riccati, MinimaWithinLimitsAreThoseOfTheirActiveSets) {
  Random random;
  for (int i = 0; i < 3000; ++i) {
    const int m = 1 + i % 4;
    const MatrixXd H = random.symmetric(m, 1e-3);
    const VectorXd g = random.matrix(m, 1);
    const VectorXd lower = -random.matrix(m, 1).cwiseAbs(), upper = random.matrix(m, 1).cwiseAbs();
    double least = HUGE_VAL;
    int sets = 1;
    for (int k = 0; k < m; ++k) sets *= 3;
    for (int set = 0; set < sets; ++set) {
      VectorXd u(m);
      std::vector<int> free;
      for (int k = 0, rest = set; k < m; ++k, rest /= 3) {
        u[k] = rest % 3 == 0 ? 0 : rest % 3 == 1 ? lower[k] : upper[k];
        if (rest % 3 == 0) free.push_back(k);
      }
      if (!free.empty()) u(free) = -H(free, free).llt().solve((H * u + g)(free)).eval();
      if ((u.array() < lower.array() - 1e-12).any() || (u.array() > upper.array() + 1e-12).any()) continue;
      least = std::min(least, u.dot(H * u) / 2 + g.dot(u));
    }
    std::vector<bool> is_free;
    const VectorXd u = box_minimum(H, g, lower, upper, is_free);
    EXPECT_TRUE((u.array() >= lower.array()).all() && (u.array() <= upper.array()).all());
    EXPECT_NEAR(u.dot(H * u) / 2 + g.dot(u), least, 1e-12) << i;
    for (int k = 0; k < m; ++k) {
      if (is_free[std::size_t(k)]) {
        EXPECT_NEAR((H * u + g)[k], 0, 1e-12) << i;
      }
    }
  }
}

}  // namespace
}  // namespace dyntape::riccati_test
