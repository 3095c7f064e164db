// SPDX-License-Identifier: BSD-3-Clause
//
// Writes the results of a simulation: tables, pictures, a report and a 3D player.
//
//   SimulationReport report{scene, simulate(scene)};
//   write_results(report, "out/pendulum");
//   std::cout << report.text();
//
// write_results writes these files into the folder, each atomically:
//   motion.csv      t (s), positions, velocities and torques of the motors, energies and works (J), at every sample
//   report.json     all results, for programs
//   effective.info  the scene with all defaults
//   trajectory.svg  positions, velocities and torques over time
//   energy.svg      energies, and the work of each effect
//   forces.svg      forces at points of the robot that vary with the motion: contacts, drag
//   motion.html     plays the motion in 3D (report/player)
#pragma once

#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include <dyntape/interface/io/csv.h>
#include <dyntape/interface/report/player/player_input.h>
#include <dyntape/interface/report/plot/picture.h>
#include <dyntape/interface/run/simulate/accuracy.h>
#include <dyntape/interface/run/simulate/simulate.h>

namespace dyntape {

struct SimulationReport {
  const Scene& scene;
  SimulatedMotion motion;
  std::vector<std::string> unwritten = {};  // files that could not be written, with the reason
  std::optional<Accuracy> accuracy = {};    // if requested

  bool success() const { return motion.is_whole(); }
  std::string verdict() const;  // one sentence
  std::string text() const;     // for people
  std::string json() const;     // for programs; reports success only if all files are written
};

// The names of the files.  Before long work, check that they can be written (check_can_write).
std::vector<std::string> simulation_files();

// Failures are listed in report.unwritten.  If the simulation was stopped, no pictures are drawn.
void write_results(SimulationReport& report, const std::string& folder, const std::stop_token& stop = {});

// Columns: t; positions by joint (q.elbow), or by number for a floating base (q0); velocities likewise; tau.<driven
// joint>; energy.kinetic, energy.stored; work.motors, work.<effect>.  dyntape eval reads the table.
io::CsvTable motion_table(const Scene& scene, const SimulatedMotion& motion);

io::Plot state_plot(const Scene& scene, const SimulatedMotion& motion);
io::Plot energy_plot(const Scene& scene, const SimulatedMotion& motion);
io::Plot force_plot(const Scene& scene, const SimulatedMotion& motion);
PlayerInput scene_player(const Scene& scene, const SimulatedMotion& motion, const std::stop_token& stop = {});

// The forces at points of the robot: one list per sample, in the order of the effects.
std::vector<std::vector<PlayerContact>> point_forces(const Scene& scene, const SimulatedMotion& motion);

// The resolved scene, each effect with its number of operations, and the accuracy of the motion.
std::string explain(const Scene& scene, const std::stop_token& stop = {});

}  // namespace dyntape
