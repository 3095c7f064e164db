// SPDX-License-Identifier: BSD-3-Clause
#include "task_program.h"

#include <algorithm>
#include <cmath>

#include <dyntape/interface/files/task/task_phases.h>

namespace dyntape::tools {

const char* name_of(HessianKind kind) {
  return kind == HessianKind::kExact         ? "exact"
         : kind == HessianKind::kGaussNewton ? "gauss_newton"
                                             : "limited_memory";
}
const char* name_of(NlpMethod method) { return method == NlpMethod::kIpopt ? "ipopt" : "stages"; }

TaskProgram::TaskProgram(const Task& task, const TaskWay& way)
    : task_(task), phases_(phases_of(task)), way_(way) {
  first_ = std::make_unique<StagedNlp>(discretize(phases_, meshes(way.fineness)));
}

int TaskProgram::intervals(double fineness) const {
  int all = 0;
  for (const MeshOptions& mesh : meshes(fineness)) all += mesh.intervals;
  return all;
}

std::unique_ptr<StagedNlp> TaskProgram::on(double fineness, const std::vector<Trajectory>& along) const {
  std::vector<std::vector<double>> nodes;
  const std::vector<MeshOptions> own = meshes(fineness);
  for (std::size_t k = 0; k < own.size(); ++k) {
    const Problem& problem = first_->problem(k);
    nodes.push_back(node_times(problem, own[k]));
    if (along.empty() || !problem.free_time) continue;
    const double longer = along[k].t[along[k].points() - 1] / nodes[k].back();
    for (double& t : nodes[k]) t *= longer;
  }
  return std::make_unique<StagedNlp>(discretize(first_->program(), nodes));
}

std::vector<MeshOptions> TaskProgram::meshes(double fineness) const {
  MeshOptions mesh = task_.optimise.mesh;
  mesh.scheme = way_.scheme, mesh.hessian = way_.hessian, mesh.evaluation = way_.evaluation;
  std::vector<MeshOptions> all = meshes_of(task_, mesh);
  for (MeshOptions& one : all) one.intervals = std::max(1, int(std::lround(fineness * one.intervals)));
  return all;
}

}  // namespace dyntape::tools
