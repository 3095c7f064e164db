// SPDX-License-Identifier: BSD-3-Clause
//
// A sweep file: a scene, and the numbers of it that vary.  Scene files do not change.
//
//   scene   ../scenes/quadruped_dropped.info        ; beside this file
//   samples 1000                                    ; for each point of the grid, if any
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
//   values_of(sweep, 17);                           // the numbers of sample 17, one per value
//   simulate(scene_of(sweep, 17));                  // its motion, as if the scene's file had these numbers
//
// The numbers of a sample are a function of the seed, its index and the value's index in the file
// (random_numbers.h).  Points of the grid are in the order of nested loops, the first value outermost; the samples
// of a point are contiguous.  Varying numbers of effects and robot are parameters of one recorded step for all
// samples.
//
// Errors.  FileError with all problems of the file and their positions; errors of reading the scene.
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

// Destinations of a value other than effects.
struct RobotPlace {
  std::string name;  // as in interface/robot/model_parameters.h: "mass:FR_CALF"
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
  std::string name;  // name of its column
  ValuePlace place;
  Spread spread = Spread::kUniform;
  double from = 0, to = 0;         // a normal number is drawn again until it is between them
  double mean = 0, deviation = 1;  // of a normal distribution
  long steps = 1;                  // of a grid, including both ends

  bool is_parameter() const {  // true: a parameter of the recorded step
    return std::holds_alternative<EffectPlace>(place) || std::holds_alternative<RobotPlace>(place);
  }
};

struct SceneSweep {
  std::string name, file;
  std::vector<std::string> inputs;  // paths of all files read
  Scene scene;
  std::vector<SweptValue> values;
  std::vector<std::string> shown;  // columns of the results in plots
  long samples = 1;                // for each point of the grid
  std::uint64_t seed = 1;
  CodegenOptions evaluation;
  unsigned threads = 1;   // 0: all of the processor's
  std::string effective;  // the file with all defaults

  long rows() const;
};

constexpr long kMostRows = 1000000;

// Settings override values of the file (settings.h).
SceneSweep read_sweep(const std::string& path, const std::vector<io::Setting>& settings = {});
SceneSweep read_sweep_text(const std::string& text, const std::string& path,
                           const std::vector<io::Setting>& settings = {});

// All keys of a sweep file, in order of reading.
std::vector<io::Question> sweep_questions();

// (values) of a row
Eigen::VectorXd values_of(const SceneSweep& sweep, long row);

// The start of a row: state (q, v, motors with a lag), commands of each column of scene.commands, parameters.
struct SampleStart {
  Eigen::VectorXd x, p;
  Eigen::MatrixXd u;
};
SampleStart start_of(const SceneSweep& sweep, const Eigen::VectorXd& values);

// The scene with these numbers: simulate(scene_of(sweep, 17)) ends like row 17, with the same bits.
Scene scene_of(const SceneSweep& sweep, long row);

// The scene as a system with the parameters of the sweep, and the edit that inserts them into a recording.
SceneEdit edit_of(const SceneSweep& sweep);
int parameters_of(const SceneSweep& sweep);

// Columns of a sample's results: t, q and v, energies, the largest velocity.
std::vector<std::string> result_names(const Scene& scene);
std::vector<std::string> row_names(const SceneSweep& sweep);  // sample, varied values, ok, and the results

}  // namespace dyntape
