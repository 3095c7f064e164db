// SPDX-License-Identifier: BSD-3-Clause
//
// The shapes that a page draws: those of the URDF, and sticks for bodies without shapes; and their boxes.
//
//   const std::vector<Visual> shapes = player_shapes(model, visuals, X_WB);
//   const Eigen::AlignedBox3d own = own_box(shape);                       // once, since meshes are large
//   const Eigen::AlignedBox3d box = world_box(shape, own, X_WB);             // world frame, m
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include <dyntape/dynamics/urdf/visuals.h>

namespace dyntape {

using Placements = std::vector<dynamics::Placement<double>>;  // of bodies in the world

// X_WB: of any configuration; the thickness of sticks is proportional to the robot's extent in it.
std::vector<dynamics::Visual> player_shapes(const dynamics::Model<double>& model,
                                            const dynamics::UrdfVisuals& visuals, const Placements& X_WB);

// A massless body on a prismatic joint that only positions others, as of a base in the plane; it is not drawn.
bool only_places(const dynamics::Model<double>& model, int body);

// The box of a shape along its own axes, before its scale.
Eigen::AlignedBox3d own_box(const dynamics::Visual& shape);

// The axis-aligned box in the world that contains a shape; of a mesh, that contains its own box.
Eigen::AlignedBox3d world_box(const dynamics::Visual& shape, const Eigen::AlignedBox3d& own,
                              const Placements& X_WB);

}  // namespace dyntape
