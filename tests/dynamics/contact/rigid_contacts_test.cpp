// SPDX-License-Identifier: BSD-3-Clause
//
// Rows of rigid contacts on planes of the world and of other bodies: against slopes of the gap in 113 bits, and against velocities of
// points that are taken body by body.
#include <gtest/gtest.h>

#include <dyntape/dynamics/contact/rigid_contacts.h>

#include "dynamics/exact_robot.h"
#include "dynamics/random_robots.h"

namespace dyntape::dynamics::rigid_contacts_test {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

RigidContact random_contact(Random& random, const Model<double>& model) {
  RigidContact contact{.name = "contact", .body = random.below(model.njoints())};
  contact.X_BF = random_placement(random);
  contact.radius = random.uniform(0, 0.3);
  contact.normal = Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(0.2, 1));
  contact.offset = random.uniform(-1, 1);
  contact.friction = 0.5;
  contact.plane_body = random.below(model.njoints() + 1) - 1;
  return contact;
}

// The point of a body that is at a place of the world.
template <class T>
Vector3<T> velocity_at(const Model<T>& model, Data<T>& data, const VectorX<T>& q, const VectorX<T>& v,
                       int body, const Vector3<T>& place) {
  if (body < 0) return Vector3<T>::Zero();
  const VectorX<T> twist =
      frame_jacobian<T>(model, data, q, on_body(body), ReferenceFrame::kLocalWorldAligned) * v;
  const Vector3<T> linear = twist.template head<3>(), angular = twist.template tail<3>();
  return linear + angular.cross(place - data.X_WB[std::size_t(body)].p);
}

TEST(RigidContacts, RowsAreVelocitiesOfTheTouchingPointBesideThePlanes) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    Random random(seed);
    const Model<double> model = random_tree(
        random, {4 + random.below(4), seed % 2 ? Base::kFloating : Base::kFixed, seed % 3 == 0, false});
    const State s = random_state(model, random);
    const RigidContact contact = random_contact(random, model);
    if (contact.body == contact.plane_body) continue;
    SCOPED_TRACE("seed " + std::to_string(seed));
    const UnilateralConstraints rigid{{contact}, {}};

    const Model<Float128> exact = model.cast<Float128>();
    Data<Float128> data(exact);
    const VectorXq q = s.q.cast<Float128>();
    const auto gap = [&](const VectorXq& at) {
      return VectorXq(unilateral_rows<Float128>(exact, data, rigid, at).gap);
    };
    const Eigen::RowVectorXd slope = tangent_difference(exact, q, gap).row(0);
    Data<double> plain(model);
    const UnilateralRows<double> rows = unilateral_rows<double>(model, plain, rigid, s.q);
    EXPECT_LT((rows.J.row(0) - slope).cwiseAbs().maxCoeff(), 1e-12 * (1 + slope.cwiseAbs().maxCoeff()));

    // The same with both bodies' Jacobians, which know nothing of common ancestors.
    forward_kinematics<double>(model, plain, s.q);
    const bool moves = contact.plane_body >= 0;
    const Placement<double> P = moves ? plain.X_WB[std::size_t(contact.plane_body)] : Placement<double>{};
    const Eigen::Matrix3d axes = P.R * plane_axes(contact.normal);
    const Placement<double>& X = plain.X_WB[std::size_t(contact.body)];
    const Vector3d point = X.p + X.R * contact.X_BF.p - contact.radius * axes.col(0);
    const Vector3d relative = velocity_at<double>(model, plain, s.q, s.v, contact.body, point) -
                              velocity_at<double>(model, plain, s.q, s.v, contact.plane_body, point);
    EXPECT_LT((rows.J * s.v - axes.transpose() * relative).norm(),
              1e-12 * (1 + relative.norm() + s.v.norm()));
    EXPECT_NEAR(rows.gap[0], axes.col(0).dot(point - P.p) - contact.offset, 1e-13);
  }
}

// What moves both bodies alike moves no contact between them: exactly, also after rounding.
TEST(RigidContacts, JointsThatCarryBothBodiesHaveNoEntries) {
  Random random(7);
  const Model<double> model = random_tree(random, {7, Base::kFloating, false, false});
  const State s = random_state(model, random);
  RigidContact contact = random_contact(random, model);
  contact.body = model.njoints() - 1, contact.plane_body = 0;
  Data<double> data(model);
  const auto rows = unilateral_rows<double>(model, data, {{contact}, {}}, s.q);
  EXPECT_EQ(rows.J.leftCols(6), Eigen::MatrixXd::Zero(3, 6));
}

}  // namespace
}  // namespace dyntape::dynamics::rigid_contacts_test
