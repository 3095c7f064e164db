// SPDX-License-Identifier: BSD-3-Clause
//
// The sheet that every joint type must pass; a new type joins kAll and nothing else.
#include <gtest/gtest.h>

#include <dyntape/dynamics/float128.h>

#include <algorithm>

#include "random_robots.h"

namespace dyntape::dynamics {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr JointType kAll[] = {JointType::kRevolute, JointType::kContinuous, JointType::kPrismatic,
                              JointType::kHelical,  JointType::kSpherical,  JointType::kPlanar,
                              JointType::kFreeFlyer};
constexpr int kTries = 50;

class JointSheet : public testing::TestWithParam<JointType> {
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

INSTANTIATE_TEST_SUITE_P(Types, JointSheet, testing::ValuesIn(kAll), [](const auto& info) {
  std::string name = to_string(info.param);
  name.erase(std::remove(name.begin(), name.end(), '-'), name.end());
  return name;
});

}  // namespace
}  // namespace dyntape::dynamics
