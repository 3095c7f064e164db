// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/solve/whole_motion.h>

#include <algorithm>
#include <cmath>

namespace dyntape {

namespace {

// Where controls of a phase stand among those of the task.
std::vector<Eigen::Index> places(const std::vector<std::string>& names, const std::vector<std::string>& all) {
  std::vector<Eigen::Index> at;
  for (const std::string& name : names) at.push_back(std::find(all.begin(), all.end(), name) - all.begin());
  return at;
}

Trajectory joined(const Task& task, const PhasedSolution& phases) {
  Eigen::Index n = 0;
  for (const Trajectory& motion : phases.motions) n += motion.points();
  const Trajectory& first = phases.motions.front();
  Trajectory all{Eigen::VectorXd(n), Eigen::MatrixXd(first.x.rows(), n), Eigen::MatrixXd(first.a.rows(), n),
                 Eigen::MatrixXd::Zero(task.problem.n_u(), n), first.scheme};
  Eigen::Index at = 0;
  for (std::size_t k = 0; k < phases.motions.size(); ++k) {
    const Trajectory& motion = phases.motions[k];
    const Eigen::Index points = motion.points();
    all.t.segment(at, points) = motion.t.array() + phases.begin(k);
    all.x.middleCols(at, points) = motion.x;
    all.a.middleCols(at, points) = motion.a;
    const std::vector<Eigen::Index> rows = places(task.phases[k].problem.controls, task.problem.controls);
    for (std::size_t i = 0; i < rows.size(); ++i)
      all.u.row(rows[i]).segment(at, points) = motion.u.row(Eigen::Index(i));
    at += points;
  }
  return all;
}

bool is_worse(double a, double b) { return !(a <= b); }  // NaN is worse than any number

void append(Eigen::VectorXd& all, const Eigen::VectorXd& more) {
  all.conservativeResize(all.size() + more.size());
  all.tail(more.size()) = more;
}

}  // namespace

std::vector<const Task*> parts_of(const Task& task) {
  std::vector<const Task*> parts;
  for (const Task& phase : task.phases) parts.push_back(&phase);
  if (parts.empty()) parts.push_back(&task);
  return parts;
}

Verification whole_verification(const Task& task, const PhasedSolution& phases) {
  if (task.phases.empty()) return phases.verifications.front();
  Verification all;
  all.violation = phases.link_violation;
  all.worst_row = "the links between phases";
  for (std::size_t k = 0; k < phases.verifications.size(); ++k) {
    const Verification& v = phases.verifications[k];
    const std::string in = task.phases[k].name + ": ";
    if (is_worse(v.violation, all.violation)) all.violation = v.violation, all.worst_row = in + v.worst_row;
    if (k == 0 || is_worse(v.worst_defect, all.worst_defect)) all.worst_defect = v.worst_defect;
    if (k == 0 || is_worse(v.worst_relative, all.worst_relative)) {
      all.worst_relative = v.worst_relative;
      all.worst_interval = int(all.relative_defect.size()) + v.worst_interval;
      all.worst_state = v.worst_state.empty() ? "" : in + v.worst_state;
      all.worst_state_defect = v.worst_state_defect;
    }
    if (k == 0 || is_worse(v.miss, all.miss)) {
      all.miss = v.miss;
      all.miss_state = v.miss_state.empty() ? "" : in + v.miss_state;
      all.miss_index = v.miss_index;
    }
    if (all.trouble.empty() && !v.trouble.empty()) all.trouble = in + v.trouble;
    append(all.integration_error, v.integration_error);
    append(all.relative_defect, v.relative_defect);
    all.cost += v.cost;
  }
  return all;
}

Solution whole(const Task& task, const PhasedSolution& phases) {
  Solution s;
  s.nlp = phases.nlp;
  s.demands = phases.demands;
  s.motion = task.phases.empty() ? phases.motions.front() : joined(task, phases);
  s.derivatives = phases.derivatives;
  s.kkt = phases.kkt;
  if (!phases.verifications.empty()) s.verification = whole_verification(task, phases);
  s.build_seconds = phases.build_seconds, s.check_seconds = phases.check_seconds;
  s.verify_seconds = phases.verify_seconds;
  return s;
}

// Of each joint and quantity the worst of all phases.
std::vector<LimitExcess> excesses_of(const Task& task, const PhasedSolution& phases) {
  std::vector<LimitExcess> all;
  const std::vector<const Task*> parts = parts_of(task);
  const auto beyond = [](const LimitExcess& e) { return std::abs(e.value - e.limit); };
  for (std::size_t k = 0; k < parts.size(); ++k) {
    for (LimitExcess excess : limit_excesses(*parts[k], phases.motions[k])) {
      excess.time += phases.begin(k);
      const auto is_same = [&](const LimitExcess& e) {
        return e.quantity == excess.quantity && e.joint == excess.joint;
      };
      const auto before = std::find_if(all.begin(), all.end(), is_same);
      if (before == all.end())
        all.push_back(excess);
      else if (beyond(excess) > beyond(*before))
        *before = excess;
    }
  }
  return all;
}

}  // namespace dyntape
