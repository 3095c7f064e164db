// SPDX-License-Identifier: BSD-3-Clause
//
// Statements about derivatives of rigid-body dynamics that are often printed and give wrong numbers, each beside
// the right one: the wrong one must fail by a wide margin, so that a test here cannot pass by accident.  Others of
// their kind are tested where the quantity is: the order of placement and joint, S x (X m) and joints whose S
// depends on q in joints_test.cpp; wrenches fixed in the world in wrenches_test.cpp; inertial parameters about the
// centre of mass in regressor_test.cpp; contact forces that move with the body in constraints_test.cpp.
#include <gtest/gtest.h>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::errata_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Matrix6d = Matrix6<double>;
using Vector6d = Vector6<double>;

// The derivative recursion column by column, as textbooks have it, with 6 x 6 matrices; what can be left out of it:
struct Textbook {
  bool own_column = true;   // the term v_i x S_i of da_i/dv_i
  bool base_falls = true;   // a_0 = -gravity in the recursion of values
  bool force_turns = true;  // the term S_i x* f_i of a force that is handed to the parent
};

Matrix6d cross_matrix(const Vector6d& v) {
  Matrix6d m = Matrix6d::Zero();
  const Vector3<double> l = v.head<3>(), w = v.tail<3>();
  m.topLeftCorner<3, 3>() = m.bottomRightCorner<3, 3>() = skew(w);
  m.topRightCorner<3, 3>() = skew(l);
  return m;
}

// Of I v, linear first, about the frame's origin.
Matrix6d matrix(const Inertia<double>& I) {
  Matrix6d m = Matrix6d::Zero();
  const Matrix3<double> mc = skew(Vector3<double>(I.com * I.mass));
  m.topLeftCorner<3, 3>().diagonal().setConstant(I.mass);
  m.topRightCorner<3, 3>() = -mc;
  m.bottomLeftCorner<3, 3>() = mc;
  m.bottomRightCorner<3, 3>() = I.I_c + unit_point_inertia(I.com) * I.mass;
  return m;
}

struct Slopes {
  MatrixXd by_q, by_v;
};

// For single joints; q has been given to `data` before.
Slopes textbook_slopes(const Model<double>& model, const Data<double>& data, const VectorXd& v,
                       const VectorXd& a, const Textbook& with) {
  const int n = model.nv;
  std::vector<Matrix6d> X(n), I(n);  // parent to child
  std::vector<Vector6d> S(n), vel(n), acc(n), f(n, Vector6d::Zero());
  std::vector<MatrixXd> v_q(n), v_v(n), a_q(n), a_v(n), f_q(n), f_v(n);
  const MatrixXd none = MatrixXd::Zero(6, n);
  Vector6d falling = Vector6d::Zero();
  if (with.base_falls) falling.head<3>() = -model.gravity;
  for (int i = 0; i < n; ++i) {
    const int p = model.parent[i];
    X[i] = action_matrix(inverse(data.X_PB[i]));
    I[i] = matrix(model.inertias[i]);
    S[i] = motion<double>(data.tree.dofs[i]).vector();
    const Vector6d v_p = p < 0 ? Vector6d::Zero() : Vector6d(X[i] * vel[p]);
    const Vector6d a_p = X[i] * (p < 0 ? falling : acc[p]);
    vel[i] = v_p + S[i] * v[i];
    acc[i] = a_p + S[i] * a[i] + cross_matrix(vel[i]) * S[i] * v[i];
    f[i] = I[i] * acc[i] - cross_matrix(vel[i]).transpose() * I[i] * vel[i];
    v_q[i] = X[i] * (p < 0 ? none : v_q[p]);
    v_v[i] = X[i] * (p < 0 ? none : v_v[p]);
    a_q[i] = X[i] * (p < 0 ? none : a_q[p]);
    a_v[i] = X[i] * (p < 0 ? none : a_v[p]);
    v_q[i].col(i) += cross_matrix(v_p) * S[i];
    v_v[i].col(i) += S[i];
    for (int k = 0; k < n; ++k) {
      a_q[i].col(k) += cross_matrix(v_q[i].col(k)) * S[i] * v[i];
      a_v[i].col(k) += cross_matrix(v_v[i].col(k)) * S[i] * v[i];
    }
    a_q[i].col(i) += cross_matrix(a_p) * S[i];
    if (with.own_column) a_v[i].col(i) += cross_matrix(vel[i]) * S[i];
    const auto slope = [&](const MatrixXd& dv, const MatrixXd& da) {
      MatrixXd df = I[i] * da - cross_matrix(vel[i]).transpose() * I[i] * dv;
      for (int k = 0; k < n; ++k) df.col(k) -= cross_matrix(dv.col(k)).transpose() * I[i] * vel[i];
      return df;
    };
    f_q[i] = slope(v_q[i], a_q[i]);
    f_v[i] = slope(v_v[i], a_v[i]);
  }
  Slopes result{MatrixXd::Zero(n, n), MatrixXd::Zero(n, n)};
  for (int i = n - 1; i >= 0; --i) {
    result.by_q.row(i) = S[i].transpose() * f_q[i];
    result.by_v.row(i) = S[i].transpose() * f_v[i];
    const int p = model.parent[i];
    if (p < 0) continue;
    if (with.force_turns) f_q[i].col(i) -= cross_matrix(S[i]).transpose() * f[i];
    f[p] += X[i].transpose() * f[i];
    f_q[p] += X[i].transpose() * f_q[i];
    f_v[p] += X[i].transpose() * f_v[i];
  }
  return result;
}

class Errata : public ::testing::TestWithParam<unsigned long> {
 protected:
  Errata() : random(GetParam()) {
    model.gravity = {1, 2, -9};
    for (int i = 0; i < 7; ++i) {
      const JointType type = i % 3 == 2 ? JointType::kPrismatic : JointType::kRevolute;
      const int parent = i == 0 ? -1 : i < 4 ? i - 1 : random.below(i);
      model.add_joint(parent, random_joint(random, "joint " + std::to_string(i), type),
                      random_placement(random), random_inertia(random));
      model.joints.back().armature = 0;
    }
    s = random_state(model, random);
  }

  Random random;
  Model<double> model;
  State s;
};

TEST_P(Errata, TextbookRecursionAsItShouldBe) {
  Data<double> data(model);
  id_derivatives<double>(model, data, s.q, s.v, s.a);
  const Slopes derivatives = textbook_slopes(model, data, s.v, s.a, {});
  EXPECT_LE(relative_error(derivatives.by_q, data.dtau_dq), 1e-12);
  EXPECT_LE(relative_error(derivatives.by_v, data.dtau_dv), 1e-12);
}

// E1: da_i/dv_i without v_i x S_i.
TEST_P(Errata, AccelerationNeedsItsOwnColumn) {
  Data<double> data(model);
  id_derivatives<double>(model, data, s.q, s.v, s.a);
  EXPECT_GT(relative_error(textbook_slopes(model, data, s.v, s.a, {.own_column = false}).by_v, data.dtau_dv),
            1e-2);
}

// E1b: a_0 = 0 instead of -gravity loses the slope of gravity.
TEST_P(Errata, TheBaseFallsAgainstGravity) {
  Data<double> data(model);
  id_derivatives<double>(model, data, s.q, s.v, s.a);
  EXPECT_GT(relative_error(textbook_slopes(model, data, s.v, s.a, {.base_falls = false}).by_q, data.dtau_dq),
            1e-2);
  const VectorXd rest = VectorXd::Zero(model.nv);
  id_derivatives<double>(model, data, s.q, rest, rest);
  EXPECT_GT(data.dtau_dq.norm(), 1e-2);
  EXPECT_EQ(textbook_slopes(model, data, rest, rest, {.base_falls = false}).by_q.norm(), 0);
}

// The force handed to the parent turns with the joint.
TEST_P(Errata, ForcesTurnWithTheirJoint) {
  Data<double> data(model);
  id_derivatives<double>(model, data, s.q, s.v, s.a);
  EXPECT_GT(relative_error(textbook_slopes(model, data, s.v, s.a, {.force_turns = false}).by_q, data.dtau_dq),
            1e-2);
}

// E17: ddq/dq = -M^-1 dtau/dq holds at a = FD(q, v, tau) and nowhere else.
TEST_P(Errata, ForwardFromInverseAtTheRightAcceleration) {
  Data<double> data(model), other(model);
  fd_derivatives<double>(model, data, s.q, s.v, s.tau);
  id_derivatives<double>(model, other, s.q, s.v, data.ddq);
  EXPECT_LE(relative_error(-data.Minv * other.dtau_dq, data.ddq_dq), 1e-11);
  id_derivatives<double>(model, other, s.q, s.v, s.a);
  EXPECT_GT(relative_error(-data.Minv * other.dtau_dq, data.ddq_dq), 1e-3);
}

// E19: an articulated inertia is carried to the parent's frame by a congruence.
TEST_P(Errata, ArticulatedInertiasChangeFrames) {
  const auto accelerations = [&](bool congruent) {
    Data<double> data(model);
    nonlinear_effects<double>(model, data, s.q, s.v);
    const VectorXd u = s.tau - data.nle;
    std::vector<Matrix6d> A;
    for (const Inertia<double>& I : model.inertias) A.push_back(matrix(I));
    std::vector<Vector6d> S, U(model.nv), p(model.nv, Vector6d::Zero()), a(model.nv);
    VectorXd rest(model.nv), ddq(model.nv);
    for (int i = 0; i < model.nv; ++i) S.push_back(motion<double>(data.tree.dofs[i]).vector());
    for (int i = model.nv - 1; i >= 0; --i) {
      const Matrix6d X = action_matrix(inverse(data.X_PB[i]));
      U[i] = A[i] * S[i];
      rest[i] = u[i] - S[i].dot(p[i]);
      const double D = S[i].dot(U[i]);
      if (model.parent[i] < 0) continue;
      const Matrix6d felt = A[i] - U[i] * U[i].transpose() / D;
      A[model.parent[i]] += congruent ? Matrix6d(X.transpose() * felt * X) : felt;
      p[model.parent[i]] += X.transpose() * (p[i] + U[i] * (rest[i] / D));
    }
    for (int i = 0; i < model.nv; ++i) {
      const Matrix6d X = action_matrix(inverse(data.X_PB[i]));
      const Vector6d a_p = model.parent[i] < 0 ? Vector6d::Zero() : Vector6d(X * a[model.parent[i]]);
      ddq[i] = (rest[i] - U[i].dot(a_p)) / S[i].dot(U[i]);
      a[i] = a_p + S[i] * ddq[i];
    }
    return ddq;
  };
  Data<double> data(model);
  aba<double>(model, data, s.q, s.v, s.tau);
  EXPECT_LE(relative_error(accelerations(true), data.ddq), 1e-9);
  EXPECT_GT(relative_error(accelerations(false), data.ddq), 1e-2);
}

// E19: a torque moves the joints above it and on their other branches as well.
TEST_P(Errata, TorquesMoveTheWholeTree) {
  Data<double> data(model);
  const MatrixXd& Minv = minverse<double>(model, data, s.q);
  for (int j = 0; j < model.nv; ++j) {
    for (int i = 0; i < model.nv; ++i) EXPECT_NE(Minv(i, j), 0) << i << " " << j;
  }
}

// E24: of the step v' = v + h a, q' = q (+) h v' the derivatives are not those of the continuous system.
TEST(ErrataOfSteps, DiscreteSlopesGoThroughTheIntegrator) {
  Random random(24);
  const Model<double> model = random_tree(random, {.joints = 4, .base = Base::kFloating});
  const State s = random_state(model, random);
  const int n = model.nv;
  const double h = 0.1;
  const auto step = [&](const VectorXd& q, const VectorXd& v, const VectorXd& tau) {
    Data<double> data(model);
    const VectorXd next = v + h * aba<double>(model, data, q, v, tau), moved = h * next;
    return std::pair<VectorXd, VectorXd>(integrate<double>(model, q, moved), next);
  };
  Data<double> data(model);
  fd_derivatives<double>(model, data, s.q, s.v, s.tau);
  const auto first = step(s.q, s.v, s.tau);
  const VectorXd &q1 = first.first, &v1 = first.second;
  const VectorXd moved = h * v1;
  const TangentJacobians<double> d = integrate_jacobians<double>(model, moved);
  const MatrixXd A_qq = d.first + d.second * (h * h * data.ddq_dq);
  const MatrixXd A_qv = d.second * (h * (MatrixXd::Identity(n, n) + h * data.ddq_dv));
  const MatrixXd B_q = d.second * (h * h * data.Minv);
  const auto difference_by = [&](auto change) {
    MatrixXd slope(n, n);
    for (int k = 0; k < n; ++k) {
      const VectorXd e = 1e-5 * VectorXd::Unit(n, k), back = -e;
      const VectorXd up = change(e), down = change(back);
      slope.col(k) = (difference<double>(model, q1, up) - difference<double>(model, q1, down)) / 2e-5;
    }
    return slope;
  };
  const auto by_q = [&](const VectorXd& e) {
    return step(integrate<double>(model, s.q, e), s.v, s.tau).first;
  };
  const auto by_v = [&](const VectorXd& e) { return step(s.q, s.v + e, s.tau).first; };
  const auto by_tau = [&](const VectorXd& e) { return step(s.q, s.v, s.tau + e).first; };
  EXPECT_LE(relative_error(A_qq, difference_by(by_q)), 1e-6);
  EXPECT_LE(relative_error(A_qv, difference_by(by_v)), 1e-6);
  EXPECT_LE(relative_error(B_q, difference_by(by_tau)), 1e-6);
  EXPECT_GT(relative_error(MatrixXd::Identity(n, n), difference_by(by_q)), 1e-3);
  EXPECT_GT(relative_error(h * MatrixXd::Identity(n, n), difference_by(by_v)), 1e-3);
}

INSTANTIATE_TEST_SUITE_P(Random, Errata, ::testing::Range(1ul, 6ul));

}  // namespace
}  // namespace dyntape::dynamics::errata_test
