// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/urdf/mesh.h>

#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <assimp/Importer.hpp>
#include <assimp/ProgressHandler.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <string_view>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/mesh_access.h>

namespace dyntape::dynamics {

namespace fs = std::filesystem;

namespace {

bool is_file(const fs::path& path) {
  std::error_code none;
  return fs::is_regular_file(path, none);
}

// `rest` of `package` below a folder that holds packages, or that is the package.
std::string in_folder(const fs::path& folder, const std::string& package, const std::string& rest) {
  if (is_file(folder / package / rest)) return (folder / package / rest).string();
  if (folder.filename() == package && is_file(folder / rest)) return (folder / rest).string();
  return "";
}

std::string in_package(const std::string& package, const std::string& rest, const fs::path& urdf) {
  for (fs::path folder = urdf.parent_path(); folder != folder.root_path(); folder = folder.parent_path()) {
    if (std::string found = in_folder(folder, package, rest); !found.empty()) return found;
  }
  const char* paths = std::getenv("ROS_PACKAGE_PATH");
  std::istringstream folders(paths ? paths : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    while (folder.ends_with('/')) folder.pop_back();
    if (folder.empty()) continue;
    if (std::string found = in_folder(folder, package, rest); !found.empty()) return found;
  }
  return "";
}

std::string lower_extension(const std::string& path) {
  std::string extension = fs::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

Mesh triangles_of(const aiMesh& source) {
  Mesh mesh;
  for (unsigned i = 0; i < source.mNumVertices; ++i) {
    const aiVector3D& v = source.mVertices[i];
    mesh.vertices.emplace_back(float(v.x), float(v.y), float(v.z));
  }
  for (unsigned i = 0; i < source.mNumFaces; ++i) {
    const aiFace& face = source.mFaces[i];
    if (face.mNumIndices == 3)
      mesh.triangles.push_back({int(face.mIndices[0]), int(face.mIndices[1]), int(face.mIndices[2])});
  }
  return mesh;
}

bool is_finite(const Mesh& mesh) {
  return std::all_of(mesh.vertices.begin(), mesh.vertices.end(),
                     [](const Eigen::Vector3f& v) { return v.allFinite(); });
}

// assimp gives a material to files that have none, under a name of its own.
std::optional<Eigen::Vector4d> color_of(const aiMaterial& material) {
  aiString name;
  aiColor4D c;
  if (material.Get(AI_MATKEY_NAME, name) == AI_SUCCESS &&
      std::string_view(name.C_Str()) == AI_DEFAULT_MATERIAL_NAME)
    return std::nullopt;
  if (material.Get(AI_MATKEY_COLOR_DIFFUSE, c) != AI_SUCCESS) return std::nullopt;
  const auto part = [](float x) { return std::isfinite(x) ? std::clamp(double(x), 0.0, 1.0) : 1.0; };
  return Eigen::Vector4d(part(c.r), part(c.g), part(c.b), 1);  // exporters disagree on what opacity is
}

// In which files are that a mesh may name.
std::vector<fs::path> folders_of(const std::string& mesh, const std::string& urdf) {
  std::vector<fs::path> folders = {fs::absolute(mesh).parent_path()};
  if (!urdf.empty()) folders.push_back(fs::absolute(urdf).lexically_normal().parent_path());
  for (fs::path at = folders.front(); at != at.root_path(); at = at.parent_path()) {
    if (!is_file(at / "package.xml")) continue;
    folders.push_back(at);
    break;
  }
  return folders;
}

class Stopper : public Assimp::ProgressHandler {
 public:
  explicit Stopper(std::stop_token stop) : stop_(std::move(stop)) {}
  bool Update(float) override { return !stop_.stop_requested(); }

 private:
  std::stop_token stop_;
};

// Of all copies that the nodes of a scene place.
MeshSize placed_size(const aiScene& scene) {
  std::vector<MeshSize> sizes(scene.mNumMeshes);
  for (unsigned i = 0; i < scene.mNumMeshes; ++i) {
    for (unsigned k = 0; k < scene.mMeshes[i]->mNumFaces; ++k) {
      const unsigned corners = scene.mMeshes[i]->mFaces[k].mNumIndices;
      sizes[i].triangles += corners > 2 ? corners - 2 : 0;
      sizes[i].effort += double(corners) * corners;
    }
  }
  MeshSize all;
  std::vector<const aiNode*> open = {scene.mRootNode};
  while (!open.empty()) {
    const aiNode* node = open.back();
    open.pop_back();
    if (!node) continue;
    open.insert(open.end(), node->mChildren, node->mChildren + node->mNumChildren);
    for (unsigned i = 0; i < node->mNumMeshes; ++i) {
      all.triangles += sizes[node->mMeshes[i]].triangles;
      all.effort += sizes[node->mMeshes[i]].effort;
    }
  }
  return all;
}

void check_size(const std::string& path, const MeshSize& size, std::size_t most_triangles) {
  constexpr double kMostEffort = 1e7;  // about a second
  if (size.triangles > most_triangles)
    throw FileError(path + ": this mesh of " + std::to_string(size.triangles) +
                    " triangles is left out; expected at most " + std::to_string(most_triangles));
  if (size.effort > kMostEffort)
    throw FileError(
        path +
        ": this mesh is left out: its faces have so many corners that cutting them into triangles "
        "takes too long; expected triangles");
}

}  // namespace

std::string find_mesh(const std::string& name, const std::string& urdf) {
  const fs::path here = fs::absolute(urdf).lexically_normal();
  constexpr std::string_view kPackage = "package://", kFile = "file://";
  if (name.starts_with(kPackage)) {
    const std::string inside = name.substr(kPackage.size());
    const std::size_t slash = inside.find('/');
    return slash == inside.npos ? "" : in_package(inside.substr(0, slash), inside.substr(slash + 1), here);
  }
  const fs::path path = here.parent_path() / (name.starts_with(kFile) ? name.substr(kFile.size()) : name);
  return is_file(path) ? path.lexically_normal().string() : "";
}

MeshFile read_mesh(const std::string& path, const MeshQuestion& question) {
  const std::string extension = lower_extension(path);
  if (extension != ".stl" && extension != ".obj" && extension != ".dae")
    throw FileError(path + ": meshes of this kind are not read; expected .stl, .obj or .dae");
  const std::string bytes = mesh_bytes(path);
  check_size(path, size_of_mesh(bytes, extension), question.most_triangles);
  MeshFile file;
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  importer.SetPropertyInteger(AI_CONFIG_PP_RVC_FLAGS, aiComponent_NORMALS | aiComponent_TEXCOORDS |
                                                          aiComponent_COLORS |
                                                          aiComponent_TANGENTS_AND_BITANGENTS);
  importer.SetIOHandler(new MeshAccess(path, bytes, folders_of(path, question.urdf), file.notes));
  importer.SetProgressHandler(new Stopper(question.stop));
  const aiScene* scene = importer.ReadFile(path, 0);
  if (scene) check_size(path, placed_size(*scene), question.most_triangles);
  for (const aiPostProcessSteps step :
       {aiProcess_RemoveComponent, aiProcess_PreTransformVertices, aiProcess_Triangulate,
        aiProcess_SortByPType, aiProcess_JoinIdenticalVertices}) {
    if (question.stop.stop_requested()) throw FileError(path + ": this mesh is left out: interrupted");
    if (scene) scene = importer.ApplyPostProcessing(step);
  }
  if (!scene) throw FileError(path + ": this mesh cannot be read: " + importer.GetErrorString());
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    const aiMesh& source = *scene->mMeshes[i];
    auto mesh = std::make_shared<const Mesh>(triangles_of(source));
    if (!is_finite(*mesh)) throw FileError(path + ": this mesh has a vertex that is not a finite number");
    if (!mesh->triangles.empty())
      file.parts.push_back({mesh, color_of(*scene->mMaterials[source.mMaterialIndex])});
  }
  if (file.parts.empty()) throw FileError(path + ": this mesh has no triangles");
  return file;
}

}  // namespace dyntape::dynamics
