// SPDX-License-Identifier: BSD-3-Clause
//
// Robots that are given body by body: what dyntape.assemble (dyntape/_bodies.py) calls, and how they are pickled.
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <memory>

#include "../robot.h"
#include "bodies.h"

namespace dyntape::python {
namespace {

RobotSourceText source_of(const BodiesState& state) {
  RobotSourceText source;
  source.bodies = std::make_shared<const RobotBodies>(bodies_from(state));
  source.file = source.bodies->model.name;
  source.gravity = source.bodies->model.gravity;
  return source;
}

std::shared_ptr<Robot> assembled(const BodiesState& state) {
  return std::make_shared<Robot>(source_of(state));
}

void restore_bodies(Robot& robot, const BodiesState& state) { new (&robot) Robot(source_of(state)); }

}  // namespace

void bind_bodies(nb::module_& module, nb::class_<Robot>& robot) {
  robot.def("__setstate__", restore_bodies);
  module.def("assembled", assembled, nb::arg("state"),
             nb::sig("def assembled(state: tuple[Any, ...]) -> Robot"),
             "What dyntape.assemble calls: a robot of lists and numbers, which are its pickled state too.");
}

}  // namespace dyntape::python
