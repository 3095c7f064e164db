// SPDX-License-Identifier: BSD-3-Clause
//
// What of a task file differential dynamic programming does not know, and what rigid contacts do not go together with.
#include <cmath>
#include <limits>

#include <dyntape/interface/files/task/task_keys.h>
#include <dyntape/interface/io/number.h>

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

void read_continuation(Section& file, Task& task, const dynamics::Model<double>* model) {
  if (model && !task.simulated) {  // in the list of keys it stands
    if (file.has("contact_implicit"))
      file.problem("contact_implicit",
                   "'contact_implicit' is of rigid contacts, and there are none; expected a 'scene' whose "
                   "'constraints' have contacts");
    return;
  }
  Section block = file.about("of a scene with rigid contacts, whose times and forces are to be found")
                      .child_or_empty("contact_implicit");
  ContactContinuation& c = task.continuation;
  const auto number = [&](const char* key, const std::string& what, double fallback) {
    return block.about(what).get_or(key, fallback, io::positive());
  };
  c.last.relaxation = number("relaxation",
                             "most that a force, as a part of the robot's weight, times its distance from "
                             "touching may be, at the end [m]",
                             c.last.relaxation);
  c.last.slip = number("slip", "speed over which friction builds up, at the end [m/s]", c.last.slip);
  c.first.relaxation = number("first_relaxation", "the same in the first solve [m]", c.first.relaxation);
  c.first.slip = number("first_slip", "the same in the first solve [m/s]", c.first.slip);
  c.solves = block.about("each from the motion of the one before, with both smaller by equal ratios")
                 .get_or("solves", c.solves, io::between(1, 20));
  const auto check_order = [&](const char* first, double a, const char* last, double b) {
    if (a < b)
      block.problem(first, std::string("'") + first + "' is " + io::shortest(a) + ", expected '" + last +
                               "', " + io::shortest(b) + ", at least");
  };
  check_order("first_relaxation", c.first.relaxation, "relaxation", c.last.relaxation);
  check_order("first_slip", c.first.slip, "slip", c.last.slip);
}

void check_rigid_contacts(Section& file, const Task& task, const TaskKeys& keys) {
  if (!task.simulated) return;
  const std::string found = ", and the scene has rigid contacts, whose times are found; expected one of them";
  if (task.by_ddp)
    file.child_or_empty("solver").problem(
        "method", "'solver.method' is ddp, which knows no rigid contacts; expected riccati or ipopt");
  if (task.optimise.mesh.scheme.name != kRigidScheme)
    file.child_or_empty("transcription")
        .problem("scheme", std::string("'transcription.scheme' has to be ") + kRigidScheme +
                               " where the scene has rigid contacts: others do not land within a step");
  if (!task.robot.contacts.empty()) file.problem("contacts", "'contacts' are held all along" + found);
  if (!task.robot.thrusters.empty())
    file.problem("thrusters", "'thrusters' are not simulated in a scene with rigid contacts");
  if (!keys.phases.empty()) file.problem("phases", "'phases' say when contacts hold" + found);
  if (keys.closed) file.problem("periodic", "'periodic' says when contacts hold" + found);
}

void judge_by_simulation(Section& verify, Task::VerifyOptions& demands) {
  for (const char* key : {"integration_error", "between_nodes"}) {
    if (verify.has(key))
      verify.problem(key, std::string("'") + key +
                              "' is of motions without rigid contacts; of these the simulation of the scene "
                              "tells what they are off by, expected 'simulation_error'");
  }
  demands.integration_error = demands.between = std::numeric_limits<double>::infinity();
}

}  // namespace dyntape
