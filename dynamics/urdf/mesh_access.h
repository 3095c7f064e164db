// SPDX-License-Identifier: BSD-3-Clause
//
// Limits the cost of a mesh file before it is parsed, and the other files that it may read (private to mesh.cpp).
//
//   const std::string bytes = mesh_bytes(path);                  // of a regular file; FileError
//   const MeshSize size = size_of_mesh(bytes, ".obj");           // counted in the text, nothing is parsed
//   importer.SetIOHandler(new MeshAccess(path, bytes, folders, notes));
//
// A mesh names other files, for example the materials of an .obj.  The path may be any path, also a pipe without a
// writer.
#pragma once

#include <assimp/IOStream.hpp>
#include <assimp/IOSystem.hpp>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace dyntape::dynamics {

std::string mesh_bytes(const std::string& path);

struct MeshSize {
  std::size_t triangles = 0;
  double effort = 0;  // of cutting faces into triangles: the sum of the squared numbers of corners
};
// Zero for .dae files, whose sizes are known only after parsing.
MeshSize size_of_mesh(const std::string& bytes, const std::string& extension);

// Gives the importer the mesh, whose bytes are already read, and the files that it names: regular files of moderate
// size in or below these folders.
class MeshAccess : public Assimp::IOSystem {
 public:
  MeshAccess(std::string path, const std::string& bytes, std::vector<std::filesystem::path> folders,
             std::vector<std::string>& notes);

  bool Exists(const char* file) const override;
  char getOsSeparator() const override { return '/'; }
  Assimp::IOStream* Open(const char* file, const char* mode) override;
  void Close(Assimp::IOStream* stream) override { delete stream; }

 private:
  bool is_allowed(const std::string& file) const;

  std::string path_;
  const std::string& bytes_;
  std::vector<std::filesystem::path> folders_;
  std::vector<std::string>& notes_;
};

}  // namespace dyntape::dynamics
