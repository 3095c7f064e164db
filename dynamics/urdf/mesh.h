// SPDX-License-Identifier: BSD-3-Clause
//
// Mesh files: where they are, and what is in them.
//
//   std::string path = find_mesh("package://solo/meshes/base.stl", "/robots/solo12.urdf");  // "" if not there
//   for (const MeshPart& part : read_mesh(path)) ...
//
// assimp reads them.  Frames inside a COLLADA file are carried out, its unit of length becomes the metre, and its
// axes are taken as they are (as RViz does), whatever it calls upwards.
//
// Errors: FileError for a file that is not there, is no .stl, .obj or .dae, or has no triangles.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace dyntape::dynamics {

// Triangles in the axes of the shape; lengths as in the file, before the scale of the URDF.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<int, 3>> triangles;  // three vertices each
};

// The triangles of one colour.
struct MeshPart {
  std::shared_ptr<const Mesh> mesh;
  std::optional<Eigen::Vector4d> color;  // red, green, blue, opacity; none where the file gives none
};

std::string find_mesh(const std::string& name, const std::string& urdf);

std::vector<MeshPart> read_mesh(const std::string& path);

}  // namespace dyntape::dynamics
