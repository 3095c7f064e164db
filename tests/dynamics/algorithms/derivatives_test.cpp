// SPDX-License-Identifier: BSD-3-Clause
//
// Analytic derivatives in double against central differences of the value in 113 bits: a step of 1e-11 leaves
// an error near 1e-21, so that what is seen is the rounding of the double result.
#include <gtest/gtest.h>

#include <algorithm>

#include "dynamics/exact_robot.h"

namespace dyntape::dynamics::derivatives_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

bool on_one_path(const Model<double>& model, int i, int j) {
  for (int p = i; p >= 0; p = model.parent[p]) {
    if (p == j) return true;
  }
  for (int p = j; p >= 0; p = model.parent[p]) {
    if (p == i) return true;
  }
  return false;
}

class Derivatives : public ExactRobot {
 protected:
  Derivatives() : ExactRobot(7, 7) {}
};

TEST_P(Derivatives, OfInverseDynamics) {
  id_derivatives(model, *data, s.q, s.v, s.a);
  const MatrixXd dq =
      tangent_difference(exact, q, [&](const VectorXq& x) { return rnea(exact, *data128, x, v, a); });
  const MatrixXd dv = vector_difference(v, [&](const VectorXq& x) { return rnea(exact, *data128, q, x, a); });
  EXPECT_LE(relative_error(data->dtau_dq, dq), 1e-13);
  // A single joint has dtau/dv = 0: its error is held against the torque then.
  const double scale = std::max(dv.cwiseAbs().maxCoeff(), data->tau.cwiseAbs().maxCoeff());
  EXPECT_LE((data->dtau_dv - dv).cwiseAbs().maxCoeff(), 1e-13 * scale);
  const MatrixXd M = data->M;
  const VectorXd torque = data->tau;
  EXPECT_LE(relative_error(crba(model, *data, s.q), M), 1e-14);
  EXPECT_LE(relative_error(rnea(model, *data, s.q, s.v, s.a), torque), 1e-13);
}

TEST_P(Derivatives, OfForwardDynamics) {
  fd_derivatives(model, *data, s.q, s.v, s.tau);
  const MatrixXd dq =
      tangent_difference(exact, q, [&](const VectorXq& x) { return aba(exact, *data128, x, v, tau); });
  const MatrixXd dv =
      vector_difference(v, [&](const VectorXq& x) { return aba(exact, *data128, q, x, tau); });
  const MatrixXd dtau =
      vector_difference(tau, [&](const VectorXq& x) { return aba(exact, *data128, q, v, x); });
  EXPECT_LE(relative_error(data->ddq_dq, dq), 1e-13);
  EXPECT_LE(relative_error(data->ddq_dv, dv), 1e-13);
  EXPECT_LE(relative_error(data->Minv, dtau), 1e-13);
}

// Constant in the body frame, external forces turn with the body.
TEST_P(Derivatives, WithExternalForcesAndWithoutGravity) {
  std::vector<Force<double>> external(model.njoints());
  std::vector<Force<Float128>> external128;
  for (auto& f : external) {
    f = {random.vector3(5), random.vector3(5)};
    external128.push_back({f.linear.cast<Float128>(), f.angular.cast<Float128>()});
  }
  DynamicsTerms<double> acting;
  acting.gravity = false;
  acting.external = &external;
  DynamicsTerms<Float128> acting128;
  acting128.gravity = false;
  acting128.external = &external128;
  id_derivatives(model, *data, s.q, s.v, s.a, acting);
  const MatrixXd dq = tangent_difference(
      exact, s.q, [&](const VectorXq& x) { return rnea(exact, *data128, x, v, a, acting128); });
  EXPECT_LE(relative_error(data->dtau_dq, dq), 1e-13);
}

TEST_P(Derivatives, PairsOnDifferentBranchesAreZero) {
  id_derivatives(model, *data, s.q, s.v, s.a);
  for (int i = 0; i < model.nv; ++i) {
    for (int j = 0; j < model.nv; ++j) {
      if (on_one_path(model, data->tree.dofs[i].joint, data->tree.dofs[j].joint)) continue;
      EXPECT_EQ(data->dtau_dq(i, j), 0);
      EXPECT_EQ(data->dtau_dv(i, j), 0);
      EXPECT_EQ(data->M(i, j), 0);
    }
  }
}

// Moving a floating robot does not matter; turning it matters through gravity, except about the vertical.
TEST_P(Derivatives, OfAFloatingBaseKnowItsSymmetries) {
  if (model.joints[0].type != JointType::kFreeFlyer) return;
  const MatrixXd zero = MatrixXd::Zero(model.nv, 6);
  id_derivatives(model, *data, s.q, s.v, s.a);
  EXPECT_EQ(data->dtau_dq.leftCols<3>(), zero.leftCols<3>());
  forward_kinematics(model, *data, s.q);
  const VectorXd down = data->X_WB[0].R.transpose() * model.gravity.normalized();
  EXPECT_LE((data->dtau_dq.middleCols<3>(3) * down).norm(), 1e-13 * data->dtau_dq.norm());
  fd_derivatives(model, *data, s.q, s.v, s.tau);
  EXPECT_EQ(data->ddq_dq.leftCols<3>(), zero.leftCols<3>());
  EXPECT_LE(data->ddq_dq.middleCols<3>(3).bottomRows(model.nv - 3).norm(), 1e-11 * data->ddq_dq.norm());
  DynamicsTerms<double> acting;
  acting.gravity = false;
  id_derivatives(model, *data, s.q, s.v, s.a, acting);
  EXPECT_EQ(data->dtau_dq.leftCols<6>(), zero);
}

// tau is quadratic in v, so dtau/dv v = 2 (h(q, v) - h(q, 0)), and dtau/dv = 0 at rest.
TEST_P(Derivatives, InVelocityAreThoseOfAQuadraticForm) {
  id_derivatives(model, *data, s.q, s.v, s.a);
  const VectorXd twice =
      2 * (nonlinear_effects(model, *data, s.q, s.v) - generalized_gravity(model, *data, s.q));
  EXPECT_LE((data->dtau_dv * s.v - twice).norm(), 1e-12 * (1 + data->nle.norm()));
  id_derivatives(model, *data, s.q, VectorXd::Zero(model.nv), s.a);
  EXPECT_EQ(data->dtau_dv, MatrixXd::Zero(model.nv, model.nv));
}

INSTANTIATE_TEST_SUITE_P(Seeds, Derivatives, ::testing::Range(1UL, 21UL));

}  // namespace
}  // namespace dyntape::dynamics::derivatives_test
