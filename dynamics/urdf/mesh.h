// SPDX-License-Identifier: BSD-3-Clause
//
// Finds and reads mesh files.
//
//   std::string path = find_mesh("package://solo/meshes/base.stl", "/robots/solo12.urdf");  // "" if not there
//   for (const MeshPart& part : read_mesh(path, {.urdf = "/robots/solo12.urdf"}).parts) ...
//
// assimp reads the files.  Frames inside a COLLADA file are applied, and its unit of length is converted to metres.
// Its axes are used as they are (as in RViz), independent of its up axis.
//
// Triangles are counted before a file is parsed if the format allows, else before faces are triangulated and
// instances are placed.  Files that a mesh names, such as the materials of an .obj, must be regular files below the
// mesh's folder, the robot's folder or its package (the nearest folder above with a package.xml); a note lists what
// is skipped.
//
// Errors.  FileError: a file that does not exist, is not .stl, .obj or .dae, or has no triangles or too many; and if
// stopped.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

namespace dyntape::dynamics {

// Triangles in the axes of the shape; lengths as in the file, without the scale of the URDF.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<int, 3>> triangles;  // three vertices each
};

// The triangles of one colour.
struct MeshPart {
  std::shared_ptr<const Mesh> mesh;
  std::optional<Eigen::Vector4d> color;  // red, green, blue, opacity; empty if the file has no colour
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
