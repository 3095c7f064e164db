// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/solution.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

std::size_t place_of(const std::string& name, const std::vector<std::string>& all) {
  return std::size_t(std::find(all.begin(), all.end(), name) - all.begin());
}

// NaN is worse than any number, and nothing is worse than NaN.
bool is_worse(double a, double b) { return !std::isnan(b) && !(a <= b); }

void append(Eigen::VectorXd& all, const Eigen::VectorXd& more) {
  all.conservativeResize(all.size() + more.size());
  all.tail(more.size()) = more;
}

}  // namespace

bool is_optimal(const KktResiduals& kkt, StationaryPoint order, const VerifyOptions& demands) {
  return kkt.stationarity <= demands.stationarity && kkt.complementarity <= demands.complementarity &&
         order != StationaryPoint::kNotMinimum;
}
bool is_feasible(const Verification& verification, const VerifyOptions& demands) {
  return verification.violation <= demands.violation;
}
bool is_accurate(const Verification& verification, const VerifyOptions& demands) {
  return verification.worst_relative <= demands.integration_error && verification.trouble.empty() &&
         verification.passings.worst() <= demands.between && verification.cost_error <= demands.cost_error;
}

int Solution::iterations() const {
  if (meshes.empty()) return nlp.iterations();
  int sum = 0;
  for (const MeshRound& mesh : meshes) sum += mesh.iterations;
  return sum;
}

std::string Solution::verdict() const {
  const Verification& v = verification;
  const auto digits = [](double value) { return io::with_digits(value, 2); };
  const std::string coarse = refinement_trouble.empty()
                                 ? std::string("; use more intervals")
                                 : "; a finer mesh was given up, " + refinement_trouble;
  const std::string violated =
      "; the constraint violated most is " + v.worst_row + ", by " + digits(v.violation);
  if (!converged()) return describe(nlp.status) + (is_feasible(v, demands) ? "" : violated);
  if (success()) return "solved, and verified";
  if (!is_feasible(v, demands))
    return "solved, but " + v.worst_row + " is violated by " + digits(v.violation);
  if (!v.trouble.empty()) return "solved, but " + v.trouble;
  if (!(v.worst_relative <= demands.integration_error))
    return "solved, but an interval differs from its re-simulation by " + digits(v.worst_relative) +
           " of the motion" + coarse;
  if (!(v.passings.worst() <= demands.between))
    return "solved, but " + v.passings.rows.front().text() + coarse;
  if (!(v.cost_error <= demands.cost_error))
    return "solved, but the motion costs " + io::with_digits(v.true_cost, 6) + " instead of " +
           io::with_digits(v.cost, 6) + coarse;
  if (nlp.stationary_point == StationaryPoint::kNotMinimum)
    return "solved, but the cost falls along a direction from here: it is no minimum";
  return "solved, but its multipliers do not show it to be an optimum";
}

Trajectory whole_motion(const std::vector<SolvedPhase>& phases,
                        const std::vector<std::vector<std::string>>& controls_of_phases,
                        std::vector<std::string> controls) {
  const Trajectory& first = phases.front().motion;
  if (phases.size() == 1 && (controls.empty() || controls == controls_of_phases.front())) return first;
  for (const auto& names : controls_of_phases) {
    for (const std::string& name : names) {
      if (place_of(name, controls) == controls.size()) controls.push_back(name);
    }
  }
  Eigen::Index n = 0;
  for (const SolvedPhase& phase : phases) {
    n += phase.motion.points();
    if (phase.motion.x.rows() != first.x.rows() || phase.motion.a.rows() != first.a.rows()) return {};
  }
  Trajectory all{Eigen::VectorXd(n), Eigen::MatrixXd(first.x.rows(), n), Eigen::MatrixXd(first.a.rows(), n),
                 Eigen::MatrixXd::Zero(Eigen::Index(controls.size()), n), first.scheme};
  Eigen::Index at = 0;
  for (std::size_t k = 0; k < phases.size(); ++k) {
    const Trajectory& motion = phases[k].motion;
    const Eigen::Index points = motion.points();
    all.t.segment(at, points) = motion.t.array() + phases[k].begin;
    all.x.middleCols(at, points) = motion.x;
    all.a.middleCols(at, points) = motion.a;
    for (std::size_t i = 0; i < controls_of_phases[k].size(); ++i) {
      const auto row = Eigen::Index(place_of(controls_of_phases[k][i], controls));
      all.u.row(row).segment(at, points) = motion.u.row(Eigen::Index(i));
    }
    at += points;
  }
  return all;
}

Verification whole_verification(const std::vector<SolvedPhase>& phases, double link_violation) {
  Verification all = phases.front().verification;
  const std::string of_links = phases.size() == 1 ? "the end against the start" : "the links between phases";
  if (phases.size() == 1) {
    if (is_worse(link_violation, all.violation)) all.violation = link_violation, all.worst_row = of_links;
    return all;
  }
  all = {};
  all.violation = link_violation;
  all.worst_row = of_links;
  double cost_error = 0, cost_size = 0;
  for (std::size_t k = 0; k < phases.size(); ++k) {
    const Verification& v = phases[k].verification;
    const std::string in = phases[k].name + ": ";
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
    for (Passing row : v.passings.rows) {
      row.name = in + row.name, row.time += phases[k].begin, row.interval += int(all.relative_defect.size());
      all.passings.rows.push_back(std::move(row));
    }
    append(all.passings.of_intervals, v.passings.of_intervals);
    append(all.cost_errors, v.cost_errors);
    all.true_cost += v.true_cost;
    cost_error += v.cost_error * v.cost_size, cost_size += v.cost_size;
    append(all.integration_error, v.integration_error);
    append(all.relative_defect, v.relative_defect);
    all.cost += v.cost;
  }
  const auto worse = [](const Passing& a, const Passing& b) { return a.excess > b.excess; };
  std::stable_sort(all.passings.rows.begin(), all.passings.rows.end(), worse);
  all.cost_size = cost_size;
  all.cost_error = cost_size > 0 ? cost_error / cost_size : 0;
  return all;
}

}  // namespace dyntape
