// SPDX-License-Identifier: BSD-3-Clause
//
// Second derivatives of constrained dynamics, contracted: against central differences, in 113 bits, of the first ones.
#include <dyntape/dynamics/contact/constrained_hessian.h>

#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include "constrained_robot.h"
#include "dynamics/exact_robot.h"
#include "dynamics/robot_files.h"

namespace dyntape::dynamics::constrained_hessian_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// A robot with constraints twice: in double, and in 113 bits.
struct Twice {
  Twice(const Model<double>& robot, const Constraints& list, const State& state)
      : model(robot),
        model128(robot.cast<Float128>()),
        s(state),
        data(model),
        data128(model128),
        c(model, list),
        c128(model128, exact(list)),
        second(model, c) {}

  const MatrixXd& hessian(const VectorXd& mu, const VectorXd& nu) {
    return constrained_hessian(model, data, c, second, s.q, s.v, s.tau, mu, nu);
  }

  // (mu^T ddq + nu^T lambda) by (q, v, tau).
  VectorXq gradient(const VectorXq& q, const VectorXq& v, const VectorXq& tau, const VectorXd& mu,
                    const VectorXd& nu) {
    constrained_dynamics_derivatives(model128, data128, c128, q, v, tau);
    const VectorXq m = mu.cast<Float128>(), n = nu.cast<Float128>();
    VectorXq g(3 * model.nv);
    g << c128.ddq_dq.transpose() * m + c128.lambda_dq.transpose() * n,
        c128.ddq_dv.transpose() * m + c128.lambda_dv.transpose() * n,
        c128.ddq_dtau.transpose() * m + c128.lambda_dtau.transpose() * n;
    return g;
  }

  // Its slopes; of successive derivatives by q the mean of both orders.
  MatrixXd slopes(const VectorXd& mu, const VectorXd& nu) {
    const VectorXq q = s.q.cast<Float128>(), v = s.v.cast<Float128>(), tau = s.tau.cast<Float128>();
    MatrixXd H(3 * model.nv, 3 * model.nv);
    H << tangent_difference(model128, q, [&](const VectorXq& x) { return gradient(x, v, tau, mu, nu); }),
        vector_difference(v, [&](const VectorXq& x) { return gradient(q, x, tau, mu, nu); }),
        vector_difference(tau, [&](const VectorXq& x) { return gradient(q, v, x, mu, nu); });
    return (H + H.transpose()) / 2;
  }

  // Of impacts, by (q, v).
  MatrixXd impulse_slopes(double restitution, const VectorXd& mu, const VectorXd& nu) {
    const VectorXq q = s.q.cast<Float128>(), v = s.v.cast<Float128>();
    const VectorXq m = mu.cast<Float128>(), n = nu.cast<Float128>();
    const auto g = [&](const VectorXq& at, const VectorXq& with) {
      impulse_dynamics_derivatives(model128, data128, c128, at, with, Float128(restitution));
      VectorXq y(2 * model.nv);
      y << c128.v_plus_dq.transpose() * m + c128.impulse_dq.transpose() * n,
          c128.v_plus_dv.transpose() * m + c128.impulse_dv.transpose() * n;
      return y;
    };
    MatrixXd H(2 * model.nv, 2 * model.nv);
    H << tangent_difference(model128, q, [&](const VectorXq& x) { return g(x, v); }),
        vector_difference(v, [&](const VectorXq& x) { return g(q, x); });
    return (H + H.transpose()) / 2;
  }

  Model<double> model;
  Model<Float128> model128;
  State s;
  Data<double> data;
  Data<Float128> data128;
  ConstraintData<double> c;
  ConstraintData<Float128> c128;
  ConstrainedHessian<double> second;
};

class ConstrainedHessianOf : public ::testing::TestWithParam<unsigned long> {};

// Loops, places in the world, three and six rows, with stabilisation; fixed and floating bases.
TEST_P(ConstrainedHessianOf, IsTheSlopeOfTheFirstDerivatives) {
  ConstrainedRobot robot(GetParam());
  Twice both(robot.model, robot.list, robot.s);
  const VectorXd mu = robot.random.vector(robot.model.nv), nu = robot.random.vector(both.c.lambda.size());
  const MatrixXd expected = both.slopes(mu, nu);
  EXPECT_LE(relative_error(both.hessian(mu, nu), expected), 1e-11);
  EXPECT_TRUE(both.second.H == both.second.H.transpose());
  const MatrixXd first = both.second.H;
  const long n = robot.model.nv;
  EXPECT_EQ(first.bottomRightCorner(2 * n, n), MatrixXd::Zero(2 * n, n));
  EXPECT_TRUE(both.hessian(mu, nu) == first);
  both.c.independent = true;
  EXPECT_LE(relative_error(both.hessian(mu, nu), expected), 1e-11);
  // It is linear in the multipliers, and without some of them they are zero.
  const MatrixXd of_accelerations = both.hessian(mu, {});
  EXPECT_LE(relative_error(of_accelerations + both.hessian(0 * mu, nu), expected), 1e-11);
}

TEST_P(ConstrainedHessianOf, ImpactsIsTheSlopeOfTheirFirstDerivatives) {
  ConstrainedRobot robot(GetParam());
  Twice both(robot.model, robot.list, robot.s);
  const long n = robot.model.nv;
  const VectorXd mu = robot.random.vector(n), nu = robot.random.vector(both.c.lambda.size());
  const MatrixXd H =
      impulse_hessian(both.model, both.data, both.c, both.second, both.s.q, both.s.v, 0.3, mu, nu);
  EXPECT_LE(relative_error(H, both.impulse_slopes(0.3, mu, nu)), 1e-11);
  EXPECT_TRUE(H == H.transpose());
  EXPECT_EQ(H.bottomRightCorner(n, n), MatrixXd::Zero(n, n));
  EXPECT_TRUE(impulse_hessian(both.model, both.data, both.c, both.second, both.s.q, both.s.v, 0.3, mu, nu) ==
              H);
}

INSTANTIATE_TEST_SUITE_P(Seeds, ConstrainedHessianOf, ::testing::Range(1UL, 13UL));

State state_of(const Model<double>& model, unsigned long seed) {
  Random random(seed);
  return random_state(model, random);
}

Constraints feet_of(const Model<double>& model) {
  Constraints feet;
  for (const char* name : {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"}) {
    feet.push_back(point_constraint(model, model.frame_index(name), {0.2, -0.1, 0.3}));
  }
  return feet;
}

// Feet written twice: half of the rows depend on the others, accelerations do not notice.
TEST(ConstrainedHessians, RowsWrittenTwice) {
  const Model<double> model = load_urdf(robot_file("solo12"), {.base = Base::kFloating});
  const State s = state_of(model, 3);
  Constraints feet = feet_of(model);
  Twice once(model, feet, s);
  feet.insert(feet.end(), feet.begin(), feet.end());
  Twice again(model, feet, s);
  const VectorXd mu = Random(4).vector(model.nv);
  const MatrixXd H = once.hessian(mu, {});
  EXPECT_LE(relative_error(again.hessian(mu, {}), H), 1e-11);
  EXPECT_EQ(again.c.delassus.dependent().sum(), 12);
  EXPECT_LE(relative_error(H, once.slopes(mu, VectorXd::Zero(12))), 1e-11);
  const auto impact = [&](Twice& feet_of_it) {
    return MatrixXd(impulse_hessian(model, feet_of_it.data, feet_of_it.c, feet_of_it.second, s.q, s.v, 0.0,
                                    mu, VectorXd()));
  };
  EXPECT_LE(relative_error(impact(again), impact(once)), 1e-11);
}

// The same templates in 113 bits: feet that do not turn either, with stabilisation.
TEST(ConstrainedHessians, AreAccurate) {
  const Model<double> model = load_urdf(robot_file("simple_humanoid"), {.base = Base::kFloating});
  Random random(5);
  const State s = random_state(model, random);
  Constraints feet;
  for (const char* foot : {"l_ankle", "r_ankle"}) {
    feet.push_back(frame_constraint(model, model.frame_index(foot), random_placement(random)));
  }
  Twice both(model, feet, s);
  both.c.independent = both.c128.independent = true;
  const VectorXd mu = random.vector(model.nv), nu = random.vector(12);
  ConstrainedHessian<Float128> second(both.model128, both.c128);
  const MatrixXd exact_H =
      constrained_hessian<Float128>(both.model128, both.data128, both.c128, second, s.q.cast<Float128>(),
                                    s.v.cast<Float128>(), s.tau.cast<Float128>(), mu.cast<Float128>(),
                                    nu.cast<Float128>())
          .cast<double>();
  EXPECT_LE(relative_error(both.hessian(mu, nu), exact_H), 1e-12);
}

// Two joints cannot give a point of the tip three accelerations: what is left of the rows turns as well.
TEST(ConstrainedHessians, ContradictoryRows) {
  Random random(12);
  for (int k = 0; k < 10; ++k) {
    Model<double> arm;
    arm.name = "arm";
    for (int i = 0; i < 2; ++i) {
      Joint<double> joint;
      joint.axis = random.vector3().normalized();
      arm.add_joint(i - 1, joint, {Eigen::Matrix3d::Identity(), random.vector3()},
                    {1, random.vector3(), Eigen::Matrix3d::Identity() * 0.1});
    }
    Constraint<double> held{3, 1, random_placement(random), -1, random_placement(random)};
    Twice both(arm, {held}, state_of(arm, 20 + static_cast<unsigned long>(k)));
    const VectorXd mu = random.vector(2);
    const MatrixXd H = both.hessian(mu, {});
    EXPECT_GT(both.c.residual.norm(), 1e-3);
    EXPECT_LE(relative_error(H, both.slopes(mu, VectorXd::Zero(3))), 1e-9) << k;
    EXPECT_TRUE(both.hessian(mu, {}) == H);
  }
}

// Two bodies that hold each other: a loop without a base, of twelve columns on both sides of it.
TEST(ConstrainedHessians, LoopOfTwoFreeBodies) {
  Random random(8);
  Model<double> pair;
  pair.name = "pair";
  for (int i = 0; i < 2; ++i) {
    Joint<double> joint;
    joint.type = JointType::kFreeFlyer;
    pair.add_joint(-1, joint, random_placement(random), random_inertia(random));
  }
  for (const int rows : {3, 6}) {
    const Constraint<double> weld{rows, 0, random_placement(random), 1, random_placement(random), 25, 8};
    Twice both(pair, {weld}, state_of(pair, 9));
    const VectorXd mu = random.vector(12), nu = random.vector(rows);
    EXPECT_LE(relative_error(both.hessian(mu, nu), both.slopes(mu, nu)), 1e-12) << rows;
  }
}

// Without constraints it is forward dynamics'.
TEST(ConstrainedHessians, OfNothingIsThatOfForwardDynamics) {
  const Model<double> model = load_urdf(robot_file("panda"));
  const State s = state_of(model, 1);
  Twice free(model, {}, s);
  Hessian<double> hessian(model);
  const VectorXd mu = Random(2).vector(model.nv);
  EXPECT_LE(relative_error(free.hessian(mu, {}), fd_hessian(model, free.data, hessian, s.q, s.v, s.tau, mu)),
            1e-12);
}

TEST(ConstrainedHessians, RefuseWrongSizes) {
  Random random(1);
  const Model<double> model = random_tree(random, {.joints = 4}), other = random_tree(random, {.joints = 5});
  const State s = random_state(model, random);
  const Constraint<double> held{3, 2, {}, -1, {}};
  Twice both(model, {held}, s);
  const VectorXd mu = random.vector(model.nv), nu = random.vector(3);
  EXPECT_THROW(both.hessian(random.vector(model.nv + 1), nu), ArgumentError);
  EXPECT_THROW(both.hessian(mu, random.vector(2)), ArgumentError);
  const auto with = [&](ConstrainedHessian<double> second) {
    constrained_hessian(model, both.data, both.c, second, s.q, s.v, s.tau, mu, nu);
  };
  EXPECT_THROW(with({other, ConstraintData<double>(other, {held})}), ArgumentError);
  EXPECT_THROW(with({model, ConstraintData<double>(model, {held, held})}), ArgumentError);
  EXPECT_NO_THROW(with({model, both.c}));
}

}  // namespace
}  // namespace dyntape::dynamics::constrained_hessian_test
