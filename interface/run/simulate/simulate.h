// SPDX-License-Identifier: BSD-3-Clause
//
// The motion of a scene: its recorded step, compiled, over and over.
//
//   const Scene scene = read_scene("config/scenes/pendulum.info");
//   const SimulatedMotion motion = simulate(scene);
//   motion.q.col(k)                    // at motion.t[k]
//   motion.energy_error()              // what the energy balance is off by, J
//
// The step contains what the scene calls for and nothing else: effects that are off leave no operation.
//
// Energy balance.  The kinetic energy changes by the work of the motors and of each effect, gravity among them,
//   T = T(0) + sum of W + what the steps gave.
// W of what a potential stores is what it stores less.  Other work is that of the scheme's own forces along its own velocities
// (energy_account.h), so that a scheme that keeps the energy balances to rounding, and another is off by what it took or gave.
// With rigid contacts or hard limits it is taken between events (rigid_account.h); power is then of the other flows alone.  More
// than a tenth of what moved, in any mechanism by itself, is a warning (energy_balance.h).
//
// A motion that leaves the finite numbers, or a step whose equations have no solution, ends the simulation there:
// `trouble` says when and why.  One whose steps are too long to be trusted has a `warning` (stability.h).
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include <dyntape/codegen/timings.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/system/energy_balance.h>

namespace dyntape {

// What adds energy to the robot or takes it away, at each sample.
struct EnergyFlow {
  std::string name;           // of the effect, or "motors"
  std::vector<double> power;  // (W), positive: the robot gains energy
  std::vector<double> work;   // (J) since the start
};

struct SimulatedMotion {
  std::vector<double> t;                // (s)
  Eigen::MatrixXd q, v, drive;          // (nq, nv, driven joints) x samples; drive: torques of the motors
  std::vector<double> kinetic, stored;  // (J)
  // (m) x samples, of the rows of rigid contacts and stops (rigid_contacts.h): their means over the step that ends with the
  // sample, impulses included (N, N m).
  Eigen::MatrixXd reactions;
  std::vector<EnergyFlow> flows;

  long impacts = 0;                        // of rigid contacts and stops
  double assembled_by = 0;                 // how far a joint was moved to close the loops at the start
  double slowed_by = 0;                    // how much its velocity was changed for that, largest entry
  double loop_error = 0;                   // the farthest that loops were open at samples (m, rad)
  double deepest = 0;                      // likewise, the farthest that rigid contacts and stops were passed
  long steps = 0;                          // that were made
  StepEffort effort = {};                  // of adaptive ones
  std::string trouble;                     // why it ended ahead of its time, or ""
  std::string warning;                     // where its steps are too long to be trusted, or ""
  std::vector<MechanismBalance> balances;  // of energy, at every step
  bool was_stopped = false;                // from outside
  std::size_t operations = 0;              // of one step
  double step_seconds = 0, build_seconds = 0;  // of all steps; of recording, compiling and loading
  std::vector<std::string> sources = {};       // C files, where there are any

  int samples() const { return static_cast<int>(t.size()); }
  bool is_whole() const { return trouble.empty() && warning.empty() && !was_stopped; }
  double energy(int sample) const { return kinetic[std::size_t(sample)] + stored[std::size_t(sample)]; }
  // Of the mechanism whose balance is the worst: what is missing (J), and the largest energy that moved, which it is to be
  // compared with.
  double energy_error() const { return worst_of(balances).error; }
  double energy_scale() const { return worst_of(balances).moved; }
};

struct SimulationWatch {
  std::stop_token stop = {};
  std::function<void(const std::string& what)> tell = {};  // "t = 1.23 of 2 s"
};

SimulatedMotion simulate(const Scene& scene, const SimulationWatch& watch = {});

// ArgumentError where its steps are too long already at the start, or that state is not finite; simulate() asks too.
void check_start(const Scene& scene);

}  // namespace dyntape
