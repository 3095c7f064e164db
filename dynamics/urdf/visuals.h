// SPDX-License-Identifier: BSD-3-Clause
//
// Reads the visual shapes of a URDF file, to draw the robot.
//
//   UrdfRobot robot = read_urdf("solo12.urdf", {.base = Base::kFloating});
//   UrdfVisuals visuals = read_visuals("solo12.urdf", robot.model);
//   for (const Visual& v : visuals.shapes) draw(v.shape, X_WB[v.body] * v.X_BV, v.scale, v.color);
//
// A shape is in the frame of the body that carries its link.  Fixed links, locked joints and changed bases are as in
// the model (Frame, model.h).  Every shape is a unit shape, scaled along its axes by `scale` before it is placed:
//   box       edges of 1 m about the origin       scale: the edges (m)
//   cylinder  radius 1 m, z from -1/2 to 1/2 m    scale: (radius, radius, length) (m)
//   sphere    radius 1 m                          scale: (radius, radius, radius) (m)
//   mesh      as in its file                      scale: the scale of the URDF, negative: mirrored
//
// Meshes are STL, OBJ and COLLADA (.dae) files.  Paths are relative to the URDF, file://, or package://name/rest.  A
// package path is searched as name/rest in the folders above the URDF and in ROS_PACKAGE_PATH.  A material of the
// URDF colours a whole mesh.  Without one, each part of a mesh has the colour of the mesh file and is a shape.
//
// A shape that cannot be drawn is skipped with a note, and its link is listed in `incomplete`.  Causes: a mesh that
// is missing, damaged or too large; a shape without size; a length <= 0; a colour outside 0 to 1; an unknown
// material or geometry.
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
  std::string link;             // the link: a frame of the model
  int body = -1;                // joint index of this frame's body; -1: the world
  Placement<double> X_BV = {};  // shape in the body
  Shape shape = Shape::kBox;
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  // Red, green, blue, opacity, each 0 to 1; empty if no file defines a colour.
  std::optional<Eigen::Vector4d> color = {};
  // Shared by all shapes from the same part of a file; null if the shape is not a mesh.
  std::shared_ptr<const Mesh> mesh = {};
};

struct UrdfVisuals {
  std::vector<Visual> shapes;           // in the order of the file
  std::vector<std::string> incomplete;  // links with shapes that were skipped
  std::vector<std::string> notes;       // `file:line: sentence`
};

struct VisualOptions {
  std::size_t most_triangles =
      kMostTriangles;         // limit for all meshes together, each shape counted; meshes beyond are skipped
  std::stop_token stop = {};  // meshes not read by then are skipped
  // kCollisions: reads the <collision> shapes, without colours; meshes are skipped and their links are incomplete
  // (collisions.h).
  enum class Of { kVisuals, kCollisions };
  Of of = Of::kVisuals;
};

UrdfVisuals read_visuals(const std::string& path, const Model<double>& model,
                         const VisualOptions& options = {});

// Reads from text in memory; mesh paths are relative to `file`.
UrdfVisuals read_visuals_text(const std::string& text, const std::string& file, const Model<double>& model,
                              const VisualOptions& options = {});

}  // namespace dyntape::dynamics
