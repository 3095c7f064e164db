// SPDX-License-Identifier: BSD-3-Clause
//
// Robot.shapes: what a robot looks like, for viewers (dyntape/bridges/viewers.py).
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <map>

#include "../arrays.h"
#include "../robot.h"

namespace dyntape::python {
namespace {

using dynamics::Placement;
using dynamics::Visual;

const char* kind_of(dynamics::Shape shape) {
  switch (shape) {
    case dynamics::Shape::kBox:
      return "box";
    case dynamics::Shape::kCylinder:
      return "cylinder";
    case dynamics::Shape::kSphere:
      return "sphere";
    case dynamics::Shape::kMesh:
      break;
  }
  return "mesh";
}

nb::object matrix_of(const Placement<double>& X) {
  double* entries = nullptr;
  nb::object array = new_array({4, 4}, entries);
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) entries[4 * i + j] = i == 3 ? (j == 3 ? 1 : 0) : j == 3 ? X.p[i] : X.R(i, j);
  return array;
}

nb::object vertices_of(const dynamics::Mesh& mesh) {
  double* entries = nullptr;
  nb::object array = new_array({std::ssize(mesh.vertices), 3}, entries);
  for (const auto& v : mesh.vertices)
    for (int k = 0; k < 3; ++k) *entries++ = static_cast<double>(v[k]);
  return array;
}

nb::object triangles_of(const dynamics::Mesh& mesh) {
  std::vector<std::ptrdiff_t> corners;
  for (const auto& triangle : mesh.triangles) corners.insert(corners.end(), triangle.begin(), triangle.end());
  return new_integers(corners).attr("reshape")(-1, 3);
}

nb::list shapes_of(const Robot& robot, bool collisions) {
  dynamics::VisualOptions options;
  if (collisions) options.of = dynamics::VisualOptions::Of::kCollisions;
  dynamics::UrdfVisuals visuals;
  {
    const nb::gil_scoped_release unlocked;
    visuals = robot.visuals(options);
  }
  const nb::object make = nb::module_::import_("dyntape._bodies").attr("Shape");
  std::map<const dynamics::Mesh*, nb::object> meshes;  // each once
  nb::list shapes;
  for (const Visual& visual : visuals.shapes) {
    const dynamics::Frame<double>& frame =
        robot.model().frames[static_cast<std::size_t>(robot.model().frame_index(visual.link))];
    nb::object mesh = nb::none(), color = nb::none();
    if (visual.mesh) {
      nb::object& known = meshes[visual.mesh.get()];
      if (!known.is_valid()) known = nb::make_tuple(vertices_of(*visual.mesh), triangles_of(*visual.mesh));
      mesh = known;
    }
    if (visual.color) color = copy_of(visual.color->data(), {4});
    shapes.append(make(visual.link, kind_of(visual.shape), matrix_of(inverse(frame.X_BF) * visual.X_BV),
                       copy_of(visual.scale.data(), {3}), color, mesh));
  }
  return shapes;
}

}  // namespace

void bind_shapes(nb::class_<Robot>& robot) {
  robot.def("shapes", shapes_of, nb::kw_only(), nb::arg("collisions") = false,
            nb::sig("def shapes(self, *, collisions: bool = False) -> list[Shape]"),
            "What it looks like, a dyntape.Shape each: of its file's <visual>, meshes read, or of what it "
            "was assembled of.\n\n"
            "collisions: the <collision> shapes instead, without meshes.  A shape that cannot be read is "
            "left out.\n\n"
            ">>> sorted({shape.kind for shape in dyntape.load(\"config/robots/pendulum.urdf\").shapes()})\n"
            "['cylinder', 'sphere']");
}

}  // namespace dyntape::python
