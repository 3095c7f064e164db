// SPDX-License-Identifier: BSD-3-Clause
//
// Momentum about the centre of mass against sums over the bodies in the world, and its derivatives against
// central differences in 113 bits.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/centroidal.h>

#include <algorithm>
#include <functional>
#include <memory>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::centroidal_test {
namespace {

using Eigen::MatrixXd;
using Vector3d = Vector3<double>;
using Eigen::VectorXd;
using MatrixXq = MatrixX<Float128>;
using VectorXq = VectorX<Float128>;

// As relative_error, for what may be zero but for the noise of a difference: sizes here are one and more.
double error(const MatrixXd& a, const MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / std::max(b.cwiseAbs().maxCoeff(), 0.1);
}

VectorXq stacked(const Force<Float128>& f) { return f.vector(); }

class CentroidalOf : public ::testing::TestWithParam<unsigned long> {
 protected:
  CentroidalOf() : random(GetParam()) {
    const RandomTreeShape shape{1 + random.below(7), GetParam() % 2 ? Base::kFloating : Base::kFixed,
                                GetParam() % 5 == 0, GetParam() % 7 == 0};
    model = random_tree(random, shape);
    if (GetParam() % 6 == 0) {  // a second tree on the world
      model.add_joint(-1, random_joint(random, "other root", JointType::kFreeFlyer), random_placement(random),
                      random_inertia(random));
      model.add_joint(model.njoints() - 1, random_joint(random, "other joint", JointType::kRevolute),
                      random_placement(random), random_inertia(random));
    }
    exact = model.cast<Float128>();
    s = random_state(model, random);
    q = s.q.cast<Float128>();
    v = s.v.cast<Float128>();
    a = s.a.cast<Float128>();
    data = std::make_unique<Data<double>>(model);
    data128 = std::make_unique<Data<Float128>>(exact);
    c = std::make_unique<Centroidal<double>>(model);
    c128 = std::make_unique<Centroidal<Float128>>(exact);
  }

  // (f(q (+) d) - f(q (-) d)) / 2 h, a column for each direction; along: one direction.
  VectorXq slope(const VectorXq& direction, const std::function<VectorXq(const VectorXq&)>& f) {
    const Float128 h(1e-11);
    return (f(integrate<Float128>(exact, q, direction * h)) -
            f(integrate<Float128>(exact, q, -direction * h))) /
           (2 * h);
  }
  MatrixXd derivatives(const std::function<VectorXq(const VectorXq&)>& f) {
    MatrixXq d(f(q).size(), model.nv);
    for (int k = 0; k < model.nv; ++k) d.col(k) = slope(VectorXq(VectorXq::Unit(model.nv, k)), f);
    return d.cast<double>();
  }
  MatrixXd slopes_of_vector(const VectorXq& x, const std::function<VectorXq(const VectorXq&)>& f) {
    const Float128 h(1e-11);
    MatrixXq d(f(x).size(), model.nv);
    for (int k = 0; k < model.nv; ++k) {
      const VectorXq step = VectorXq::Unit(model.nv, k) * h;
      d.col(k) = (f(x + step) - f(x - step)) / (2 * h);
    }
    return d.cast<double>();
  }
  bool floats_alone() const { return model.joints[0].type == JointType::kFreeFlyer && roots() == 1; }
  int roots() const { return static_cast<int>(std::count(model.parent.begin(), model.parent.end(), -1)); }

  Random random;
  Model<double> model;
  Model<Float128> exact;
  State s;
  VectorXq q, v, a;
  std::unique_ptr<Data<double>> data;
  std::unique_ptr<Data<Float128>> data128;
  std::unique_ptr<Centroidal<double>> c;
  std::unique_ptr<Centroidal<Float128>> c128;
};

// The definition: sums over bodies whose motion in the world forward_kinematics knows.
TEST_P(CentroidalOf, MomentumIsASumOverBodies) {
  forward_kinematics(model, *data, s.q, s.v, s.a);
  const auto X_WB = data->X_WB;
  const auto body_v = data->v;
  double mass = 0;
  Vector3d com = Vector3d::Zero(), p = Vector3d::Zero(), l = Vector3d::Zero();
  for (int i = 0; i < model.njoints(); ++i) {
    mass += model.inertias[i].mass;
    com += model.inertias[i].mass * (X_WB[i].R * model.inertias[i].com + X_WB[i].p);
  }
  com /= mass;
  Matrix3<double> inertia = Matrix3<double>::Zero();
  for (int i = 0; i < model.njoints(); ++i) {
    const Inertia<double>& I = model.inertias[i];
    const Vector3d r = X_WB[i].R * I.com + X_WB[i].p - com;
    const Vector3d body_p = X_WB[i].R * (I.mass * (body_v[i].linear + body_v[i].angular.cross(I.com)));
    p += body_p;
    l += r.cross(body_p) + X_WB[i].R * (I.I_c * body_v[i].angular);
    inertia += X_WB[i].R * I.I_c * X_WB[i].R.transpose() +
               I.mass * (r.squaredNorm() * Matrix3<double>::Identity() - r * r.transpose());
  }
  const Force<double> h = centroidal_momentum(model, *data, *c, s.q, s.v);
  EXPECT_NEAR(c->mass, mass, 1e-14 * mass);
  EXPECT_LE((c->com - com).norm(), 1e-14 * (1 + com.norm()));
  EXPECT_LE((h.vector() - (VectorXd(6) << p, l).finished()).norm(), 1e-13 * h.vector().norm());
  EXPECT_LE((c->velocity - p / mass).norm(), 1e-13 * c->velocity.norm());
  centroidal_matrix(model, *data, *c, s.q);
  EXPECT_LE(relative_error(c->A * s.v, h.vector()), 1e-13);
  EXPECT_LE(relative_error(c->I, inertia), 1e-13);
  EXPECT_EQ(c->I, c->I.transpose());
}

// Along q (+) (v t + a t^2/2): the position of the centre of mass, its velocity, momentum and matrix.
TEST_P(CentroidalOf, RatesAreDerivativesInTime) {
  center_of_mass(model, *data, *c, s.q, s.v, s.a);
  const VectorXq along = v;
  const VectorXd velocity = slope(along, [&](const VectorXq& x) -> VectorXq {
                              return center_of_mass(exact, *data128, *c128, x);
                            }).cast<double>();
  EXPECT_LE(relative_error(c->velocity, velocity), 1e-13);
  const Force<double> h_dot = centroidal_momentum_rate(model, *data, *c, s.q, s.v, s.a);
  const Float128 h(1e-11);
  const auto momentum = [&](const Float128& t) {
    return stacked(centroidal_momentum<Float128>(exact, *data128, *c128, integrate<Float128>(exact, q, v * t),
                                                 v + a * t));
  };
  const VectorXd rate = ((momentum(h) - momentum(-h)) / (2 * h)).cast<double>();
  EXPECT_LE(relative_error(h_dot.vector(), rate), 1e-13);
  EXPECT_LE(relative_error(c->acceleration * c->mass, rate.head<3>()), 1e-13);
  centroidal_matrix_rate(model, *data, *c, s.q, s.v);
  const MatrixXd A_dot = c->A_dot;
  const VectorXd sum = c->A * s.a + A_dot * s.v;
  EXPECT_LE(relative_error(sum, h_dot.vector()), 1e-13);
  const VectorXq A_rate = slope(along, [&](const VectorXq& x) -> VectorXq {
    const MatrixXq A = centroidal_matrix(exact, *data128, *c128, x);
    return A.reshaped();
  });
  EXPECT_LE(error(A_dot, A_rate.cast<double>().reshaped(6, model.nv)), 1e-13);
}

TEST_P(CentroidalOf, DerivativesMatchDifferences) {
  centroidal_derivatives(model, *data, *c, s.q, s.v, s.a);
  const auto momentum = [&](const VectorXq& x) {
    return stacked(centroidal_momentum(exact, *data128, *c128, x, v));
  };
  const auto rate = [&](const VectorXq& x, const VectorXq& y) {
    return stacked(centroidal_momentum_rate(exact, *data128, *c128, x, y, a));
  };
  EXPECT_LE(error(c->dh_dq, derivatives(momentum)), 1e-13);
  EXPECT_LE(error(c->dh_dot_dq, derivatives([&](const VectorXq& x) { return rate(x, v); })), 1e-13);
  EXPECT_LE(error(c->dh_dot_dv, slopes_of_vector(v, [&](const VectorXq& y) { return rate(q, y); })), 1e-13);
  const VectorXd h = c->h.vector(), h_dot = c->h_dot.vector();
  EXPECT_LE(relative_error(centroidal_momentum_rate(model, *data, *c, s.q, s.v, s.a).vector(), h_dot), 1e-14);
  EXPECT_LE(relative_error(c->h.vector(), h), 1e-14);
}

TEST_P(CentroidalOf, AgreesWithItselfIn113Bits) {
  centroidal_matrix_rate(model, *data, *c, s.q, s.v);
  centroidal_matrix_rate(exact, *data128, *c128, q, v);
  const auto off = [](const MatrixXd& x, const MatrixXq& y) { return error(x, y.cast<double>()); };
  EXPECT_LE(off(c->A, c128->A), 1e-14);
  EXPECT_LE(off(c->h.vector(), c128->h.vector()), 1e-14);
  EXPECT_LE(off(c->A_dot, c128->A_dot), 1e-13);
  centroidal_derivatives(model, *data, *c, s.q, s.v, s.a);
  centroidal_derivatives(exact, *data128, *c128, q, v, a);
  EXPECT_LE(off(c->com, c128->com), 1e-14);
  EXPECT_LE(off(c->velocity, c128->velocity), 1e-14);
  EXPECT_LE(off(c->acceleration, c128->acceleration), 1e-14);
  EXPECT_LE(off(c->I, c128->I), 1e-14);
  EXPECT_LE(off(c->h_dot.vector(), c128->h_dot.vector()), 1e-14);
  EXPECT_LE(off(c->dh_dq, c128->dh_dq), 1e-13);
  EXPECT_LE(off(c->dh_dot_dq, c128->dh_dot_dq), 1e-13);
  EXPECT_LE(off(c->dh_dot_dv, c128->dh_dot_dv), 1e-13);
}

TEST_P(CentroidalOf, JacobiansOfCentresOfMass) {
  com_jacobian(model, *data, *c, s.q);
  const auto com = [&](const VectorXq& x) -> VectorXq { return center_of_mass(exact, *data128, *c128, x); };
  EXPECT_LE(relative_error(c->J, derivatives(com)), 1e-13);
  const int body = random.below(model.njoints());
  const MatrixXd J = subtree_com_jacobian(model, *data, *c, s.q, body);
  const auto com_of_subtree = [&](const VectorXq& x) -> VectorXq {
    center_of_mass(exact, *data128, *c128, x);
    forward_kinematics(exact, *data128, x);
    return data128->X_WB[body].R * c128->subtree_com[body] + data128->X_WB[body].p;
  };
  EXPECT_LE(relative_error(J, derivatives(com_of_subtree)), 1e-13);
  center_of_mass(model, *data, *c, s.q, s.v, s.a);
  forward_kinematics(model, *data, s.q);
  const Matrix3<double> R = data->X_WB[body].R;
  EXPECT_LE(relative_error(R * c->subtree_velocity[body], J * s.v), 1e-13);
  const Float128 h(1e-11);
  const auto velocity = [&](const Float128& t) -> VectorXq {
    const VectorXq x = integrate<Float128>(exact, q, v * t);
    center_of_mass<Float128>(exact, *data128, *c128, x, v + a * t);
    forward_kinematics<Float128>(exact, *data128, x);
    return data128->X_WB[body].R * c128->subtree_velocity[body];
  };
  const VectorXd rate = ((velocity(h) - velocity(-h)) / (2 * h)).cast<double>();
  EXPECT_LE(relative_error(R * c->subtree_acceleration[body], rate), 1e-13);
}

// Total momentum changes by the wrenches from outside alone: weight, and what pushes the bodies.
TEST_P(CentroidalOf, MomentumChangesByOutsideWrenchesOnly) {
  if (!floats_alone()) return;
  std::vector<Force<double>> external(model.njoints());
  for (Force<double>& f : external) f = {random.vector3(5), random.vector3(5)};
  DynamicsTerms<double> acting;
  acting.armature = false;  // rotors carry no momentum here, but their reaction accelerates the bodies
  acting.external = &external;
  VectorXd tau = s.tau;
  tau.head<6>().setZero();
  const VectorXd ddq = aba(model, *data, s.q, s.v, tau, acting);
  const VectorXd h_dot = centroidal_momentum_rate(model, *data, *c, s.q, s.v, ddq).vector();
  forward_kinematics(model, *data, s.q);
  VectorXd sum = VectorXd::Zero(6);
  double size = 0;
  sum.head<3>() = c->mass * model.gravity;
  for (int i = 0; i < model.njoints(); ++i) {
    Placement<double> X_GB = data->X_WB[i];
    X_GB.p -= c->com;
    sum += act(X_GB, external[i]).vector();
    size += external[i].vector().norm();
  }
  EXPECT_LE((h_dot - sum).norm(), 1e-12 * (size + c->mass * model.gravity.norm() + ddq.norm()));
}

// Moving everything changes no momentum; turning it turns the momentum.
TEST_P(CentroidalOf, AFloatingBaseCarriesTheMomentumAlong) {
  if (!floats_alone()) return;
  centroidal_derivatives(model, *data, *c, s.q, s.v, s.a);
  EXPECT_EQ(c->dh_dq.leftCols<3>(), MatrixXd::Zero(6, 3));
  EXPECT_EQ(c->dh_dot_dq.leftCols<3>(), MatrixXd::Zero(6, 3));
  forward_kinematics(model, *data, s.q);
  for (int k = 0; k < 3; ++k) {
    const Vector3d axis = data->X_WB[0].R.col(k);
    const auto turned = [&](const Force<double>& f) -> VectorXd {
      return (VectorXd(6) << axis.cross(Vector3d(f.linear)), axis.cross(Vector3d(f.angular))).finished();
    };
    EXPECT_LE((c->dh_dq.col(3 + k) - turned(c->h)).norm(), 1e-13 * c->dh_dq.norm());
    EXPECT_LE((c->dh_dot_dq.col(3 + k) - turned(c->h_dot)).norm(), 1e-13 * c->dh_dot_dq.norm());
  }
}

TEST_P(CentroidalOf, RootPositionEntersTheCentreOnly) {
  if (!floats_alone()) return;
  Centroidal<double> far(model);
  VectorXd moved = s.q;
  moved.head<3>() += Vector3d(1e8, -1e8, 3e7);
  for (auto [at, work] : {std::pair(&s.q, c.get()), std::pair(&moved, &far)}) {
    com_jacobian<double>(model, *data, *work, *at);
    centroidal_matrix_rate<double>(model, *data, *work, *at, s.v);
    centroidal_derivatives<double>(model, *data, *work, *at, s.v, s.a);
    center_of_mass<double>(model, *data, *work, *at, s.v, s.a);
  }
  EXPECT_EQ(far.h.vector(), c->h.vector());
  EXPECT_EQ(far.h_dot.vector(), c->h_dot.vector());
  EXPECT_EQ(far.velocity, c->velocity);
  EXPECT_EQ(far.acceleration, c->acceleration);
  EXPECT_EQ(far.I, c->I);
  EXPECT_EQ(far.J, c->J);
  EXPECT_EQ(far.A, c->A);
  EXPECT_EQ(far.A_dot, c->A_dot);
  EXPECT_EQ(far.dh_dq, c->dh_dq);
  EXPECT_EQ(far.dh_dot_dq, c->dh_dot_dq);
  EXPECT_EQ(far.dh_dot_dv, c->dh_dot_dv);
  EXPECT_EQ(far.subtree_com, c->subtree_com);
}

INSTANTIATE_TEST_SUITE_P(Seeds, CentroidalOf, ::testing::Range(1UL, 21UL));

TEST(Centroidal, BodiesWithoutMassHaveTheirCentreAtZero) {
  Random random(4);
  Model<double> model = random_tree(random, {3, Base::kFloating, true});
  model.inertias[2] = {};
  Data<double> data(model);
  Centroidal<double> c(model);
  const State s = random_state(model, random);
  center_of_mass(model, data, c, s.q, s.v, s.a);
  EXPECT_EQ(c.subtree_com[2], Vector3d::Zero());
  EXPECT_EQ(c.subtree_velocity[2], Vector3d::Zero());
  EXPECT_EQ(subtree_com_jacobian(model, data, c, s.q, 2).cols(), model.nv);
  EXPECT_TRUE(c.J.allFinite());
}

TEST(Centroidal, WrongArgumentsAreNamed) {
  Random random(3);
  const Model<double> model = random_tree(random), other = random_tree(random, {3});
  Data<double> data(model);
  Centroidal<double> c(model), small(other);
  const VectorXd q = neutral(model), v = VectorXd::Zero(model.nv), longer = VectorXd::Zero(model.nv + 1);
  EXPECT_THROW(centroidal_momentum(model, data, c, q, longer), ArgumentError);
  EXPECT_THROW(centroidal_derivatives(model, data, c, q, v, longer), ArgumentError);
  EXPECT_THROW(centroidal_matrix(model, data, small, q), ArgumentError);
  EXPECT_THROW(subtree_com_jacobian(model, data, c, q, model.njoints()), ArgumentError);
}

}  // namespace
}  // namespace dyntape::dynamics::centroidal_test
