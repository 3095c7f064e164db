// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/solution.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/io/table.h>

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

// Of what the solver calls solved: which of the conditions of an optimum does not hold.
std::string of_not_optimal(const Solution& s) {
  const KktResiduals& kkt = s.kkt;
  if (kkt.stationarity <= s.demands.stationarity && kkt.complementarity <= s.demands.complementarity)
    return "The motion is stationary, but it is not a minimum: the cost falls along a direction of negative "
           "curvature, and no better optimum was found along it; expected another guess, or a start beside "
           "the symmetric one.";
  const bool is_stationary = kkt.stationarity <= s.demands.stationarity;
  return std::string("The solver reports success, but the motion is not shown to be an optimum: ") +
         (is_stationary ? "complementarity" : "stationarity") + ", computed anew, is " +
         io::scientific(is_stationary ? kkt.complementarity : kkt.stationarity) + ", where " +
         io::scientific(is_stationary ? s.demands.complementarity : s.demands.stationarity) +
         " is allowed; " +
         (is_stationary ? "limits are kept at a distance, as by a barrier that is left."
                        : "constraints that nearly depend on each other can look like this.");
}

// "v.elbow is off by 95.0 in interval 12 of 50, 3.7e-01 of its motion, where 1.0e-03 is allowed"
std::string defect_of(const Solution& s) {
  const Verification& v = s.verification;
  return v.worst_state + " is off by " + io::significant(v.worst_state_defect, 3) + " in interval " +
         std::to_string(v.worst_interval) + " of " + std::to_string(v.relative_defect.size()) + ", " +
         io::scientific(v.worst_relative) + " of its motion, where " +
         io::scientific(s.demands.integration_error) + " is allowed";
}

std::string of_coarse(const Solution& s) {
  const Verification& v = s.verification;
  const std::string begin = "Solved, but too coarse: ", why = of_mesh(s);
  if (!(v.worst_relative <= s.demands.integration_error))
    return begin + "re-simulated, " + defect_of(s) + why;
  if (!(v.passings.worst() <= s.demands.between))
    return begin + "the motion exceeds a bound: " + v.passings.rows.front().text() + why;
  return begin + "the motion costs " + io::significant(v.true_cost, 6) + " instead of " +
         io::significant(v.cost, 6) + why;
}

}  // namespace

std::string of_violated(const Solution& s) {
  const Verification& v = s.verification;
  if (is_feasible(v, s.demands) || v.worst_row.empty()) return "";
  return " The constraint violated most is " + v.worst_row + ", by " + io::scientific(v.violation) +
         " of its magnitude.";
}

std::string of_mesh(const Solution& s) {
  if (!s.refinement_trouble.empty()) return "; a finer mesh was not solved, " + s.refinement_trouble;
  int refinements = 0;  // a mesh may be solved twice
  for (std::size_t k = 1; k < s.meshes.size(); ++k)
    refinements += s.meshes[k].intervals != s.meshes[k - 1].intervals;
  return refinements > 0 ? " after " + std::to_string(refinements) + " refinements of the mesh."
                         : ": use more intervals, or let the mesh be refined.";
}

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

SolveTimes Solution::times() const {
  if (meshes.empty()) return nlp.times;
  SolveTimes sum;
  for (const MeshRound& mesh : meshes) sum += mesh.times;
  return sum;
}

std::string Solution::verdict() const {
  const Verification& v = verification;
  if (!converged()) return describe(nlp.status) + of_violated(*this);
  if (!is_feasible(v, demands))
    return "The solver reports success, but the motion violates " + v.worst_row + " by " +
           io::scientific(v.violation) + " of its magnitude.";
  if (!is_optimal(kkt, nlp.stationary_point, demands)) return of_not_optimal(*this);
  if (!v.trouble.empty())
    return "The solver reports success, but the motion cannot be re-simulated: " + v.trouble + ".";
  if (!is_accurate(v, demands)) return of_coarse(*this);
  return "A local optimum was found and verified.";
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
