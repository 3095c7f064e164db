// SPDX-License-Identifier: BSD-3-Clause
//
// A scene file: a robot, what acts on it, how it starts, and how its motion is computed.
//
//   robot
//   {
//     urdf ../robots/solo12.urdf          ; beside this file
//     base floating
//   }
//   effects    { joint_damping robot }     ; gravity besides; nothing else is recorded
//   start      { base { position "0 0 0.35" } }
//   simulation { duration 2  step 1e-3 }
//
//   const Scene scene = read_scene("config/scenes/dropped_quadruped.info");
//   const SimulatedMotion motion = simulate(scene);                              // simulate.h
//
// Keys, with their meanings, units and defaults: dyntape check-config --scene-keys, docs/reference/.
//
// Errors: FileError listing every problem of the file with its place; those of reading the robot.
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

// What the driven joints are told over time: rows of a table, straight lines between them, constant outside.  Where they also
// follow a motion, as motors with a controller of their own do:
//   u + stiffness (q - positions) + damping (v - velocities),     q and v those of the table
// of positions and velocities when the command is given, which then is held over a step.
struct Commands {
  std::vector<double> t;  // (s), ascending
  Eigen::MatrixXd u;      // (driven joints x times)
  struct Followed {
    Eigen::VectorXd stiffness, damping;  // (driven joints) N m/rad, N m s/rad, or N/m, N s/m
    Eigen::MatrixXd q, v;                // (driven joints x times)
    std::vector<int> in_x;               // where positions stand in x = (q, v, ...), then where velocities do
  };
  std::optional<Followed> followed = {};

  Eigen::VectorXd at(double time, const Eigen::VectorXd& x) const;
};

// Where a floating base is at the start, as files say it.
struct BaseStart {
  Eigen::Vector3d position{0, 0, 0};        // of its origin in the world (m)
  Eigen::Vector3d roll_pitch_yaw{0, 0, 0};  // turns about the fixed axes x, then y, then z of the world (rad)
  Eigen::Vector3d velocity{0, 0, 0};        // of its origin, in its own axes (m/s)
  Eigen::Vector3d angular_velocity{0, 0, 0};  // in its own axes (rad/s)
};

struct Scene {
  std::string name, file, urdf;
  std::vector<std::string> inputs;  // paths of all files that it was read from
  std::vector<std::string>
      notes;  // what was odd in the robot's file or is left out of it; which sample of a sweep it is
  std::vector<std::string> left_out;  // elements of the robot's file that nothing reads
  RobotScene robot;
  Eigen::VectorXd q, v;  // at the start
  BaseStart base;        // what stands in q and v of it, where there is one
  Commands commands;
  double duration = 1, step = 1e-3, sample = 0.01;  // (s)
  Integrator integrator = Integrator::kRungeKutta4;
  Tolerances tolerances;  // of adaptive integrators
  CodegenOptions evaluation;
  std::string effective;  // the file as it was understood, defaults included

  long steps() const;   // of `step` in `duration`
  long stride() const;  // steps from one sample to the next
  bool is_sample(long k) const { return k % stride() == 0 || k == steps(); }  // the state before step k
};

// Settings stand in place of what the file says (settings.h).
Scene read_scene(const std::string& path, const std::vector<io::Setting>& settings = {});
// The same of text in memory; `path` stands for its place in messages, and its folder for where other files are looked
// for.
Scene read_scene_text(const std::string& text, const std::string& path,
                      const std::vector<io::Setting>& settings = {});

// The block `base` of a section that says a state: what it does not say is zero.
BaseStart read_base(io::Section& state);

// To the beginning of (q, v) of a robot that floats.
void place_base(const BaseStart& base, Eigen::VectorXd& q, Eigen::VectorXd& v);

// Every key that a scene file may have, in the order of reading.
std::vector<io::Question> scene_questions();

}  // namespace dyntape
