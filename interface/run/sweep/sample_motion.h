// SPDX-License-Identifier: BSD-3-Clause
//
// One sample of a sweep, step by step, and the functions that all samples share.  Internal.
//
//   SweptFunctions functions(sweep, options);             // recorded, compiled; functions.twin() for another thread
//   SampleMotion motion = begin_of(functions, row);
//   advance(functions, motion, sweep.scene.steps());      // motion.trouble: the reason for an early end
#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include <dyntape/interface/files/sweep/sweep.h>
#include <dyntape/interface/run/simulate/accuracy_warnings.h>
#include <dyntape/interface/run/simulate/energy_account.h>
#include <dyntape/interface/system/rigid/robot_stepper.h>

namespace dyntape {

// Statistics over many samples, for a file of results.
struct SampleExtremes {
  double v = 0;       // largest |entry of v| at any step
  double energy = 0;  // largest kinetic and stored energy at any sample of the scene (J)
};

struct SampleMotion {
  SampleStart start;
  long row = 0, steps = 0;  // made
  Eigen::VectorXd x;
  SampleExtremes extremes;
  std::string trouble;
};

class SweptFunctions {
 public:
  SweptFunctions(const SceneSweep& sweep, const CodegenOptions& options);
  std::unique_ptr<SweptFunctions> twin() const;

  const SceneSweep& sweep;
  const std::unique_ptr<RobotStepper> motion;
  Stepper& stepper;  // that of `motion`
  EnergyMeter meter;
  const bool is_in_lanes, has_table;

 private:
  SweptFunctions(const SweptFunctions& other, std::unique_ptr<RobotStepper> motion);
};

// True if samples move together in lanes: explicit schemes without rigid contacts and stops.
bool moves_in_lanes(const Scene& scene);

SampleMotion begin_of(SweptFunctions& functions, long row);

// Judges a motion as simulate does: by its contacts, half steps and energy.
struct SampleJudge {
  explicit SampleJudge(const SweptFunctions& functions);
  std::string warning(const SceneSweep& sweep, long row);  // "" or a sentence

  std::string of_contacts;  // "" or a sentence
  HalfSteps halves;
  EnergyAccount account;
};

// The motors' commands over a step from `t`.
Eigen::VectorXd commands_at(const SceneSweep& sweep, const SampleStart& start, double t);

// Makes steps until `step` of them are made.  With a judge, which hears of all steps, or with rigid contacts, they
// begin at the start of the motion.  Returns false if it was stopped.
bool advance(SweptFunctions& functions, SampleMotion& motion, long step, SampleJudge* judge = nullptr,
             const std::stop_token& stop = {});

}  // namespace dyntape
