// SPDX-License-Identifier: BSD-3-Clause
//
// Contact problems and impacts against what does not know the solver: enumeration of active sets, the laws themselves.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include <dyntape/dynamics/contact/impact.h>

namespace dyntape::dynamics::contact_problem_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr unsigned kSeed = 20;

double uniform(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * (static_cast<double>(random() >> 11) * 0x1p-53);
}
MatrixXd random_matrix(std::mt19937_64& random, int rows, int cols) {
  return MatrixXd::NullaryExpr(rows, cols, [&] { return uniform(random, -1, 1); });
}

// Contacts of a body with nv degrees of freedom, of which `same` rows repeat others.
struct Body {
  Body(std::mt19937_64& random, int contacts, int nv, bool repeats) : velocity(random_matrix(random, nv, 1)) {
    J = random_matrix(random, 3 * contacts, nv);
    if (repeats && contacts > 1) J.middleRows<3>(0) = J.middleRows<3>(3 * (contacts - 1));
    const MatrixXd root = random_matrix(random, nv, nv);
    W = root * root.transpose() + 0.1 * MatrixXd::Identity(nv, nv);
    // All normals can be left at once: there is a solution.
    for (int i = 0; i < contacts; ++i) J(3 * i, 0) = 2;
  }
  MatrixXd D() const { return J * W * J.transpose(); }
  MatrixXd J, W;
  VectorXd velocity;
};

// By how much each law does not hold, written out.
double broken_law(const ContactProblem& problem, const VectorXd& p) {
  const VectorXd u = problem.D * p + problem.b;
  double most = 0;
  Eigen::Index first = 0;
  for (const ContactBlock& block : problem.blocks) {
    const double p_n = p[first], u_n = u[first];
    most = std::max({most, -p_n, -u_n, std::abs(p_n * u_n)});
    if (block.rows == 3) {
      const Eigen::Vector2d p_t = p.segment<2>(first + 1), u_t = u.segment<2>(first + 1);
      most = std::max(most, p_t.norm() - block.friction * p_n);
      // The most that friction can take: p_t . u_t = - mu p_n |u_t|.
      most = std::max(most, std::abs(p_t.dot(u_t) + block.friction * p_n * u_t.norm()));
    }
    first += block.rows;
  }
  return most;
}

TEST(ContactProblems, TheProjectionOnTheConeIsTheNearestPoint) {
  std::mt19937_64 random(kSeed);
  for (int i = 0; i < 5000; ++i) {
    const double mu = i % 5 == 0 ? 0 : uniform(random, 0, 2);
    const Vector3d x = random_matrix(random, 3, 1), y = project_on_cone(x, mu);
    EXPECT_LE(y.tail<2>().norm(), mu * y[0] + 1e-15);
    // x - y is in the polar cone, and normal to y: what makes it the projection.
    const Vector3d away = x - y;
    EXPECT_NEAR(away.dot(y), 0, 1e-15);
    EXPECT_LE(away[0] + mu * away.tail<2>().norm(), 1e-15);
  }
  EXPECT_EQ(project_on_cone(Vector3d::Zero(), 0.5), Vector3d::Zero());
  EXPECT_EQ(project_on_cone(Vector3d(0, 1, 0), 0), Vector3d::Zero());
}

TEST(ContactProblems, OneContactObeysItsLaw) {
  std::mt19937_64 random(kSeed + 1);
  for (int i = 0; i < 20000; ++i) {
    const int rank = 1 + i % 3;
    const MatrixXd root = random_matrix(random, 3, rank);
    const VectorXd v = random_matrix(random, rank, 1);
    const ContactProblem problem{
        root * root.transpose(), root * v, {{3, i % 7 == 0 ? 0 : uniform(random, 0, 1.5)}}};
    // Of rank 1 a normal that nothing moves, and tangents that press of themselves, may have no solution.
    if (rank < 3 && problem.blocks[0].friction * root.row(0).norm() > 0.3 * root.row(0).squaredNorm())
      continue;
    const Vector3d p = solve_one_contact(problem.D, problem.b, problem.blocks[0].friction);
    ASSERT_TRUE(p.allFinite());
    const double size = 1 + p.norm();
    EXPECT_LT(broken_law(problem, p), 1e-9 * size * size) << i;
  }
}

// All sets of contacts that may press; of those whose velocities and impulses have the right signs.
TEST(ContactProblems, WithoutFrictionAreWhatEnumerationFinds) {
  std::mt19937_64 random(kSeed + 2);
  for (int i = 0; i < 3000; ++i) {
    const int n = 1 + i % 6, nv = 1 + int(random() % 8);
    MatrixXd J = random_matrix(random, n, nv);
    J.col(0).setConstant(2);
    if (i % 3 == 0) J.row(n - 1) = J.row(0);  // one contact twice
    const VectorXd v = random_matrix(random, nv, 1);
    ContactProblem problem{J * J.transpose(), J * v, std::vector<ContactBlock>(std::size_t(n), {1, 0})};
    VectorXd p = VectorXd::Zero(n);
    ContactSolver solver;
    ASSERT_TRUE(solver.solve(problem, p)) << i << " " << solver.residual();
    const VectorXd u = problem.D * p + problem.b;
    bool found = false;
    for (int set = 0; set < (1 << n) && !found; ++set) {
      std::vector<int> rows;
      for (int k = 0; k < n; ++k) {
        if (set >> k & 1) rows.push_back(k);
      }
      VectorXd q = VectorXd::Zero(n);
      if (!rows.empty()) {
        const MatrixXd own = problem.D(rows, rows);
        const VectorXd b = problem.b(rows);
        q(rows) = VectorXd(-own.completeOrthogonalDecomposition().solve(b));
      }
      const VectorXd other = problem.D * q + problem.b;
      if ((q.array() < -1e-9).any() || (other.array() < -1e-9).any()) continue;
      if (std::abs(q.dot(other)) > 1e-9) continue;
      found = true;
      EXPECT_LT((other - u).cwiseAbs().maxCoeff(), 1e-8 * (1 + u.norm())) << i;  // velocities are unique
    }
    EXPECT_TRUE(found) << i;
  }
}

TEST(ContactProblems, WithFrictionObeyTheirLaws) {
  std::mt19937_64 random(kSeed + 3);
  int unsolved = 0, sweeps = 0;
  for (int i = 0; i < 3000; ++i) {
    const int n = 1 + i % 6;
    const Body body(random, n, 3 + int(random() % 12), i % 4 == 0);
    ContactProblem problem{body.D(), body.J * body.velocity, {}};
    for (int k = 0; k < n; ++k) problem.blocks.push_back({3, i % 9 == 0 ? 0 : uniform(random, 0, 0.8)});
    VectorXd p = VectorXd::Zero(3 * n);
    ContactSolver solver;
    const bool solved = solver.solve(problem, p);
    sweeps += solver.sweeps();
    ASSERT_TRUE(p.allFinite());
    unsolved += !solved;
    if (solved) {
      const double size = 1 + p.norm() * problem.b.norm();
      EXPECT_LT(broken_law(problem, p), 1e-10 * size) << i;
    }
  }
  EXPECT_EQ(unsolved, 0);
  std::cout << "sweeps a problem: " << double(sweeps) / 3000 << "\n";
}

TEST(ContactProblems, AtTheApexOfTheConeNothingIsNaN) {
  ContactSolver solver;
  // It slides past without pressing; it rests without a force; all is zero.
  for (const Vector3d& b :
       {Vector3d(0, 1, 0), Vector3d(0, 0, 0), Vector3d(1e-140, 0, 1), Vector3d(0, 1e-140, 0)}) {
    for (const double mu : {0.0, 0.5, 1e6}) {
      ContactProblem problem{Eigen::Matrix3d::Identity(), b, {{3, mu}}};
      VectorXd p = VectorXd::Zero(3);
      EXPECT_TRUE(solver.solve(problem, p));
      EXPECT_EQ(p, VectorXd(VectorXd::Zero(3)));
      EXPECT_EQ(contact_residual(problem, b, p), 0);
    }
  }
  // Nothing can move it, and nothing does.
  ContactProblem fixed{Eigen::Matrix3d::Zero(), VectorXd::Zero(3), {{3, 0.5}}};
  VectorXd p = VectorXd::Zero(3);
  EXPECT_TRUE(solver.solve(fixed, p));
  EXPECT_TRUE(p.isZero(0));
  // What must be pushed and cannot be has no solution, which is said.
  fixed.b[0] = -1;
  EXPECT_FALSE(solver.solve(fixed, p));
  EXPECT_TRUE(p.allFinite());
}

// A box on four corners: twelve rows of rank six.
struct Box {
  static constexpr double m = 2;
  Box() : J(12, 6), inverse(6) {
    const double a = 0.15, b = 0.1, c = 0.05;
    const Vector3d inertia(m / 3 * (b * b + c * c), m / 3 * (a * a + c * c), m / 3 * (a * a + b * b));
    inverse << 1 / m, 1 / m, 1 / m, inertia.cwiseInverse();
    int row = 0;
    for (const Vector3d& r :
         {Vector3d(a, b, -c), Vector3d(a, -b, -c), Vector3d(-a, b, -c), Vector3d(-a, -b, -c)}) {
      for (const Vector3d& d : {Vector3d(0, 0, 1), Vector3d(1, 0, 0), Vector3d(0, 1, 0)}) {
        J.row(row).head<3>() = d;
        J.row(row++).tail<3>() = r.cross(d);
      }
    }
  }
  ContactProblem problem(const VectorXd& v, double mu) const {
    return {J * inverse.asDiagonal() * J.transpose(), J * v, std::vector<ContactBlock>(4, {3, mu}),
            (J.cwiseAbs() * v.cwiseAbs()).maxCoeff()};
  }
  MatrixXd J;
  VectorXd inverse;
};

TEST(ContactProblems, ABoxOnFourCornersIsCarried) {
  const Box box;
  for (const double mu : {0.0, 0.3, 0.9}) {
    for (const double slope : {0.0, 0.2, 0.7}) {
      VectorXd v = VectorXd::Zero(6);
      v[0] = 9.81e-3 * std::sin(slope), v[2] = -9.81e-3 * std::cos(slope);
      const ContactProblem problem = box.problem(v, mu);
      VectorXd p = VectorXd::Zero(12);
      ContactSolver solver;
      ASSERT_TRUE(solver.solve(problem, p)) << mu << " " << slope;
      const VectorXd after = v + box.inverse.asDiagonal() * box.J.transpose() * p;
      EXPECT_NEAR(p[0] + p[3] + p[6] + p[9], box.m * -v[2], 1e-15);
      // Sliding, it does not tip over: c mu < a.
      const double sliding = mu < std::tan(slope) ? v[0] + mu * v[2] : 0;
      EXPECT_NEAR(after[0], sliding, 1e-15);
      EXPECT_LT(after.tail<5>().norm(), 1e-14);
    }
  }
}

// At rest on a slope each corner carries a quarter of the friction, and normals are linear in the place: N / 4 -+ c F / (4 a).
TEST(ContactProblems, ABoxAtRestHasTheLeastForces) {
  const Box box;
  constexpr double kLength = 0.15, kHeight = 0.05;
  std::mt19937_64 random(kSeed + 6);
  for (const double slope : {0.0, 0.2, 0.5}) {
    for (int start = 0; start < 20; ++start) {
      VectorXd v = VectorXd::Zero(6);
      v[0] = 9.81e-3 * std::sin(slope), v[2] = -9.81e-3 * std::cos(slope);
      VectorXd p = start == 0 ? VectorXd(VectorXd::Zero(12)) : VectorXd(0.02 * random_matrix(random, 12, 1));
      ContactSolver solver;
      ASSERT_TRUE(solver.solve(box.problem(v, 0.9), p));
      const double normal = -box.m * v[2], friction = box.m * v[0];
      for (int corner = 0; corner < 4; ++corner) {
        const double side = corner < 2 ? 1 : -1;
        EXPECT_NEAR(p[3 * corner], normal / 4 + side * kHeight * friction / (4 * kLength), 1e-14);
        EXPECT_NEAR(p[3 * corner + 1], -friction / 4, 1e-14);
        EXPECT_NEAR(p[3 * corner + 2], 0, 1e-14);
      }
    }
  }
}

// Whatever the start: the same impulses, and none nearby with the same velocities, within the laws, is less.
TEST(ContactProblems, ImpulsesAreTheLeastFromAnyStart) {
  std::mt19937_64 random(kSeed + 7);
  int depend = 0, differ = 0, tried = 0;
  for (int i = 0; i < 1000; ++i) {
    const int n = 2 + i % 5, nv = 3 + int(random() % 4);
    const Body body(random, n, nv, i % 4 == 0);
    ContactProblem problem{body.D(), body.J * body.velocity, {}};
    for (int k = 0; k < n; ++k) problem.blocks.push_back({3, i % 9 == 0 ? 0 : uniform(random, 0, 0.8)});
    if (i % 2 == 0) problem.b = problem.D * problem.b - 5 * problem.D * VectorXd::Unit(3 * n, 0);
    VectorXd p = VectorXd::Zero(3 * n), other = random_matrix(random, 3 * n, 1);
    ContactSolver solver;
    if (!solver.solve(problem, p) || !solver.solve(problem, other)) continue;
    const VectorXd u = problem.D * p + problem.b;
    // With friction u need not be unique.
    if ((problem.D * (p - other)).norm() > 1e-9 * (1 + problem.b.norm())) continue;
    ++depend;
    differ += (p - other).norm() > 1e-7 * (1 + p.norm());
    const MatrixXd kernel = Eigen::FullPivLU<MatrixXd>(body.J.transpose()).kernel();
    for (int k = 0; k < 20; ++k) {
      const VectorXd step = kernel * random_matrix(random, int(kernel.cols()), 1);
      for (const double t : {1e-3, 1e-2, 0.1, -1e-3, -1e-2, -0.1}) {
        const VectorXd q = p + t * step;
        if (contact_residual(problem, u, q) > 1e-12) continue;
        ++tried;
        EXPECT_GE(q.norm(), p.norm() - 1e-9) << i;
      }
    }
  }
  std::cout << depend << " problems, " << differ << " differ, " << tried << " others\n";
  EXPECT_LE(differ, depend / 100);
}

// One that rocks from edge to edge: what its corners can do touches the cones only, where sweeps hardly move.
TEST(ContactProblems, ABoxThatRocksObeysTheLaws) {
  const Box box;
  std::mt19937_64 random(kSeed + 3);
  ContactSolver solver;
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    // Rotations about an edge, to one side or the other, with a little of all else.
    VectorXd v = VectorXd::Zero(6);
    const double rate = uniform(random, -1, 1);
    (i % 2 ? v[3] : v[4]) = rate;
    v[2] = (i % 2 ? 0.1 : 0.15) * rate * (i % 4 < 2 ? 1 : -1);
    v += std::pow(10, uniform(random, -12, -1)) * random_matrix(random, 6, 1);
    v *= std::pow(10, uniform(random, -8, 0));
    const ContactProblem problem = box.problem(v, i % 3 == 0 ? 0.5 : uniform(random, 0, 1.5));
    VectorXd p = VectorXd::Zero(12);
    ASSERT_TRUE(solver.solve(problem, p)) << i << ", what is left is " << solver.residual();
    worst = std::max(worst, solver.residual() / problem.b.cwiseAbs().maxCoeff());
  }
  EXPECT_LT(worst, 1e-10);
}

TEST(Impacts, NeverCreateEnergy) {
  std::mt19937_64 random(kSeed + 4);
  int reduced = 0;
  for (int i = 0; i < 3000; ++i) {
    const int n = 1 + i % 5, nv = 3 + int(random() % 9);
    const Body body(random, n, nv, i % 3 == 0);
    std::vector<ContactBlock> blocks;
    std::vector<double> restitution;
    for (int k = 0; k < n; ++k) {
      blocks.push_back({3, i % 4 == 0 ? 0 : uniform(random, 0, 1)});
      restitution.push_back(uniform(random, 0, 1));
    }
    ContactSolver solver;
    const VectorXd u = body.J * body.velocity;
    const ImpactImpulses impact = solve_impact(solver, body.D(), blocks, restitution, u);
    ASSERT_TRUE(impact.solved) << i;
    ASSERT_TRUE(impact.p.allFinite());
    const VectorXd after = body.velocity + body.W * body.J.transpose() * impact.p;
    const MatrixXd M = body.W.inverse();
    const double before = body.velocity.dot(M * body.velocity) / 2, then = after.dot(M * after) / 2;
    EXPECT_LE(then, before * (1 + 1e-9)) << i;
    EXPECT_NEAR(then - before, impact.energy, 1e-8 * (1 + before)) << i;
    EXPECT_GE((body.J * after)(Eigen::seq(0, Eigen::last, 3)).minCoeff(), -1e-9) << i;
    reduced += impact.restitution < 1;
  }
  std::cout << "restitution reduced in " << reduced << " of 3000\n";
}

TEST(Impacts, AreNewtonsWhereThereIsNoFriction) {
  std::mt19937_64 random(kSeed + 5);
  for (int i = 0; i < 1000; ++i) {
    const VectorXd J = random_matrix(random, 6, 1);
    const VectorXd v = random_matrix(random, 6, 1);
    const double e = uniform(random, 0, 1), u = J.dot(v);
    ContactSolver solver;
    const ImpactImpulses impact =
        solve_impact(solver, MatrixXd::Constant(1, 1, J.dot(J)), {{1, 0}}, {e}, VectorXd::Constant(1, u));
    EXPECT_NEAR(impact.u[0], u < 0 ? -e * u : u, 1e-14);
    EXPECT_EQ(impact.restitution, 1);
  }
}

}  // namespace
}  // namespace dyntape::dynamics::contact_problem_test
