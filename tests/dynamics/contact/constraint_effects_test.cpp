// SPDX-License-Identifier: BSD-3-Clause
//
// Constrained dynamics with every effect: its equations, and derivatives against 113 bits.
#include <gtest/gtest.h>

#include <dyntape/dynamics/contact/constraints.h>

#include "dynamics/all_effects.h"
#include "dynamics/exact_robot.h"

namespace dyntape::dynamics::constraint_effects_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// One point of the last body of a robot whose base moves freely: its three rows are independent.
class ConstrainedWithEffects : public ExactRobot {
 protected:
  ConstrainedWithEffects()
      : ExactRobot(6, 7),
        effects(all_effects(model, random)),
        torques(model),
        c(model, {point_constraint(model, static_cast<int>(model.frames.size()) - 1, random.vector3())}) {
    exact = model.cast<Float128>();
  }

  Effects<double> effects;
  EffectTorques<double> torques;
  ConstraintData<double> c;
};

TEST_P(ConstrainedWithEffects, InverseDynamicsGivesTheTorquesBack) {
  const VectorXd a = constrained_dynamics(model, *data, c, torques, effects, s.q, s.v, s.tau);
  const VectorXd needed = inverse_dynamics(model, *data, torques, effects, s.q, s.v, a);
  const VectorXd given = torques.driven + c.J.transpose() * c.lambda;
  EXPECT_LE((needed - given).norm(), 1e-13 * (given.norm() + a.norm())) << "seed " << GetParam();
  EXPECT_LE(c.residual.norm(), 1e-13 * (1 + a.norm()));
}

TEST_P(ConstrainedWithEffects, DerivativesAgreeWith113Bits) {
  const Effects<Float128> all = effects.cast<Float128>();
  Data<Float128> data128(exact);
  EffectTorques<Float128> torques128(exact);
  ConstraintData<Float128> c128(exact, {c.constraints[0].cast<Float128>()});
  const auto f = [&](const VectorXq& x, const VectorXq& w) {
    constrained_dynamics<Float128>(exact, data128, c128, torques128, all, x, w, s.tau.cast<Float128>());
    VectorXq y(model.nv + 3);
    y << c128.ddq, c128.lambda;
    return y;
  };
  constrained_dynamics_derivatives(model, *data, c, torques, effects, s.q, s.v, s.tau);
  MatrixXd by_q(model.nv + 3, model.nv), by_v = by_q;
  by_q << c.ddq_dq, c.lambda_dq;
  by_v << c.ddq_dv, c.lambda_dv;
  EXPECT_LE(relative_error(by_q, tangent_difference(exact, q, [&](const VectorXq& x) { return f(x, v); })),
            5e-13);
  EXPECT_LE(relative_error(by_v, vector_difference(v, [&](const VectorXq& x) { return f(q, x); })), 5e-13);
}

TEST_P(ConstrainedWithEffects, NothingChosenIsThePlainAlgorithm) {
  const Effects<double> none;
  constrained_dynamics_derivatives(model, *data, c, torques, none, s.q, s.v, s.tau);
  Data<double> plain_data(model);
  ConstraintData<double> plain(model, c.constraints);
  constrained_dynamics_derivatives(model, plain_data, plain, s.q, s.v, s.tau, none.acting());
  EXPECT_EQ(c.ddq, plain.ddq);
  EXPECT_EQ(c.ddq_dq, plain.ddq_dq);
  EXPECT_EQ(c.lambda_dv, plain.lambda_dv);
}

INSTANTIATE_TEST_SUITE_P(Seeds, ConstrainedWithEffects, ::testing::Range(1UL, 32UL, 2UL));

}  // namespace
}  // namespace dyntape::dynamics::constraint_effects_test
