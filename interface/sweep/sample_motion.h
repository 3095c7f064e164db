// SPDX-License-Identifier: BSD-3-Clause
//
// One sample of a sweep, step by step; and the functions that all samples share.
//
//   SweptFunctions functions(sweep, options);             // recorded, compiled; functions.twin() for another thread
//   SampleMotion motion = begin_of(sweep, row);
//   advance(functions, motion, sweep.scene.steps());      // motion.trouble: why it ended ahead of that
//
// Internal.
#pragma once

#include <string>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/scene/step_doubts.h>
#include <dyntape/interface/sweep/sweep.h>

namespace dyntape {

// Of many samples: those that a file of results tells of.
struct SampleExtremes {
  double v = 0;       // largest |entry of v| at any step
  double energy = 0;  // largest kinetic and stored energy at any sample of the scene (J)
};

// What is known of the steps of a motion: at a few places, how far two half ones lead from a whole one.
class HalfSteps {
 public:
  // `end` of the whole step from `look`, and of the two halves.
  void note(const Scene& scene, Look look, const Eigen::VectorXd& whole, const Eigen::VectorXd& twice);

  // As simulate doubts a motion (interface/scene/step_doubts.h), but of stiffness at two places alone: at the first, and
  // where half steps lead farthest away.  "" or a sentence.
  std::string doubt(const SceneSweep& sweep, long row) const;

 private:
  std::vector<Look> looks_;
  std::vector<Eigen::VectorXd> errors_;
  Eigen::VectorXd most_;  // change of v in a step
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

  struct Energies {
    double kinetic = 0, stored = 0;
    double all() const { return kinetic + stored; }
  };
  Energies energies(const SampleMotion& at);

  const SceneSweep& sweep;
  Stepper stepper;
  CompiledFunction energy;  // of variables x and parameters (t, h, u, p): kinetic, stored
  CompiledFunction::Workspace of_energy;
  bool is_implicit, has_table;
  long look_stride;

 private:
  SweptFunctions(const SweptFunctions& other, Stepper stepper);
  Eigen::VectorXd arguments_;
};

// Scene steps between two places where half steps are tried.
bool is_look(const SweptFunctions& functions, long step);
bool is_sample_time(const Scene& scene, long step);

SampleMotion begin_of(SweptFunctions& functions, long row);

// Up to `step` steps; `halves`, where there is one, is told of half steps.
void advance(SweptFunctions& functions, SampleMotion& motion, long step, HalfSteps* halves = nullptr);

}  // namespace dyntape
