// SPDX-License-Identifier: BSD-3-Clause
// Water that bodies carry along: Kirchhoff's equations, and what it must share with rigid bodies.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/energy.h>
#include <dyntape/dynamics/algorithms/second_order.h>
#include <dyntape/dynamics/effects/effects.h>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::added_mass_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

AddedBody<double> random_hull(const Model<double>& model, Random& random) {
  AddedBody<double> hull;
  hull.body = random.below(model.njoints());
  hull.X_BF = random_placement(random);
  for (int k = 0; k < 3; ++k) hull.mass[k] = random.uniform(0, 5), hull.inertia[k] = random.uniform(0, 2);
  return hull;
}

class AddedMassOn : public ::testing::TestWithParam<unsigned long> {
 protected:
  AddedMassOn() : random(GetParam()) {
    model = random_tree(random, {1 + random.below(6), GetParam() % 2 ? Base::kFloating : Base::kFixed});
    s = random_state(model, random);
    for (int i = 0; i < 3; ++i) effects.added_mass.push_back(random_hull(model, random));
  }
  Random random;
  Model<double> model;
  State s;
  Effects<double> effects;
};

TEST_P(AddedMassOn, IsPartOfTheInertiaAndOfTheKineticEnergy) {
  Data<double> data(model);
  const DynamicsTerms<double> acting = effects.acting();
  const MatrixXd M = crba(model, data, s.q, acting), bare = crba(model, data, s.q);
  EXPECT_EQ(M, M.transpose());
  EXPECT_GT((M - bare).norm(), 1e-3);
  const MatrixXd one = MatrixXd::Identity(model.nv, model.nv);
  EXPECT_LE((M * minverse(model, data, s.q, acting) - one).norm(), 1e-9);
  const double energy = kinetic_energy(model, data, s.q, s.v, acting);
  EXPECT_NEAR(energy, 0.5 * s.v.dot(M * s.v), 1e-12 * energy);
  EnergyGradients<double> e(model);
  kinetic_energy_gradients(model, data, e, s.q, s.v, acting);
  EXPECT_NEAR(data.kinetic_energy, energy, 1e-13 * energy);
  EXPECT_LE((e.dT_dv - M * s.v).norm(), 1e-12 * e.dT_dv.norm());
}

// d/dt T = v . tau + power of gravity, along the motion.
TEST_P(AddedMassOn, NeitherTakesNorSuppliesEnergy) {
  Data<double> data(model);
  EffectTorques<double> torques(model);
  EnergyGradients<double> e(model);
  const VectorXd a = forward_dynamics(model, data, torques, effects, s.q, s.v, s.tau);
  kinetic_energy_gradients(model, data, e, s.q, s.v, effects.acting());
  const double rate = e.dT_dq.dot(s.v) + e.dT_dv.dot(a);
  const double power = s.v.dot(s.tau) + effect_power(model, data, torques, effects, s.q, s.v, s.tau);
  EXPECT_NEAR(rate, power, 1e-10 * (std::abs(rate) + e.dT_dv.cwiseProduct(a).cwiseAbs().sum()));
}

// The same along all axes: a rigid body whose weight is carried.
TEST_P(AddedMassOn, OfASphereIsThatOfARigidBodyThatIsCarried) {
  AddedBody<double> sphere = random_hull(model, random);
  sphere.mass.setConstant(3), sphere.inertia.setConstant(0.4);
  effects.added_mass = AddedMass<double>(std::vector<AddedBody<double>>{sphere});
  Data<double> data(model);
  EffectTorques<double> torques(model);
  const VectorXd in_water = forward_dynamics(model, data, torques, effects, s.q, s.v, s.tau);

  Model<double> heavier = model;
  const Matrix3<double> ball = Matrix3<double>::Identity() * 0.4;
  heavier.inertias[sphere.body] = heavier.inertias[sphere.body] + Inertia<double>{3, sphere.X_BF.p, ball};
  Effects<double> carried;
  Wrench<double> lift;
  lift.body = sphere.body, lift.X_BF = sphere.X_BF, lift.fixed_in = FixedIn::kWorld;
  lift.value.linear = -(model.gravity * 3.0);
  carried.wrenches.push_back(lift);
  const VectorXd rigid = forward_dynamics(heavier, data, torques, carried, s.q, s.v, s.tau);
  EXPECT_LE((in_water - rigid).norm(), 1e-10 * (1 + rigid.norm()));
}

TEST_P(AddedMassOn, IsRefusedWhereSecondOrderDoesNotKnowIt) {
  Data<double> data(model);
  SecondOrder<double> second(model);
  EXPECT_THROW(id_second_order(model, data, second, s.q, s.v, s.a, effects.acting()), ArgumentError);
}

INSTANTIATE_TEST_SUITE_P(Seeds, AddedMassOn, ::testing::Range(1UL, 9UL));

// A free body far from gravity: Kirchhoff's equations, with the moment v x D v that turns hulls broadside.
TEST(AddedMass, OfAFreeBodyFollowsKirchhoff) {
  Random random(7);
  Model<double> model = random_tree(random, {1, Base::kFloating});
  Effects<double> effects;
  effects.gravity = false;
  const Inertia<double> I = model.inertias[0];
  AddedBody<double> hull = random_hull(model, random);
  hull.body = 0, hull.X_BF = Placement<double>{Matrix3<double>::Identity(), I.com};
  effects.added_mass.push_back(hull);
  for (int trial = 0; trial < 20; ++trial) {
    const State s = random_state(model, random);
    Data<double> data(model);
    EffectTorques<double> torques(model);
    const VectorXd a =
        forward_dynamics(model, data, torques, effects, s.q, s.v, VectorXd::Zero(model.nv).eval());
    const Eigen::Vector3d c = I.com, w = s.v.segment<3>(3), v = s.v.head<3>() + w.cross(c);
    // Of the centre of mass, in body axes: d/dt (R v_c) = R (v_c' + w x v_c).
    const Eigen::Vector3d w_dot = a.segment<3>(3), v_dot = a.head<3>() + w_dot.cross(c);
    const Eigen::Vector3d D = hull.mass, m = D.array() + I.mass;
    const Eigen::Matrix3d J =
        Eigen::Matrix3d(I.I_c) + Eigen::Vector3d(hull.inertia).asDiagonal().toDenseMatrix();
    const Eigen::Vector3d force = m.cwiseProduct(v_dot) + w.cross(m.cwiseProduct(v));
    const Eigen::Vector3d moment = J * w_dot + w.cross(J * w) + v.cross(D.cwiseProduct(v));
    EXPECT_LE(force.norm(), 1e-11 * (1 + v.norm() * w.norm() * m.norm()));
    EXPECT_LE(moment.norm(), 1e-11 * (1 + v.squaredNorm() * m.norm() + w.squaredNorm() * J.norm()));
  }
}

}  // namespace
}  // namespace dyntape::dynamics::added_mass_test
