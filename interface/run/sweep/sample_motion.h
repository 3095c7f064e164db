// SPDX-License-Identifier: BSD-3-Clause
//
// One sample of a sweep, step by step, and the functions that all samples share.  Internal.
//
//   SweptFunctions functions(sweep, options);             // recorded, compiled; functions.twin() for another thread
//   SampleMotion motion = begin_of(sweep, row);
//   advance(functions, motion, sweep.scene.steps());      // motion.trouble: the reason for an early end
#pragma once

#include <string>

#include <dyntape/interface/files/sweep/sweep.h>
#include <dyntape/interface/run/simulate/accuracy_warnings.h>
#include <dyntape/interface/run/simulate/energy_account.h>

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
  SweptFunctions twin() const;

  const SceneSweep& sweep;
  Stepper stepper;
  EnergyMeter meter;
  bool is_implicit, has_table;

 private:
  SweptFunctions(const SweptFunctions& other, Stepper stepper);
};

SampleMotion begin_of(SweptFunctions& functions, long row);

// Judges a motion as simulate does: by half steps and by energy.
struct SampleJudge {
  SampleJudge(SweptFunctions& functions, const SampleMotion& motion);
  std::string warning(const SceneSweep& sweep, long row);  // "" or a sentence

  HalfSteps halves;
  EnergyAccount account;
};

// The motors' commands over a step from `t`.
Eigen::VectorXd commands_at(const SceneSweep& sweep, const SampleStart& start, double t);

// Makes up to `step` steps; reports them to `judge` if there is one.
void advance(SweptFunctions& functions, SampleMotion& motion, long step, SampleJudge* judge = nullptr);

}  // namespace dyntape
