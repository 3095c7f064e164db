// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/urdf/visuals.h>

#include <map>
#include <string_view>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/suggest.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/dynamics/urdf/mesh.h>
#include <dyntape/dynamics/urdf/rotation_snap.h>
#include <dyntape/dynamics/urdf/text.h>

namespace dyntape::dynamics {

using tinyxml2::XMLElement;

namespace {

class VisualReader {
 public:
  VisualReader(const UrdfText& text, const std::string& file, const Model<double>& model,
               const VisualOptions& options)
      : text_(text),
        file_(file),
        model_(model),
        of_(options.of),
        most_triangles_(options.most_triangles),
        stop_(options.stop) {}

  UrdfVisuals read() {
    for (const XMLElement* material : text_.children("material")) or_note([&] { learn(*material); });
    for (const XMLElement* link : text_.children("link")) {
      const char* const kind = of_ == VisualOptions::Of::kVisuals ? "visual" : "collision";
      for (auto* visual = link->FirstChildElement(kind); visual; visual = visual->NextSiblingElement(kind)) {
        if (or_note([&] { add(*link, *visual); })) continue;
        if (const char* name = link->Attribute("name")) result_.incomplete.push_back(name);
      }
    }
    return std::move(result_);
  }

 private:
  template <class Read>
  bool or_note(Read&& read) {
    try {
      read();
      return true;
    } catch (const FileError& e) {
      result_.notes.push_back(e.what());
      return false;
    }
  }

  // A material with a colour is known by its name from there on, as in urdfdom.
  void learn(const XMLElement& material) {
    const char* name = material.Attribute("name");
    if (const auto color = color_in(material); color && name) colors_[name] = *color;
  }

  std::optional<Eigen::Vector4d> color_in(const XMLElement& material) const {
    const XMLElement* tag = material.FirstChildElement("color");
    if (!tag) return std::nullopt;
    const auto rgba = text_.numbers(*tag, "rgba", 4);
    if (!rgba) text_.fail(*tag, "<color> has no rgba; expected four numbers of 0 to 1");
    const Eigen::Vector4d color = Eigen::Vector4d::Map(rgba->data());
    if (color.minCoeff() < 0 || color.maxCoeff() > 1)
      text_.fail(*tag, std::string("<color rgba=\"") + tag->Attribute("rgba") +
                           "\">: expected four numbers of 0 to 1");
    return color;
  }

  std::optional<Eigen::Vector4d> color_of(const XMLElement& visual) {
    const XMLElement* material = visual.FirstChildElement("material");
    if (!material) return std::nullopt;
    learn(*material);
    if (const auto color = color_in(*material)) return color;
    const char* name = material->Attribute("name");
    if (material->FirstChildElement("texture") || !name || !*name) return std::nullopt;
    if (const auto known = colors_.find(name); known != colors_.end()) return known->second;
    if (is_declared(name)) return std::nullopt;
    std::vector<std::string> names;
    for (const auto& [known, color] : colors_) names.push_back(known);
    text_.fail(*material, describe(*material) + " is not declared in the file" + suggestion(name, names));
  }

  // One that has a texture, and no colour.
  bool is_declared(std::string_view name) const {
    for (const XMLElement* material : text_.children("material")) {
      if (const char* other = material->Attribute("name"); other && name == other) return true;
    }
    return false;
  }

  void add(const XMLElement& link, const XMLElement& visual) {
    const char* name = link.Attribute("name");
    const Frame<double>& frame = model_.frames[std::size_t(model_.frame_index(name ? name : ""))];
    const Eigen::Vector3d xyz = text_.vector_below(visual, "origin", "xyz", Eigen::Vector3d::Zero());
    const Eigen::Vector3d rpy = text_.vector_below(visual, "origin", "rpy", Eigen::Vector3d::Zero());
    Visual shape{.link = frame.name, .body = frame.body};
    shape.X_BV = frame.X_BF * Placement<double>{rotation_from_rpy(rpy, 0).R, xyz};
    if (of_ == VisualOptions::Of::kVisuals) shape.color = color_of(visual);
    const XMLElement* geometry = visual.FirstChildElement("geometry");
    const XMLElement* kind = geometry ? geometry->FirstChildElement() : nullptr;
    if (!kind)
      text_.fail(visual, describe(link) + " has a <" + visual.Name() +
                             "> without a shape in its <geometry>; " + kKinds);
    read_shape(link, *kind, shape);
  }

  void read_shape(const XMLElement& link, const XMLElement& kind, Visual& shape) {
    const std::string_view name = kind.Name();
    if (name == "mesh" && of_ == VisualOptions::Of::kCollisions)
      return result_.incomplete.push_back(shape.link);
    if (name == "mesh") return add_mesh(link, kind, shape);
    if (name == "box") {
      shape.shape = Shape::kBox;
      shape.scale = Eigen::Vector3d::Map(positive(kind, "size", 3).data());
    } else if (name == "cylinder") {
      shape.shape = Shape::kCylinder;
      const double radius = positive(kind, "radius", 1)[0];
      shape.scale = {radius, radius, positive(kind, "length", 1)[0]};
    } else if (name == "sphere") {
      shape.shape = Shape::kSphere;
      shape.scale.setConstant(positive(kind, "radius", 1)[0]);
    } else {
      text_.fail(kind,
                 describe(link) + " has a shape <" + one_line(kind.Name()) + "> that is unknown; " + kKinds);
    }
    result_.shapes.push_back(shape);
  }

  std::vector<double> positive(const XMLElement& kind, const char* attribute, int count) const {
    const auto values = text_.numbers(kind, attribute, count);
    if (!values) text_.fail(kind, std::string("<") + kind.Name() + "> has no " + attribute);
    for (double value : *values) {
      if (!(value > 0))
        text_.fail(kind, std::string("<") + kind.Name() + " " + attribute + "=\"" +
                             kind.Attribute(attribute) + "\">: expected lengths above zero");
    }
    return *values;
  }

  void add_mesh(const XMLElement& link, const XMLElement& kind, Visual& shape) {
    const char* name = kind.Attribute("filename");
    if (!name || !*name) text_.fail(kind, "<mesh> has no filename");
    shape.shape = Shape::kMesh;
    if (const auto scale = text_.numbers(kind, "scale", 3)) shape.scale = Eigen::Vector3d::Map(scale->data());
    if ((shape.scale.array() == 0).any()) text_.fail(kind, "<mesh> has a scale of zero");
    try {
      const std::vector<MeshPart>& parts = parts_of(name, text_.where(kind) + describe(link));
      std::size_t triangles = 0;
      for (const MeshPart& part : parts) triangles += part.mesh->triangles.size();
      if (triangles > most_triangles_ - triangles_)
        throw FileError("the mesh " + std::string(name) + " of " + std::to_string(triangles) +
                        " triangles is left out; expected at most " + std::to_string(most_triangles_) +
                        " in all");
      triangles_ += triangles;
      for (const MeshPart& part : parts) {
        Visual piece = shape;
        piece.mesh = part.mesh;
        if (!piece.color) piece.color = part.color;
        result_.shapes.push_back(piece);
      }
    } catch (const FileError& e) {
      result_.notes.push_back(text_.where(kind) + describe(link) + ": " + e.what());
      result_.incomplete.push_back(shape.link);
    }
  }

  // Each file is read once; what is wrong with it is said of each link.
  const std::vector<MeshPart>& parts_of(const std::string& name, const std::string& where) {
    const std::string path = find_mesh(name, file_);
    if (path.empty()) throw FileError("there is no mesh " + name);
    const auto fault = faults_.find(path);
    if (fault != faults_.end()) throw FileError(fault->second);
    const auto known = meshes_.find(path);
    if (known != meshes_.end()) return known->second;
    try {
      MeshFile file = read_mesh(path, {file_, most_triangles_, stop_});
      for (const std::string& note : file.notes) result_.notes.push_back(where + ": " + note);
      return meshes_.emplace(path, std::move(file.parts)).first->second;
    } catch (const FileError& e) {
      faults_[path] = e.what();
      throw;
    }
  }

  static constexpr const char* kKinds = "expected <box>, <cylinder>, <sphere> or <mesh>";
  const UrdfText& text_;
  const std::string& file_;
  const Model<double>& model_;
  const VisualOptions::Of of_;
  const std::size_t most_triangles_;
  const std::stop_token stop_;
  std::size_t triangles_ = 0;
  std::map<std::string, Eigen::Vector4d> colors_;
  std::map<std::string, std::vector<MeshPart>> meshes_;
  std::map<std::string, std::string> faults_;
  UrdfVisuals result_;
};

}  // namespace

UrdfVisuals read_visuals_text(const std::string& text, const std::string& file, const Model<double>& model,
                              const VisualOptions& options) {
  const UrdfText positions = parse_urdf_text(text, file);
  return VisualReader(positions, file, model, options).read();
}

UrdfVisuals read_visuals(const std::string& path, const Model<double>& model, const VisualOptions& options) {
  return read_visuals_text(read_file(path), path, model, options);
}

}  // namespace dyntape::dynamics
