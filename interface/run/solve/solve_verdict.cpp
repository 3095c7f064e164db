// SPDX-License-Identifier: BSD-3-Clause
//
// The verdict of a solved task in one sentence.
#include <cmath>

#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/solve/solve_report.h>

namespace dyntape {

namespace {

const std::string kLimitsHold =
    " The robot's limits hold unless the task says otherwise (bounds): within them there may be none.";

// "velocity of panda_joint1 is 2.41 rad/s at 0.52 s, rated for 2.175, and 2 more"
std::string first_of(const std::vector<LimitExcess>& excesses) {
  const std::size_t others = excesses.size() - 1;
  return excesses.front().text() + (others ? ", and " + std::to_string(others) + " more" : "");
}

std::string beyond(LimitOf of) {
  switch (of) {
    case LimitOf::kRobot:
      return "asks for more than the robot can do: ";
    case LimitOf::kClearance:
      return "comes nearer to what is around than the task allows: ";
    case LimitOf::kFloor:
      break;
  }
  return "puts feet below the floor (its height is contacts.floor): ";
}

// A solved motion that exceeds the robot's limits, or clearances, between points; "" if something else is wrong.
std::string of_passed(const SolveReport& report) {
  const Solution& s = report.solution;
  const Verification& v = s.verification;
  const bool is_passed = s.converged() && report.feasible() && report.optimal() && v.trouble.empty() &&
                         v.worst_relative <= s.demands.integration_error &&
                         !(v.passings.worst() <= s.demands.between);
  if (!is_passed || !report.demands.limits || report.excesses.empty()) return "";
  return "A local optimum was found, but it " + beyond(report.excesses.front().of) +
         first_of(report.excesses) + of_mesh(s);
}

std::string of_interrupted(const SolveReport& report) {
  const std::string after = "Interrupted after " + std::to_string(report.iterations()) + " iterations: ";
  const Verification& v = report.solution.verification;
  if (report.solution.converged()) {
    return after + "the motion is an optimum of " + std::to_string(v.relative_defect.size()) +
           " intervals, and not verified to be what its controls do.";
  }
  return after + "the motion is the best so far, no optimum, and violates the constraints by up to " +
         io::scientific(v.violation) + " of their nominal values.";
}

}  // namespace

bool SolveReport::cost_matches() const {
  return !expected || std::abs(solution.cost() - expected->cost) <= expected->tolerance;
}

bool SolveReport::optimal() const {
  return is_optimal(solution.kkt, solution.nlp.stationary_point, solution.demands);
}

bool SolveReport::reaches_goal() const { return !ddp || has_soft_goal || ddp->goal_miss <= demands.goal; }

bool SolveReport::simulates() const {
  return !simulated || (simulated->error <= demands.simulation && simulated->from_afar <= demands.simulation);
}

bool SolveReport::success() const {
  return solution.success() && are_limits_checked && simulates() && reaches_goal() && within_limits() &&
         cost_matches();
}

int SolveReport::iterations() const {
  int sum = 0;
  for (const MeshRound& mesh : meshes) sum += mesh.iterations;
  return sum;
}

SolveTimes SolveReport::times() const {
  SolveTimes sum;
  for (const MeshRound& mesh : meshes) sum += mesh.times;
  return sum;
}

double SolveReport::verify_seconds() const {
  double sum = 0;
  for (const MeshRound& mesh : meshes) sum += mesh.verify_seconds;
  return sum;
}

std::string SolveReport::verdict() const {
  if (interrupted) return of_interrupted(*this);
  if (!solution.converged() && !unreachable.empty())
    return "Out of reach: " + unreachable + "." + of_violated(solution);
  if (solution.nlp.status == SolveStatus::kLocallyInfeasible) return solution.verdict() + kLimitsHold;
  if (!solution.success()) {
    const std::string passed = of_passed(*this);
    return passed.empty() ? solution.verdict() : passed;
  }
  if (!simulates())
    return "A local optimum was found, but its torques do something else when the scene is simulated: " +
           simulated->sentence() +
           (simulated->trouble.empty()
                ? ", where verify.simulation_error allows " + io::significant(100 * demands.simulation, 3) +
                      " %; "
                      "expected more intervals, or a smaller relaxation or slip in contact_implicit."
                : ".");
  if (!reaches_goal()) {
    return "A local optimum was found, but it misses the goal: " + ddp->missed + " ends off by " +
           io::significant(100 * ddp->goal_miss, 3) +
           " % of how far it moves, where verify.goal_error allows " +
           io::significant(100 * demands.goal, 3) +
           " %; expected greater weights in costs.tracking.end, or 'goal { soft on }' where the goal need "
           "not be "
           "met.";
  }
  if (!within_limits())
    return "A local optimum was found, but it " + beyond(excesses.front().of) + first_of(excesses) + ".";
  if (!cost_matches()) {
    return "A local optimum was found, but not the known one: the cost differs by " +
           io::scientific(solution.cost() - expected->cost) + ".";
  }
  const std::string found = expected ? "The known optimum was found" : "A local optimum was found";
  if (excesses.empty()) return found + " and verified.";
  return found + " and verified, but for the limits, which the task does not ask for: " + first_of(excesses) +
         ".";
}

}  // namespace dyntape
