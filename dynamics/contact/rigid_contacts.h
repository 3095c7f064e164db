// SPDX-License-Identifier: BSD-3-Clause
//
// Unilateral rigid constraints: contacts of spheres with planes, and hard stops of joints.  Computes the gap and the
// Jacobian rows of each; contact_problem.h and impact.h have the laws.
//
//   UnilateralConstraints rigid;
//   RigidContact foot{.name = "foot", .radius = 0.02, .friction = 0.7};
//   place_at_frame(model, "foot", foot);
//   rigid.contacts.push_back(foot);                                  // on the plane z = 0
//   rigid.stops = hard_stops(model, 0.0);                            // of the robot's limits
//   UnilateralRows<double> at = unilateral_rows(model, data, rigid, q);   // at.gap, at.J
//
// A contact is a sphere about the origin c of a frame (radius 0: a point) on the plane n . x = offset.  The plane is
// fixed in the world or on another body; x is then in the axes of this body.
//   gap = n . c - offset - radius                                                                  (m)
//   J v = velocity of the body's point at c - radius n along n, t_1, t_2 (plane_axes)              (m/s)
//         minus the velocity of the plane's body there
// d gap / dt is exactly the first row, also if the sphere rolls or the plane turns.  A contact without friction has
// the normal row only.  Planes are unbounded: a contact does not end at the edge of a body's face.
//
// A stop is a limit of a joint on a line: gap = +-(q - limit), row +-1                             (rad or m)
//
// The force (N, N m) of a row is J^T times its multiplier.  A contact force is fixed in the world while the body
// moves.  The functions are templates on the scalar; interface/system/rigid records them.
#pragma once

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/contact/contact_problem.h>

#include <cmath>
#include <string>
#include <vector>

namespace dyntape::dynamics {

struct RigidContact {
  std::string name;  // name of the frame
  int body = -1;     // set by place_at_frame (parameters.h)
  Placement<double> X_BF = {};
  double radius = 0;                                  // m
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // of the plane; any nonzero length
  double offset = 0;                                  // m, along the unit normal
  int plane_body = -1;                                // normal and offset are in its axes; -1: the world's
  double friction = 0;                                // mu >= 0
  double restitution = 0;                             // 0 ... 1
};

struct HardStop {
  std::string name;  // name of the joint
  int idx_q = 0, idx_v = 0;
  double sign = 1;  // 1: lower limit, -1: upper
  double limit = 0;
  double restitution = 0;
};

struct UnilateralConstraints {
  std::vector<RigidContact> contacts;
  std::vector<HardStop> stops;

  bool empty() const { return contacts.empty() && stops.empty(); }
  std::size_t size() const { return contacts.size() + stops.size(); }
  const std::string& name(std::size_t i) const {
    return i < contacts.size() ? contacts[i].name : stops[i - contacts.size()].name;
  }
  double restitution(std::size_t i) const {
    return i < contacts.size() ? contacts[i].restitution : stops[i - contacts.size()].restitution;
  }
};

// The contacts in their order, then the stops.
inline std::vector<ContactBlock> blocks_of(const UnilateralConstraints& rigid) {
  std::vector<ContactBlock> blocks;
  for (const RigidContact& c : rigid.contacts) blocks.push_back({c.friction > 0 ? 3 : 1, c.friction});
  for (std::size_t i = 0; i < rigid.stops.size(); ++i) blocks.push_back({1, 0});
  return blocks;
}

// Columns n, t_1, t_2, right-handed.  t_1 is the projection of x (of y if n is close to x).
inline Eigen::Matrix3d plane_axes(const Eigen::Vector3d& normal) {
  const Eigen::Vector3d n = normal.normalized();
  const Eigen::Vector3d x = std::abs(n.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d along = (x - n * n.dot(x)).normalized();
  Eigen::Matrix3d axes;
  axes << n, along, n.cross(along);
  return axes;
}

// The finite position limits of all joints on a line.
template <class T>
std::vector<HardStop> hard_stops(const Model<T>& model, double restitution) {
  std::vector<HardStop> stops;
  for (const Joint<T>& joint : model.joints) {
    if (!traits(joint.type).on_a_line) continue;
    const auto add = [&](double sign, double limit) {
      if (std::isfinite(limit))
        stops.push_back({joint.name, joint.idx_q, joint.idx_v, sign, limit, restitution});
    };
    add(1, joint.limits.lower);
    add(-1, joint.limits.upper);
  }
  return stops;
}

template <class T>
struct UnilateralRows {
  VectorX<T> gap;  // one per constraint
  MatrixX<T> J;    // (m x nv)
};

// Adds to J, from `row`, the velocity of a point of `body` along `axes`, times `sign`.  `lever` (m, world) goes from
// the body's origin to the point.  Joints that carry both `body` and `other` are skipped: they move both alike.
template <class T>
void add_point_rows(const Model<T>& model, Data<T>& data, const VectorX<T>& q, int body, int other,
                    const Vector3<T>& lever, const Matrix3<T>& axes, double sign, Eigen::Index row, int rows,
                    MatrixX<T>& J) {
  std::vector<bool> is_common(std::size_t(model.njoints()), false);
  for (int joint = other; joint >= 0; joint = model.parent[joint]) is_common[std::size_t(joint)] = true;
  const Matrix6X<T>& of_body =
      frame_jacobian<T>(model, data, q, on_body(body), ReferenceFrame::kLocalWorldAligned);
  for (int k = 0; k < rows; ++k) {
    const Vector3<T> along = axes.col(k), moment = lever.cross(along);
    for (int joint = body; joint >= 0 && !is_common[std::size_t(joint)]; joint = model.parent[joint]) {
      for (int j = data.tree.first[joint]; j < data.tree.first[joint] + data.tree.count[joint]; ++j) {
        const auto column = of_body.col(j);
        const T speed = along.dot(column.template head<3>()) + moment.dot(column.template tail<3>());
        J(row + k, j) = sign > 0 ? speed : T(-speed);
      }
    }
  }
}

// Overwrites data.X_WB and data.J.
template <class T>
UnilateralRows<T> unilateral_rows(const Model<T>& model, Data<T>& data, const UnilateralConstraints& rigid,
                                  const VectorX<T>& q) {
  const std::vector<ContactBlock> blocks = blocks_of(rigid);
  Eigen::Index m = 0;
  for (const ContactBlock& block : blocks) m += block.rows;
  UnilateralRows<T> rows;
  rows.gap = VectorX<T>::Constant(Eigen::Index(rigid.size()), T(0));
  rows.J = MatrixX<T>::Constant(m, model.nv, T(0));
  forward_kinematics<T>(model, data, q);
  Eigen::Index row = 0, i = 0;
  for (const RigidContact& c : rigid.contacts) {
    Matrix3<T> axes = plane_axes(c.normal).cast<T>();
    const Placement<T> X = data.X_WB[std::size_t(c.body)];
    const Vector3<T> arm = X.R * c.X_BF.p.cast<T>();
    Vector3<T> center = X.p + arm;
    if (c.plane_body >= 0) {
      const Placement<T>& P = data.X_WB[std::size_t(c.plane_body)];
      axes = P.R * axes;
      center -= P.p;  // from the origin of the plane's body
    }
    const Vector3<T> n = axes.col(0);
    const int count = blocks[std::size_t(i)].rows;
    rows.gap[i] = n.dot(center) - T(c.offset + c.radius);
    add_point_rows<T>(model, data, q, c.body, c.plane_body, arm - n * T(c.radius), axes, 1, row, count,
                      rows.J);
    if (c.plane_body >= 0)
      add_point_rows<T>(model, data, q, c.plane_body, c.body, center - n * T(c.radius), axes, -1, row, count,
                        rows.J);
    row += count;
    ++i;
  }
  for (const HardStop& stop : rigid.stops) {
    rows.gap[i++] = (q[stop.idx_q] - T(stop.limit)) * T(stop.sign);
    rows.J(row++, stop.idx_v) = T(stop.sign);
  }
  return rows;
}

}  // namespace dyntape::dynamics
