// SPDX-License-Identifier: BSD-3-Clause
//
// Constraints that depend on each other, closed loops with a known answer, and what holds over time.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include "dynamics/random_robots.h"
#include "dynamics/robot_files.h"

namespace dyntape::dynamics::redundant_constraints_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Constraints = std::vector<Constraint<double>>;

double largest(const MatrixXd& x) { return x.size() == 0 ? 0 : x.cwiseAbs().maxCoeff(); }

// A rigid box of 2 kg on four feet at (+-0.3, +-0.2, -0.1), the feet on the ground.
struct Box {
  Box() {
    model.name = "box";
    Joint<double> joint;
    joint.type = JointType::kFreeFlyer;
    model.add_joint(-1, joint, {}, {2, {0, 0, 0}, Eigen::Vector3d(0.03, 0.05, 0.07).asDiagonal()});
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector3d foot(k < 2 ? 0.3 : -0.3, k % 2 ? 0.2 : -0.2, -0.1);
      feet.push_back({3, 0, {Eigen::Matrix3d::Identity(), foot}, -1, {Eigen::Matrix3d::Identity(), foot}});
    }
  }

  Model<double> model;
  Constraints feet;
};

// H50: 12 rows of rank 6.  The box rests and each foot carries a quarter.
TEST(RedundantConstraints, FourCoplanarFeetShareTheWeight) {
  const Box box;
  Data<double> data(box.model);
  ConstraintData<double> c(box.model, box.feet);
  const VectorXd q = neutral(box.model), zero = VectorXd::Zero(6);
  EXPECT_LE(largest(constrained_dynamics(box.model, data, c, q, zero, zero)), 1e-12);
  EXPECT_EQ(c.delassus.dependent().sum(), 6);
  for (int k = 0; k < 4; ++k) {
    EXPECT_LE((c.lambda.segment<3>(3 * k) - Eigen::Vector3d(0, 0, 2 * 9.81 / 4)).norm(), 1e-12);
  }
}

// And pushed: the force of least norm is that of the pseudo-inverse; without the box's rank nothing moves.
TEST(RedundantConstraints, ForceIsOfLeastNorm) {
  const Box box;
  Data<double> data(box.model);
  ConstraintData<double> c(box.model, box.feet);
  Random random(1);
  const VectorXd q = neutral(box.model), zero = VectorXd::Zero(6), tau = random.vector(6, 20);
  EXPECT_LE(largest(constrained_dynamics(box.model, data, c, q, zero, tau)), 1e-11);
  const VectorXd expected = c.J.transpose().completeOrthogonalDecomposition().solve(
      nonlinear_effects(box.model, data, q, zero) - tau);
  EXPECT_LE(relative_error(c.lambda, expected), 1e-12);
}

// H53: derivatives stay of the size of the numbers around them.
TEST(RedundantConstraints, DerivativesOfFourFeet) {
  const Box box;
  Data<double> data(box.model);
  ConstraintData<double> c(box.model, box.feet);
  Random random(2);
  const VectorXd q = integrate(box.model, neutral(box.model), random.vector(6, 1e-3));
  const VectorXd v = random.vector(6, 1e-3), tau = random.vector(6, 20);
  constrained_dynamics_derivatives(box.model, data, c, q, v, tau);
  EXPECT_LE(largest(c.lambda_dq), 1e5);
  EXPECT_LE(largest(c.J * c.ddq_dtau), 1e-10);
  const double h = 1e-6;
  for (int k = 0; k < 6; ++k) {
    const VectorXd d = VectorXd::Unit(6, k) * h;
    const auto slope = [&](const VectorXd& q_up, const VectorXd& q_down, const VectorXd& v_up,
                           const VectorXd& v_down) {
      const VectorXd up = constrained_dynamics(box.model, data, c, q_up, v_up, tau);
      return VectorXd((up - constrained_dynamics(box.model, data, c, q_down, v_down, tau)) / (2 * h));
    };
    const VectorXd dq = slope(integrate(box.model, q, d), integrate(box.model, q, VectorXd(-d)), v, v);
    EXPECT_LE(largest(dq - c.ddq_dq.col(k)), 1e-7 * (1 + largest(c.ddq_dq))) << k;
    EXPECT_LE(largest(slope(q, q, v + d, v - d) - c.ddq_dv.col(k)), 1e-7 * (1 + largest(c.ddq_dv))) << k;
  }
}

// Feet of a quadruped on its legs are independent; written twice, they change nothing and share the force.
TEST(RedundantConstraints, WrittenTwiceChangesNothing) {
  const Model<double> model = load_urdf(robot_file("solo12"), {.base = Base::kFloating});
  Data<double> data(model);
  Random random(3);
  const State s = random_state(model, random);
  Constraints feet;
  for (const char* name : {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"}) {
    feet.push_back(point_constraint(model, model.frame_index(name), random.vector3()));
  }
  ConstraintData<double> once(model, feet);
  constrained_dynamics_derivatives(model, data, once, s.q, s.v, s.tau);
  EXPECT_EQ(once.delassus.dependent().sum(), 0);
  feet.insert(feet.end(), feet.begin(), feet.end());
  ConstraintData<double> twice(model, feet);
  constrained_dynamics_derivatives(model, data, twice, s.q, s.v, s.tau);
  EXPECT_EQ(twice.delassus.dependent().sum(), 12);
  EXPECT_LE(relative_error(twice.ddq, once.ddq), 1e-12);
  EXPECT_LE(relative_error(twice.lambda.head(12), once.lambda / 2), 1e-11);
  EXPECT_LE(relative_error(twice.lambda.tail(12), once.lambda / 2), 1e-11);
  EXPECT_LE(relative_error(twice.ddq_dq, once.ddq_dq), 1e-11);
  EXPECT_LE(relative_error(twice.ddq_dv, once.ddq_dv), 1e-11);
  EXPECT_LE(relative_error(twice.ddq_dtau, once.ddq_dtau), 1e-11);
  EXPECT_LE(relative_error(twice.lambda_dq.topRows(12), once.lambda_dq / 2), 1e-11);
  impulse_dynamics_derivatives(model, data, once, s.q, s.v, 0.5);
  impulse_dynamics_derivatives(model, data, twice, s.q, s.v, 0.5);
  EXPECT_LE(relative_error(twice.v_plus, once.v_plus), 1e-12);
  EXPECT_LE(relative_error(twice.v_plus_dq, once.v_plus_dq), 1e-11);
}

// One foot sent to two places: the least-squares acceleration, and a residual that says so.
TEST(RedundantConstraints, ContradictionsShowInTheResidual) {
  Box box;
  Data<double> data(box.model);
  Constraints pulled = {box.feet[0], box.feet[0]}, middle = {box.feet[0]};
  pulled[0].X_2.p[0] += 0.01;
  pulled[1].X_2.p[0] -= 0.03;
  middle[0].X_2.p[0] -= 0.01;
  ConstraintData<double> c(box.model, pulled), expected(box.model, middle);
  const VectorXd q = neutral(box.model), zero = VectorXd::Zero(6);
  constrained_dynamics(box.model, data, c, q, zero, zero);
  constrained_dynamics(box.model, data, expected, q, zero, zero);
  EXPECT_LE(largest(c.ddq - expected.ddq), 1e-12);
  EXPECT_LE(largest(expected.residual), 1e-12);
  EXPECT_NEAR(c.residual[0], -2, 1e-12);
  EXPECT_NEAR(c.residual[3], 2, 1e-12);
}

// A parallelogram: two cranks of length l under a coupler, turning about x; the loop closed at a point.  In
// its plane it is a pendulum; the row across the plane is zero.
struct Parallelogram {
  Parallelogram() {
    model.name = "parallelogram";
    Joint<double> joint;
    joint.axis = Eigen::Vector3d::UnitX();
    const Inertia<double> crank{
        kCrank, {0, 0, -kLength / 2}, Eigen::Vector3d(0.01, 0.01, 0.002).asDiagonal()};
    const Inertia<double> coupler{
        kCoupler, {0, kBase / 2, 0}, Eigen::Vector3d(0.02, 0.01, 0.02).asDiagonal()};
    const auto at = [](double y, double z) {
      return Placement<double>{Eigen::Matrix3d::Identity(), {0, y, z}};
    };
    model.add_joint(-1, joint, {}, crank);
    model.add_joint(-1, joint, at(kBase, 0), crank);
    model.add_joint(0, joint, at(0, -kLength), coupler);
    loop = {{3, 2, at(kBase, 0), 1, at(0, -kLength), 0, 0}};
  }

  static constexpr double kLength = 0.7, kBase = 0.5, kCrank = 1.5, kCoupler = 2.5;
  Model<double> model;
  Constraints loop;
};

TEST(ClosedLoops, ParallelogramIsAPendulum) {
  using P = Parallelogram;
  const P linkage;
  Data<double> data(linkage.model);
  ConstraintData<double> c(linkage.model, linkage.loop);
  const double inertia =
      2 * (0.01 + P::kCrank * P::kLength * P::kLength / 4) + P::kCoupler * P::kLength * P::kLength;
  const double weight = 9.81 * P::kLength * (P::kCrank + P::kCoupler);
  for (double angle : {-2.0, -1.0, 0.3, 1.4}) {
    const Eigen::Vector3d q(angle, angle, -angle), v(0.8, 0.8, -0.8), zero(0, 0, 0);
    const VectorXd a = constrained_dynamics(linkage.model, data, c, q, v, zero);
    const double expected = -weight * std::sin(angle) / inertia;
    EXPECT_LE((a - Eigen::Vector3d(1, 1, -1) * expected).norm(), 1e-12 * std::abs(expected)) << angle;
    EXPECT_EQ(c.delassus.dependent().sum(), 1);
  }
}

// H58: flat, the linkage could also fold, and the loop loses a rank.
TEST(ClosedLoops, FlatParallelogram) {
  const Parallelogram linkage;
  Data<double> data(linkage.model);
  ConstraintData<double> c(linkage.model, linkage.loop);
  const double flat = std::acos(-1.0) / 2;
  const Eigen::Vector3d q(flat, flat, -flat), zero(0, 0, 0);
  const VectorXd a = constrained_dynamics(linkage.model, data, c, q, zero, zero);
  EXPECT_EQ(c.delassus.dependent().sum(), 2);
  EXPECT_LE(largest(c.residual), 1e-12);
  EXPECT_LE(largest(c.lambda), 1e2);
  EXPECT_LE(largest(rnea(linkage.model, data, q, zero, a) - c.J.transpose() * c.lambda), 1e-11);
}

// A body that floats but is welded to another by a loop moves as one that was built so.
TEST(ClosedLoops, WeldedBodyIsPartOfTheOther) {
  for (unsigned long seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    Model<double> merged = random_tree(random, {6, seed % 2 ? Base::kFloating : Base::kFixed});
    const int host = 5;
    const Placement<double> X_host = random_placement(random);
    const Inertia<double> load = random_inertia(random);
    Model<double> loose = merged;
    merged.inertias[host] = merged.inertias[host] + act(X_host, load);
    Joint<double> floating;
    floating.type = JointType::kFreeFlyer;
    const int body = loose.add_joint(-1, floating, {}, load);
    const State s = random_state(merged, random);
    Data<double> data(merged), data_loose(loose);
    forward_kinematics(merged, data, s.q, s.v);
    const Placement<double> X = data.X_WB[host] * X_host;
    const Motion<double> V = act_inverse(X_host, data.v[host]);
    VectorXd q(loose.nq), v(loose.nv), tau(loose.nv);
    q << s.q, X.p, quaternion(X.R);
    v << s.v, V.vector();
    tau << s.tau, VectorXd::Zero(6);
    for (bool reversed : {false, true}) {
      Constraint<double> weld{6, body, {}, host, X_host};
      if (reversed) weld = {6, host, X_host, body, {}};
      ConstraintData<double> c(loose, {weld});
      const VectorXd a = constrained_dynamics(loose, data_loose, c, q, v, tau);
      EXPECT_LE(relative_error(a.head(merged.nv), aba(merged, data, s.q, s.v, s.tau)), 1e-11) << seed;
      constrained_dynamics_derivatives(loose, data_loose, c, q, v, tau);
      fd_derivatives(merged, data, s.q, s.v, s.tau);
      EXPECT_LE(relative_error(c.ddq_dtau.topLeftCorner(merged.nv, merged.nv), data.Minv), 1e-11);
    }
  }
}

// Five seconds of a swinging linkage without stabilisation: energy and closure stay; with it, an error decays.
TEST(ClosedLoops, OverTime) {
  const Parallelogram linkage;
  const Model<double>& model = linkage.model;
  Data<double> data(model);
  const auto run = [&](ConstraintData<double>& c, Eigen::Vector3d& q, Eigen::Vector3d& v, int steps) {
    const double h = 1e-3;
    const VectorXd tau = VectorXd::Zero(3);
    const auto f = [&](const Eigen::Vector3d& x, const Eigen::Vector3d& w) {
      return Eigen::Vector3d(constrained_dynamics(model, data, c, x, w, tau));
    };
    for (int k = 0; k < steps; ++k) {
      const Eigen::Vector3d a1 = f(q, v), v2 = v + h / 2 * a1, a2 = f(q + h / 2 * v, v2);
      const Eigen::Vector3d v3 = v + h / 2 * a2, a3 = f(q + h / 2 * v2, v3), v4 = v + h * a3;
      const Eigen::Vector3d a4 = f(q + h * v3, v4);
      q += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
      v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
  };
  const auto energy = [&](const Eigen::Vector3d& q, const Eigen::Vector3d& v) {
    return kinetic_energy(model, data, q, v) + potential_energy(model, data, q);
  };
  ConstraintData<double> free(model, linkage.loop);
  Eigen::Vector3d q(0.9, 0.9, -0.9), v(0, 0, 0);
  const double start = energy(q, v);
  run(free, q, v, 3000);
  constraint_kinematics<double>(model, data, free, q, v);
  EXPECT_NEAR(energy(q, v), start, 1e-8);
  EXPECT_LE(largest(free.error), 1e-9);

  Constraints damped = linkage.loop;
  damped[0].kp = 100;
  damped[0].kd = 20;
  ConstraintData<double> c(model, damped);
  q = {0.9, 0.91, -0.9};
  v = {0, 0, 0};
  constraint_kinematics<double>(model, data, c, q, v);
  const double before = c.error.norm();
  run(c, q, v, 1000);
  constraint_kinematics<double>(model, data, c, q, v);
  // (1 + 10 t) exp(-10 t) at 1 s.
  EXPECT_NEAR(c.error.norm() / before, 11 * std::exp(-10.0), 2e-6);
}

}  // namespace
}  // namespace dyntape::dynamics::redundant_constraints_test
