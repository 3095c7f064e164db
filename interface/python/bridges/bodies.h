// SPDX-License-Identifier: BSD-3-Clause
//
// A robot that is given body by body in the place of a file: dyntape.assemble, and what bridges make of other tools' models.
//
//   RobotBodies given = bodies_from(state);     // lists and numbers, as Python gives and pickles them
//   BodiesState same = state_of(given);
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include <dyntape/dynamics/model/model.h>
#include <dyntape/dynamics/urdf/collisions.h>
#include <dyntape/dynamics/urdf/visuals.h>

namespace dyntape::python {

struct RobotBodies {
  dynamics::Model<double> model;
  std::vector<std::string> left_out;                // of the model that it was made of, a sentence each
  std::vector<dynamics::Visual> shapes;             // what it looks like
  std::vector<dynamics::CollisionSphere> touching;  // where contacts may be
};

// Joint, type, parent, numbers: axis (3), pitch, fixed side in the parent (rotation by rows 9, position 3), mass, centre of mass (3),
// inertia about it (9), lowest and highest position, speed and effort, armature, damping, friction.
using BodyRow = std::tuple<std::string, std::string, int, std::vector<double>>;
inline constexpr std::size_t kBodyNumbers = 36;
// Name, joint that carries it, placement in that joint's frame (rotation by rows 9, position 3).
using FrameRow = std::tuple<std::string, int, std::vector<double>>;
// Frame, joint, kind, placement in that joint's frame (12) and scale (3), colour (4 or none), number of its mesh or -1.
using ShapeRow = std::tuple<std::string, int, std::string, std::vector<double>, std::vector<double>, int>;
// Frame, joint, centre in that joint's frame (3), radius.
using ContactRow = std::tuple<std::string, int, std::vector<double>, double>;
// Vertices (3 n), triangles (3 m).
using MeshRow = std::tuple<std::vector<float>, std::vector<int>>;
// Name, gravity, bodies, frames, what was left out, shapes, meshes, where it touches.
using BodiesState = std::tuple<std::string, std::vector<double>, std::vector<BodyRow>, std::vector<FrameRow>,
                               std::vector<std::string>, std::vector<ShapeRow>, std::vector<MeshRow>,
                               std::vector<ContactRow>>;

// ArgumentError, naming the joint or frame, for what is no robot: a parent that does not come before, an axis that is not of unit
// length, numbers that are not finite, a mass or a principal moment below zero, two joints or frames of one name.
RobotBodies bodies_from(const BodiesState& state);
BodiesState state_of(const RobotBodies& bodies);

}  // namespace dyntape::python
