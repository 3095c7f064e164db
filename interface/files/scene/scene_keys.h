// SPDX-License-Identifier: BSD-3-Clause
//
// The common keys of scene and task files: robot, effects, driven joints, and evaluation.
//
//   io::Section file = io::Section::parse(text, path);
//   SceneRobot robot = read_scene_robot(file, path, Floating::kAllowed);      // empty model: a problem of the file
//   read_scene_keys(file, scene, {&robot.model, urdf});
//
// Without a robot (null), keys over its joints and frames are known but not read.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/codegen/options/options.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/scene/collision_keys.h>
#include <dyntape/interface/robot/robot_scene.h>

namespace dyntape {

enum class Floating { kRefused, kAllowed };

struct SceneRobot {
  std::string urdf;                            // its path, from here
  std::optional<dynamics::UrdfRobot> robot{};  // none: there is a problem, which the file has noted
};
SceneRobot read_scene_robot(io::Section& file, const std::string& path, Floating floating);

// Moves the model to a scene and the rest to the readers; returns false if there is no robot.
template <class Read>
bool take_robot(SceneRobot&& found, Read& read, RobotScene& scene) {
  read.urdf = std::move(found.urdf);
  if (!found.robot) return false;
  read.notes = std::move(found.robot->notes);
  read.left_out = std::move(found.robot->left_out);
  scene.model = std::move(found.robot->model);
  scene.mimics = dynamics::resolved(found.robot->mimics);
  return true;
}

// Throws FileError if the text is XML, since each line of a robot's file would be a separate problem.
void check_is_no_robot(std::string_view text, const std::string& path, const std::string& expected);

// effects, actuated.
void read_scene_keys(io::Section& file, RobotScene& scene, const KeyedRobot& robot);

// A path that a file names: from the folder of that file; in its effective values it means the same elsewhere.
std::string path_beside(const std::string& file, io::Section& block, const std::string& key,
                        const std::string& name);

// One: no lanes and threads are asked for.  Samples: nor functions, which are portable ones.
enum class PointsAtOnce { kOne, kMany, kSamples };
struct EvaluationKeys {
  CodegenOptions options;
  unsigned threads = 1;
};
EvaluationKeys read_evaluation(io::Section& file, PointsAtOnce points);

}  // namespace dyntape
