// SPDX-License-Identifier: BSD-3-Clause
//
// Rotations on the tape: first and second derivatives where formulas with sqrt and acos break, without a branch.
#include <gtest/gtest.h>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/model/joints.h>

#include <algorithm>
#include <cmath>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::recorded_lie_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<double> list(const VectorXd& x) { return {x.begin(), x.end()}; }

RecordOptions without_branches() {
  RecordOptions options;
  options.branches = RecordOptions::Branches::kError;
  return options;
}

MatrixXd jacobian(const Function& f, const VectorXd& x) {
  const Derivatives d = derive(f, Order::kFirst);
  const std::vector<double> all = evaluate(d.function, list(x));
  MatrixXd j = MatrixXd::Zero(static_cast<long>(f.n_y()), static_cast<long>(f.n_x()));
  for (std::size_t k = 0; k < d.jacobian.nnz(); ++k) j(d.jacobian.row[k], d.jacobian.col[k]) = all[d.n_y + k];
  return j;
}

MatrixXd hessian(const Function& f, const VectorXd& x, long output) {
  const SparseFunction h = sparse_hessian(f);
  const std::vector<double> entries =
      evaluate(h.function, list(x), {}, list(VectorXd::Unit(static_cast<long>(f.n_y()), output)));
  MatrixXd full = MatrixXd::Zero(x.size(), x.size());
  for (std::size_t k = 0; k < entries.size(); ++k) {
    full(h.pattern.row[k], h.pattern.col[k]) = full(h.pattern.col[k], h.pattern.row[k]) = entries[k];
  }
  return full;
}

// v -> q0 (+) v -> back to v: the identity, with Jacobian 1 and Hessian 0 at every v.
Function there_and_back(const VectorXd& q0) {
  return record(
      "there and back", 6,
      [&](const VectorXad& v) {
        Joint<AD> joint;
        joint.type = JointType::kFreeFlyer;
        const VectorXad q = q0.cast<AD>();
        VectorXad next(7), back(6);
        integrate<AD>(joint, q, v, next);
        difference<AD>(joint, q, next, back);
        return back;
      },
      without_branches());
}

TEST(RecordedLie, ThereAndBackIsTheIdentityToSecondOrder) {
  Random random(1);
  VectorXd q0(7);
  q0 << random.vector3(), random.vector(4).normalized();
  const Function f = there_and_back(q0);
  for (const double angle :
       {0.0, 1e-300, 1e-160, 1e-20, 1e-12, 1e-8, 1e-4, 1e-2, 0.5, 1.0, 1.9, 2.1, 3.0, 3.141}) {
    VectorXd v(6);
    v << random.vector3(), random.vector3().normalized() * angle;
    const std::vector<double> y = evaluate(f, list(v));
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(y[k], v[k], 4e-15) << "angle " << angle;
    EXPECT_LE((jacobian(f, v) - MatrixXd::Identity(6, 6)).norm(), 3e-14) << "angle " << angle;
    for (int k = 0; k < 6; ++k) {
      EXPECT_LE(hessian(f, v, k).norm(), 3e-13) << "angle " << angle << " output " << k;
    }
  }
}

// q0 (-) q0 and its derivatives: where every rest-to-rest problem starts.
TEST(RecordedLie, DifferenceOfEqualConfigurations) {
  Random random(2);
  VectorXd q0(7);
  q0 << random.vector3(), random.vector(4).normalized();
  const Function f = there_and_back(q0);
  const VectorXd zero = VectorXd::Zero(6);
  for (const double y : evaluate(f, list(zero))) EXPECT_NEAR(y, 0, 1e-16);
  EXPECT_LE((jacobian(f, zero) - MatrixXd::Identity(6, 6)).norm(), 2e-15);
  for (int k = 0; k < 6; ++k) EXPECT_LE(hessian(f, zero, k).norm(), 2e-15);
}

// exp w = (w/2, 1 - |w|^2/8) + third order.
TEST(RecordedLie, ExponentialAtZeroIsItsPowerSeries) {
  const Function f = record(
      "exp", 3, [](const VectorXad& w) { return VectorXad(exp_quaternion(Vector3<AD>(w))); },
      without_branches());
  const VectorXd zero = VectorXd::Zero(3);
  MatrixXd expected = MatrixXd::Zero(4, 3);
  expected.topRows<3>().diagonal().setConstant(0.5);
  EXPECT_EQ(jacobian(f, zero), expected);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(hessian(f, zero, k), MatrixXd::Zero(3, 3));
  EXPECT_EQ(hessian(f, zero, 3), MatrixXd(MatrixXd::Identity(3, 3) * -0.25));
}

// Recorded on one sheet, evaluated on both: rotation, log and log of the matrix.
TEST(RecordedLie, BothQuaternionsGiveTheSameBits) {
  const Function f = record(
      "sheets", 4,
      [](const VectorXad& x) {
        const Vector4<AD> q = x;
        VectorXad y(15);
        const Matrix3<AD> R = rotation(q);
        y << log(q), log(R), R.col(0), R.col(1), R.col(2);
        return y;
      },
      without_branches());
  Random random(3);
  for (int n = 0; n < 50; ++n) {
    VectorXd q = random.vector(4);
    if (n % 5 == 0) q[3] = 0;  // half a turn
    EXPECT_EQ(evaluate(f, list(q)), evaluate(f, list(-q)));
    const std::vector<double> y = evaluate(f, list(q));
    if (n % 5 == 0) continue;  // the matrix does not know from which side it was reached
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(y[k], y[3 + k], 1e-14);
  }
}

// The Jacobians of lie.h are the derivatives of its exponentials: d/dd exp(w)^-1 exp(w + d) at d = 0.
TEST(RecordedLie, JacobiansAreTheTapesOwn) {
  Random random(4);
  for (const double angle : {0.0, 1e-9, 1e-3, 1.0, 2.5, 3.1}) {
    const Motion<double> xi{random.vector3(), random.vector3().normalized() * angle};
    const Function f = record(
        "screw", 6,
        [&](const VectorXad& d) {
          const Motion<AD> from{xi.linear.cast<AD>(), xi.angular.cast<AD>()};
          const Motion<AD> to{from.linear + d.head<3>(), from.angular + d.tail<3>()};
          return VectorXad(log(inverse(exp(from)) * exp(to)).vector());
        },
        without_branches());
    EXPECT_LE((jacobian(f, VectorXd::Zero(6)) - right_jacobian(xi)).norm(), 2e-14) << "angle " << angle;
  }
}

}  // namespace
}  // namespace dyntape::dynamics::recorded_lie_test
