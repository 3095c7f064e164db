// SPDX-License-Identifier: BSD-3-Clause
//
// Torques and energies are linear in the masses, and in nothing else that is called inertia.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/regressor.h>
#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include "dynamics/random_robots.h"
#include "dynamics/robot_files.h"

namespace dyntape::dynamics::regressor_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// The robot in 113 bits with rotations that are rotations to 113 bits: those of the file hold to 1e-16, and
// identities between two formulas then hold no better.
Model<Float128> with_true_rotations(Model<double> model) {
  for (Joint<double>& joint : model.joints) {
    if (Axis::from(joint.axis).index < 0) joint.axis = Eigen::Vector3d::UnitY();
  }
  Model<Float128> exact = model.cast<Float128>();
  for (Placement<Float128>& X : exact.X_PJ) {
    const Vector3<Float128> x = X.R.column(0) * (1 / sqrt(X.R.column(0).squaredNorm()));
    Vector3<Float128> z = x.cross(X.R.column(1));
    z = z * (1 / sqrt(z.squaredNorm()));
    X.R.set_column(0, x);
    X.R.set_column(1, z.cross(x));
    X.R.set_column(2, z);
  }
  return exact;
}

class RegressorOf : public ::testing::TestWithParam<unsigned long> {
 protected:
  RegressorOf() : random(GetParam()) {
    RandomTreeShape shape{1 + random.below(9), GetParam() % 2 ? Base::kFloating : Base::kFixed};
    shape.inner_free_flyers = GetParam() % 3 == 0;
    model = random_tree(random, shape);
    s = random_state(model, random);
    acting.armature = false;
  }

  Random random;
  Model<double> model;
  State s;
  DynamicsTerms<double> acting;
};

TEST_P(RegressorOf, TimesParametersIsInverseDynamics) {
  Data<double> data(model);
  RegressorData<double> regressor(model);
  const VectorXd theta = inertial_parameters(model);
  const MatrixXd& Y = torque_regressor(model, data, regressor, s.q, s.v, s.a);
  EXPECT_LE(relative_error(Y * theta, rnea(model, data, s.q, s.v, s.a, acting)), 1e-14);
}

TEST_P(RegressorOf, AgreesWithItselfIn113Bits) {
  const Model<Float128> exact = model.cast<Float128>();
  Data<double> data(model);
  Data<Float128> exact_data(exact);
  RegressorData<double> regressor(model);
  RegressorData<Float128> exact_regressor(exact);
  const VectorX<Float128> q = s.q.cast<Float128>(), v = s.v.cast<Float128>(), a = s.a.cast<Float128>();
  const MatrixXd reference = torque_regressor(exact, exact_data, exact_regressor, q, v, a).cast<double>();
  EXPECT_LE(relative_error(torque_regressor(model, data, regressor, s.q, s.v, s.a), reference), 1e-14);
}

TEST_P(RegressorOf, TimesParametersIsInverseDynamicsTo113Bits) {
  const Model<Float128> exact = with_true_rotations(model);
  Data<Float128> data(exact);
  RegressorData<Float128> regressor(exact);
  const VectorX<Float128> q = s.q.cast<Float128>(), v = s.v.cast<Float128>(), a = s.a.cast<Float128>();
  const VectorX<Float128> theta = inertial_parameters(exact);
  DynamicsTerms<Float128> bare;
  bare.armature = false;
  const MatrixX<Float128>& Y = torque_regressor(exact, data, regressor, q, v, a);
  EXPECT_LE(relative_error(Y * theta, rnea(exact, data, q, v, a, bare)), 1e-31);
}

// A column is the torque of a robot that has one parameter and nothing else.
TEST_P(RegressorOf, ColumnsAreTorquesOfUnitParameters) {
  Data<double> data(model);
  RegressorData<double> regressor(model);
  const MatrixXd Y = torque_regressor(model, data, regressor, s.q, s.v, s.a);
  const VectorXd theta = inertial_parameters(model);
  const VectorXd tau = rnea(model, data, s.q, s.v, s.a, acting);
  MatrixXd differences(Y.rows(), Y.cols());
  for (long k = 0; k < theta.size(); ++k) {
    VectorXd changed = theta;
    changed[k] += 1;
    Model<double> other = model;
    set_inertial_parameters(other, changed);
    differences.col(k) = rnea(other, data, s.q, s.v, s.a, acting) - tau;
  }
  EXPECT_LE(relative_error(Y, differences), 1e-12);
}

// Errata E22: with the inertia about the centre of mass among the parameters there is no such matrix.
TEST_P(RegressorOf, InertiaAboutTheCentreOfMassFails) {
  Data<double> data(model);
  RegressorData<double> regressor(model);
  const MatrixXd& Y = torque_regressor(model, data, regressor, s.q, s.v, s.a);
  VectorXd about_com(10 * model.njoints());
  for (int i = 0; i < model.njoints(); ++i) {
    Inertia<double> centred = model.inertias[i];
    centred.com.setZero();
    about_com.segment<10>(10 * i) = inertial_parameters(centred);
    about_com.segment<3>(10 * i + 1) = model.inertias[i].com * model.inertias[i].mass;
  }
  bool turns = false;
  for (const Joint<double>& joint : model.joints) turns = turns || joint.type != JointType::kPrismatic;
  const VectorXd tau = rnea(model, data, s.q, s.v, s.a, acting);
  const double error = relative_error(Y * about_com, tau);
  EXPECT_EQ(error > 1e-6, turns) << error;
}

TEST_P(RegressorOf, EnergiesAreLinear) {
  Data<double> data(model);
  RegressorData<double> regressor(model);
  const VectorXd theta = inertial_parameters(model);
  const double kinetic = kinetic_energy_regressor(model, data, regressor, s.q, s.v).dot(theta);
  EXPECT_NEAR(kinetic, kinetic_energy(model, data, s.q, s.v, acting), 1e-13 * std::abs(kinetic));
  const double potential = potential_energy_regressor(model, data, regressor, s.q).dot(theta);
  double scale = 0;
  for (int i = 0; i < model.njoints(); ++i) {
    scale += model.inertias[i].mass * model.gravity.norm() * (1 + data.X_WB[i].p.norm());
  }
  EXPECT_NEAR(potential, potential_energy(model, data, s.q), 1e-14 * scale);
}

// Power of the torques is the rate of the energy, parameter by parameter: v^T Y = d/dt (kinetic + potential).
TEST_P(RegressorOf, PowerIsTheRateOfEnergy) {
  const Model<Float128> exact = with_true_rotations(model);
  Data<Float128> data(exact);
  RegressorData<Float128> regressor(exact);
  const VectorX<Float128> q = s.q.cast<Float128>(), v = s.v.cast<Float128>(), a = s.a.cast<Float128>();
  const RowVectorX<Float128> power = v.transpose() * torque_regressor(exact, data, regressor, q, v, a);
  const auto energy = [&](const Float128& t) -> RowVectorX<Float128> {
    const VectorX<Float128> step = v * t, later_v = v + a * t;
    const VectorX<Float128> later_q = integrate<Float128>(exact, q, step);
    return kinetic_energy_regressor(exact, data, regressor, later_q, later_v) +
           potential_energy_regressor(exact, data, regressor, later_q);
  };
  const Float128 h(1e-11);
  const RowVectorX<Float128> rate = (energy(h) - energy(-h)) / (2 * h);
  EXPECT_LE(relative_error(power, rate), 1e-18);
}

TEST_P(RegressorOf, ArmatureAndFrictionHaveColumns) {
  Data<double> data(model);
  JointColumns columns{true, true, true, 0.3};
  RegressorData<double> regressor(model, columns);
  Effects<double> effects;
  effects.armature = model_armature(model);
  effects.damping = model_damping(model);
  effects.friction = CoulombFriction<double>{model_friction(model), columns.smoothing};
  const long n = static_cast<long>(regressor.single.size()), bodies = 10 * model.njoints();
  VectorXd theta(bodies + 3 * n);
  theta.head(bodies) = inertial_parameters(model);
  for (long k = 0; k < n; ++k) {
    const int dof = regressor.single[static_cast<std::size_t>(k)];
    theta[bodies + k] = effects.armature->inertia[dof];
    theta[bodies + n + k] = effects.damping->coefficient[dof];
    theta[bodies + 2 * n + k] = effects.friction->torque[dof];
  }
  EffectTorques<double> torques(model);
  const MatrixXd& Y = torque_regressor(model, data, regressor, s.q, s.v, s.a);
  ASSERT_EQ(Y.cols(), theta.size());
  EXPECT_LE(relative_error(Y * theta, inverse_dynamics(model, data, torques, effects, s.q, s.v, s.a)), 1e-14);
}

TEST_P(RegressorOf, DoesNotKnowWhereTheBaseIs) {
  Data<double> data(model);
  RegressorData<double> regressor(model);
  const MatrixXd near = torque_regressor(model, data, regressor, s.q, s.v, s.a);
  for (int i = 0; i < model.njoints(); ++i) {
    if (model.parent[i] < 0) model.X_PJ[i].p += Eigen::Vector3d(1e8, -3e8, 2e8);
  }
  EXPECT_EQ(near, torque_regressor(model, data, regressor, s.q, s.v, s.a));
}

INSTANTIATE_TEST_SUITE_P(Seeds, RegressorOf, ::testing::Range(1UL, 31UL));

TEST(Regressor, HoldsOnTheRobots) {
  for (const std::string& name : robot_names()) {
    UrdfOptions options;
    options.base = name == "solo12" ? Base::kFloating : Base::kFixed;
    const Model<double> model = load_urdf(robot_file(name), options);
    Random random(7);
    const State s = random_state(model, random);
    Data<double> data(model);
    RegressorData<double> regressor(model);
    DynamicsTerms<double> acting;
    acting.armature = false;
    const MatrixXd& Y = torque_regressor(model, data, regressor, s.q, s.v, s.a);
    EXPECT_LE(relative_error(Y * inertial_parameters(model), rnea(model, data, s.q, s.v, s.a, acting)), 1e-14)
        << name;
  }
}

TEST(Regressor, ParametersAndInertiasAreTheSame) {
  Random random(3);
  for (int k = 0; k < 20; ++k) {
    const Inertia<double> inertia = random_inertia(random);
    const Inertia<double> again = inertia_from(inertial_parameters(inertia));
    EXPECT_EQ(again.mass, inertia.mass);
    EXPECT_LE(relative_error(again.com, inertia.com), 1e-15);
    EXPECT_LE(relative_error(again.I_c, inertia.I_c), 1e-13);
  }
  const Inertia<double> none = inertia_from(Vector10<double>(Vector10<double>::Zero()));
  EXPECT_EQ(none.com, Eigen::Vector3d::Zero());
}

TEST(Regressor, WrongSizesAreNamed) {
  Random random(1);
  Model<double> model = random_tree(random), other = random_tree(random, {.joints = 3});
  Data<double> data(model);
  RegressorData<double> regressor(model), small(other);
  const VectorXd q = neutral(model), v = VectorXd::Zero(model.nv);
  EXPECT_THROW(torque_regressor(model, data, regressor, v.head(1), v, v), ArgumentError);
  EXPECT_THROW(torque_regressor(model, data, small, q, v, v), ArgumentError);
  EXPECT_THROW(set_inertial_parameters<double>(model, v.head(1)), ArgumentError);
}

}  // namespace
}  // namespace dyntape::dynamics::regressor_test
