// SPDX-License-Identifier: BSD-3-Clause
//
// Chains of stages against the whole linear system at once.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include <dyntape/interface/control/riccati/riccati_kkt.h>

#include "random_matrices.h"

namespace dyntape::riccati_kkt_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

using Random = test::RandomMatrices;

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
  chain.take_structure();
  return chain;
}

// Links that say one variable each by the stage before, some twice.
void make_explicit(RiccatiKkt& chain) {
  for (std::size_t k = 1; k < chain.stages(); ++k) {
    RiccatiKkt::Rows& D = chain.stage(k).D;
    D.setZero();
    for (Eigen::Index r = 0; r < D.rows(); ++r) D(r, (r + Eigen::Index(k)) % D.cols()) = r % 2 == 0 ? -1 : 2;
  }
  chain.take_structure();
}

// What only some entries of H and C of the stages are other than zero, many enough variables for that to be worth something.
RiccatiKkt sparse_chain(Random& random, bool puts_in_links) {
  std::vector<StageSizes> sizes;
  for (int k = 0; k < 5; ++k) sizes.push_back({24 + random.below(6), 4 + random.below(4), k > 0 ? 9 : 0});
  RiccatiKkt chain(sizes, puts_in_links);
  for (std::size_t k = 0; k < sizes.size(); ++k) {
    RiccatiKkt::Stage& s = chain.stage(k);
    const Eigen::Index n = s.H.rows();
    s.H.setZero();
    for (Eigen::Index i = 0; i < n; ++i) s.H(i, i) = 2;
    for (Eigen::Index i = 0; i + 3 < n; i += 4) s.H(i, i + 3) = s.H(i + 3, i) = 1;
    s.G = random.matrix(s.G.rows(), n), s.C.setZero(), s.D.setZero();
    for (Eigen::Index r = 0; r < s.C.rows(); ++r)
      s.C(r, 2 * r) = 1, s.C(r, (3 * r + 1) % n) = random.matrix(1, 1)(0);
    for (Eigen::Index r = 0; r < s.D.rows(); ++r) s.D(r, (2 * r + 3) % n) = r % 2 == 0 ? -1 : 2;
  }
  chain.take_structure();
  return chain;
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

// Stages of which little is other than zero, and links that were to say one variable and say none.
TEST(RiccatiKkt, KnowsWhatIsZero) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Random random(seed);
    RiccatiKkt chain = sparse_chain(random, seed % 2 == 0);
    if (seed % 4 >= 2) chain.stage(2).D.row(3).setZero();
    for (double elastic : {0.0, 0.3}) {
      ASSERT_TRUE(chain.factor(0.1, elastic)) << "seed " << seed;
      const MatrixXd K = whole(chain, 0.1, elastic);
      const Eigen::Index n = chain.variables(), m = chain.rows();
      const VectorXd right = K * random.vector(n + m);
      VectorXd z, lambda, x = VectorXd::Zero(n + m);
      for (int i = 0; i < 6; ++i) {
        const VectorXd left = right - K * x;
        chain.solve(left.head(n), left.tail(m), z, lambda);
        x.head(n) += z, x.tail(m) += lambda;
      }
      EXPECT_LE((K * x - right).norm(), 1e-11 * (right.norm() + x.norm())) << "seed " << seed;
    }
  }
}

// The first stage alone, of right sides that are zero behind the second, is that of the whole: to rounding, and where rows are springs,
// whose 1e10 leave few digits, as near to what solving again for what is missing ends at.
TEST(RiccatiKkt, SolvesTheFirstStageAlone) {
  int plain = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    Random random(seed);
    const bool is_sparse = seed % 5 == 0;
    RiccatiKkt chain =
        is_sparse ? sparse_chain(random, seed % 2 == 0) : random_chain(random, true, seed % 2 == 0);
    if (!is_sparse && seed % 4 == 0) make_explicit(chain);
    bool has_springs = false;
    for (std::size_t k = 0; k < chain.stages(); ++k)
      has_springs |= chain.stage(k).G.rows() + chain.stage(k).D.rows() > chain.stage(k).H.rows();
    plain += !has_springs;
    ASSERT_TRUE(chain.factor(0.1)) << "seed " << seed;
    const MatrixXd K = whole(chain, 0.1, 0);
    const Eigen::Index n = chain.variables(), m = chain.rows(), first = chain.first_variable(1);
    // Rows that repeat each other do not contradict: they are what some values of the first stage give.
    const MatrixXd slopes = random.matrix(8, chain.variables_before(2));
    const MatrixXd rows = random.matrix(8, first) *
                          K.bottomLeftCorner(m, n).topLeftCorner(chain.rows_before(2), first).transpose();
    const MatrixXd alone = chain.solve_first(slopes, rows);
    for (Eigen::Index side = 0; side < 8; ++side) {
      VectorXd right = VectorXd::Zero(n + m), z, lambda, x = right;
      right.head(slopes.cols()) = slopes.row(side), right.segment(n, rows.cols()) = rows.row(side);
      VectorXd once;
      for (int i = 0; i < 12; ++i) {
        const VectorXd left = right - K * x;
        chain.solve(left.head(n), left.tail(m), z, lambda);
        x.head(n) += z, x.tail(m) += lambda;
        if (i == 0) once = x.head(first);
      }
      const VectorXd exact = x.head(first);
      const double error = (alone.row(side).transpose() - exact).norm();
      const double rounding =
          has_springs ? 100 * (once - exact).norm() + 1e-9 * exact.norm() : 1e-11 * exact.norm();
      EXPECT_LE(error, rounding) << "seed " << seed;
    }
  }
  EXPECT_GT(plain, 100);
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
void solve_goals(bool takes_structure) {
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
    if (takes_structure) chain.take_structure();
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
TEST(RiccatiKkt, GoalsOfFineMeshes) { solve_goals(false); }
TEST(RiccatiKkt, GoalsOfFineMeshesWhoseStructureIsKnown) { solve_goals(true); }

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
}  // namespace dyntape::riccati_kkt_test
