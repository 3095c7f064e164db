// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/task/limits.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/task/pictures.h>

namespace dyntape {

namespace {

using Joint = dynamics::Joint<double>;

constexpr double kBeyond =
    1e-6;  // of a limit: the solver widens bounds by 1e-8 and ends within its tolerance

std::string plain_digits(double value) { return io::with_digits(value, 6); }

const Joint& joint_at(const Task& task, int dof) { return task.scene.model.joints[std::size_t(dof)]; }

// The worst of a row of values that ought to lie within [lower, upper], if any does not.
void find_excess(const Eigen::VectorXd& values, const Eigen::VectorXd& times, double lower, double upper,
                 LimitExcess excess, std::vector<LimitExcess>& excesses) {
  double most = 0;
  for (Eigen::Index p = 0; p < values.size(); ++p) {
    const bool above = values[p] > upper;
    const double limit = above ? upper : lower, beyond = above ? values[p] - upper : lower - values[p];
    if (!(beyond > most) || beyond <= kBeyond * std::max(std::abs(limit), kBeyond)) continue;
    most = beyond;
    excess.value = values[p];
    excess.limit = limit;
    excess.time = times[p];
  }
  if (most > 0) excesses.push_back(std::move(excess));
}

}  // namespace

std::string LimitExcess::text() const {
  return quantity + " of " + joint + " is " + plain_digits(value) + " " + unit + " at " + plain_digits(time) +
         " s, rated for " + plain_digits(limit);
}

std::vector<LimitExcess> limit_excesses(const Task& task, const Trajectory& motion) {
  const Curves c = curves_of(task, motion);
  const Eigen::Index points = motion.points();
  const Eigen::Index used = motion.scheme.uses_last_point() ? points : points - 1;
  const std::vector<int> driven = actuated_dofs(task.scene);
  std::vector<LimitExcess> excesses;
  for (int i = 0; i < task.scene.model.nv; ++i) {
    const Joint& joint = joint_at(task, i);
    const bool slides = joint.type == dynamics::JointType::kPrismatic;
    const auto check = [&](const char* quantity, const char* unit, const Eigen::VectorXd& values,
                           double lower, double upper) {
      find_excess(values, motion.t, lower, upper, {quantity, joint.name, unit, 0, 0, 0}, excesses);
    };
    const double velocity = rated(joint.limits.velocity), effort = rated(joint.limits.effort);
    check("position", slides ? "m" : "rad", c.q.row(i), joint.limits.lower, joint.limits.upper);
    check("velocity", slides ? "m/s" : "rad/s", c.v.row(i), -velocity, velocity);
    const auto at = std::find(driven.begin(), driven.end(), i);
    if (at == driven.end()) continue;
    check("effort", slides ? "N" : "N m", c.tau.row(at - driven.begin()).head(used), -effort, effort);
  }
  return excesses;
}

void bound_by_ratings(Problem& problem, const Task& task, const RatedParts& parts) {
  if (parts.positions) limit_positions(problem, task.scene);
  if (parts.velocities) limit_velocities(problem, task.scene);
  if (parts.efforts) limit_efforts(problem, task.scene, task.robot.unit);
}

void check_ends(const Task& task, const RatedParts& parts) {
  const Problem& problem = task.problem;
  const int n = task.scene.model.nv;
  std::vector<std::string> faults;
  const auto check = [&](const Eigen::VectorXd& state, const std::string& end, int i, const char* key) {
    const double lower = problem.x.lower[i], upper = problem.x.upper[i];
    const double rounding = 1e-12 * std::max(1.0, std::abs(state[i]));  // as check() of the problem takes it
    if (!(state[i] < lower - rounding || state[i] > upper + rounding)) return;
    faults.push_back(task.file + ": the " + end + " of \"" + problem.states[std::size_t(i)] + "\" is " +
                     plain_digits(state[i]) + ", the robot's limits are " + plain_digits(lower) + " and " +
                     plain_digits(upper) + "; expected a value within them, or '" + key +
                     " none' in 'bounds'");
  };
  for (int i = 0; i < n; ++i) {
    for (const auto& [state, end] : {std::pair(&problem.start, "start"), std::pair(&problem.goal, "goal")}) {
      if (parts.positions) check(*state, end, i, "positions");
      if (parts.velocities) check(*state, end, n + i, "velocities");
    }
  }
  if (!faults.empty()) throw FileError(faults);
}

}  // namespace dyntape
