// SPDX-License-Identifier: BSD-3-Clause
//
// A scene file: a robot, its effects, its start, and the computation of its motion.
//
//   robot
//   {
//     urdf ../robots/solo12.urdf          ; beside this file
//     base floating
//   }
//   effects    { joint_damping robot }     ; gravity is on by default; no other effect is recorded
//   start      { base { position "0 0 0.35" } }
//   simulation { duration 2  step 1e-3 }
//
//   const Scene scene = read_scene("config/scenes/dropped_quadruped.info");
//   const SimulatedMotion motion = simulate(scene);                              // simulate.h
//
// Keys, with meanings, units and defaults: dyntape check-config --scene-keys, docs/reference/.
//
// Errors.  FileError with all problems of the file and their positions; errors of reading the robot.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/codegen/options/options.h>
#include <dyntape/interface/files/info/question.h>
#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/info/settings.h>
#include <dyntape/interface/robot/robot_scene.h>
#include <dyntape/interface/system/steps/stepper.h>

namespace dyntape {

// Commands of the driven joints over time: rows of a table, linear between rows, constant outside.  With a reference
// motion the motors also have position control:
//   u + stiffness (q - positions) + damping (v - velocities),     q and v those of the table
// with positions and velocities at the time of the command, which is then constant over a step.
struct Commands {
  std::vector<double> t;  // (s), ascending
  Eigen::MatrixXd u;      // (driven joints x times)
  struct Followed {
    Eigen::VectorXd stiffness, damping;  // (driven joints) N m/rad, N m s/rad, or N/m, N s/m
    Eigen::MatrixXd q, v;                // (driven joints x times)
    std::vector<int> in_x;  // indices of the positions in x = (q, v, ...), then of the velocities
  };
  std::optional<Followed> followed = {};

  Eigen::VectorXd at(double time, const Eigen::VectorXd& x) const;
};

// The start of a floating base as in files.
struct BaseStart {
  Eigen::Vector3d position{0, 0, 0};  // of its origin in the world (m)
  Eigen::Vector3d roll_pitch_yaw{0, 0,
                                 0};  // rotations about the fixed axes x, then y, then z of the world (rad)
  Eigen::Vector3d velocity{0, 0, 0};  // of its origin, in its own axes (m/s)
  Eigen::Vector3d angular_velocity{0, 0, 0};  // in its own axes (rad/s)
};

struct Scene {
  std::string name, file, urdf;
  io::Places places;                  // of the file's keys
  std::vector<std::string> inputs;    // paths of all files read
  std::vector<std::string> notes;     // oddities and omissions of the robot's file; the sample of a sweep
  std::vector<std::string> left_out;  // elements of the robot's file that are ignored
  RobotScene robot;
  Eigen::VectorXd q, v;  // at the start
  BaseStart base;        // the base in q and v, if it floats
  Commands commands;
  double duration = 1, step = 1e-3, sample = 0.01;  // (s)
  Integrator integrator = Integrator::kRungeKutta4;
  Tolerances tolerances;  // of adaptive integrators
  CodegenOptions evaluation;
  std::string effective;  // the file with all defaults

  long steps() const;                                                         // of `step` in `duration`
  long stride() const;                                                        // steps between samples
  bool is_sample(long k) const { return k % stride() == 0 || k == steps(); }  // for the state before step k
};

// Settings override values of the file (settings.h).
Scene read_scene(const std::string& path, const std::vector<io::Setting>& settings = {});
// Reads text in memory; `path` is the name in messages, and its folder is the base of relative paths.
Scene read_scene_text(const std::string& text, const std::string& path,
                      const std::vector<io::Setting>& settings = {});

// The block `base` of a section with a state; missing values are zero.
BaseStart read_base(io::Section& state);

// Writes it to the beginning of (q, v) of a floating robot.
void place_base(const BaseStart& base, Eigen::VectorXd& q, Eigen::VectorXd& v);

// All keys of a scene file, in order of reading.
std::vector<io::Question> scene_questions();

}  // namespace dyntape
