// SPDX-License-Identifier: BSD-3-Clause
//
// What a solved task is worth, in one sentence.
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

// "v.elbow is off by 95.0 in interval 12 of 50, 3.7e-01 of its motion, where the task allows 1.0e-03"
std::string defect_of(const Solution& solution, const Task::VerifyOptions& demands) {
  const Verification& v = solution.verification;
  return v.worst_state + " is off by " + io::significant(v.worst_state_defect, 3) + " in interval " +
         std::to_string(v.worst_interval) + " of " + std::to_string(v.relative_defect.size()) + ", " +
         io::scientific(v.worst_relative) + " of its motion, where the task allows " +
         io::scientific(demands.integration_error);
}

std::string beyond(LimitOf of) {
  return of == LimitOf::kRobot ? "asks for more than the robot can do: "
                               : "comes nearer to what is around than the task allows: ";
}

std::string of_coarse(const SolveReport& report) {
  int refinements = 0;  // a mesh may be solved twice
  for (std::size_t k = 1; k < report.meshes.size(); ++k)
    refinements += report.meshes[k].intervals != report.meshes[k - 1].intervals;
  const std::string why =
      !report.refinement_trouble.empty() ? "; a finer mesh was given up, " + report.refinement_trouble
      : refinements > 0 ? " after " + std::to_string(refinements) + " refinements of the mesh."
                        : ": use more intervals, or let the mesh be refined.";
  const Verification& v = report.solution.verification;
  if (!(v.worst_relative <= report.demands.integration_error))
    return "Solved, but too coarse: re-simulated, " + defect_of(report.solution, report.demands) + why;
  if (!(v.passings.worst() <= report.demands.between) && report.demands.limits && !report.excesses.empty())
    return "A local optimum was found, but it " + beyond(report.excesses.front().of) +
           first_of(report.excesses) + why;
  if (!(v.passings.worst() <= report.demands.between))
    return "Solved, but too coarse: the motion exceeds a bound of the task: " +
           v.passings.rows.front().text() + why;
  return "Solved, but too coarse: the motion costs " + io::significant(v.true_cost, 6) + " instead of " +
         io::significant(v.cost, 6) + why;
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

// " The constraint violated most is goal of panda_hand[0], by 2.1e-01 of its magnitude."  Empty where all hold.
std::string of_violated(const SolveReport& report) {
  const Verification& v = report.solution.verification;
  if (report.feasible() || v.worst_row.empty()) return "";
  return " The constraint violated most is " + v.worst_row + ", by " + io::scientific(v.violation) +
         " of its magnitude.";
}

// Of what the solver calls solved: which of the conditions of an optimum does not hold.
std::string of_not_optimal(const Solution& solution) {
  const KktResiduals& kkt = solution.kkt;
  const VerifyOptions& demands = solution.demands;
  if (kkt.stationarity <= demands.stationarity && kkt.complementarity <= demands.complementarity)
    return "The motion is stationary, but it is not a minimum: the cost falls along a direction of negative "
           "curvature, and no better optimum was found along it; expected another guess, or a start beside "
           "the "
           "symmetric one.";
  const bool is_stationary = kkt.stationarity <= demands.stationarity;
  return std::string("The solver reports success, but the motion is not shown to be an optimum: ") +
         (is_stationary ? "complementarity" : "stationarity") + ", computed anew, is " +
         io::scientific(is_stationary ? kkt.complementarity : kkt.stationarity) + ", where " +
         io::scientific(is_stationary ? demands.complementarity : demands.stationarity) + " is allowed; " +
         (is_stationary ? "limits are kept at a distance, as by a barrier that is left."
                        : "constraints that nearly depend on each other can look like this.");
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
  return solution.success() && simulates() && reaches_goal() && within_limits() && cost_matches();
}

int SolveReport::iterations() const {
  int sum = 0;
  for (const MeshRound& mesh : meshes) sum += mesh.iterations;
  return sum;
}

std::string SolveReport::verdict() const {
  const Verification& v = solution.verification;
  if (interrupted) return of_interrupted(*this);
  if (!solution.converged() && !unreachable.empty())
    return "Out of reach: " + unreachable + "." + of_violated(*this);
  if (solution.nlp.status == SolveStatus::kLocallyInfeasible)
    return describe(solution.nlp.status) + of_violated(*this) + kLimitsHold;
  if (!solution.converged()) return describe(solution.nlp.status) + of_violated(*this);
  if (!feasible()) {
    return "The solver reports success, but the motion violates " + v.worst_row + " by " +
           io::scientific(v.violation) + " of its magnitude.";
  }
  if (!optimal()) return of_not_optimal(solution);
  if (!v.trouble.empty())
    return "The solver reports success, but the motion cannot be re-simulated: " + v.trouble + ".";
  if (!true_enough()) return of_coarse(*this);
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
  return found +
         " and verified, but for the robot's limits, which the task does not ask for: " + first_of(excesses) +
         ".";
}

}  // namespace dyntape
