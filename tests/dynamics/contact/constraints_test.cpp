// SPDX-License-Identifier: BSD-3-Clause
//
// Constrained dynamics: its own equations, redundancy, loops, and derivatives against 113 bits.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include <algorithm>

#include "constrained_robot.h"
#include "dynamics/exact_robot.h"
#include "dynamics/robot_files.h"

namespace dyntape::dynamics::constraints_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

double largest(const MatrixXd& x) { return x.size() == 0 ? 0 : x.cwiseAbs().maxCoeff(); }

class Constrained : public ::testing::TestWithParam<unsigned long> {};

// The equations of motion and the demanded acceleration hold; work goes where it should.
TEST_P(Constrained, EquationsHold) {
  ConstrainedRobot robot(GetParam());
  Data<double> data(robot.model);
  ConstraintData<double> c(robot.model, robot.list);
  const VectorXd a = constrained_dynamics(robot.model, data, c, robot.s.q, robot.s.v, robot.s.tau);
  const double size = 1 + largest(c.J) * largest(a) + largest(c.bias);
  EXPECT_LE(largest(c.residual), 1e-12 * size);
  const VectorXd tau = rnea(robot.model, data, robot.s.q, robot.s.v, a) - c.J.transpose() * c.lambda;
  EXPECT_LE(largest(tau - robot.s.tau), 1e-11 * (1 + largest(c.lambda) + largest(a)));
}

template <class A, class B>
MatrixX<typename A::Scalar> stacked(const A& x, const B& y) {
  MatrixX<typename A::Scalar> both(x.rows() + y.rows(), x.cols());
  both << x, y;
  return both;
}

TEST_P(Constrained, DerivativesAgreeWith113Bits) {
  ConstrainedRobot robot(GetParam());
  const Model<Float128> model = robot.model.cast<Float128>();
  Data<double> data(robot.model);
  Data<Float128> data128(model);
  ConstraintData<double> c(robot.model, robot.list);
  ConstraintData<Float128> c128(model, exact(robot.list));
  const auto f = [&](const VectorXq& q, const VectorXq& v, const VectorXq& tau) {
    constrained_dynamics(model, data128, c128, q, v, tau);
    return VectorXq(stacked(c128.ddq, c128.lambda));
  };
  const VectorXq q = robot.s.q.cast<Float128>(), v = robot.s.v.cast<Float128>();
  const VectorXq tau = robot.s.tau.cast<Float128>();
  constrained_dynamics_derivatives(robot.model, data, c, robot.s.q, robot.s.v, robot.s.tau);
  EXPECT_LE(relative_error(stacked(c.ddq, c.lambda), f(q, v, tau).cast<double>()), 5e-14);
  const MatrixXd dq = tangent_difference(model, q, [&](const VectorXq& x) { return f(x, v, tau); });
  const MatrixXd dv = vector_difference(v, [&](const VectorXq& x) { return f(q, x, tau); });
  const MatrixXd dtau = vector_difference(tau, [&](const VectorXq& x) { return f(q, v, x); });
  const long nv = robot.model.nv;
  EXPECT_LE(relative_error(c.ddq_dq, dq.topRows(nv)), 5e-13);
  EXPECT_LE(relative_error(c.ddq_dv, dv.topRows(nv)), 5e-13);
  EXPECT_LE(relative_error(c.ddq_dtau, dtau.topRows(nv)), 5e-13);
  EXPECT_LE(relative_error(c.lambda_dq, dq.bottomRows(c.lambda.size())), 5e-13);
  EXPECT_LE(relative_error(c.lambda_dv, dv.bottomRows(c.lambda.size())), 5e-13);
  EXPECT_LE(relative_error(c.lambda_dtau, dtau.bottomRows(c.lambda.size())), 5e-13);
}

// Two joints cannot give a point of the tip three accelerations: what is left depends on the joints too.
TEST(ContradictoryRows, DerivativesAgreeWith113Bits) {
  Random random(12);
  for (int k = 0; k < 20; ++k) {
    Model<double> arm;
    arm.name = "arm";
    for (int i = 0; i < 2; ++i) {
      Joint<double> joint;
      joint.axis = random.vector3().normalized();
      const Placement<double> place{Eigen::Matrix3d::Identity(), random.vector3()};
      arm.add_joint(i - 1, joint, place, {1, random.vector3(), Eigen::Matrix3d::Identity() * 0.1});
    }
    const std::vector<Constraint<double>> held = {{3,
                                                   1,
                                                   {Eigen::Matrix3d::Identity(), random.vector3()},
                                                   -1,
                                                   {Eigen::Matrix3d::Identity(), random.vector3()}}};
    const VectorXd q = random.vector(2, 1), v = random.vector(2, 1), tau = random.vector(2, 1);
    Data<double> data(arm);
    ConstraintData<double> c(arm, held);
    constrained_dynamics_derivatives(arm, data, c, q, v, tau);
    EXPECT_GT(c.residual.norm(), 1e-3);
    const MatrixXd once = c.ddq_dq;
    constrained_dynamics_derivatives(arm, data, c, q, v, tau);
    EXPECT_EQ(c.ddq_dq, once);
    const Model<Float128> exact_arm = arm.cast<Float128>();
    Data<Float128> data128(exact_arm);
    ConstraintData<Float128> c128(exact_arm, exact(held));
    const VectorXq q128 = q.cast<Float128>(), v128 = v.cast<Float128>(), tau128 = tau.cast<Float128>();
    const auto f = [&](const VectorXq& x, const VectorXq& y) {
      return VectorXq(constrained_dynamics(exact_arm, data128, c128, x, y, tau128));
    };
    const MatrixXd dq = tangent_difference(exact_arm, q128, [&](const VectorXq& x) { return f(x, v128); });
    const MatrixXd dv = vector_difference(v128, [&](const VectorXq& x) { return f(q128, x); });
    EXPECT_LE(relative_error(c.ddq_dq, dq), 1e-10) << k;
    EXPECT_LE(relative_error(c.ddq_dv, dv), 1e-10) << k;
  }
}

TEST_P(Constrained, ImpulseDerivativesAgreeWith113Bits) {
  ConstrainedRobot robot(GetParam());
  const Model<Float128> model = robot.model.cast<Float128>();
  Data<double> data(robot.model);
  Data<Float128> data128(model);
  ConstraintData<double> c(robot.model, robot.list);
  ConstraintData<Float128> c128(model, exact(robot.list));
  const auto f = [&](const VectorXq& q, const VectorXq& v) {
    impulse_dynamics(model, data128, c128, q, v, Float128(0.3));
    return VectorXq(stacked(c128.v_plus, c128.impulse));
  };
  const VectorXq q = robot.s.q.cast<Float128>(), v = robot.s.v.cast<Float128>();
  impulse_dynamics_derivatives(robot.model, data, c, robot.s.q, robot.s.v, 0.3);
  EXPECT_LE(largest(c.J * (c.v_plus + 0.3 * robot.s.v)), 1e-12 * (1 + largest(c.J) * largest(c.v_plus)));
  const MatrixXd dq = tangent_difference(model, q, [&](const VectorXq& x) { return f(x, v); });
  const MatrixXd dv = vector_difference(v, [&](const VectorXq& x) { return f(q, x); });
  EXPECT_LE(relative_error(stacked(c.v_plus_dq, c.impulse_dq), dq), 5e-13);
  EXPECT_LE(relative_error(stacked(c.v_plus_dv, c.impulse_dv), dv), 5e-13);
}

// Slopes as a derivation would give them that forgot something: (L.13) with another P or A.
MatrixXd derivatives(const ConstraintData<double>& c, const MatrixXd& P, const MatrixXd& A) {
  return -(c.ddq_dtau * P + c.Z * A);
}

// Each part of the derivative matters.  "Almost free, one back-substitution" forgets all of them.
TEST_P(Constrained, ForgettingAPartIsWrong) {
  ConstrainedRobot robot(GetParam());
  Data<double> data(robot.model);
  ConstraintData<double> c(robot.model, robot.list);
  constrained_dynamics_derivatives(robot.model, data, c, robot.s.q, robot.s.v, robot.s.tau);
  const MatrixXd dq = c.ddq_dq, dv = c.ddq_dv, lambda_dq = c.lambda_dq, P = c.P, A = c.A_dq;
  const MatrixXd P_v = data.dtau_dv, none = MatrixXd::Zero(A.rows(), A.cols());
  EXPECT_LE(relative_error(derivatives(c, P, A), dq), 1e-13);
  EXPECT_GE(relative_error(derivatives(c, P, none), dq), 1e-4);
  EXPECT_GE(relative_error(derivatives(c, P_v, none), dv), 1e-4);
  id_derivatives(robot.model, data, robot.s.q, robot.s.v, c.ddq);  // lambda fixed in the world
  const MatrixXd lambda_without = c.Z.transpose() * data.dtau_dq - c.G_inverse * A;
  if (std::any_of(c.chains.begin(), c.chains.end(),
                  [](const auto& chain) { return chain.links.size() > 1; })) {
    EXPECT_GE(
        relative_error(stacked(derivatives(c, data.dtau_dq, A), lambda_without), stacked(dq, lambda_dq)),
        1e-4);
  }
  Constraints soft = robot.list;
  for (auto& constraint : soft) constraint.kp = constraint.kd = 0;
  ConstraintData<double> unstable(robot.model, soft);
  constrained_dynamics(robot.model, data, unstable, robot.s.q, robot.s.v, robot.s.tau);
  EXPECT_GE(relative_error(unstable.ddq, c.ddq), 1e-4);
}

// p'' + kd p' + kp p = 0 and the same for the rotation to first order, from placements alone: along
// q (+) (v t + a t^2 / 2) in 113 bits.
TEST_P(Constrained, DemandsWhatItSays) {
  ConstrainedRobot robot(GetParam());
  const Model<Float128> model = robot.model.cast<Float128>();
  Data<Float128> data(model);
  ConstraintData<Float128> c(model, exact(robot.list));
  const VectorXq q = robot.s.q.cast<Float128>(), v = robot.s.v.cast<Float128>();
  const VectorXq a = constrained_dynamics(model, data, c, q, v, robot.s.tau.cast<Float128>());
  const Float128 h(1e-8);
  const auto place = [&](const Constraint<Float128>& constraint, const Float128& t) {
    forward_kinematics<Float128>(model, data,
                                 integrate<Float128>(model, q, VectorXq(v * t + a * (t * t / 2))));
    Placement<Float128> X_1 = data.X_WB[constraint.body_1] * constraint.X_1, X_2 = constraint.X_2;
    if (constraint.body_2 >= 0) X_2 = data.X_WB[constraint.body_2] * X_2;
    return inverse(X_2) * X_1;
  };
  for (const auto& constraint : c.constraints) {
    const Placement<Float128> X = place(constraint, 0), up = place(constraint, h),
                              down = place(constraint, -h);
    const VectorXq velocity = (up.p - down.p) / (2 * h), acceleration = (up.p + down.p - X.p - X.p) / (h * h);
    const Float128 kp(constraint.kp), kd(constraint.kd);
    const VectorXq sum = acceleration + velocity * kd + X.p * kp;
    EXPECT_LE(static_cast<double>(sum.norm()), 1e-10 * (1 + static_cast<double>(acceleration.norm())));
  }
}

// Results have the same bits at 2^27 m; with stabilisation too, where the place in the world moves along.
TEST(ConstraintPlaces, FarBase) {
  Random random(5);
  Model<double> model = random_tree(random, {8, Base::kFloating});
  model.X_PJ[0] = {};
  const State s = random_state(model, random);
  const Placement<double> X = random_placement(random);
  const auto snap = [](double x) { return std::ldexp(std::round(std::ldexp(x, 20)), -20); };
  const Eigen::Vector3d point(snap(0.3), snap(-0.7), snap(0.1)), far(0x1p27, -0x1p27, 0x1p26);
  VectorXd near_q = s.q;
  for (int k = 0; k < 3; ++k) near_q[k] = snap(near_q[k]);
  VectorXd far_q = near_q;
  far_q.head(3) += far;
  const auto list = [&](const Eigen::Vector3d& at) {
    return Constraints{{3, 4, X, -1, {Eigen::Matrix3d::Identity(), at}}, {6, 7, X, 2, X, 9, 1}};
  };
  Data<double> data(model);
  ConstraintData<double> near(model, list(point)), there(model, list(point + far));
  constrained_dynamics_derivatives(model, data, near, near_q, s.v, s.tau);
  constrained_dynamics_derivatives(model, data, there, far_q, s.v, s.tau);
  EXPECT_EQ(near.error, there.error);
  EXPECT_EQ(near.ddq, there.ddq);
  EXPECT_EQ(near.lambda, there.lambda);
  EXPECT_EQ(near.ddq_dq, there.ddq_dq);
  EXPECT_EQ(near.lambda_dv, there.lambda_dv);
}

// What carries both frames has no column, whatever the error; J = dV/dv (frame_jacobian) for the world.
TEST(ConstraintPlaces, Jacobian) {
  Random random(6);
  const Model<double> model = random_tree(random, {7, Base::kFloating, true});
  const State s = random_state(model, random);
  Data<double> data(model);
  ConstraintData<double> c(model, {frame_constraint(model, 6, {}), loop_constraint(model, 6, 3, 3)});
  constraint_kinematics(model, data, c, s.q, s.v);
  EXPECT_LE(largest(c.J.topRows(6) - frame_jacobian(model, data, s.q, 6, ReferenceFrame::kLocal)), 1e-14);
  EXPECT_EQ(largest(c.J.bottomRows(3).leftCols(model.joints[4].idx_v)), 0);
  EXPECT_LE(largest(c.velocity - c.J * s.v), 1e-13);
}

// An elastic impact keeps the energy, a plastic one loses what J v carried.
TEST(Impulses, Energy) {
  ConstrainedRobot robot(2);
  Data<double> data(robot.model);
  ConstraintData<double> c(robot.model, robot.list);
  const VectorXd &q = robot.s.q, &v = robot.s.v;
  const double before = kinetic_energy(robot.model, data, q, v);
  EXPECT_NEAR(
      kinetic_energy(robot.model, data, q, VectorXd(impulse_dynamics(robot.model, data, c, q, v, 1.0))),
      before, 1e-12 * before);
  const VectorXd after = impulse_dynamics(robot.model, data, c, q, v, 0.0);
  EXPECT_LE(largest(c.J * after), 1e-12);
  EXPECT_NEAR(kinetic_energy(robot.model, data, q, after), before + c.impulse.dot(c.velocity) / 2,
              1e-12 * before);
  EXPECT_LE(largest(crba(robot.model, data, q) * (after - v) - c.J.transpose() * c.impulse), 1e-12 * before);
}

TEST(ConstraintArguments, OneSentence) {
  Random random(7);
  const Model<double> model = random_tree(random, {3}), other = random_tree(random, {4});
  Data<double> data(model);
  EXPECT_THROW(ConstraintData<double>(model, {{4, 0, {}, -1, {}}}), ArgumentError);
  EXPECT_THROW(ConstraintData<double>(model, {{3, 3, {}, -1, {}}}), ArgumentError);
  EXPECT_THROW(ConstraintData<double>(model, {{3, 1, {}, 1, {}}}), ArgumentError);
  EXPECT_THROW(point_constraint(model, 9, {}), ArgumentError);
  ConstraintData<double> c(other, {{3, 1, {}, -1, {}}});
  const VectorXd q = neutral(model), v = VectorXd::Zero(model.nv);
  EXPECT_THROW(constrained_dynamics(model, data, c, q, v, v), ArgumentError);
  ConstraintData<double> none(model, {});
  EXPECT_LE(relative_error(constrained_dynamics(model, data, none, q, v, v), aba(model, data, q, v, v)),
            1e-13);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Constrained, ::testing::Range(1UL, 13UL));

}  // namespace
}  // namespace dyntape::dynamics::constraints_test
