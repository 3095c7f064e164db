// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/urdf/collisions.h>

#include <cmath>

#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/urdf/visuals.h>

namespace dyntape::dynamics {

namespace {

constexpr int kPointsOnRim = 8;

// The points of a unit shape before it is stretched.
std::vector<Eigen::Vector3d> corners(Shape shape) {
  std::vector<Eigen::Vector3d> points;
  if (shape == Shape::kSphere) return {Eigen::Vector3d::Zero()};
  for (const double z : {-0.5, 0.5}) {
    if (shape == Shape::kBox) {
      for (const double y : {-0.5, 0.5}) {
        for (const double x : {-0.5, 0.5}) points.emplace_back(x, y, z);
      }
    } else {
      for (int k = 0; k < kPointsOnRim; ++k) {
        const double angle = 2 * std::acos(-1.0) * k / kPointsOnRim;
        points.emplace_back(std::cos(angle), std::sin(angle), z);
      }
    }
  }
  return points;
}

}  // namespace

UrdfCollisions read_collisions_text(const std::string& text, const std::string& file,
                                    const Model<double>& model) {
  const UrdfVisuals found = read_visuals_text(text, file, model, {.of = VisualOptions::Of::kCollisions});
  UrdfCollisions collisions{{}, found.incomplete, found.notes};
  for (const Visual& visual : found.shapes) {
    for (const Eigen::Vector3d& corner : corners(visual.shape)) {
      const Eigen::Vector3d at = visual.X_BV.p + visual.X_BV.R * visual.scale.cwiseProduct(corner);
      const double radius = visual.shape == Shape::kSphere ? visual.scale[0] : 0;
      collisions.spheres.push_back({visual.link, visual.body, at, radius});
    }
  }
  return collisions;
}

UrdfCollisions read_collisions(const std::string& path, const Model<double>& model) {
  return read_collisions_text(read_file(path), path, model);
}

}  // namespace dyntape::dynamics
