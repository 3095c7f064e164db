// SPDX-License-Identifier: BSD-3-Clause
//
// Gradients of the energies against central differences in 113 bits, and what mechanics says about them.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/energy.h>

#include <algorithm>

#include "dynamics/exact_robot.h"

namespace dyntape::dynamics::energy_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// As relative_error, for what may be zero but for the noise of a difference: sizes here are one and more.
double error(const MatrixXd& a, const MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / std::max(b.cwiseAbs().maxCoeff(), 0.1);
}

VectorXq one(const Float128& x) { return VectorXq::Constant(1, x); }

class EnergyOf : public ExactRobot {
 protected:
  EnergyOf() : ExactRobot(7, 7), e(std::make_unique<EnergyGradients<double>>(model)) {}

  template <class F>
  MatrixXd derivatives(const F& f) const {
    return tangent_difference(exact, q, f);
  }

  std::unique_ptr<EnergyGradients<double>> e;
};

TEST_P(EnergyOf, GradientsMatchDifferences) {
  kinetic_energy_gradients(model, *data, *e, s.q, s.v);
  const double energy = data->kinetic_energy;
  const VectorXd dq =
      derivatives([&](const VectorXq& x) { return one(kinetic_energy(exact, *data128, x, v)); }).transpose();
  EXPECT_LE(error(e->dT_dq, dq), 1e-13);
  EXPECT_LE(relative_error(e->dT_dv, crba(model, *data, s.q) * s.v), 1e-13);
  EXPECT_NEAR(energy, kinetic_energy(model, *data, s.q, s.v), 1e-14 * energy);
  EXPECT_NEAR(energy, 0.5 * s.v.dot(e->dT_dv), 1e-14 * energy);
  const VectorXd dU =
      derivatives([&](const VectorXq& x) { return one(potential_energy(exact, *data128, x)); }).transpose();
  EXPECT_LE(relative_error(generalized_gravity(model, *data, s.q), dU), 1e-13);
}

TEST_P(EnergyOf, ArmatureActsWhereItIsChosen) {
  DynamicsTerms<double> acting;
  acting.armature = false;
  kinetic_energy_gradients(model, *data, *e, s.q, s.v, acting);
  EXPECT_LE(relative_error(e->dT_dv, crba(model, *data, s.q, acting) * s.v), 1e-13);
  acting.armature = true;
  const VectorXd other = random.vector(model.nv).cwiseAbs();
  acting.armature_values = &other;
  kinetic_energy_gradients(model, *data, *e, s.q, s.v, acting);
  EXPECT_LE(relative_error(e->dT_dv, crba(model, *data, s.q, acting) * s.v), 1e-13);
}

// Without losses the torques' power is the change of the whole energy.
TEST_P(EnergyOf, PowerIsTheRateOfEnergy) {
  const VectorXd tau = rnea(model, *data, s.q, s.v, s.a);
  kinetic_energy_gradients(model, *data, *e, s.q, s.v);
  const VectorXd g = generalized_gravity(model, *data, s.q);
  const double terms = std::abs(e->dT_dq.dot(s.v)) + std::abs(e->dT_dv.dot(s.a)) + std::abs(g.dot(s.v));
  EXPECT_NEAR(tau.dot(s.v), e->dT_dq.dot(s.v) + e->dT_dv.dot(s.a) + g.dot(s.v), 1e-13 * (1 + terms));
}

TEST_P(EnergyOf, GravityDerivativesMatchDifferences) {
  gravity_derivatives(model, *data, *e, s.q);
  const VectorXd g = data->g;
  const MatrixXd dg =
      derivatives([&](const VectorXq& x) -> VectorXq { return generalized_gravity(exact, *data128, x); });
  EXPECT_LE(error(e->dg_dq, dg), 1e-13);
  EXPECT_LE(relative_error(generalized_gravity(model, *data, s.q), g), 1e-14);
  const VectorXd zero = VectorXd::Zero(model.nv);
  id_derivatives(model, *data, s.q, zero, zero);
  EXPECT_LE(error(e->dg_dq, data->dtau_dq), 1e-13);
}

// The Hessian of the potential energy; but increments within one joint do not commute.
TEST_P(EnergyOf, GravityDerivativesAreSymmetricBetweenJoints) {
  gravity_derivatives(model, *data, *e, s.q);
  for (int i = 0; i < model.nv; ++i) {
    for (int k = 0; k < model.nv; ++k) {
      if (data->tree.dofs[i].joint == data->tree.dofs[k].joint) continue;
      EXPECT_EQ(e->dg_dq(i, k), e->dg_dq(k, i));
    }
  }
  if (model.joints[0].type != JointType::kFreeFlyer) return;
  const MatrixXd base = e->dg_dq.topLeftCorner<6, 6>();
  EXPECT_EQ(e->dg_dq.leftCols<3>(), MatrixXd::Zero(model.nv, 3));
  EXPECT_GT((base - base.transpose()).norm(), 0.1 * base.norm());
  VectorXd moved = s.q;
  moved.head<3>() += Vector3<double>(1e8, -1e8, 3e7);
  const MatrixXd near = e->dg_dq;
  EXPECT_EQ(gravity_derivatives(model, *data, *e, moved), near);
}

// The bias is quadratic in v, so its slope along v is twice what it is without gravity.
TEST_P(EnergyOf, BiasDerivativesMatchDifferences) {
  nonlinear_effects_derivatives(model, *data, *e, s.q, s.v);
  const MatrixXd dq =
      derivatives([&](const VectorXq& x) -> VectorXq { return nonlinear_effects(exact, *data128, x, v); });
  EXPECT_LE(error(data->dtau_dq, dq), 1e-13);
  const VectorXd nle = data->nle, twice = data->dtau_dv * s.v;
  EXPECT_LE(relative_error(nle, nonlinear_effects(model, *data, s.q, s.v)), 1e-13);
  EXPECT_LE((twice - 2 * (nle - generalized_gravity(model, *data, s.q))).norm(), 1e-13 * (1 + nle.norm()));
}

INSTANTIATE_TEST_SUITE_P(Seeds, EnergyOf, ::testing::Range(1UL, 21UL));

TEST(Energy, WrongArgumentsAreNamed) {
  Random random(3);
  const Model<double> model = random_tree(random), other = random_tree(random, {3});
  Data<double> data(model);
  EnergyGradients<double> e(model), small(other);
  const VectorXd q = neutral(model), v = VectorXd::Zero(model.nv), longer = VectorXd::Zero(model.nv + 1);
  EXPECT_THROW(kinetic_energy_gradients(model, data, e, q, longer), ArgumentError);
  EXPECT_THROW(kinetic_energy_gradients(model, data, small, q, v), ArgumentError);
  EXPECT_THROW(gravity_derivatives(model, data, small, q), ArgumentError);
  EXPECT_THROW(nonlinear_effects_derivatives(model, data, small, q, v), ArgumentError);
}

}  // namespace
}  // namespace dyntape::dynamics::energy_test
