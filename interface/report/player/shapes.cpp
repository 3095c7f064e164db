// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/player/shapes.h>

#include <algorithm>
#include <cmath>

namespace dyntape {

using dynamics::Model;
using dynamics::Placement;
using dynamics::Shape;
using dynamics::UrdfVisuals;
using dynamics::Visual;
using Eigen::Vector3d;

namespace {

Placement<double> of_body(const Placements& X_WB, int body) {
  return body < 0 ? Placement<double>{} : X_WB[std::size_t(body)];
}

// What slides on the world, or flies, hangs on nothing that could be drawn.
bool stands_on_world(dynamics::JointType type) {
  using dynamics::JointType;
  return type != JointType::kPrismatic && type != JointType::kPlanar && type != JointType::kFreeFlyer;
}

// Lists a body, the world's before all: of body i at [i + 1].
template <class T>
using OfBodies = std::vector<T>;

// Ends of the sticks of each body, in its frame: the joints that it carries and the frames away from its own.
OfBodies<std::vector<Vector3d>> stick_ends(const Model<double>& model) {
  OfBodies<std::vector<Vector3d>> ends(std::size_t(model.njoints()) + 1);
  for (int i = 0; i < model.njoints(); ++i) {
    const int parent = model.parent[std::size_t(i)];
    if (parent >= 0 || stands_on_world(model.joints[std::size_t(i)].type))
      ends[std::size_t(parent + 1)].push_back(model.X_PJ[std::size_t(i)].p);
  }
  for (const auto& frame : model.frames) {
    if (frame.body >= 0) ends[std::size_t(frame.body + 1)].push_back(frame.X_BF.p);
  }
  return ends;
}

// Bodies that shapes of the file do not show, or not wholly.
OfBodies<bool> needs_sticks(const Model<double>& model, const UrdfVisuals& visuals) {
  OfBodies<bool> needs(std::size_t(model.njoints()) + 1, true);
  for (const Visual& shape : visuals.shapes) needs[std::size_t(shape.body + 1)] = false;
  for (const std::string& link : visuals.incomplete)
    needs[std::size_t(model.frames[std::size_t(model.frame_index(link))].body + 1)] = true;
  for (int i = 0; i < model.njoints(); ++i)
    if (only_places(model, i)) needs[std::size_t(i + 1)] = false;
  return needs;
}

// How large the robot is; of one body: how long its longest stick.
double reach(const OfBodies<std::vector<Vector3d>>& ends, const Placements& X_WB) {
  Eigen::AlignedBox3d box;
  double step = 0;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const Placement<double> X = of_body(X_WB, int(i) - 1);
    if (i > 0) box.extend(X.p);
    for (const Vector3d& end : ends[i]) {
      box.extend(X.R * end + X.p);
      step = std::max(step, end.norm());
    }
  }
  return std::max(box.isEmpty() ? 0 : box.diagonal().norm(), step);
}

class Sticks {
 public:
  Sticks(int body, double radius, std::vector<Visual>& shapes)
      : body_(body), radius_(radius), shapes_(shapes) {}

  void ball(const Vector3d& at, double factor) {
    add(Shape::kSphere, {Eigen::Matrix3d::Identity(), at}, Vector3d::Constant(factor * radius_), kJointColor);
  }

  // A capsule from the body's origin: a cylinder, and a ball at its end.
  void stick(const Vector3d& end) {
    const Eigen::Matrix3d R = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), end).matrix();
    add(Shape::kCylinder, {R, end / 2}, {radius_, radius_, end.norm()}, kStickColor);
    add(Shape::kSphere, {R, end}, Vector3d::Constant(radius_), kStickColor);
  }

 private:
  void add(Shape shape, const Placement<double>& X, const Vector3d& scale, const Eigen::Vector4d& color) {
    shapes_.push_back({.link = "", .body = body_, .X_BV = X, .shape = shape, .scale = scale, .color = color});
  }

  inline static const Eigen::Vector4d kStickColor{0.55, 0.60, 0.66, 1}, kJointColor{0.90, 0.62, 0.0, 1};
  int body_;
  double radius_;
  std::vector<Visual>& shapes_;
};

void add_sticks(int body, const std::vector<Vector3d>& ends, double radius, std::vector<Visual>& shapes) {
  Sticks sticks(body, radius, shapes);
  std::vector<Vector3d> drawn;
  for (const Vector3d& end : ends) {
    const auto is_near = [&](const Vector3d& other) { return (end - other).norm() < 0.2 * radius; };
    if (end.norm() < 1.2 * radius || std::any_of(drawn.begin(), drawn.end(), is_near)) continue;
    sticks.stick(end);
    drawn.push_back(end);
  }
  sticks.ball(Vector3d::Zero(), 1.35);
}

}  // namespace

bool only_places(const Model<double>& model, int body) {
  return model.joints[std::size_t(body)].type == dynamics::JointType::kPrismatic &&
         model.inertias[std::size_t(body)].mass == 0;
}

std::vector<Visual> player_shapes(const Model<double>& model, const UrdfVisuals& visuals,
                                  const Placements& X_WB) {
  std::vector<Visual> shapes = visuals.shapes;
  const OfBodies<bool> needed = needs_sticks(model, visuals);
  const OfBodies<std::vector<Vector3d>> ends = stick_ends(model);
  const double size = reach(ends, X_WB), radius = size > 0 ? 0.018 * size : 0.1;
  for (std::size_t i = 0; i < ends.size(); ++i) {
    if (needed[i] && (i > 0 || !ends[i].empty())) add_sticks(int(i) - 1, ends[i], radius, shapes);
  }
  return shapes;
}

Eigen::AlignedBox3d own_box(const Visual& shape) {
  if (shape.shape == Shape::kBox) return {Vector3d::Constant(-0.5), Vector3d::Constant(0.5)};
  if (shape.shape == Shape::kCylinder) return {Vector3d(-1, -1, -0.5), Vector3d(1, 1, 0.5)};
  if (shape.shape == Shape::kSphere) return {Vector3d::Constant(-1), Vector3d::Constant(1)};
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& v : shape.mesh->vertices) box.extend(v.cast<double>());
  return box;
}

Eigen::AlignedBox3d world_box(const Visual& shape, const Eigen::AlignedBox3d& own, const Placements& X_WB) {
  const Placement<double> X = of_body(X_WB, shape.body) * shape.X_BV;
  const Eigen::Matrix3d R = X.R;
  const Vector3d& s = shape.scale;
  if (shape.shape == Shape::kSphere) return {X.p - s, X.p + s};
  if (shape.shape == Shape::kCylinder) {  // a disc's shadow on an axis is that of its circle
    const Vector3d along = R.col(2).cwiseAbs(), across = (1 - along.array().square()).max(0).sqrt();
    const Vector3d half = across * s.x() + along * (s.z() / 2);
    return {X.p - half, X.p + half};
  }
  const Vector3d center = R * s.cwiseProduct(own.center()) + X.p;
  const Vector3d half = R.cwiseAbs() * s.cwiseAbs().cwiseProduct(own.sizes() / 2);
  return {center - half, center + half};
}

}  // namespace dyntape
