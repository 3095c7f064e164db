// SPDX-License-Identifier: BSD-3-Clause
//
// The places where a robot touches a plane: spheres and points instead of the <collision> shapes of its URDF file.
//
//   UrdfCollisions touching = read_collisions("box.urdf", robot.model);
//   for (const CollisionSphere& s : touching.spheres) ...    // s.center in the frame of body s.body, s.radius
//
//   sphere     a sphere
//   box        its eight corners, points (radius 0)
//   cylinder   eight points on each rim: stands like a cylinder, rolls like an octagon
//   mesh       none: the link's name is in `meshes`
//
// Shapes belong to bodies of the model, with fixed links merged, like the shapes of visuals.h.  A convex shape
// touches a plane first at a corner: boxes and spheres are exact on planes, and on waves that are flat over the
// length of an edge.
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/model/model.h>

namespace dyntape::dynamics {

struct CollisionSphere {
  std::string link;
  int body = -1;           // of the model; -1: the world
  Eigen::Vector3d center;  // in the body's frame, m
  double radius = 0;       // m, 0: a point
};

struct UrdfCollisions {
  std::vector<CollisionSphere> spheres;  // in the order of the file
  std::vector<std::string> meshes;       // links with a mesh
  std::vector<std::string> notes;        // shapes that cannot be read: `file:line: sentence`
};

UrdfCollisions read_collisions(const std::string& path, const Model<double>& model);

// The same from a text in memory; messages use `file` as its name.
UrdfCollisions read_collisions_text(const std::string& text, const std::string& file,
                                    const Model<double>& model);

}  // namespace dyntape::dynamics
