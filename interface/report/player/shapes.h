// SPDX-License-Identifier: BSD-3-Clause
//
// What a page draws: the shapes of the URDF, sticks for bodies that have none, and how much room they take.
//
//   const std::vector<Visual> shapes = player_shapes(model, visuals, X_WB);
//   const Eigen::AlignedBox3d own = own_box(shape);                       // once: a mesh is long
//   const Eigen::AlignedBox3d box = world_box(shape, own, X_WB);             // world frame, m
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include <dyntape/dynamics/urdf/visuals.h>

namespace dyntape {

using Placements = std::vector<dynamics::Placement<double>>;  // of bodies in the world

// X_WB: of any configuration; the thickness of sticks goes by the extent of the robot in it.
std::vector<dynamics::Visual> player_shapes(const dynamics::Model<double>& model,
                                            const dynamics::UrdfVisuals& visuals, const Placements& X_WB);

// A body without mass that slides: it is there to place what hangs on it, as those of a base that floats in a plane, and is not
// drawn.
bool only_places(const dynamics::Model<double>& model, int body);

// The box of a shape along its own axes, before its scale.
Eigen::AlignedBox3d own_box(const dynamics::Visual& shape);

// The smallest box along the world's axes that holds a shape, of a mesh: that holds its own box.
Eigen::AlignedBox3d world_box(const dynamics::Visual& shape, const Eigen::AlignedBox3d& own,
                              const Placements& X_WB);

}  // namespace dyntape
