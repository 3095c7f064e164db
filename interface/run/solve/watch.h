// SPDX-License-Identifier: BSD-3-Clause
//
// Observes and stops a running solve of a task.
//
//   std::stop_source stop;
//   const SolveWatch watch{stop.get_token(), [](const SolveMoment& m) { std::cerr << m.text() << "\n"; }};
//   const SolveReport report = solve_task(task, watch);
#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/nlp/solution.h>

namespace dyntape {

enum class SolveStage { kRecording, kCompiling, kChecking, kSolving, kVerifying };

struct SolveMoment {
  SolveStage stage;
  int intervals = 0;                     // of the mesh
  int refinement = 0;                    // 0: the mesh of the task
  std::size_t done = 0, of = 0;          // compiled pieces of functions, now or in the background
  double seconds_left = 0;               // estimated time until all are compiled; 0: unknown
  const IterationRecord* now = nullptr;  // of the solver, or null
  std::string text() const;  // "solving on 50 intervals: iteration 12, cost 0.1321, violation 3.0e-05"
};

struct SolveWatch {
  std::stop_token stop = {};
  std::function<void(const SolveMoment&)> tell = {};  // called in the solving thread
};

// The solve was stopped before it had any motion.
struct Interrupted : Sentence {
  using Sentence::Sentence;
};

}  // namespace dyntape
