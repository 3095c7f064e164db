// SPDX-License-Identifier: BSD-3-Clause
//
// A sweep file: a scene, and which of its numbers vary.  Scene files stay as they are.
//
//   scene   ../scenes/quadruped_dropped.info        ; beside this file
//   samples 1000                                    ; of each point of the grid, where there is one
//   seed    1
//   vary
//   {
//     value { parameter effects.joint_damping   from 0.01  to 0.1  distribution log-uniform }
//     value { parameter effects.contacts.contact.friction  mean 0.7  standard_deviation 0.1  distribution normal }
//     value { parameter start.base.position  axis z  from 0.3  to 0.6  steps 4  distribution grid }
//     value { parameter robot.mass:FR_CALF  from 0.1  to 0.2 }
//   }
//
//   const SceneSweep sweep = read_sweep("config/sweeps/quadruped_dropped.info");
//   sweep.rows();                                   // 4000
//   values_of(sweep, 17);                           // the numbers of sample 17, one a value
//   simulate(scene_of(sweep, 17));                  // its motion, as if they stood in the scene's file
//
// The numbers of a sample are a function of the seed, its index and the value's place in the file (random_numbers.h).
// Points of the grid are in the order of nested loops, the first value outermost; the samples of a point follow each other.
// What varies of the effects and of the robot is a parameter of one recorded step, which serves all samples.
//
// Errors: FileError listing every problem of the file with its place; those of reading the scene.
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include <dyntape/interface/files/info/question.h>
#include <dyntape/interface/files/info/settings.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/sweep/effect_numbers.h>
#include <dyntape/interface/system/scene_system.h>

namespace dyntape {

// Where a value goes besides effects.
struct RobotPlace {
  std::string name;  // of interface/robot/model_parameters.h: "mass:FR_CALF"
};
struct StartPlace {
  enum class Block { kPosition, kVelocity, kTorque };  // q, v, commands
  Block block;
  std::vector<int> entries;  // of q, v, or the driven joints
};
struct BasePlace {
  Eigen::Vector3d BaseStart::*part;
  int axis;
};
using ValuePlace = std::variant<EffectPlace, RobotPlace, StartPlace, BasePlace>;

enum class Spread { kUniform, kLogUniform, kNormal, kGrid };

struct SweptValue {
  std::string name;  // of its column
  ValuePlace place;
  Spread spread = Spread::kUniform;
  double from = 0, to = 0;         // a normal one is drawn until it lies between them
  double mean = 0, deviation = 1;  // of a normal one
  long steps = 1;                  // of a grid, from the first to the last

  bool is_parameter() const {  // of the recorded step
    return std::holds_alternative<EffectPlace>(place) || std::holds_alternative<RobotPlace>(place);
  }
};

struct SceneSweep {
  std::string name, file;
  std::vector<std::string> inputs;  // paths of all files that it was read from
  Scene scene;
  std::vector<SweptValue> values;
  std::vector<std::string> shown;  // columns of the results that are drawn
  long samples = 1;                // of each point of the grid
  std::uint64_t seed = 1;
  CodegenOptions evaluation;
  unsigned threads = 1;   // 0: as many as the processor has
  std::string effective;  // the file as it was understood, defaults included

  long rows() const;
};

constexpr long kMostRows = 1000000;

// Settings stand in place of what the file says (settings.h).
SceneSweep read_sweep(const std::string& path, const std::vector<io::Setting>& settings = {});
SceneSweep read_sweep_text(const std::string& text, const std::string& path,
                           const std::vector<io::Setting>& settings = {});

// Every key that a sweep file may have, in the order of reading.
std::vector<io::Question> sweep_questions();

// (values) of a row.
Eigen::VectorXd values_of(const SceneSweep& sweep, long row);

// What a row starts from: state (q, v, motors with a lag), commands of each column of scene.commands, parameters.
struct SampleStart {
  Eigen::VectorXd x, p;
  Eigen::MatrixXd u;
};
SampleStart start_of(const SceneSweep& sweep, const Eigen::VectorXd& values);

// The scene with these numbers in it: simulate(scene_of(sweep, 17)) ends where row 17 does, in the strict profile to the
// last bit.
Scene scene_of(const SceneSweep& sweep, long row);

// The scene as a system with the parameters of the sweep, and what puts them into a recording.
SceneEdit edit_of(const SceneSweep& sweep);
int parameters_of(const SceneSweep& sweep);

// Columns of the results of a sample: t, q and v, energies, the largest velocity.
std::vector<std::string> result_names(const Scene& scene);
std::vector<std::string> row_names(const SceneSweep& sweep);  // sample, what varies, ok, and these

}  // namespace dyntape
