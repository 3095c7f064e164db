// SPDX-License-Identifier: BSD-3-Clause
//
// Mesh files: where they are, and what is in them.
//
//   std::string path = find_mesh("package://solo/meshes/base.stl", "/robots/solo12.urdf");  // "" if not there
//   for (const MeshPart& part : read_mesh(path, {.urdf = "/robots/solo12.urdf"}).parts) ...
//
// assimp reads them.  Frames inside a COLLADA file are carried out, its unit of length becomes the metre, and its
// axes are taken as they are (as RViz does), whatever it calls upwards.
//
// Triangles are counted before a file is parsed where its format allows, and before faces are cut into triangles and copies are
// placed otherwise.  What a mesh names, as an .obj its materials, has to be a regular file below its own folder, that of the
// robot or its package (the nearest folder above with a package.xml); a note says what is left out.
//
// Errors: FileError for a file that is not there, is no .stl, .obj or .dae, has no triangles or more than it may have; and where
// it is stopped.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <stop_token>
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

constexpr std::size_t kMostTriangles = 300'000;

struct MeshQuestion {
  std::string urdf = {};  // of the robot that has the mesh, or ""
  std::size_t most_triangles = kMostTriangles;
  std::stop_token stop = {};
};
struct MeshFile {
  std::vector<MeshPart> parts;
  std::vector<std::string> notes;
};
MeshFile read_mesh(const std::string& path, const MeshQuestion& question = {});

}  // namespace dyntape::dynamics
