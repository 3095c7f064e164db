// SPDX-License-Identifier: BSD-3-Clause
//
// Chains of stages against the whole linear system at once.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include <dyntape/interface/control/riccati/riccati_kkt.h>

namespace dyntape {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  MatrixXd matrix(Eigen::Index rows, Eigen::Index cols) {
    return MatrixXd::NullaryExpr(rows, cols, [&] { return normal_(engine_); });
  }
  VectorXd vector(Eigen::Index n) { return matrix(n, 1); }
  int below(int n) { return int(engine_() % unsigned(n)); }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
};

// [ H  M^T; M  -elastic I ] of a chain, dense.
MatrixXd whole(RiccatiKkt& chain, double shift, double elastic) {
  const Eigen::Index n = chain.variables(), m = chain.rows();
  MatrixXd K = MatrixXd::Zero(n + m, n + m);
  for (std::size_t k = 0; k < chain.stages(); ++k) {
    const RiccatiKkt::Stage& s = chain.stage(k);
    const Eigen::Index at = chain.first_variable(k), row = n + chain.first_row(k), links = s.D.rows();
    K.block(at, at, s.H.rows(), s.H.rows()) = s.H;
    K.block(row, at, links, s.H.rows()) = s.D;
    K.block(row + links, at, s.G.rows(), s.H.rows()) = s.G;
    if (k == 0) continue;
    const MatrixXd& C = chain.stage(k - 1).C;
    K.block(row, chain.first_variable(k - 1), links, C.cols()) = C;
  }
  K.topLeftCorner(n, n).diagonal().array() += shift;
  K.topRightCorner(n, m) = K.bottomLeftCorner(m, n).transpose();
  K.bottomRightCorner(m, m).diagonal().array() = -elastic;
  return K;
}

RiccatiKkt random_chain(Random& random, bool convex, bool puts_in_links = false) {
  const int N = random.below(7);
  std::vector<StageSizes> sizes;
  for (int k = 0; k <= N; ++k)
    sizes.push_back({3 + random.below(6), random.below(3), k > 0 ? 1 + random.below(4) : 0});
  RiccatiKkt chain(sizes, puts_in_links);
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    RiccatiKkt::Stage& s = chain.stage(k);
    const Eigen::Index n = s.H.rows();
    const MatrixXd A = random.matrix(n, n);
    s.H = convex ? MatrixXd(A * A.transpose() + 0.1 * MatrixXd::Identity(n, n)) : MatrixXd(A + A.transpose());
    s.G = random.matrix(s.G.rows(), n), s.D = random.matrix(s.D.rows(), n),
    s.C = random.matrix(s.C.rows(), n);
  }
  return chain;
}

// Links that say one variable each by the stage before, some twice.
void make_explicit(RiccatiKkt& chain) {
  for (std::size_t k = 1; k < chain.stages(); ++k) {
    RiccatiKkt::Rows& D = chain.stage(k).D;
    D.setZero();
    for (Eigen::Index r = 0; r < D.rows(); ++r) D(r, (r + Eigen::Index(k)) % D.cols()) = r % 2 == 0 ? -1 : 2;
  }
}

// Also where rows outnumber a stage's variables, or repeat each other, on and across stages.
TEST(RiccatiKkt, SolvesTheWholeSystem) {
  int slow = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    Random random(seed);
    RiccatiKkt chain = random_chain(random, true, seed % 8 < 4);
    RiccatiKkt::Stage& last = chain.stage(chain.stages() - 1);
    if (seed % 3 == 0 && last.G.rows() == 2) last.G.row(1) = -2 * last.G.row(0);
    if (seed % 5 == 0 && last.D.rows() > 1) last.D.row(1).setZero();
    if (seed % 4 == 1) make_explicit(chain);
    for (double elastic : {0.0, 0.3}) {
      ASSERT_TRUE(chain.factor(0, elastic)) << "seed " << seed;
      const MatrixXd K = whole(chain, 0, elastic);
      const Eigen::Index n = chain.variables(), m = chain.rows();
      const VectorXd a = random.vector(n);
      // Rows that repeat each other do not contradict.
      const VectorXd b =
          elastic > 0 ? random.vector(m) : VectorXd(K.bottomLeftCorner(m, n) * random.vector(n));
      VectorXd z, lambda, x = VectorXd::Zero(n + m), right(n + m);
      right << a, b;
      // What springs miss is solved for again; where rounding takes much of them, more often.
      int steps = 0;
      for (; steps < 60 && (K * x - right).norm() > 1e-11 * (right.norm() + x.norm()); ++steps) {
        const VectorXd left = right - K * x;
        chain.solve(left.head(n), left.tail(m), z, lambda);
        x.head(n) += z, x.tail(m) += lambda;
      }
      slow += steps > 8;
      EXPECT_LE((K * x - right).norm(), 1e-9 * (right.norm() + x.norm())) << "seed " << seed;
    }
  }
  EXPECT_LE(slow, 6);  // of 600
}

// The first stage alone, of a right side that is zero behind the second, is that of the whole.
TEST(RiccatiKkt, SolvesTheFirstStageAlone) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    Random random(seed);
    RiccatiKkt chain = random_chain(random, true, seed % 2 == 0);
    if (seed % 4 == 0) make_explicit(chain);
    ASSERT_TRUE(chain.factor(0)) << "seed " << seed;
    VectorXd a = VectorXd::Zero(chain.variables()), b = VectorXd::Zero(chain.rows()), z, lambda;
    a.head(chain.first_variable(1)) = random.vector(chain.first_variable(1));
    b.head(chain.rows_before(2)) = random.vector(chain.rows_before(2));
    chain.solve(a, b, z, lambda);
    const VectorXd whole = z.head(chain.first_variable(1));
    z.setConstant(NAN);
    chain.solve_first(a, b, z);
    EXPECT_EQ(z.head(whole.size()), whole) << "seed " << seed;
  }
}

// Every factorisation goes through if and only if the Hessian is positive definite on what the rows leave free.
TEST(RiccatiKkt, KnowsTheInertia) {
  int convex = 0;
  for (unsigned seed = 0; seed < 400; ++seed) {
    Random random(seed);
    RiccatiKkt chain = random_chain(random, false, seed % 8 < 4);
    if (seed % 4 == 1) make_explicit(chain);
    const double shift = 3.0 * random.below(4);
    const MatrixXd K = whole(chain, shift, 0);
    const Eigen::Index n = chain.variables(), m = chain.rows();
    // Eigenvalues on an orthonormal basis of what the rows leave free.
    const MatrixXd kernel = Eigen::FullPivLU<MatrixXd>(K.bottomLeftCorner(m, n)).kernel();
    const MatrixXd Q = Eigen::HouseholderQR<MatrixXd>(kernel).householderQ();
    const MatrixXd basis = Q.leftCols(kernel.cols());
    const MatrixXd reduced = basis.transpose() * K.topLeftCorner(n, n) * basis;
    const double least =
        kernel.isZero() ? 1 : Eigen::SelfAdjointEigenSolver<MatrixXd>(reduced).eigenvalues()[0];
    if (std::abs(least) < 1e-6) continue;
    EXPECT_EQ(chain.factor(shift), least > 0) << "seed " << seed << ", least " << least;
    convex += least > 0;
  }
  EXPECT_GT(convex, 40);
  EXPECT_LT(convex, 360);
}

// A goal of all states that one control meets, many stages ahead: bound multipliers stay what they are, however fine the mesh.
TEST(RiccatiKkt, GoalsOfFineMeshes) {
  for (int N : {20, 200, 2000, 20000}) {
    const double h = 1.0 / N;
    Eigen::Matrix4d A = Eigen::Matrix4d::Identity();
    A(0, 2) = A(1, 3) = h, A(2, 1) = -3 * h, A(3, 1) = -20 * h;
    const Eigen::Vector4d B(0, 0, h, 2 * h);
    std::vector<StageSizes> sizes(std::size_t(N) + 1, {5, 0, 4});
    sizes.front() = {1, 0, 0}, sizes.back() = {4, 4, 4};
    RiccatiKkt chain(sizes);
    for (std::size_t k = 0; k <= std::size_t(N); ++k) {
      RiccatiKkt::Stage& s = chain.stage(k);
      s.H.setZero();
      if (k < std::size_t(N)) s.H.bottomRightCorner(1, 1).setConstant(2 * h);
      if (k > 0) s.D.leftCols(4) = -Eigen::Matrix4d::Identity();
      if (k == std::size_t(N)) s.G.setIdentity();
      if (k == 0) s.C = B;
      if (k > 0 && k < std::size_t(N)) s.C << A, B;
    }
    ASSERT_TRUE(chain.factor(0)) << N;
    const VectorXd a = VectorXd::Zero(chain.variables());
    VectorXd b = VectorXd::Zero(chain.rows()), z, lambda, x = a, left = b;
    b.tail(4) << 1, 0, 0, 0;
    for (int i = 0; i < 12; ++i) {
      left = b;  // goal less where x ends, and what links miss
      for (std::size_t k = 0; k <= std::size_t(N); ++k) {
        const RiccatiKkt::Stage& s = chain.stage(k);
        auto rows = left.segment(chain.first_row(k), chain.first_row(k + 1) - chain.first_row(k));
        const auto own = x.segment(chain.first_variable(k), s.H.rows());
        if (k > 0) {
          const RiccatiKkt::Stage& before = chain.stage(k - 1);
          rows.head(4) -= s.D * own + before.C * x.segment(chain.first_variable(k - 1), before.H.rows());
        }
        rows.tail(s.G.rows()) -= s.G * own;
      }
      if (left.cwiseAbs().maxCoeff() < 1e-12) break;
      chain.solve(a, left, z, lambda);
      x += z;
    }
    EXPECT_LT(left.cwiseAbs().maxCoeff(), 1e-10) << N;
    double effort = 0;
    for (std::size_t k = 0; k < std::size_t(N); ++k)
      effort += h * std::pow(x[chain.first_variable(k + 1) - 1], 2);
    EXPECT_LT(effort, 1e4) << N;
    std::printf("N = %5d: effort %.6f\n", N, effort);
  }
}

// A row that contradicts others is missed, the others are not.
TEST(RiccatiKkt, ContradictionsAreLeftOut) {
  RiccatiKkt chain({{2, 2, 0}});
  chain.stage(0).H.setIdentity();
  chain.stage(0).G << 1, 1, 1, 1;
  ASSERT_TRUE(chain.factor(0));
  VectorXd z, lambda;
  chain.solve(Eigen::Vector2d(0, 0), Eigen::Vector2d(2, 3), z, lambda);
  EXPECT_NEAR(z[0], z[1], 1e-15);
  EXPECT_TRUE(std::abs(z.sum() - 2) < 1e-14 || std::abs(z.sum() - 3) < 1e-14);
  EXPECT_EQ((lambda.array() == 0).count(), 1);
}

}  // namespace
}  // namespace dyntape
