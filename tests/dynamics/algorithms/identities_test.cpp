// SPDX-License-Identifier: BSD-3-Clause
//
// What must hold between the algorithms, on random trees of every joint type, fixed and floating.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/centroidal.h>
#include <dyntape/dynamics/algorithms/energy.h>
#include <dyntape/dynamics/algorithms/hessian.h>
#include <dyntape/dynamics/algorithms/regressor.h>
#include <dyntape/dynamics/algorithms/second_order.h>
#include <dyntape/dynamics/contact/constraints.h>
#include <dyntape/dynamics/effects/effects.h>

#include <functional>
#include <memory>

#include "dynamics/random_robots.h"
#include "dynamics/reference_dynamics.h"

namespace dyntape::dynamics::identities_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr unsigned long kSeeds = 40;

class Identities : public ::testing::TestWithParam<unsigned long> {
 protected:
  Identities() : random(GetParam()) {
    const RandomTreeShape shape{1 + random.below(12), GetParam() % 2 ? Base::kFloating : Base::kFixed,
                                GetParam() % 5 == 0, GetParam() % 7 == 0};
    model = random_tree(random, shape);
    s = random_state(model, random);
    data = std::make_unique<Data<double>>(model);
  }

  Random random;
  Model<double> model;
  State s;
  std::unique_ptr<Data<double>> data;
};

class FloatingIdentities : public Identities {};

TEST_P(Identities, InverseDynamicsIsMassTimesAccelerationPlusBias) {
  const VectorXd tau = rnea(model, *data, s.q, s.v, s.a);
  const VectorXd sum = crba(model, *data, s.q) * s.a + nonlinear_effects(model, *data, s.q, s.v);
  EXPECT_LE(relative_error(sum, tau), 1e-13);
}

TEST_P(Identities, InverseDynamicsAgreesWithNewtonAndEulerInTheWorld) {
  DynamicsTerms<double> acting;
  acting.armature = false;
  EXPECT_LE(relative_error(rnea(model, *data, s.q, s.v, s.a, acting),
                           reference::inverse_dynamics(model, s.q, s.v, s.a)),
            1e-12);
}

TEST_P(Identities, ForwardDynamicsInvertsInverseDynamics) {
  const VectorXd tau = rnea(model, *data, s.q, s.v, s.a);
  EXPECT_LE(relative_error(aba(model, *data, s.q, s.v, tau), s.a), 1e-11);
}

TEST_P(Identities, MinverseInvertsM) {
  const MatrixXd product = crba(model, *data, s.q) * minverse(model, *data, s.q);
  EXPECT_LE(relative_error(product, MatrixXd::Identity(model.nv, model.nv)), 1e-10);
  EXPECT_EQ(data->M, data->M.transpose());
  EXPECT_EQ(data->Minv, data->Minv.transpose());
}

TEST_P(Identities, ColumnsOfMAreDifferencesOfInverseDynamics) {
  const MatrixXd M = crba(model, *data, s.q);
  const VectorXd zero = VectorXd::Zero(model.nv), rest = rnea(model, *data, s.q, zero, zero);
  EXPECT_LE(relative_error(rest, generalized_gravity(model, *data, s.q)), 1e-15);
  for (int k = 0; k < model.nv; ++k) {
    const VectorXd column = rnea(model, *data, s.q, zero, VectorXd::Unit(model.nv, k)) - rest;
    EXPECT_LE(relative_error(column, M.col(k)), 1e-11) << "column " << k;
  }
}

TEST_P(Identities, KineticEnergyIsAQuadraticFormOfM) {
  const double expected = 0.5 * s.v.dot(crba(model, *data, s.q) * s.v);
  EXPECT_NEAR(kinetic_energy(model, *data, s.q, s.v) / expected, 1, 1e-13);
}

TEST_P(Identities, GravityTorqueIsTheSlopeOfPotentialEnergy) {
  const VectorXd g = generalized_gravity(model, *data, s.q);
  const double h = 1e-5, scale = 1 + std::abs(potential_energy(model, *data, s.q));
  for (int k = 0; k < model.nv; ++k) {
    const VectorXd step = VectorXd::Unit(model.nv, k) * h;
    const double up = potential_energy(model, *data, integrate(model, s.q, step));
    const double down = potential_energy(model, *data, integrate<double>(model, s.q, -step));
    EXPECT_NEAR((up - down) / (2 * h), g[k], 1e-8 * scale) << "column " << k;
  }
}

// d/dt (T + V) = tau . v along the motion, by a central difference in time.
TEST_P(Identities, PowerBalance) {
  const VectorXd a = aba(model, *data, s.q, s.v, s.tau);
  const double h = 1e-5;
  const auto energy = [&](double t) {
    const VectorXd q = integrate<double>(model, s.q, s.v * t + a * (0.5 * t * t)), v = s.v + a * t;
    return kinetic_energy(model, *data, q, v) + potential_energy(model, *data, q);
  };
  const double rate = (energy(h) - energy(-h)) / (2 * h);
  EXPECT_NEAR(rate, s.tau.dot(s.v), 1e-7 * (1 + std::abs(energy(0)) + a.squaredNorm()));
}

TEST_P(Identities, ExternalForcesEnterThroughTheBodyJacobians) {
  std::vector<Force<double>> external(model.njoints());
  for (auto& f : external) f = {random.vector3(), random.vector3()};
  VectorXd expected = rnea(model, *data, s.q, s.v, s.a);
  for (int i = 0; i < model.njoints(); ++i) {
    model.frames[i].X_BF = {};
    expected -=
        frame_jacobian(model, *data, s.q, i, ReferenceFrame::kLocal).transpose() * external[i].vector();
  }
  DynamicsTerms<double> acting;
  acting.external = &external;
  EXPECT_LE(relative_error(rnea(model, *data, s.q, s.v, s.a, acting), expected), 1e-12);
  const VectorXd tau = data->tau;
  EXPECT_LE(relative_error(aba(model, *data, s.q, s.v, tau, acting), s.a), 1e-11);
}

TEST_P(Identities, FrameVelocitiesAreJacobianTimesV) {
  for (const ReferenceFrame in :
       {ReferenceFrame::kLocal, ReferenceFrame::kWorld, ReferenceFrame::kLocalWorldAligned}) {
    forward_kinematics(model, *data, s.q, s.v);
    const int frame = random.below(model.njoints());
    const VectorXd expected = frame_velocity(model, *data, frame, in).vector();
    EXPECT_LE(relative_error(frame_jacobian(model, *data, s.q, frame, in) * s.v, expected), 1e-13);
  }
}

// Velocity and acceleration of a frame's origin, by differences of its placement in time.
TEST_P(Identities, FrameMotionIsTheRateOfItsPlacement) {
  const int frame = random.below(model.njoints());
  const double h = 1e-4;
  const auto place = [&](double t) {
    forward_kinematics(model, *data, integrate<double>(model, s.q, s.v * t + s.a * (0.5 * t * t)));
    return frame_placement(model, *data, frame);
  };
  const Placement<double> X0 = place(0), up = place(h), down = place(-h);
  forward_kinematics(model, *data, s.q, s.v, s.a);
  const ReferenceFrame in = ReferenceFrame::kLocalWorldAligned;
  const Motion<double> v = frame_velocity(model, *data, frame, in);
  const Motion<double> a = frame_classical_acceleration(model, *data, frame, in);
  const double scale = 1 + a.vector().norm() * 10 + std::pow(v.vector().norm(), 3) * 10;
  EXPECT_LE(((up.p - down.p) / (2 * h) - v.linear).norm(), 1e-6 * scale);
  EXPECT_LE((log(Matrix3<double>(up.R * down.R.transpose())) / (2 * h) - v.angular).norm(), 1e-6 * scale);
  EXPECT_LE(((up.p - 2 * X0.p + down.p) / (h * h) - a.linear).norm(), 1e-5 * scale);
}

// Free fall: without external forces and joint torques the base's orientation does not show in the joints'
// accelerations.
TEST_P(FloatingIdentities, FreeFallDoesNotFeelGravity) {
  const VectorXd with = aba(model, *data, s.q, s.v, s.tau);
  DynamicsTerms<double> acting;
  acting.gravity = false;
  const VectorXd without = aba(model, *data, s.q, s.v, s.tau, acting);
  EXPECT_LE((with - without).tail(model.nv - 3).norm(), 1e-11 * with.norm());
}

TEST_P(FloatingIdentities, RootPositionEntersNothing) {
  Data<double> far(model);
  VectorXd q = s.q;
  q.head<3>() += Vector3<double>(1e8, -1e8, 3e7);
  EXPECT_EQ(rnea(model, *data, s.q, s.v, s.a), rnea(model, far, q, s.v, s.a));
  EXPECT_EQ(crba(model, *data, s.q), crba(model, far, q));
  fd_derivatives(model, *data, s.q, s.v, s.tau);
  fd_derivatives(model, far, q, s.v, s.tau);
  EXPECT_EQ(data->ddq, far.ddq);
  EXPECT_EQ(data->Minv, far.Minv);
  EXPECT_EQ(data->dtau_dq, far.dtau_dq);
  EXPECT_EQ(data->dtau_dv, far.dtau_dv);
  EXPECT_EQ(data->ddq_dq, far.ddq_dq);
  EXPECT_EQ(data->ddq_dv, far.ddq_dv);
}

TEST_P(FloatingIdentities, BothQuaternionsOfARotationAreOne) {
  Data<double> other(model);
  VectorXd q = s.q;
  q.segment<4>(3) *= -1;
  fd_derivatives(model, *data, s.q, s.v, s.tau);
  fd_derivatives(model, other, q, s.v, s.tau);
  EXPECT_EQ(data->ddq, other.ddq);
  EXPECT_EQ(data->ddq_dq, other.ddq_dq);
  EXPECT_EQ(data->ddq_dv, other.ddq_dv);
  EXPECT_EQ(data->Minv, other.Minv);
  EXPECT_EQ(difference(model, s.q, q), VectorXd::Zero(model.nv));
}

// The length of a quaternion or of a (cos, sin) pair carries nothing.
TEST_P(Identities, UnnormalisedConfigurationsAreReadByDirection) {
  VectorXd q = s.q;
  for (const Joint<double>& joint : model.joints) {
    auto unit = unit_part(joint, q);
    unit *= unit.size() == 4 ? 1e-3 : 1.01;
  }
  Data<double> other(model);
  fd_derivatives(model, *data, s.q, s.v, s.tau);
  fd_derivatives(model, other, q, s.v, s.tau);
  EXPECT_LE(relative_error(other.ddq, data->ddq), 1e-12);
  EXPECT_LE(relative_error(other.dtau_dq, data->dtau_dq), 1e-12);
  EXPECT_LE(relative_error(other.ddq_dv, data->ddq_dv), 1e-11);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Identities, ::testing::Range(1UL, kSeeds + 1));
INSTANTIATE_TEST_SUITE_P(Seeds, FloatingIdentities, ::testing::Range(1UL, kSeeds + 1, 2UL));

TEST(Arguments, WrongSizesAreNamed) {
  Random random(3);
  const Model<double> model = random_tree(random);
  Data<double> data(model);
  const VectorXd q = neutral(model), v = VectorXd::Zero(model.nv), longer = VectorXd::Zero(model.nv + 1);
  EXPECT_THROW(rnea(model, data, longer, v, v), ArgumentError);
  EXPECT_THROW(aba(model, data, q, v, longer), ArgumentError);
  EXPECT_THROW(integrate(model, q, longer), ArgumentError);
  EXPECT_THROW(frame_placement(model, data, 99), ArgumentError);
  try {
    crba(model, data, longer);
    FAIL() << "no error";
  } catch (const ArgumentError& e) {
    EXPECT_NE(std::string(e.what()).find("crba: q has"), std::string::npos) << e.what();
  }
}

// Six dofs each: a free body, arms of six joints in a row, in two branches, about other axes, and of another order.
std::vector<Model<double>> robots_of_six_dofs() {
  const Inertia<double> body{1.5, {0.1, 0.02, -0.05}, Eigen::Vector3d(0.03, 0.05, 0.07).asDiagonal()};
  std::vector<Model<double>> robots(5);
  for (int r = 0; r < 4; ++r) {
    robots[r].name = "robot " + std::to_string(r);
    for (int i = 0; i < 6; ++i) {
      Joint<double> joint;
      joint.name = "joint " + std::to_string(i);
      if (r == 3 && i == 4) joint.type = JointType::kPrismatic;
      joint.axis = Eigen::Vector3d::Unit((i + (r == 2 && i > 3)) % 3);
      robots[r].add_joint(r == 1 && i == 3 ? 0 : i - 1, joint, {Matrix3<double>::Identity(), {0.1, 0, 0.3}},
                          body);
    }
  }
  Joint<double> root;
  root.name = "root";
  root.type = JointType::kFreeFlyer;
  robots[4].name = "body";
  robots[4].add_joint(-1, root, {}, body);
  return robots;
}

// Each would otherwise run over the end of arrays, or take the other's columns.
TEST(Arguments, WorkspacesOfAnotherRobotAreRefused) {
  const std::vector<Model<double>> robots = robots_of_six_dofs();
  for (std::size_t i = 0; i < robots.size(); ++i) {
    const Model<double>& model = robots[i];
    const VectorXd q = neutral(model), v = VectorXd::Constant(6, 0.3);
    for (std::size_t k = 0; k < robots.size(); ++k) {
      const Model<double>& other = robots[k];
      Data<double> data(model), others(other);
      Centroidal<double> center(other);
      EnergyGradients<double> gradients(other);
      Hessian<double> hessian(other);
      SecondOrder<double> second(other);
      KinematicDerivatives<double> kinematics(other);
      RegressorData<double> regressor(other);
      ConstraintData<double> constraints(other, {{3, 0, {}, -1, {}}});
      const auto refused = [&](const char* what, bool expected, const std::function<void()>& call) {
        SCOPED_TRACE(std::string(what) + ", " + model.name + " and " + other.name);
        try {
          call();
          EXPECT_FALSE(expected) << "no error";
        } catch (const ArgumentError& e) {
          EXPECT_TRUE(expected) << e.what();
          EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
        }
      };
      const bool other_shape = i != k, other_count = model.njoints() != other.njoints();
      refused("rnea", other_shape, [&] { rnea(model, others, q, v, v); });
      refused("aba", other_shape, [&] { aba(model, others, q, v, v); });
      refused("crba", other_shape, [&] { crba(model, others, q); });
      refused("forward_kinematics", other_shape, [&] { forward_kinematics(model, others, q); });
      refused("fd_derivatives", other_shape, [&] { fd_derivatives(model, others, q, v, v); });
      refused("id_hessian", other_shape, [&] { id_hessian(model, data, hessian, q, v, v, v); });
      refused("fd_hessian", other_shape, [&] { fd_hessian(model, data, hessian, q, v, v, v); });
      refused("id_second_order", other_shape, [&] { id_second_order(model, data, second, q, v, v); });
      refused("constrained_dynamics", other_shape,
              [&] { constrained_dynamics(model, data, constraints, q, v, v); });
      refused("centroidal_momentum", other_count, [&] { centroidal_momentum(model, data, center, q, v); });
      refused("centroidal_matrix", other_count, [&] { centroidal_matrix(model, data, center, q); });
      refused("kinetic_energy_gradients", other_count,
              [&] { kinetic_energy_gradients(model, data, gradients, q, v); });
      refused("gravity_derivatives", other_count, [&] { gravity_derivatives(model, data, gradients, q); });
      refused("torque_regressor", other_count, [&] { torque_regressor(model, data, regressor, q, v, v); });
      refused("frame_velocity_derivatives", other_count, [&] {
        forward_kinematics(model, data, q, v);
        frame_velocity_derivatives(model, data, kinematics, on_body(0), ReferenceFrame::kWorld);
      });
    }
  }
}

}  // namespace
}  // namespace dyntape::dynamics::identities_test
