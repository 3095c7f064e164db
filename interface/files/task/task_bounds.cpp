// SPDX-License-Identifier: BSD-3-Clause
//
// The bounds of a task's problem, and whether its ends lie within them.
#include <algorithm>
#include <cmath>

#include <dyntape/interface/files/joint_values.h>
#include <dyntape/interface/files/task/task_phases.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

std::string plainly(double value) { return io::with_digits(value, 6); }

void add_bounds(Problem& problem, const TaskSpec& task) {
  const auto& model = task.scene.model;
  const auto bound = [](Bounds& bounds, int i, const Limit& limit) {
    bounds.lower[i] = -limit.value;
    bounds.upper[i] = limit.value;
  };
  for (const auto& joint : model.joints) {
    if (dynamics::traits(joint.type).on_a_line) bound(problem.x, joint.idx_q, task.bounds.positions);
    if (dynamics::is_single(joint.type)) bound(problem.x, model.nq + joint.idx_v, task.bounds.velocities);
  }
  const int driven = int(actuated_dofs(task.scene).size());
  for (int k = 0; k < driven; ++k) bound(problem.u, k, task.bounds.efforts);
  const RatedParts of_robot = task.bounds.of_robot();
  if (of_robot.positions) limit_positions(problem, task.scene);
  if (of_robot.velocities) limit_velocities(problem, task.scene);
  if (of_robot.efforts) limit_efforts(problem, task.scene, task.robot.unit);
}

void check_ends(const Task& task) {
  const Problem& problem = task.problem;
  const RatedParts parts = task.bounds.of_robot();
  const int n = task.scene.model.nq;
  std::vector<SpecFault> faults;
  const auto check = [&](const Eigen::VectorXd& state, const std::string& end, int i,
                         const dynamics::Joint<double>& joint, const std::string& key) {
    const double lower = problem.x.lower[i], upper = problem.x.upper[i];
    const double rounding = 1e-12 * std::max(1.0, std::abs(state[i]));  // as check() of the problem takes it
    if (!(state[i] < lower - rounding || state[i] > upper + rounding)) return;
    const dynamics::MimicRule* rule = rule_of(task.scene, joint.name);
    const std::string block = key == "positions" ? "q" : "v";
    faults.push_back(
        {end + "." + block + "." + (rule ? rule->leader : joint.name),
         "the " + end + " of \"" + problem.states[std::size_t(i)] + "\"" +
             (rule ? ", which follows \"" + rule->leader + "\"," : "") + " is " + plainly(state[i]) +
             ", the robot's limits are " + plainly(lower) + " and " + plainly(upper) + "; expected a value " +
             (rule ? "of \"" + rule->leader + "\" that puts it " : "") + "within them, or '" + key +
             " none' in 'bounds'" + (key == "positions" ? other_unit(joint, state[i], lower, upper) : "")});
  };
  for (const dynamics::Joint<double>& joint : task.scene.model.joints) {
    for (const auto& [state, end] : {std::pair(&problem.start, "start"), std::pair(&problem.goal, "goal")}) {
      if (parts.positions) check(*state, end, joint.idx_q, joint, "positions");
      if (parts.velocities) check(*state, end, n + joint.idx_v, joint, "velocities");
    }
  }
  const auto check_clear = [&](const Eigen::VectorXd& state, const std::string& end) {
    if (state.head(n).array().isNaN().any()) return;
    for (const Surroundings::Pair& pair : task.around.apart) {
      const double gap = clearance(task.scene.model, state.head(n), pair.a, pair.b);
      if (gap >= pair.least) continue;
      faults.push_back({end, "at the " + end + " the clearance of \"" + pair.a.name + "\" and \"" +
                                 pair.b.name + "\" is " + plainly(gap) + " m, expected " +
                                 plainly(pair.least) + " m at least"});
    }
  };
  check_clear(problem.start, "start");
  check_clear(problem.goal, "goal");
  if (!faults.empty()) refuse(task, faults);
}

}  // namespace

void bound_motion(Task& task) {
  add_bounds(task.problem, task);
  check_ends(task);
}

}  // namespace dyntape
