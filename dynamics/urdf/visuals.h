// SPDX-License-Identifier: BSD-3-Clause
//
// What a robot looks like: the visual shapes of its URDF file.
//
//   UrdfRobot robot = read_urdf("solo12.urdf", {.base = Base::kFloating});
//   UrdfVisuals visuals = read_visuals("solo12.urdf", robot.model);
//   for (const Visual& v : visuals.shapes) draw(v.shape, X_WB[v.body] * v.X_BV, v.scale, v.color);
//
// A shape stands in the frame of the body that carries its link, fixed links merged, joints locked and bases
// changed as in the model (Frame, model.h).  Every shape is a unit shape, stretched along its axes by `scale`
// before it is placed:
//   box       edges of 1 m about the origin       scale: the edges (m)
//   cylinder  radius 1 m, z from -1/2 to 1/2 m    scale: (radius, radius, length) (m)
//   sphere    radius 1 m                          scale: (radius, radius, radius) (m)
//   mesh      as the file has it                  scale: that of the URDF, negative to mirror
//
// Meshes are STL, OBJ and COLLADA (.dae) files: relative to the URDF; file://; or package://name/rest, which is
// looked for as name/rest in the folders above the URDF and in those of ROS_PACKAGE_PATH.  A material of the
// URDF colours a whole mesh; without one, parts of a mesh keep their file's colours, a shape each.
//
// What cannot be drawn leaves its link without it: a note, and the link in `incomplete`.  That is a mesh that is missing,
// damaged or too much; a shape without its size, a length that is not above zero, a colour outside 0 to 1, a material or a
// geometry that nobody knows.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/dynamics/model/model.h>
#include <dyntape/dynamics/urdf/mesh.h>

namespace dyntape::dynamics {

enum class Shape { kBox, kCylinder, kSphere, kMesh };

struct Visual {
  std::string link;             // the frame of the model that it belongs to
  int body = -1;                // of that frame: its joint, -1 for the world
  Placement<double> X_BV = {};  // shape in the body
  Shape shape = Shape::kBox;
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  // Red, green, blue, opacity, 0 to 1; none where no file gives one.
  std::optional<Eigen::Vector4d> color = {};
  // One object for all shapes from one part of a file; null for shapes that are no meshes.
  std::shared_ptr<const Mesh> mesh = {};
};

struct UrdfVisuals {
  std::vector<Visual> shapes;           // in the order of the file
  std::vector<std::string> incomplete;  // links whose meshes are not all there
  std::vector<std::string> notes;       // `file:line: sentence`
};

struct VisualOptions {
  std::size_t most_triangles =
      kMostTriangles;         // of all meshes together, each shape counted; a mesh beyond is left out
  std::stop_token stop = {};  // meshes that are not read by then are left out
  // The <collision> shapes instead, without colours, and without meshes: links with such are incomplete (collisions.h).
  enum class Of { kVisuals, kCollisions };
  Of of = Of::kVisuals;
};

UrdfVisuals read_visuals(const std::string& path, const Model<double>& model,
                         const VisualOptions& options = {});

// The same from text in memory; meshes are looked for beside `file`.
UrdfVisuals read_visuals_text(const std::string& text, const std::string& file, const Model<double>& model,
                              const VisualOptions& options = {});

}  // namespace dyntape::dynamics
