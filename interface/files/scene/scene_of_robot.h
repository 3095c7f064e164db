// SPDX-License-Identifier: BSD-3-Clause
//
// Makes a scene of an existing robot instead of a file: all keys of a scene file except `robot`.
//
//   const GivenRobot robot{read_urdf("arm.urdf"), {}};
//   const Scene scene = read_scene_text(robot, "simulation { duration 2 }", "(text)");
//
// `shapes collision` of contacts uses the robot's spheres.  Errors.  FileError as in reading a scene; ArgumentError
// for a robot with (cos, sin) joints, which scenes have as angles.
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/urdf/collisions.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/files/info/settings.h>

namespace dyntape {

struct Scene;  // scene.h

struct GivenRobot {
  dynamics::UrdfRobot robot;
  dynamics::UrdfCollisions collisions;
};

Scene read_scene_text(const GivenRobot& robot, const std::string& text, const std::string& path,
                      const std::vector<io::Setting>& settings = {});

}  // namespace dyntape
