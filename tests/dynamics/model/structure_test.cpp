// SPDX-License-Identifier: BSD-3-Clause
//
// What the shape of a robot says about its matrices: counts of entries, factors without fill-in, mirror images; and
// the two-link arm in its plane, of which every derivative is known by hand.
#include <gtest/gtest.h>

#include <dyntape/dynamics/algorithms/sparse_factor.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include "dynamics/random_robots.h"
#include "dynamics/robot_files.h"

namespace dyntape::dynamics::structure_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

bool on_one_path(const Tree& tree, int r, int c) {
  const int i = tree.dofs[r].joint, j = tree.dofs[c].joint;
  return (tree.begin[j] >= tree.begin[i] && tree.begin[j] < tree.end[i]) ||
         (tree.begin[i] >= tree.begin[j] && tree.begin[i] < tree.end[j]);
}

long count_entries(const MatrixXd& m, double below = 0) { return (m.cwiseAbs().array() > below).count(); }

// Entries of M are on one path: 49 of 49, 216 of 324, 700 of 1444; of the accelerations' derivatives by q, the joints'
// columns are full, of the base's only its own linear acceleration feels how it is turned.
TEST(Structure, CountsOfEntries) {
  const struct {
    const char* robot;
    Base base;
    long entries;
  } robots[] = {{"iiwa14", Base::kFixed, 49}, {"solo12", Base::kFloating, 216}};
  for (const auto& [robot, base, entries] : robots) {
    const Model<double> model = load_urdf(robot_file(robot), {.base = base});
    Random random(3);
    const State s = random_state(model, random);
    Data<double> data(model);
    const MatrixXd M = crba<double>(model, data, s.q);
    long on_path = 0;
    for (int r = 0; r < model.nv; ++r) {
      for (int c = 0; c < model.nv; ++c) {
        on_path += on_one_path(data.tree, r, c);
        if (!on_one_path(data.tree, r, c)) {
          EXPECT_EQ(M(r, c), 0);
        }
      }
    }
    EXPECT_EQ(on_path, entries) << robot;
  }
}

TEST(Structure, SlopesOfSolo12) {
  const Model<double> model = load_urdf(robot_file("solo12"), {.base = Base::kFloating});
  Random random(3);
  const State s = random_state(model, random);
  Data<double> data(model);
  fd_derivatives<double>(model, data, s.q, s.v, s.tau);
  EXPECT_EQ(data.dtau_dq.leftCols(3).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(data.ddq_dq.leftCols(3).cwiseAbs().maxCoeff(), 0);
  const double noise = 1e-9 * data.ddq_dq.cwiseAbs().maxCoeff();
  EXPECT_EQ(count_entries(data.ddq_dq.rightCols(12), noise), 12 * 18);
  EXPECT_EQ(count_entries(data.ddq_dq.middleCols(3, 3), noise), 6);
}

TEST(Structure, FactorsHaveNoFillIn) {
  Random random(8);
  for (int trial = 0; trial < 20; ++trial) {
    const Model<double> model =
        random_tree(random, {.joints = 12, .base = trial % 2 ? Base::kFloating : Base::kFixed});
    const State s = random_state(model, random);
    Data<double> data(model);
    const MatrixXd M = crba<double>(model, data, s.q);
    SparseFactor<double> factor(data.tree, model.parent);
    factor.compute(M);
    for (int i = 0; i < model.nv; ++i) {
      for (int j = 0; j < model.nv; ++j) {
        if (j > i || !on_one_path(data.tree, i, j)) {
          EXPECT_EQ(factor.L()(i, j), i == j ? 1 : 0);
        }
      }
    }
    const MatrixXd D = factor.D_inverse().cwiseInverse().asDiagonal();
    EXPECT_LE((factor.L().transpose() * D * factor.L() - M).cwiseAbs().maxCoeff(),
              model.nv * 2.3e-16 * M.cwiseAbs().maxCoeff());
    const MatrixXd W = factor.inverse_of_L(), inverse = factor.inverse();
    EXPECT_LE((factor.L() * W - MatrixXd::Identity(model.nv, model.nv)).cwiseAbs().maxCoeff(),
              1e-15 * model.nv * factor.L().norm() * W.norm());
    EXPECT_EQ(inverse, inverse.transpose());
    EXPECT_LE((M * inverse - MatrixXd::Identity(model.nv, model.nv)).norm(),
              1e-15 * model.nv * M.norm() * inverse.norm());
    for (int i = 0; i < model.nv; ++i) {
      for (int j = 0; j < model.nv; ++j) {
        if (j > i || !on_one_path(data.tree, i, j)) {
          EXPECT_EQ(W(i, j), i == j ? 1 : 0);
        }
      }
    }
    const VectorXd a = factor.solve(s.tau);
    EXPECT_LE((M * a - s.tau).norm(), 1e-14 * model.nv * M.norm() * a.norm());
  }
}

// A robot seen in a mirror: placements and polar vectors are mirrored, axes of rotation are axial vectors.  The same
// q, v, a take the same torques.
TEST(Structure, MirrorImagesFeelTheSameTorques) {
  Random random(5);
  const Matrix3<double> mirror = Vector3<double>(1, -1, 1).asDiagonal();
  for (int trial = 0; trial < 20; ++trial) {
    Model<double> model, image;
    model.gravity = random.vector3(10);
    image.gravity = mirror * model.gravity;
    for (int i = 0; i < 8; ++i) {
      const JointType types[] = {JointType::kRevolute, JointType::kPrismatic, JointType::kContinuous};
      Joint<double> joint = random_joint(random, "joint " + std::to_string(i), types[random.below(3)]);
      const Placement<double> X = random_placement(random);
      const Inertia<double> I = random_inertia(random);
      const int parent = i == 0 ? -1 : random.below(i);
      model.add_joint(parent, joint, X, I);
      joint.axis = (joint.type == JointType::kPrismatic ? 1 : -1) * (mirror * Vector3<double>(joint.axis));
      image.add_joint(parent, joint, {mirror * X.R * mirror, mirror * X.p},
                      {I.mass, mirror * I.com, mirror * I.I_c * mirror});
    }
    const State s = random_state(model, random);
    Data<double> data(model), mirrored(image);
    EXPECT_LE(relative_error(rnea<double>(image, mirrored, s.q, s.v, s.a),
                             rnea<double>(model, data, s.q, s.v, s.a)),
              1e-14);
    EXPECT_LE(relative_error(crba<double>(image, mirrored, s.q), crba<double>(model, data, s.q)), 1e-14);
    id_derivatives<double>(model, data, s.q, s.v, s.a);
    id_derivatives<double>(image, mirrored, s.q, s.v, s.a);
    EXPECT_LE(relative_error(mirrored.dtau_dq, data.dtau_dq), 1e-13);
  }
}

// All twelve partials, gravity in the plane of motion.
TEST(Structure, TwoLinkArmByHand) {
  constexpr double m1 = 1.3, m2 = 0.8, l1 = 0.5, c1 = 0.2, c2 = 0.3, I1 = 0.04, I2 = 0.02, g = 9.81;
  Model<double> arm;
  arm.gravity = {0, 0, -g};
  Joint<double> joint;
  joint.axis = Eigen::Vector3d::UnitY();
  const auto body = [](double m, double c, double I) {
    Inertia<double> inertia{m, {c, 0, 0}, Matrix3<double>::Zero()};
    inertia.I_c(1, 1) = I, inertia.I_c(2, 2) = I, inertia.I_c(0, 0) = I / 10;
    return inertia;
  };
  joint.name = "shoulder";
  arm.add_joint(-1, joint, {}, body(m1, c1, I1));
  joint.name = "elbow";
  arm.add_joint(0, joint, {Matrix3<double>::Identity(), {l1, 0, 0}}, body(m2, c2, I2));
  Random random(2);
  Data<double> data(arm);
  for (int trial = 0; trial < 100; ++trial) {
    const VectorXd q = random.vector(2, 3), v = random.vector(2, 2), a = random.vector(2, 5);
    const double s1 = sin(q[0]), s2 = sin(q[1]), k2 = cos(q[1]), s12 = sin(q[0] + q[1]), e = m2 * l1 * c2;
    const double k1 = cos(q[0]), k12 = cos(q[0] + q[1]);
    MatrixXd M(2, 2), by_q(2, 2), by_v(2, 2);
    M << I1 + I2 + m1 * c1 * c1 + m2 * (l1 * l1 + c2 * c2) + 2 * e * k2, I2 + m2 * c2 * c2 + e * k2,
        I2 + m2 * c2 * c2 + e * k2, I2 + m2 * c2 * c2;
    const double weight = m2 * g * c2 * s12;
    by_q << g * (m1 * c1 + m2 * l1) * s1 + weight,
        -e * s2 * (2 * a[0] + a[1]) - e * k2 * (2 * v[0] * v[1] + v[1] * v[1]) + weight, weight,
        -e * s2 * a[0] + e * k2 * v[0] * v[0] + weight;
    by_v << -2 * e * s2 * v[1], -2 * e * s2 * (v[0] + v[1]), 2 * e * s2 * v[0], 0;
    VectorXd tau = M * a;
    tau[0] += -e * s2 * (2 * v[0] * v[1] + v[1] * v[1]) - g * (m1 * c1 + m2 * l1) * k1 - m2 * g * c2 * k12;
    tau[1] += e * s2 * v[0] * v[0] - m2 * g * c2 * k12;
    id_derivatives<double>(arm, data, q, v, a);
    EXPECT_LE(relative_error(data.tau, tau), 1e-14);
    EXPECT_LE(relative_error(data.M, M), 1e-14);
    EXPECT_LE(relative_error(data.dtau_dq, by_q), 1e-14);
    EXPECT_LE(relative_error(data.dtau_dv, by_v), 1e-14);
  }
}

}  // namespace
}  // namespace dyntape::dynamics::structure_test
