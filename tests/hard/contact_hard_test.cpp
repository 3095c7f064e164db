// SPDX-License-Identifier: BSD-3-Clause
//
// Rigid contacts and loops whose rows depend on each other, impacts between very unlike masses, cones at their apex.
#include <gtest/gtest.h>

#include <cmath>

#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/contact/contact_solver.h>
#include <dyntape/dynamics/contact/impact.h>
#include <dyntape/dynamics/model/configuration.h>

#include "dynamics/random_robots.h"
#include "every_route.h"

namespace dyntape::contact_hard_test {
namespace {

using dynamics::Constraint;
using dynamics::ContactProblem;
using dynamics::Model;
using dynamics::Random;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::EveryRoute;
using ::testing::Values;

// --- Feet ----------------------------------------------------------------------------------------------------

struct Feet {
  const char* name;
  std::vector<Vector3d> places;  // in the box (m)
  int rank;
};

// A box of 2 kg with feet that are held; lengths times `unit`.
struct Box {
  Box(const std::vector<Vector3d>& places, double unit = 1) {
    model.name = "box";
    dynamics::Joint<double> joint;
    joint.type = dynamics::JointType::kFreeFlyer;
    model.add_joint(-1, joint, {}, {2, {0, 0, 0}, unit * unit * Vector3d(0.03, 0.05, 0.07).asDiagonal()});
    model.gravity *= unit;
    for (const Vector3d& place : places) {
      const dynamics::Placement<double> at{Eigen::Matrix3d::Identity(), unit * place};
      feet.push_back({3, 0, at, -1, at});
    }
  }
  // Acceleration, then forces, of (v, tau) at rest in place, in T.
  template <class T>
  testing::VectorOf<T> operator()(const testing::VectorOf<T>& x) const {
    const Model<T> robot = model.cast<T>();
    dynamics::Data<T> data(robot);
    std::vector<Constraint<T>> held;
    for (const Constraint<double>& foot : feet) held.push_back(foot.cast<T>());
    dynamics::ConstraintData<T> c(robot, held);
    dynamics::constrained_dynamics<T>(robot, data, c, dynamics::neutral<T>(robot), x.head(6), x.tail(6));
    testing::VectorOf<T> y(6 + c.lambda.size());
    y << c.ddq, c.lambda;
    return y;
  }
  MatrixXd jacobian() const {
    dynamics::Data<double> data(model);
    dynamics::ConstraintData<double> c(model, feet);
    const VectorXd zero = VectorXd::Zero(6);
    dynamics::constrained_dynamics<double>(model, data, c, dynamics::neutral<double>(model), zero, zero);
    return c.J;
  }

  Model<double> model;
  std::vector<Constraint<double>> feet;
};

class Redundant : public ::testing::TestWithParam<Feet> {};

// H50, H51 | naive: four coplanar feet make J M^-1 J^T singular: Cholesky refuses, LU answers with forces of any
// size, a proximal term biases them | holds: the acceleration is exact to 1e-12 and the forces are those of least
// norm, by the pseudo-inverse, for three feet and for eight, on a plane, on a line, at one point, written twice |
// routes: template in double, all of C and the interpreter
// H53 | naive: derivatives through the solve of dependent rows have entries of 1e16 | holds: derivatives of accelerations
// and forces by velocity and torque stay of the size of numbers around them, the same forward and reverse | routes:
// the same
TEST_P(Redundant, AccelerationsAreExactAndForcesOfLeastNorm) {
  const Box box(GetParam().places);
  Random random(21);
  const VectorXd tau = random.vector(6, 20);
  VectorXd x(12);
  x << VectorXd::Zero(6), tau;
  const Function f = record("feet", 12, [&](const VectorXad& y) { return VectorXad(box(y)); });
  const EveryRoute routes(f, Order::kFirst, {.lanes = false, .near = 1e-9});
  const EveryRoute::Parts got = routes.parts({x.begin(), x.end()});
  const MatrixXd J = box.jacobian();
  ASSERT_EQ(J.fullPivLu().rank(), GetParam().rank);
  // M a = tau + weight + J^T lambda, J a = 0.
  VectorXd M(6), free(6);
  M << 2, 2, 2, 0.03, 0.05, 0.07;
  free = tau;
  free[2] -= 2 * 9.81;
  const MatrixXd W = M.cwiseInverse().asDiagonal();
  const VectorXd lambda = -(J * W * J.transpose()).completeOrthogonalDecomposition().solve(J * W * free);
  const VectorXd a = W * (free + J.transpose() * lambda);
  const VectorXd direct = box(x);
  for (const VectorXd& y : {VectorXd(Eigen::Map<const VectorXd>(got.y.data(), long(got.y.size()))), direct}) {
    EXPECT_LE((y.head(6) - a).cwiseAbs().maxCoeff(), 1e-12 * free.norm() / 0.03);
    EXPECT_LE((y.tail(y.size() - 6) - lambda).cwiseAbs().maxCoeff(), 1e-10 * lambda.norm());
    EXPECT_LE((J * y.head(6)).cwiseAbs().maxCoeff(), 1e-12 * free.norm() / 0.03);
  }
  for (double slope : got.jacobian) EXPECT_LE(std::abs(slope), 1e4);
}

const Vector3d kCorners[] = {{0.3, 0.2, -0.1}, {0.3, -0.2, -0.1}, {-0.3, 0.2, -0.1}, {-0.3, -0.2, -0.1}};

std::vector<Vector3d> around(int n) {
  std::vector<Vector3d> feet;
  for (int k = 0; k < n; ++k)
    feet.push_back({0.3 * std::cos(6.28 * k / n), 0.3 * std::sin(6.28 * k / n), -0.1});
  return feet;
}

INSTANTIATE_TEST_SUITE_P(
    Of, Redundant,
    ::testing::Values(Feet{"one", {kCorners[0]}, 3}, Feet{"two", {kCorners[0], kCorners[3]}, 5},
                      Feet{"three", {kCorners[0], kCorners[1], kCorners[2]}, 6},
                      Feet{"four_coplanar", {std::begin(kCorners), std::end(kCorners)}, 6},
                      Feet{"eight_coplanar", around(8), 6},
                      Feet{"three_on_a_line", {{-0.3, 0, -0.1}, {0, 0, -0.1}, {0.3, 0, -0.1}}, 5},
                      Feet{"two_at_one_point", {kCorners[1], kCorners[1]}, 3},
                      Feet{"three_written_twice",
                           {kCorners[0], kCorners[1], kCorners[2], kCorners[0], kCorners[1], kCorners[2]},
                           6}),
    [](const auto& info) { return info.param.name; });

// X06 | naive: "rank by 1e-10" finds another rank in millimetres | holds: accelerations and forces of four feet in
// other units of length (powers of two) have the same bits | routes: template in double, tape
TEST(RedundantUnits, LengthsInAnyUnitAreTheSame) {
  const auto bits = [](double u) {
    const Box box({std::begin(kCorners), std::end(kCorners)}, u);
    const Function f = record("feet", 12, [&](const VectorXad& y) { return VectorXad(box(y)); });
    Values x = {0, 0, 0, 0, 0, 0, 3 * u, -7 * u, 2 * u, u * u, -2 * u * u, 3 * u * u};
    Values y = evaluate(f, x);
    const VectorXd direct = box(VectorXd(Eigen::Map<const VectorXd>(x.data(), 12)));
    y.insert(y.end(), direct.begin(), direct.end());
    for (std::size_t k = 0; k < y.size(); ++k) {
      const std::size_t entry = k % std::size_t(direct.size());
      if (entry < 3 || entry >= 6) y[k] /= u;
    }
    return y;
  };
  const Values metres = bits(1);
  for (const double u : {0x1p10, 0x1p-10, 0x1p30}) EXPECT_TRUE(testing::same_bits(bits(u), metres)) << u;
}

// --- Problems of contact -------------------------------------------------------------------------------------

struct Scale {
  const char* name;
  double response, velocity;  // factors of D and b
};

class ContactScale : public ::testing::TestWithParam<Scale> {};

// X06, X08 | naive: a solver that ends at 1e-8 ends at once where impulses are of grains and never where they are of
// ships | holds: contacts of robots 1e12 times lighter or heavier, 1e9 times slower or faster, obey their laws to the
// rounding of their own velocities | routes: solver in double
TEST_P(ContactScale, LawsHoldToRounding) {
  for (unsigned long seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const int contacts = 1 + random.below(4), n = 3 * contacts;
    const MatrixXd J = MatrixXd::NullaryExpr(n, n + 2, [&] { return random.uniform(); });
    ContactProblem problem{
        GetParam().response * J * J.transpose(), GetParam().velocity * random.vector(n), {}};
    for (int k = 0; k < contacts; ++k) problem.blocks.push_back({3, random.uniform(0.1, 1)});
    dynamics::ContactSolver solver;
    VectorXd p = VectorXd::Zero(n);
    ASSERT_TRUE(solver.solve(problem, p)) << "seed " << seed << " residual " << solver.residual();
    const VectorXd u = problem.D * p + problem.b;
    EXPECT_LE(dynamics::contact_residual(problem, u, p), 1e-9 * GetParam().velocity) << "seed " << seed;
    EXPECT_TRUE(p.allFinite());
  }
}

INSTANTIATE_TEST_SUITE_P(Of, ContactScale,
                         ::testing::Values(Scale{"grains", 1e12, 1}, Scale{"ships", 1e-12, 1},
                                           Scale{"slow", 1, 1e-9}, Scale{"fast", 1, 1e9},
                                           Scale{"slow_grains", 1e12, 1e-9}),
                         [](const auto& info) { return info.param.name; });

class MassRatio : public ::testing::TestWithParam<double> {};

// X04, X08 | naive: a ball between two walls of very unlike masses takes sweeps without end, or is thrown out faster
// than it came | holds: three bodies in a row in contact, masses in the given ratio: the impact is that of Newton's
// law at each contact, and energy is never gained | routes: solver in double
TEST_P(MassRatio, ImpactsInARowObeyNewton) {
  const double ratio = GetParam();
  const Vector3d masses(1, ratio, 1);
  MatrixXd J(2, 3);  // gaps between neighbours
  J << -1, 1, 0, 0, -1, 1;
  const MatrixXd D = J * masses.cwiseInverse().asDiagonal() * J.transpose();
  for (const double e : {0.0, 0.5, 1.0}) {
    const Vector3d v(1, 0, -0.5);
    dynamics::ContactSolver solver;
    const VectorXd u = J * v;
    const dynamics::ImpactImpulses impact =
        dynamics::solve_impact(solver, D, {{1, 0}, {1, 0}}, {e, e}, u, v.norm());
    ASSERT_TRUE(impact.solved) << e;
    const Vector3d after = v + masses.cwiseInverse().asDiagonal() * (J.transpose() * impact.p);
    const double before = 0.5 * masses.dot(v.cwiseAbs2()), kept = 0.5 * masses.dot(after.cwiseAbs2());
    EXPECT_LE(kept, before * (1 + 1e-13) + 1e-15 * D.maxCoeff() * impact.p.squaredNorm()) << e;
    // Velocities are differences of impulses over the lightest mass.
    const double rounding = 1e-15 * (D.cwiseAbs().maxCoeff() * impact.p.norm() + v.norm());
    EXPECT_NEAR(kept - before, impact.energy, rounding * impact.p.norm() + 1e-13 * before) << e;
    for (int k = 0; k < 2; ++k) {
      EXPECT_GE(impact.p[k], 0);
      EXPECT_GE(impact.u[k] + e * u[k], -8 * rounding) << e;
      EXPECT_LE(impact.p[k] * (impact.u[k] + e * u[k]), 8 * rounding * impact.p.norm()) << e;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, MassRatio, ::testing::Values(1e-9, 1e-3, 1.0, 1e3, 1e9),
                         [](const auto& info) { return "number_" + std::to_string(info.index); });

// H54 | naive: the projection on a friction cone divides by |x_t| = 0 | holds: at the apex, on the axis inside and
// outside, at a mu of 0 and of 1e9, from 1e-150 to 1e150, the projection is finite, in the cone, and no farther than
// the apex | routes: double
TEST(Cones, ProjectionsAreFiniteEverywhere) {
  const Vector3d points[] = {{0, 0, 0},
                             {1, 0, 0},
                             {-1, 0, 0},
                             {0, 1, 0},
                             {-1, 1e-150, 0},
                             {1e-150, 3e-150, 0},
                             {1e150, -1e150, 2e149},
                             {-0.0, -0.0, 0.0}};
  for (const Vector3d& x : points) {
    for (const double mu : {0.0, 0.5, 1.0, 1e9}) {
      const Vector3d p = dynamics::project_on_cone(x, mu);
      ASSERT_TRUE(p.allFinite()) << x.transpose() << ", mu " << mu;
      EXPECT_LE(p.tail<2>().stableNorm(), mu * p[0] * (1 + 1e-15)) << x.transpose() << ", mu " << mu;
      EXPECT_LE((p - x).stableNorm(), x.stableNorm() * (1 + 1e-15)) << x.transpose() << ", mu " << mu;
    }
  }
}

}  // namespace
}  // namespace dyntape::contact_hard_test
