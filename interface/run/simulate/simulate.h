// SPDX-License-Identifier: BSD-3-Clause
//
// Simulates a scene: records and compiles its step, and runs it.
//
//   const Scene scene = read_scene("config/scenes/pendulum.info");
//   const SimulatedMotion motion = simulate(scene);
//   motion.q.col(k)                    // at motion.t[k]
//   motion.energy_error()              // residual of the energy balance, J
//
// The step has the scene's effects only; effects that are off add no operation.
//
// Energy balance.  The kinetic energy changes by the work of the motors and of each effect, including gravity,
//   T = T(0) + sum of W + error of the steps.
// For a potential, W is the decrease of the stored energy.  Other work is that of the scheme's own forces along its
// own velocities (energy_account.h).  So an energy-preserving scheme balances to rounding; for another the residual
// is the energy that its steps add or remove.  With rigid contacts or hard limits the balance holds between events
// (rigid_account.h); power is then of the other flows only.  If the residual of any mechanism exceeds a tenth of the
// moving energy, there is a warning (energy_balance.h).
//
// If the motion is no longer finite, or a step's equations have no solution, the simulation ends and `trouble` says
// when and why.  If steps are too long, there is a `warning` (stability.h).
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include <dyntape/codegen/timings.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/system/energy_balance.h>

namespace dyntape {

// A supplier or consumer of the robot's energy, at each sample.
struct EnergyFlow {
  std::string name;           // of the effect, or "motors"
  std::vector<double> power;  // (W), positive: the robot gains energy
  std::vector<double> work;   // (J) since the start
};

struct SimulatedMotion {
  std::vector<double> t;                // (s)
  Eigen::MatrixXd q, v, drive;          // (nq, nv, driven joints) x samples; drive: torques of the motors
  std::vector<double> kinetic, stored;  // (J)
  // (m) x samples: forces of rigid contacts and stops (rigid_contacts.h), averaged over the step that ends at the
  // sample, including impulses (N, N m).
  Eigen::MatrixXd reactions;
  std::vector<EnergyFlow> flows;

  long impacts = 0;                        // of rigid contacts and stops
  double assembled_by = 0;                 // largest change of a joint to close the loops at the start
  double slowed_by = 0;                    // largest change of an entry of the velocity for the same reason
  double loop_error = 0;                   // largest error of the loops at samples (m, rad)
  double deepest = 0;                      // largest penetration of rigid contacts and stops at samples
  long steps = 0;                          // number of steps made
  StepEffort effort = {};                  // of adaptive steps
  std::string trouble;                     // reason of an early end, or ""
  std::string warning;                     // why its steps are too long, or ""
  std::vector<MechanismBalance> balances;  // energy balances, at every step
  bool was_stopped = false;                // by the caller
  std::size_t operations = 0;              // of one step
  double step_seconds = 0, build_seconds = 0;  // all steps; recording, compiling and loading
  std::vector<std::string> sources = {};       // C files, if any

  int samples() const { return static_cast<int>(t.size()); }
  bool is_whole() const { return trouble.empty() && warning.empty() && !was_stopped; }
  double energy(int sample) const { return kinetic[std::size_t(sample)] + stored[std::size_t(sample)]; }
  // For the mechanism with the worst balance: the residual (J), and the largest moving energy, its reference.
  double energy_error() const { return worst_of(balances).error; }
  double energy_scale() const { return worst_of(balances).moved; }
};

struct SimulationWatch {
  std::stop_token stop = {};
  std::function<void(const std::string& what)> tell = {};  // "t = 1.23 of 2 s"
  std::function<void()> begin = {};                        // called once, before the first step
};

SimulatedMotion simulate(const Scene& scene, const SimulationWatch& watch = {});

// Throws ArgumentError if the steps are too long at the start, or the state is not finite; simulate() calls it.
void check_start(const Scene& scene);

}  // namespace dyntape
