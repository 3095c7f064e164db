// SPDX-License-Identifier: BSD-3-Clause
//
// A simulated motion, written down.
//
//   SimulationReport report{scene, simulate(scene)};
//   write_results(report, "out/pendulum");
//   std::cout << report.text();
//
// write_results leaves in the folder, each file whole or not at all:
//   motion.csv      t (s), positions, velocities and torques of the motors, energies and works (J), at every sample
//   report.json     everything below, for programs
//   effective.info  the scene as it was understood, defaults included
//   trajectory.svg  positions, velocities and torques over time
//   energy.svg      energies, and the work of all that acts
//   forces.svg      what acts at points of the robot and changes as it moves: contacts, drag
//   motion.html     plays the motion in 3D (interface/player)
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
  std::vector<std::string> unwritten = {};  // why results are not where they belong, a sentence each
  std::optional<Accuracy> accuracy = {};    // where it was asked for

  bool success() const { return motion.is_whole(); }
  std::string verdict() const;  // one sentence
  std::string text() const;     // for people
  std::string json() const;     // for programs; of success where all is written as well
};

// Their names.  For long work: whether they can be written is known before it (check_can_write).
std::vector<std::string> simulation_files();

// What cannot be written stands in report.unwritten.  Pictures are left out where the simulation was stopped.
void write_results(SimulationReport& report, const std::string& folder, const std::stop_token& stop = {});

// t; positions by joint (q.elbow), those of a floating base by number (q0); likewise velocities; tau.<driven joint>;
// energy.kinetic, energy.stored; work.motors, work.<effect>.  dyntape eval reads it.
io::CsvTable motion_table(const Scene& scene, const SimulatedMotion& motion);

io::Plot state_plot(const Scene& scene, const SimulatedMotion& motion);
io::Plot energy_plot(const Scene& scene, const SimulatedMotion& motion);
io::Plot force_plot(const Scene& scene, const SimulatedMotion& motion);
PlayerInput scene_player(const Scene& scene, const SimulatedMotion& motion, const std::stop_token& stop = {});

// What acts at points of the robot, a list a sample, in the order of the effects.
std::vector<std::vector<PlayerContact>> point_forces(const Scene& scene, const SimulatedMotion& motion);

// What is recorded and what is not: the resolved scene, each effect with what it costs; and how accurate its motion is.
std::string explain(const Scene& scene, const std::stop_token& stop = {});

}  // namespace dyntape
