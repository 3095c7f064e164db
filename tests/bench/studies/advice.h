// SPDX-License-Identifier: BSD-3-Clause
//
// How one task is best solved and simulated on this machine, to so many digits: found by solving it in many ways.
//
//   const Advice advice = advise(read_task("config/tasks/cart_pole_swing_up.info"), {.digits = 6});
//   advice.keys                    // lines for the task file
//   advice.choices[0].chosen       // "hermite-simpson on 52 intervals"
//   write_study(advice.study, {}, "out")                         // every point that was measured
//
// The error of a motion is that of its cost, relative to the optimum's, or its relative true defect (verify.h), whichever is more.
// The reference is lobatto-5, which is no candidate, on meshes that are halved until it stays; radau-4 on the finest of them says
// how well that is known.  Each decision is taken with those before it:
//   scheme, mesh     the least time of a solve of all that keep the digits, on meshes 1/4 to 16 times as fine as the task's
//   solver, Hessian  likewise, on that mesh
//   route            the least time of `solves` solves, compiling included
//   integrator       the least time of all that follow the motion to the digits, its controls held over each interval
// What comes later in a list is taken only if it is a twentieth quicker, and quicker each time that both are measured in turn: less
// is noise.
//
// Errors: ArgumentError for a task that is solved by differential dynamic programming, which has none of these choices;
// NumericalError where no reference is found.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/files/task/task.h>

#include "quicker.h"
#include "study.h"

namespace dyntape::tools {

struct AdviceOptions {
  int digits = 6;
  double solves = 100;   // of the task, until it changes so that it has to be compiled again
  double seconds = 120;  // of measuring; what is begun is ended
  std::function<void(const std::string& doing)> watch = [](const std::string&) {};
};

struct Choice {
  std::string what, chosen;
  double seconds, error;                   // of a solve, or of a simulated second
  std::vector<std::string> measured = {};  // what there was to choose from, or why there was nothing
};

struct Advice {
  Study study;
  double reference = 0, known_to = 0;  // the optimum, and its own relative error
  bool reached = false;                // the digits, or as many as are known
  std::vector<Choice> choices;         // first the task as it is
  std::string keys;                    // of a task file, a line each
};

Advice advise(const Task& task, const AdviceOptions& options = {});

// Integrators along a motion of the task: rows of part "integrators", and the choice.
struct FollowedMotion {
  const Task& task;
  const Trajectory& motion;
  double error;       // that is allowed
  double per_method;  // s, for each
};
Choice advise_integrator(Study& study, const FollowedMotion& followed);

}  // namespace dyntape::tools
