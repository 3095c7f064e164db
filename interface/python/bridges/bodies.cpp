// SPDX-License-Identifier: BSD-3-Clause
#include "bodies.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/text.h>

namespace dyntape::python {
namespace {

using dynamics::digits;
using dynamics::JointType;
using Matrix3ByRows = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
using Placed = dynamics::Placement<double>;

// Takes numbers from a list, one after the other.
class Taker {
 public:
  explicit Taker(const std::vector<double>& from) : at_(from.data()) {}
  double number() { return *at_++; }
  Eigen::Vector3d vector() {
    const Eigen::Vector3d v(at_[0], at_[1], at_[2]);
    at_ += 3;
    return v;
  }
  Eigen::Matrix3d matrix() {
    const Eigen::Matrix3d m = Matrix3ByRows::Map(at_);
    at_ += 9;
    return m;
  }
  Placed placement() {
    const Eigen::Matrix3d R = matrix();
    return {R, vector()};
  }

 private:
  const double* at_;
};

void put(std::vector<double>& to, const Eigen::Vector3d& v) { to.insert(to.end(), v.data(), v.data() + 3); }
void put(std::vector<double>& to, const Eigen::Matrix3d& m) {
  const Matrix3ByRows rows = m;
  to.insert(to.end(), rows.data(), rows.data() + 9);
}
void put(std::vector<double>& to, const Placed& X) {
  put(to, Eigen::Matrix3d(X.R));
  put(to, Eigen::Vector3d(X.p));
}

JointType type_from(const std::string& word, const std::string& joint) {
  std::string all;
  for (std::size_t i = 0; i < std::size(dynamics::kJointTraits); ++i) {
    const std::string name = dynamics::kJointTraits[i].name;
    if (word == name) return static_cast<JointType>(i);
    all += (i == 0 ? "\"" : ", \"") + name + "\"";
  }
  throw ArgumentError("assemble: joint \"" + joint + "\": expected a type of " + all + ", got \"" + word +
                      "\"");
}

void check_count(const std::vector<double>& numbers, std::size_t expected, const std::string& what) {
  if (numbers.size() == expected) return;
  throw ArgumentError("assemble: " + what + " has " + std::to_string(numbers.size()) + " numbers, expected " +
                      std::to_string(expected));
}

void check_finite(const std::vector<double>& numbers, std::size_t first, std::size_t end,
                  const std::string& what) {
  const auto begin = numbers.begin();
  if (!std::all_of(begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(end),
                   [](double x) { return std::isfinite(x); }))
    throw ArgumentError("assemble: " + what + " has a number that is not finite");
}

void check_rotation(const Placed& X, const std::string& what) {
  const Eigen::Matrix3d& R = X.R;
  if ((R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < 1e-9 && R.determinant() > 0) return;
  throw ArgumentError("assemble: " + what + " is placed by a matrix that is no rotation");
}

void check_inertia(double mass, const Eigen::Matrix3d& I, const std::string& what) {
  if (mass < 0)
    throw ArgumentError("assemble: " + what + " has the mass " + digits(mass) + " kg; expected zero or more");
  const double scale = I.cwiseAbs().maxCoeff();
  if (scale == 0) return;
  if ((I - I.transpose()).cwiseAbs().maxCoeff() > 1e-9 * scale)
    throw ArgumentError("assemble: " + what + " has an inertia that is not symmetric");
  const Eigen::Matrix3d of_one = I / scale;
  const double least =
      scale * Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(of_one, Eigen::EigenvaluesOnly).eigenvalues()[0];
  if (least < -1e-9 * scale)
    throw ArgumentError("assemble: " + what +
                        " has an inertia that no body has: its smallest principal moment is " +
                        digits(least) + " kg m^2");
}

void add_body(const BodyRow& row, dynamics::Model<double>& model) {
  const auto& [name, type, parent, numbers] = row;
  const std::string what = "the body of joint \"" + name + "\"";
  check_count(numbers, kBodyNumbers, what);
  check_finite(numbers, 0, 29, what);
  check_finite(numbers, 33, kBodyNumbers, what);
  Taker take(numbers);
  dynamics::Joint<double> joint;
  joint.name = name;
  joint.type = type_from(type, name);
  joint.axis = take.vector();
  joint.pitch = take.number();
  const Placed X = take.placement();
  check_rotation(X, what);
  const double mass = take.number();
  const Eigen::Vector3d com = take.vector();
  const Eigen::Matrix3d I = take.matrix();
  check_inertia(mass, I, what);
  for (double* limit :
       {&joint.limits.lower, &joint.limits.upper, &joint.limits.velocity, &joint.limits.effort})
    *limit = take.number();
  for (double* number : {&joint.armature, &joint.damping, &joint.friction}) *number = take.number();
  if (!dynamics::is_single(joint.type) && joint.armature != 0)
    throw ArgumentError("assemble: joint \"" + name + "\" is " + type +
                        "; only joints about or along one axis have an armature");
  if (!(joint.limits.lower <= joint.limits.upper) || !(joint.limits.velocity >= 0) ||
      !(joint.limits.effort >= 0))
    throw ArgumentError("assemble: joint \"" + name + "\" has limits that nothing is within");
  model.add_joint(parent, joint, X, {mass, com, I});
}

void check_carrier(int joint, const dynamics::Model<double>& model, const std::string& what) {
  if (joint < -1 || joint >= model.njoints())
    throw ArgumentError("assemble: " + what + " names joint " + std::to_string(joint) +
                        ", expected -1 (the world) to " + std::to_string(model.njoints() - 1));
}

void check_distinct(const std::vector<std::string>& names, const std::string& kind) {
  std::set<std::string> seen;
  for (const std::string& name : names) {
    if (name.empty()) throw ArgumentError("assemble: a " + kind + " has no name");
    if (!seen.insert(name).second)
      throw ArgumentError("assemble: two " + kind + "s are called \"" + name + "\"");
  }
}

constexpr const char* kKinds[] = {"box", "cylinder", "sphere", "mesh"};

dynamics::Visual shape_from(const ShapeRow& row, const dynamics::Model<double>& model,
                            const std::vector<std::shared_ptr<const dynamics::Mesh>>& meshes) {
  const auto& [frame, body, kind, numbers, color, mesh] = row;
  const std::string what = "a shape of \"" + frame + "\"";
  check_count(numbers, 15, what);
  check_finite(numbers, 0, 15, what);
  check_carrier(body, model, what);
  const auto known = std::find(std::begin(kKinds), std::end(kKinds), kind);
  if (known == std::end(kKinds))
    throw ArgumentError("assemble: " + what + ": expected box, cylinder, sphere or mesh, got \"" + kind +
                        "\"");
  Taker take(numbers);
  dynamics::Visual visual;
  visual.link = frame;
  visual.body = body;
  visual.X_BV = take.placement();
  visual.scale = take.vector();
  visual.shape = static_cast<dynamics::Shape>(known - std::begin(kKinds));
  if (!color.empty()) {
    check_count(color, 4, "the colour of " + what);
    visual.color = Eigen::Vector4d::Map(color.data());
  }
  if (visual.shape == dynamics::Shape::kMesh) {
    if (mesh < 0 || mesh >= std::ssize(meshes)) throw ArgumentError("assemble: " + what + " has no mesh");
    visual.mesh = meshes[static_cast<std::size_t>(mesh)];
  }
  return visual;
}

std::shared_ptr<const dynamics::Mesh> mesh_from(const MeshRow& row) {
  const auto& [points, corners] = row;
  auto mesh = std::make_shared<dynamics::Mesh>();
  for (std::size_t i = 0; i + 2 < points.size(); i += 3)
    mesh->vertices.emplace_back(points[i], points[i + 1], points[i + 2]);
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    for (std::size_t k = i; k < i + 3; ++k)
      if (corners[k] < 0 || corners[k] >= std::ssize(mesh->vertices))
        throw ArgumentError("assemble: a mesh has a triangle without its vertices");
    mesh->triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
  }
  return mesh;
}

}  // namespace

RobotBodies bodies_from(const BodiesState& state) {
  const auto& [name, gravity, bodies, frames, left_out, shapes, meshes, contacts] = state;
  RobotBodies made;
  made.model.name = name;
  check_count(gravity, 3, "gravity");
  check_finite(gravity, 0, 3, "gravity");
  made.model.gravity = Eigen::Vector3d(Eigen::Vector3d::Map(gravity.data()));
  if (bodies.empty()) throw ArgumentError("assemble: \"" + name + "\" has no joint; expected one at least");
  for (const BodyRow& row : bodies) add_body(row, made.model);
  for (const auto& [frame, body, numbers] : frames) {
    const std::string what = "frame \"" + frame + "\"";
    check_count(numbers, 12, what);
    check_finite(numbers, 0, 12, what);
    check_carrier(body, made.model, what);
    const Placed X = Taker(numbers).placement();
    check_rotation(X, what);
    made.model.frames.push_back({frame, body, X});
  }
  check_distinct(dynamics::detail::names_of(made.model.joints), "joint");
  check_distinct(dynamics::detail::names_of(made.model.frames), "frame");
  made.left_out = left_out;
  std::vector<std::shared_ptr<const dynamics::Mesh>> read;
  for (const MeshRow& mesh : meshes) read.push_back(mesh_from(mesh));
  for (const ShapeRow& shape : shapes) made.shapes.push_back(shape_from(shape, made.model, read));
  for (const auto& [frame, body, center, radius] : contacts) {
    const std::string what = "a contact of \"" + frame + "\"";
    check_count(center, 3, what);
    check_finite(center, 0, 3, what);
    check_carrier(body, made.model, what);
    if (!(radius >= 0) || !std::isfinite(radius)) throw ArgumentError("assemble: " + what + " has no radius");
    made.touching.push_back({frame, body, Eigen::Vector3d::Map(center.data()), radius});
  }
  return made;
}

BodiesState state_of(const RobotBodies& bodies) {
  const dynamics::Model<double>& model = bodies.model;
  BodiesState state;
  auto& [name, gravity, body_rows, frames, left_out, shapes, meshes, contacts] = state;
  name = model.name;
  gravity.assign(model.gravity.data(), model.gravity.data() + 3);
  left_out = bodies.left_out;
  for (int i = 0; i < model.njoints(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    const dynamics::Joint<double>& joint = model.joints[k];
    const dynamics::JointLimits& limits = joint.limits;
    std::vector<double> numbers;
    put(numbers, joint.axis);
    numbers.push_back(joint.pitch);
    put(numbers, model.X_PJ[k]);
    numbers.push_back(model.inertias[k].mass);
    put(numbers, Eigen::Vector3d(model.inertias[k].com));
    put(numbers, Eigen::Matrix3d(model.inertias[k].I_c));
    numbers.insert(numbers.end(), {limits.lower, limits.upper, limits.velocity, limits.effort, joint.armature,
                                   joint.damping, joint.friction});
    body_rows.emplace_back(joint.name, to_string(joint.type), model.parent[k], std::move(numbers));
  }
  for (const auto& frame : model.frames) {
    std::vector<double> numbers;
    put(numbers, frame.X_BF);
    frames.emplace_back(frame.name, frame.body, std::move(numbers));
  }
  std::map<const dynamics::Mesh*, int> places;
  for (const dynamics::Visual& shape : bodies.shapes) {
    const auto [place, is_new] = places.try_emplace(shape.mesh.get(), static_cast<int>(meshes.size()));
    if (!shape.mesh) {
      place->second = -1;
    } else if (is_new) {
      auto& [points, corners] = meshes.emplace_back();
      for (const auto& v : shape.mesh->vertices) points.insert(points.end(), v.data(), v.data() + 3);
      for (const auto& t : shape.mesh->triangles) corners.insert(corners.end(), t.begin(), t.end());
    }
    std::vector<double> numbers, color;
    put(numbers, shape.X_BV);
    put(numbers, shape.scale);
    if (shape.color) color.assign(shape.color->data(), shape.color->data() + 4);
    shapes.emplace_back(shape.link, shape.body, kKinds[static_cast<int>(shape.shape)], std::move(numbers),
                        std::move(color), place->second);
  }
  for (const dynamics::CollisionSphere& sphere : bodies.touching)
    contacts.emplace_back(sphere.link, sphere.body,
                          std::vector<double>(sphere.center.data(), sphere.center.data() + 3), sphere.radius);
  return state;
}

}  // namespace dyntape::python
