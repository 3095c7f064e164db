// SPDX-License-Identifier: BSD-3-Clause
//
// The operational-space law on random robots, redundant and not, by closing the loop: torques into forward
// dynamics, accelerations into kinematics; and near singularities.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/operational_space.h>

#include <Eigen/Eigenvalues>
#include <limits>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::operational_space_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr ReferenceFrame kFrames[] = {ReferenceFrame::kLocal, ReferenceFrame::kWorld,
                                      ReferenceFrame::kLocalWorldAligned};
const std::vector<int> kPosition = {0, 1, 2};

VectorXd pick(const std::vector<int>& rows, const Vector6<double>& all) {
  VectorXd some(rows.size());
  for (size_t i = 0; i < rows.size(); ++i) some[static_cast<long>(i)] = all[rows[i]];
  return some;
}

// Of the last frame of a chain: revolute joints about coordinate axes that are not all parallel.
Model<double> arm(int joints, Random& random) {
  Model<double> model;
  model.name = "arm";
  for (int i = 0; i < joints; ++i) {
    Joint<double> joint;
    joint.name = "joint " + std::to_string(i);
    joint.axis = Eigen::Vector3d::Unit(i % 2 ? 1 : 2 * (i % 3 == 0));
    joint.armature = random.uniform(0, 0.1);
    model.add_joint(i - 1, joint, {Eigen::Matrix3d::Identity(), {0.1, 0, i % 2 ? 0.0 : 0.3}},
                    random_inertia(random));
  }
  model.frames.push_back({"tip", joints - 1, random_placement(random)});
  return model;
}

struct Arms {
  explicit Arms(int joints, unsigned long seed)
      : random(seed), model(arm(joints, random)), s(random_state(model, random)), data(model) {}

  int tip() const { return static_cast<int>(model.frames.size()) - 1; }

  // What the task's rate does under the torques: from kinematics, not from a Jacobian.
  VectorXd acceleration(const VectorXd& tau, const std::vector<int>& rows, ReferenceFrame in) {
    const VectorXd a = aba(model, data, s.q, s.v, tau);
    forward_kinematics(model, data, s.q, s.v, a);
    const Motion<double> A = in == ReferenceFrame::kLocalWorldAligned
                                 ? frame_classical_acceleration(model, data, tip(), in)
                                 : frame_acceleration(model, data, tip(), in);
    return pick(rows, A.vector());
  }

  Random random;
  Model<double> model;
  State s;
  Data<double> data;
};

class OperationalSpaceLaw : public ::testing::TestWithParam<int> {};

TEST_P(OperationalSpaceLaw, GivesTheAccelerationThatIsAskedFor) {
  const int joints = GetParam();
  int regular = 0;
  for (unsigned long seed = 1; seed <= 12; ++seed) {
    Arms arms(joints, seed);
    const std::vector<int> rows = joints < 6 ? kPosition : std::vector<int>{0, 1, 2, 3, 4, 5};
    OperationalSpace<double> space(arms.model, rows);
    for (const ReferenceFrame in : kFrames) {
      const VectorXd x_dd = arms.random.vector(space.size(), 3), tau_0 = arms.random.vector(arms.model.nv, 3);
      operational_space(arms.model, arms.data, space, arms.s.q, arms.s.v, arms.tip(), in);
      const Eigen::SelfAdjointEigenSolver<MatrixXd> mobility(space.Lambda_inverse);
      if (mobility.eigenvalues()[0] < 1e-4 * mobility.eigenvalues().maxCoeff()) continue;  // nearly singular
      ++regular;
      for (const VectorXd* posture : {static_cast<const VectorXd*>(nullptr), &tau_0}) {
        const VectorXd tau =
            operational_torque(arms.model, arms.data, space, arms.s.q, arms.s.v, x_dd, posture);
        EXPECT_LE((arms.acceleration(tau, rows, in) - x_dd).norm(), 1e-10 * (1 + x_dd.norm()));
      }
    }
  }
  EXPECT_GE(regular, 18);
}

TEST_P(OperationalSpaceLaw, HoldsItsDefinitions) {
  Arms arms(GetParam(), 5);
  OperationalSpace<double> space(arms.model, kPosition);
  const VectorXd tau_0 = arms.random.vector(arms.model.nv, 3), x_dd = arms.random.vector(3, 3);
  operational_space(arms.model, arms.data, space, arms.s.q, arms.s.v, arms.tip(),
                    ReferenceFrame::kLocalWorldAligned);
  const MatrixXd Minv = arms.data.Minv, identity = MatrixXd::Identity(3, 3);
  EXPECT_LE(relative_error(space.Lambda_inverse, space.J * Minv * space.J.transpose()), 1e-12);
  EXPECT_LE(relative_error(space.Lambda * space.Lambda_inverse, identity), 1e-9);
  EXPECT_LE(relative_error(space.J * space.J_bar, identity), 1e-9);
  EXPECT_EQ(space.Lambda, space.Lambda.transpose());
  EXPECT_EQ(space.phi, 0);
  const VectorXd tau = operational_torque(arms.model, arms.data, space, arms.s.q, arms.s.v, x_dd, &tau_0);
  const VectorXd expected = space.J.transpose() * space.Lambda * (x_dd - space.J_dot_v) + arms.data.nle +
                            tau_0 - space.J.transpose() * space.J_bar.transpose() * tau_0;
  EXPECT_LE(relative_error(tau, expected), 1e-10);
}

INSTANTIATE_TEST_SUITE_P(Joints, OperationalSpaceLaw, ::testing::Values(3, 4, 6, 7, 9));

// Errata E44: with the spatial acceleration for the rate of a velocity, the loop does not close.
TEST(OperationalSpace, NeedsTheClassicalBias) {
  Arms arms(7, 3);
  OperationalSpace<double> space(arms.model, kPosition);
  const ReferenceFrame in = ReferenceFrame::kLocalWorldAligned;
  const VectorXd x_dd = VectorXd::Zero(3), rest = VectorXd::Zero(arms.model.nv);
  operational_space(arms.model, arms.data, space, arms.s.q, arms.s.v, arms.tip(), in);
  forward_kinematics(arms.model, arms.data, arms.s.q, arms.s.v, rest);
  const VectorXd spatial = frame_acceleration(arms.model, arms.data, arms.tip(), in).vector().head(3);
  EXPECT_GT((spatial - space.J_dot_v).norm(), 0.1);
  space.J_dot_v = spatial;
  const VectorXd tau = operational_torque(arms.model, arms.data, space, arms.s.q, arms.s.v, x_dd);
  EXPECT_GT(arms.acceleration(tau, kPosition, in).norm(), 0.1);
}

// A floating base, all of whose dofs are driven.
TEST(OperationalSpace, OfAFloatingTree) {
  for (unsigned long seed = 1; seed <= 6; ++seed) {
    Random random(seed);
    const Model<double> model = random_tree(random, {.joints = 8, .base = Base::kFloating});
    const State s = random_state(model, random);
    Data<double> data(model);
    OperationalSpace<double> space(model);
    const VectorXd x_dd = random.vector(6, 3);
    operational_space(model, data, space, s.q, s.v, 7, ReferenceFrame::kLocal, {.damping = 1e-6});
    const VectorXd a = aba(model, data, s.q, s.v, operational_torque(model, data, space, s.q, s.v, x_dd));
    forward_kinematics(model, data, s.q, s.v, a);
    const Vector6<double> got = frame_acceleration(model, data, 7, ReferenceFrame::kLocal).vector();
    EXPECT_EQ(space.phi, 0);
    EXPECT_LE((got - x_dd).norm(), 1e-10 * (1 + x_dd.norm())) << "seed " << seed;
  }
}

// Three bars in a plane; stretched, the tip cannot move along them.
Model<double> planar_arm() {
  Model<double> model;
  for (int i = 0; i < 3; ++i) {
    Joint<double> joint;
    joint.name = "joint " + std::to_string(i);
    model.add_joint(i - 1, joint, {Eigen::Matrix3d::Identity(), {i ? 1.0 : 0.0, 0, 0}},
                    {1, {0.5, 0, 0}, Eigen::Matrix3d::Identity() * 0.1});
  }
  model.frames.push_back({"tip", 2, {Eigen::Matrix3d::Identity(), {1, 0, 0}}});
  return model;
}

// Smallest eigenvalue of D^-1/2 Lambda^-1 D^-1/2, damped.
double smallest_lifted(const OperationalSpace<double>& space) {
  const VectorXd root = space.D.cwiseSqrt();
  const MatrixXd C_inverse = root.asDiagonal() * space.Lambda * root.asDiagonal();
  return 1 / Eigen::SelfAdjointEigenSolver<MatrixXd>(C_inverse).eigenvalues().maxCoeff();
}

TEST(OperationalSpace, DampsStretchedArms) {
  const Model<double> model = planar_arm();
  Data<double> data(model);
  const VectorXd v = VectorXd::Zero(3);
  const Eigen::Vector2d x_dd(1, 0.5);
  OperationalSpace<double> space(model, {0, 1}), undamped(model, {0, 1});
  const ReferenceFrame in = ReferenceFrame::kLocalWorldAligned;
  double largest = 0, without = 0;
  VectorXd before;
  for (double bend = 1e-9; bend < 1; bend *= 1.02) {
    const VectorXd q = Eigen::Vector3d(0.3, bend, bend);
    operational_space(model, data, undamped, q, v, 0, in);
    operational_space(model, data, space, q, v, 0, in, {.damping = 1e-3});
    EXPECT_GE(smallest_lifted(space), 1e-3 / 3);
    if (space.phi == 0) {
      EXPECT_EQ(space.Lambda, undamped.Lambda);
    }
    without = std::max(without, undamped.Lambda.norm());
    largest = std::max(largest, space.Lambda.norm());
    const VectorXd tau = operational_torque(model, data, space, q, v, x_dd);
    ASSERT_TRUE(tau.allFinite());
    if (bend > 1e-9) {
      EXPECT_LE((tau - before).norm(), 0.1 * (1 + before.norm())) << "a jump at " << bend;
    }
    before = tau;
  }
  EXPECT_EQ(space.phi, 0);  // bent far enough, nothing is damped
  EXPECT_GT(without, 1e12);
  EXPECT_LT(largest, 1e5);

  // Exactly stretched; and all six rows, of which a plane offers three.
  const VectorXd q = VectorXd::Zero(3);
  operational_space(model, data, space, q, v, 0, in, {.damping = 1e-3});
  EXPECT_TRUE(operational_torque(model, data, space, q, v, x_dd).allFinite());
  OperationalSpace<double> six(model);
  const VectorXd bent = Eigen::Vector3d(0.3, 0.8, 0.9), x6 = (VectorXd(6) << 1, 2, 0, 0, 0, 3).finished();
  operational_space(model, data, six, bent, v, 0, in, {.damping = 1e-6});
  EXPECT_GE(smallest_lifted(six), 1e-6 / 3);
  EXPECT_GT(six.phi, 0.5);
  forward_kinematics(model, data, bent, v,
                     aba(model, data, bent, v, operational_torque(model, data, six, bent, v, x6)));
  EXPECT_LE((frame_acceleration(model, data, 0, in).vector() - x6).norm(), 1e-3);
}

TEST(OperationalSpace, LiftsNoEigenvalueTooLittle) {
  for (unsigned long seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const Model<double> model = random_tree(random, {.joints = 1 + random.below(8), .chain = true});
    const State s = random_state(model, random);
    Data<double> data(model);
    OperationalSpace<double> space(model);
    const double damping = std::pow(10, random.uniform(-8, -1));
    operational_space(model, data, space, s.q, s.v, model.njoints() - 1, ReferenceFrame::kLocal,
                      {.damping = damping});
    EXPECT_GE(smallest_lifted(space), damping / 3 * (1 - 1e-6)) << "seed " << seed;
    EXPECT_GE(space.phi, 0);
    EXPECT_LT(space.phi, 1);
    ASSERT_TRUE(operational_torque(model, data, space, s.q, s.v, random.vector(6)).allFinite());
  }
}

TEST(OperationalSpace, NamesWhatIsWrong) {
  const Model<double> model = planar_arm();
  Data<double> data(model);
  const VectorXd q = VectorXd::Zero(3);
  EXPECT_THROW(OperationalSpace<double>(model, {}), ArgumentError);
  EXPECT_THROW(OperationalSpace<double>(model, {0, 6}), ArgumentError);
  EXPECT_THROW(OperationalSpace<double>(model, {2, 1, 2}), ArgumentError);
  OperationalSpace<double> space(model, {0, 1});
  const ReferenceFrame in = ReferenceFrame::kLocal;
  EXPECT_THROW(operational_space(model, data, space, q, q, 1, in), ArgumentError);
  EXPECT_THROW(operational_space(model, data, space, q, q, 0, in, {.damping = -1}), ArgumentError);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(operational_space(model, data, space, q, q, 0, in, {.damping = nan}), ArgumentError);
  EXPECT_THROW(operational_torque(model, data, space, q, q, q), ArgumentError);
}

}  // namespace
}  // namespace dyntape::dynamics::operational_space_test
