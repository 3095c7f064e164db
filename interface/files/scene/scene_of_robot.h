// SPDX-License-Identifier: BSD-3-Clause
//
// A scene of a robot that is there already, in the place of a file: all keys of a scene file but `robot`.
//
//   const GivenRobot robot{read_urdf("arm.urdf"), {}};
//   const Scene scene = read_scene_text(robot, "simulation { duration 2 }", "(text)");
//
// `shapes collision` of contacts takes the spheres that come with it.  Errors: FileError, those of reading a scene; ArgumentError for
// a robot with (cos, sin) joints, which scenes have as angles, or with joints that follow others.
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
