// SPDX-License-Identifier: BSD-3-Clause
//
// The sheet that every joint type must pass, alone and within a chain; a new type joins kAll and nothing else.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algebra/float128.h>

#include <algorithm>

#include "dynamics/random_robots.h"
#include "dynamics/reference_dynamics.h"

namespace dyntape::dynamics::joints_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr JointType kAll[] = {JointType::kRevolute, JointType::kContinuous, JointType::kPrismatic,
                              JointType::kHelical,  JointType::kSpherical,  JointType::kPlanar,
                              JointType::kFreeFlyer};
constexpr int kTries = 50;

using Vectorq = VectorX<Float128>;

// d f(h e_k)/dh at 0 in 113 bits; a step of 1e-11 leaves an error of 1e-22.
template <class F>
auto slope(int n, int k, F f) {
  const Float128 h(1e-11);
  Vectorq e = Vectorq::Zero(n);
  e[k] = h;
  const auto up = f(e);
  e[k] = -h;
  return ((up - f(e)) / (2 * h)).eval();
}

class JointSheet : public ::testing::TestWithParam<JointType> {
 protected:
  // A robot of one joint, placed anywhere, about any axis.
  void next_robot() {
    model = Model<double>();
    model.add_joint(-1, random_joint(random, "joint", GetParam()), random_placement(random),
                    random_inertia(random));
    q = random_configuration(model, random.engine);
    v = random.vector(model.nv, 1.5);
  }

  template <class T>
  Placement<T> place(const VectorX<T>& x) {
    const Model<T> m = model.cast<T>();
    Data<T> data(m);
    forward_kinematics<T>(m, data, x);
    return data.X_WB[0];
  }

  Random random{static_cast<unsigned long>(GetParam()) + 1};
  Model<double> model;
  VectorXd q, v;
};

TEST_P(JointSheet, SizesAgree) {
  next_robot();
  EXPECT_EQ(model.nq, nq(GetParam()));
  EXPECT_EQ(model.nv, nv(GetParam()));
  EXPECT_EQ(static_cast<int>(joint_dofs(model.joints[0], 0).size()), model.nv);
  EXPECT_STRNE(to_string(GetParam()), "");
}

// The row of the table says what the joint does.
TEST_P(JointSheet, TraitsAreTheJointsOwn) {
  const JointTraits& row = traits(GetParam());
  EXPECT_EQ(row.single, row.nv == 1);
  for (int n = 0; n < kTries; ++n) {
    next_robot();
    const bool adds = model.nq == model.nv && integrate<double>(model, q, v) == VectorXd(q + v);
    EXPECT_EQ(adds, row.on_a_line);
    if (!row.on_a_line) continue;
    // Only an angle brings the rotation back after a turn.
    const VectorXd turned = q.array() + 2 * 3.14159265358979323846;
    const Matrix3<double> R = place<double>(q).R, after = place<double>(turned).R;
    const bool turns = (place<double>(VectorXd(q.array() + 1)).R - R).norm() > 1e-3;
    EXPECT_EQ(row.has_angle, turns && (after - R).norm() < 1e-12);
  }
  EXPECT_EQ(std::size(kAll), std::size(kJointTraits));
}

TEST_P(JointSheet, NeutralIsTheIdentity) {
  next_robot();
  const Placement<double> X = place<double>(neutral(model));
  EXPECT_EQ(X.R, model.X_PJ[0].R);
  EXPECT_EQ(X.p, model.X_PJ[0].p);
}

TEST_P(JointSheet, MovingByZeroStays) {
  for (int n = 0; n < kTries; ++n) {
    next_robot();
    EXPECT_LE((integrate<double>(model, q, VectorXd::Zero(model.nv)) - q).norm(), 5e-16);
    EXPECT_LE(difference<double>(model, q, q).norm(), 1e-16);
  }
}

TEST_P(JointSheet, DifferenceUndoesIntegrate) {
  for (int n = 0; n < kTries; ++n) {
    next_robot();
    const VectorXd back = difference(model, q, integrate(model, q, v));
    EXPECT_LE((back - v).norm(), 1e-14 * (1 + v.norm())) << "v " << v.transpose();
  }
}

TEST_P(JointSheet, PlacementIsRigid) {
  for (int n = 0; n < kTries; ++n) {
    next_robot();
    const Placement<double> X = place<double>(integrate(model, q, v));
    EXPECT_LE((X.R * X.R.transpose() - Matrix3<double>::Identity()).norm(), 3e-15);
    EXPECT_NEAR(X.R.determinant(), 1, 3e-15);
  }
}

// X(q (+) v) = X(q) exp(S v): S is the slope of X along integrate, and the motion is a screw.
TEST_P(JointSheet, MotionIsTheExponentialOfTheSubspace) {
  for (int n = 0; n < kTries; ++n) {
    next_robot();
    const std::vector<Dof> dofs = joint_dofs(model.joints[0], 0);
    Motion<double> xi;
    for (int k = 0; k < model.nv; ++k) add_along(dofs[k], v[k], xi);
    const Placement<double> expected = place<double>(q) * exp(xi), X = place<double>(integrate(model, q, v));
    EXPECT_LE((X.R - expected.R).norm(), 3e-15);
    EXPECT_LE((X.p - expected.p).norm(), 3e-15 * (1 + expected.p.norm()));
  }
}

// Against differences in 113 bits, increments in the moving frames.
TEST_P(JointSheet, TangentJacobians) {
  using Vq = VectorX<Float128>;
  const Float128 h(1e-11);
  for (int n = 0; n < 10; ++n) {
    next_robot();
    const Model<Float128> m = model.cast<Float128>();
    const Vq x = q.cast<Float128>(), w = v.cast<Float128>(), y = integrate<Float128>(m, x, w);
    const TangentJacobians<double> di = integrate_jacobians<double>(model, v);
    const TangentJacobians<double> dd = difference_jacobians<double>(model, v);
    MatrixXd iq(model.nv, model.nv), iv = iq, d0 = iq, d1 = iq;
    for (int k = 0; k < model.nv; ++k) {
      Vq e = Vq::Zero(model.nv);
      e[k] = h;
      const auto along = [&](auto f) {
        const Vq slope = (f(e) - f(Vq(-e))) / (2 * h);
        return VectorXd(slope.template cast<double>());
      };
      iq.col(k) = along([&](const Vq& s) {
        return difference<Float128>(m, y, integrate<Float128>(m, integrate<Float128>(m, x, s), w));
      });
      iv.col(k) =
          along([&](const Vq& s) { return difference<Float128>(m, y, integrate<Float128>(m, x, w + s)); });
      d0.col(k) =
          along([&](const Vq& s) { return difference<Float128>(m, integrate<Float128>(m, x, s), y); });
      d1.col(k) =
          along([&](const Vq& s) { return difference<Float128>(m, x, integrate<Float128>(m, y, s)); });
    }
    EXPECT_LE(relative_error(di.first, iq), 1e-14);
    EXPECT_LE(relative_error(di.second, iv), 1e-14);
    EXPECT_LE(relative_error(dd.first, d0), 2e-14);
    EXPECT_LE(relative_error(dd.second, d1), 2e-14);
    EXPECT_LE(relative_error(dd.second * di.second, MatrixXd::Identity(model.nv, model.nv)), 1e-14);
  }
}

TEST_P(JointSheet, RandomConfigurationsKeepLimits) {
  next_robot();
  if (model.nq != 1) return;
  model.joints[0].limits.lower = 0.25;
  model.joints[0].limits.upper = 0.5;
  for (int n = 0; n < kTries; ++n) {
    const double x = random_configuration(model, random.engine)[0];
    EXPECT_GE(x, 0.25);
    EXPECT_LE(x, 0.5);
  }
}

TEST_P(JointSheet, LengthDoesNotDrift) {
  next_robot();
  for (int n = 0; n < 100000; ++n) q = integrate<double>(model, q, v * 0.01);
  const auto unit = unit_part(model.joints[0], q);
  if (unit.size() == 0) return;
  EXPECT_NEAR(unit.norm(), 1, 1e-15);
}

// What S must satisfy in every recursion: d(X m)/dq = (X m) x S for the map X of motions from the parent to the
// body, d(X^T f)/dq = X^T (S x* f) for forces from the body to the parent.  As exact as the rotations and axes of the
// model are, which are doubles.
TEST_P(JointSheet, SubspaceIsTheSlopeOfThePlacement) {
  for (int n = 0; n < 10; ++n) {
    next_robot();
    const Motion<Float128> m{random.vector3().cast<Float128>(), random.vector3().cast<Float128>()};
    const Force<Float128> f{random.vector3().cast<Float128>(), random.vector3().cast<Float128>()};
    const Model<Float128> exact = model.cast<Float128>();
    const Vectorq x = q.cast<Float128>();
    const Placement<Float128> X = place<Float128>(x);
    const std::vector<Dof> dofs = joint_dofs(model.joints[0], 0);
    for (int k = 0; k < model.nv; ++k) {
      const auto moved = [&](const Vectorq& d) { return place<Float128>(integrate<Float128>(exact, x, d)); };
      const auto dm = slope(model.nv, k, [&](const Vectorq& d) { return act_inverse(moved(d), m).vector(); });
      const auto df = slope(model.nv, k, [&](const Vectorq& d) { return act(moved(d), f).vector(); });
      const Motion<Float128> Xm = act_inverse(X, m);
      EXPECT_LE(relative_error(dm, cross(Xm, dofs[k]).vector()), 3e-15);
      EXPECT_LE(relative_error(df, act(X, cross(dofs[k], f)).vector()), 3e-15);
      // The chapter's s x (X m), without the sign of X_J = exp(-s q), cannot pass (errata E6).
      EXPECT_GE(relative_error(dm, cross(motion<Float128>(dofs[k]), Xm).vector()), 1.0);
    }
  }
}

// The chapter's order, X_tree X_J for the map from the parent, is not a motion along S (errata E5).
TEST_P(JointSheet, TreeTransformBeforeTheJointIsAnotherRobot) {
  next_robot();
  const Motion<double> m = random.motion();
  const Placement<double> tree = model.X_PJ[0];
  model.X_PJ[0] = {};
  const double h = 1e-5;
  const auto wrong = [&](double s) {
    const VectorXd d = VectorXd::Unit(model.nv, 0) * s;
    return act_inverse(tree, act_inverse(place<double>(integrate<double>(model, q, d)), m));
  };
  const Vector6<double> difference = (wrong(h).vector() - wrong(-h).vector()) / (2 * h);
  const Dof S = joint_dofs(model.joints[0], 0)[0];
  EXPECT_GE(relative_error(cross(wrong(0), S).vector(), difference), 0.01);
  // It is one along S carried through the tree transform.
  const Motion<double> carried = act_inverse(tree, motion<double>(S));
  EXPECT_LE(relative_error(cross(wrong(0), carried).vector(), difference), 1e-8);
}

// The type within a chain: at its root, in its middle and at its end.
class JointInAChain : public ::testing::TestWithParam<JointType> {
 protected:
  JointInAChain() {
    model.gravity = random.vector3(10);
    for (int i = 0; i < 5; ++i) {
      const JointType type = i % 2 == 0 ? GetParam() : kAll[random.below(4)];
      model.add_joint(i - 1, random_joint(random, "joint " + std::to_string(i), type),
                      random_placement(random), random_inertia(random));
    }
    s = random_state(model, random);
    exact = model.cast<Float128>();
    q = s.q.cast<Float128>();
    v = s.v.cast<Float128>();
    a = s.a.cast<Float128>();
    tau = s.tau.cast<Float128>();
  }

  // Columns: derivatives of f(q (+) d, v + d_v) with respect to d and d_v.
  template <class F>
  std::pair<MatrixXd, MatrixXd> derivatives(F f) {
    MatrixXd dq(model.nv, model.nv), dv = dq;
    for (int k = 0; k < model.nv; ++k) {
      dq.col(k) = slope(model.nv, k, [&](const Vectorq& d) {
                    return Vectorq(f(integrate<Float128>(exact, q, d), v));
                  }).template cast<double>();
      dv.col(k) = slope(model.nv, k, [&](const Vectorq& d) {
                    return Vectorq(f(q, Vectorq(v + d)));
                  }).template cast<double>();
    }
    return {dq, dv};
  }

  Random random{static_cast<unsigned long>(GetParam()) + 100};
  Model<double> model;
  Model<Float128> exact;
  State s;
  Vectorq q, v, a, tau;
};

TEST_P(JointInAChain, ForwardDynamicsInvertsInverseDynamics) {
  Data<double> data(model);
  const VectorXd back = aba(model, data, s.q, s.v, VectorXd(rnea(model, data, s.q, s.v, s.a)));
  EXPECT_LE(relative_error(back, s.a), 1e-11);
  const MatrixXd M = crba(model, data, s.q);
  EXPECT_LE(relative_error(minverse(model, data, s.q) * M, MatrixXd::Identity(model.nv, model.nv)), 1e-11);
  EXPECT_EQ(data.Minv, data.Minv.transpose());
}

TEST_P(JointInAChain, MassMatrixIsTheSlopeOfInverseDynamics) {
  Data<double> data(model);
  const MatrixXd M = crba(model, data, s.q);
  EXPECT_EQ(M, M.transpose());
  const VectorXd h = rnea(model, data, s.q, s.v, VectorXd::Zero(model.nv));
  for (int k = 0; k < model.nv; ++k) {
    const VectorXd column = rnea(model, data, s.q, s.v, VectorXd::Unit(model.nv, k)) - h;
    EXPECT_LE((column - M.col(k)).norm(), 1e-13 * (M.norm() + h.norm()));
  }
}

TEST_P(JointInAChain, AgreesWithNewtonAndEulerInTheWorld) {
  Data<double> data(model);
  DynamicsTerms<double> acting;
  acting.armature = false;
  const VectorXd tau_world = reference::inverse_dynamics(model, s.q, s.v, s.a);
  EXPECT_LE(relative_error(rnea(model, data, s.q, s.v, s.a, acting), tau_world), 1e-12);
}

TEST_P(JointInAChain, DerivativesOfInverseDynamics) {
  Data<Float128> data128(exact);
  const auto [dq, dv] = derivatives(
      [&](const Vectorq& x, const Vectorq& w) { return rnea<Float128>(exact, data128, x, w, a); });
  Data<double> data(model);
  id_derivatives(model, data, s.q, s.v, s.a);
  EXPECT_LE(relative_error(data.dtau_dq, dq), 1e-13);
  EXPECT_LE(relative_error(data.dtau_dv, dv), 1e-13);
}

TEST_P(JointInAChain, DerivativesOfForwardDynamics) {
  Data<Float128> data128(exact);
  const auto [dq, dv] = derivatives(
      [&](const Vectorq& x, const Vectorq& w) { return aba<Float128>(exact, data128, x, w, tau); });
  Data<double> data(model);
  fd_derivatives(model, data, s.q, s.v, s.tau);
  EXPECT_LE(relative_error(data.ddq_dq, dq), 1e-11);
  EXPECT_LE(relative_error(data.ddq_dv, dv), 1e-11);
}

// d/dt (T + U) = v . tau.
TEST_P(JointInAChain, PowerIsTheRateOfEnergy) {
  Data<Float128> data(exact);
  const auto energy = [&](const Vectorq& t) {
    const Vectorq x = integrate<Float128>(exact, q, v * t[0]), w = v + a * t[0];
    return Vectorq::Constant(
               1, kinetic_energy<Float128>(exact, data, x, w) + potential_energy<Float128>(exact, data, x))
        .eval();
  };
  const Float128 rate = slope(1, 0, energy)[0], power = rnea<Float128>(exact, data, q, v, a).dot(v);
  EXPECT_LE(abs(Float128(rate - power)), 1e-14 * (1 + abs(power)));
}

std::string name_of(const ::testing::TestParamInfo<JointType>& info) {
  std::string name = to_string(info.param);
  name.erase(std::remove(name.begin(), name.end(), '-'), name.end());
  return name;
}

INSTANTIATE_TEST_SUITE_P(Types, JointInAChain, ::testing::ValuesIn(kAll), name_of);
INSTANTIATE_TEST_SUITE_P(Types, JointSheet, ::testing::ValuesIn(kAll), name_of);

TEST(Joints, AScrewOfNoPitchIsARevoluteJoint) {
  Random random(1);
  Model<double> model, turning;
  for (int i = 0; i < 4; ++i) {
    Joint<double> joint = random_joint(random, "joint " + std::to_string(i), JointType::kHelical);
    joint.pitch = 0;
    const Placement<double> X = random_placement(random);
    const Inertia<double> I = random_inertia(random);
    model.add_joint(i - 1, joint, X, I);
    joint.type = JointType::kRevolute;
    turning.add_joint(i - 1, joint, X, I);
  }
  const State s = random_state(turning, random);
  Data<double> one(model), other(turning);
  fd_derivatives(model, one, s.q, s.v, s.tau);
  fd_derivatives(turning, other, s.q, s.v, s.tau);
  EXPECT_EQ(one.ddq_dq, other.ddq_dq);
  EXPECT_EQ(one.ddq_dv, other.ddq_dv);
}

// A universal joint and its body as one joint whose S depends on q, in the frame of the body:
//   S = [R_2^T a_1, a_2],  w = S v,  w_d = S a + (R_2^T a_1 x a_2) v_1 v_2
struct UniversalBody {
  Eigen::Vector3d a_1, a_2;
  Placement<double> X;
  Inertia<double> I;
  Eigen::Vector3d gravity;

  using Matrix32 = Eigen::Matrix<double, 3, 2>;
  static Eigen::Matrix3d about(const Eigen::Vector3d& axis, double angle) {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  }
  Matrix32 S(const VectorXd& q) const {
    Matrix32 S;
    S << about(a_2, q[1]).transpose() * a_1, a_2;
    return S;
  }
  Eigen::Matrix3d inertia() const {
    return I.I_c + I.mass * (I.com.squaredNorm() * Eigen::Matrix3d::Identity() - I.com * I.com.transpose());
  }
  // Torques at q with the subspace taken at q_S: the same unless dS/dq is to be left out.
  VectorXd torques(const VectorXd& q, const VectorXd& q_S, const VectorXd& v, const VectorXd& a) const {
    const Matrix32 S_q = S(q_S);
    const Eigen::Vector3d first = S_q.col(0), w = S_q * v, w_d = S_q * a + first.cross(a_2) * (v[0] * v[1]);
    const Eigen::Matrix3d R = Eigen::Matrix3d(X.R) * about(a_1, q[0]) * about(a_2, q[1]);
    const Eigen::Vector3d L = inertia() * w, weight = I.mass * (R.transpose() * gravity), c = I.com;
    const Eigen::Vector3d moment = inertia() * w_d + w.cross(L) - c.cross(weight);
    return S_q.transpose() * moment;
  }
  MatrixXd slope(const VectorXd& q, const VectorXd& v, const VectorXd& a, bool with_S) const {
    MatrixXd d(2, 2);
    const double h = 1e-5;
    for (int k = 0; k < 2; ++k) {
      const VectorXd up = q + VectorXd::Unit(2, k) * h, down = q - VectorXd::Unit(2, k) * h;
      d.col(k) = (torques(up, with_S ? up : q, v, a) - torques(down, with_S ? down : q, v, a)) / (2 * h);
    }
    return d;
  }
};

// Two revolute joints with a massless cross, against S(q); and that a recursion that takes S(q) for constant is
// wrong (errata E1c).
TEST(Joints, UniversalIsTwoRevoluteJointsAboutAMasslessCross) {
  for (unsigned long seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    const Eigen::Vector3d a_1 = random.vector3().normalized(), any = random.vector3();
    const UniversalBody body{a_1, a_1.cross(any).normalized(), random_placement(random),
                             random_inertia(random), random.vector3(10)};
    Model<double> model;
    model.gravity = body.gravity;
    EXPECT_EQ(model.add_universal(-1, "u", body.a_1, body.a_2, body.X, body.I), 1);
    const State s = random_state(model, random);
    Data<double> data(model);
    EXPECT_LE(relative_error(rnea(model, data, s.q, s.v, s.a), body.torques(s.q, s.q, s.v, s.a)), 1e-13);
    const MatrixXd S = body.S(s.q);
    EXPECT_LE(relative_error(crba(model, data, s.q), S.transpose() * body.inertia() * S), 1e-13);
    EXPECT_LE(relative_error(aba(model, data, s.q, s.v, body.torques(s.q, s.q, s.v, s.a)), s.a), 1e-11);
    id_derivatives(model, data, s.q, s.v, s.a);
    EXPECT_LE(relative_error(data.dtau_dq, body.slope(s.q, s.v, s.a, true)), 1e-7);
    EXPECT_GE(relative_error(data.dtau_dq, body.slope(s.q, s.v, s.a, false)), 1e-2);
  }
}

// Pinocchio 4.1: JointModelUniversal(x, y), one body.
TEST(Joints, UniversalHasTheCoordinatesOfPinocchio) {
  Model<double> model;
  const Eigen::Vector3d principal(.3, .4, .5);
  model.add_universal(-1, "u", Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(), {},
                      {2, Eigen::Vector3d(.1, -.2, .3), Eigen::Matrix3d(principal.asDiagonal())});
  Data<double> data(model);
  const Eigen::Vector2d q(.3, .4), v(1, 2), a(-.5, .7);
  const Eigen::Vector2d expected(-5.058104573479021, -3.5104827102717038);
  EXPECT_LE(relative_error(rnea<double>(model, data, q, v, a), expected), 1e-14);
}

TEST(Joints, BadJointsAreRefused) {
  const auto refused = [](auto add) {
    Model<double> model;
    try {
      add(model);
    } catch (const ArgumentError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  Joint<double> joint;
  joint.name = "screw";
  joint.type = JointType::kHelical;
  joint.pitch = std::numeric_limits<double>::infinity();
  EXPECT_NE(refused([&](auto& m) { m.add_joint(-1, joint, {}, {}); }).find("pitch of joint \"screw\""),
            std::string::npos);
  joint.pitch = 0.1;
  joint.axis *= 1.1;
  EXPECT_NE(refused([&](auto& m) { m.add_joint(-1, joint, {}, {}); }).find("length 1.1"), std::string::npos);
  joint.type = JointType::kPlanar;  // has no axis
  EXPECT_EQ(refused([&](auto& m) { m.add_joint(-1, joint, {}, {}); }), "");
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  EXPECT_NE(refused([&](auto& m) { m.add_universal(-1, "u", x, -x, {}, {}); }).find("parallel"),
            std::string::npos);
}

}  // namespace
}  // namespace dyntape::dynamics::joints_test
