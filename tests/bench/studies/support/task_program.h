// SPDX-License-Identifier: BSD-3-Clause
//
// A task to be solved in many ways: its functions are recorded and compiled once for each, its meshes follow from that.
//
//   const TaskProgram program(task, {.scheme = lobatto(4), .evaluation = {.route = Route::kInterpreter}});
//   auto nlp = program.on(1.5);                                  // 1.5 times as many intervals as the task has
//   const Solution s = optimise(*nlp, nlp->start(), {});
//
// Errors: those of discretize().
#pragma once

#include <memory>
#include <vector>

#include <dyntape/interface/control/solve/optimise.h>
#include <dyntape/interface/files/task/task.h>

namespace dyntape::tools {

// One way to solve the task.
struct TaskWay {
  Scheme scheme;
  double fineness = 1;
  HessianKind hessian = HessianKind::kExact;
  NlpMethod method = NlpMethod::kRiccati;
  CodegenOptions evaluation = {};
};

// As task files spell them.
const char* name_of(HessianKind kind);
const char* name_of(NlpMethod method);

class TaskProgram {
 public:
  TaskProgram(const Task& task, const TaskWay& way);

  BuildReport build() const { return first_->build(); }
  int intervals(double fineness) const;  // of all phases
  // Along motions of its phases, whose durations those of the meshes are then where they are free.
  std::unique_ptr<StagedNlp> on(double fineness, const std::vector<Trajectory>& along = {}) const;

 private:
  std::vector<MeshOptions> meshes(double fineness) const;

  const Task& task_;
  Phases phases_;
  TaskWay way_;
  std::unique_ptr<StagedNlp> first_;
};

}  // namespace dyntape::tools
