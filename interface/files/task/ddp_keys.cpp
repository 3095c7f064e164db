// SPDX-License-Identifier: BSD-3-Clause
//
// What of a task file differential dynamic programming does not know.
#include <cmath>

#include <dyntape/interface/files/task/task_keys.h>

namespace dyntape {

using io::Section;

// What differential dynamic programming does not know of a task, said where it stands.
void check_ddp(Section& file, const Task& task, const TaskKeys& keys) {
  if (!task.by_ddp) return;
  const auto refuse = [&](const char* block, const char* key, const std::string& what) {
    file.child_or_empty(block).problem(key, "'" + std::string(block) + "." + key + "' " + what);
  };
  const std::string method = ", which the method ddp does not know; expected ";
  if (keys.free_time)
    refuse("horizon", "min_duration", "is of a duration to be found" + method + "a given one");
  Section form = file.child_or_empty("transcription");
  const Scheme& scheme = task.optimise.mesh.scheme;
  if (form.has("scheme") && scheme.name != "euler" && !(scheme.step && scheme.steps == 1))
    refuse("transcription", "scheme",
           "is one of collocation" + method + "runge-kutta-4, which is the default, or semi-implicit-euler");
  if (keys.closed) file.problem("periodic", "'periodic' is what the method ddp does not know");
  if (!keys.phases.empty()) file.problem("phases", "'phases' are what the method ddp does not know");
  if (task.robot.form == DynamicsForm::kInverse)
    refuse("transcription", "dynamics", "has accelerations and equations for them" + method + "forward");
  if (task.optimise.mesh.hessian == HessianKind::kLimitedMemory)
    refuse("transcription", "hessian", "is limited_memory" + method + "exact or gauss_newton");
  if (!task.robot.contacts.empty())
    refuse("contacts", "points",
           "are constraints" + method + "a task without contacts, or the method riccati");
  if (!task.around.apart.empty() && task.around.barrier == 0) {
    const char* block = task.around.obstacles.empty() ? "bodies" : "obstacles";
    file.problem(block, "'" + std::string(block) + "' are to be kept clear of" + method +
                            "a task without them, or the method riccati");
  }
  if (!task.optimise.solver.extra.empty())
    refuse("solver", "ipopt", "has options of Ipopt" + method + "the method ipopt");
  const auto check_bound = [&](const char* key, const Limit& limit) {
    if (file.child_or_empty("bounds").has(key) && (limit.robot || std::isfinite(limit.value)))
      refuse("bounds", key, "are limits of states" + method + "none, or the method riccati");
  };
  check_bound("positions", keys.limits.positions), check_bound("velocities", keys.limits.velocities);
  const TaskKeys::Costs& c = keys.costs;
  if (keys.terms.empty() && !keys.reference && c.tracking_q.isZero(0) && c.tracking_v.isZero(0) &&
      c.end_q.isZero(0) && c.end_v.isZero(0) &&
      c.tracking_position + c.tracking_orientation + c.tracking_base_position + c.tracking_base_orientation ==
          0)
    file.problem("goal", "'goal' is to be met at the end" + method +
                             "weights that draw to it, in costs.tracking or costs.tracking.end");
}

}  // namespace dyntape
