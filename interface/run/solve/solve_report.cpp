// SPDX-License-Identifier: BSD-3-Clause
//
// The report for people and for programs.

#include <dyntape/interface/files/scene/folded_notes.h>
#include <dyntape/interface/io/facts.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/run/solve/solve_report.h>

namespace dyntape {

namespace {

using nlohmann::ordered_json;

std::string precise(double value) { return io::with_digits(value, 12); }

std::string defect_text(const SolveReport& report) {
  const Verification& v = report.solution.verification;
  const std::string worst = v.worst_state.empty()
                                ? ""
                                : v.worst_state + " in interval " + std::to_string(v.worst_interval) +
                                      " of " + std::to_string(v.relative_defect.size()) + ", ";
  return io::scientific(v.worst_relative) + " (" + worst + "allowed " +
         io::scientific(report.demands.integration_error) + ")";
}

std::string order_text(StationaryPoint order) {
  switch (order) {
    case StationaryPoint::kMinimum:
      return "yes";
    case StationaryPoint::kNotMinimum:
      return "no";
    case StationaryPoint::kUnknown:
      break;
  }
  return "not known";
}

std::string excess_text(const std::vector<LimitExcess>& excesses) {
  std::string text;
  for (const LimitExcess& excess : excesses) text += "  " + excess.text() + "\n";
  return text.empty() ? "" : "\nbeyond limits:\n" + text;
}

// "push_off 0.3 s, flight 0.25 s"
std::string phases_text(const std::vector<SolvedPhase>& phases) {
  std::string text;
  for (const SolvedPhase& phase : phases)
    text += (text.empty() ? "" : ", ") + phase.name + " " + io::significant(phase.duration(), 5) + " s";
  return text;
}

// " in 3 solves on 2 meshes": a mesh may be solved twice.
std::string solves_text(const std::vector<MeshRound>& rounds) {
  if (rounds.size() < 2) return "";
  std::size_t meshes = 1;
  for (std::size_t k = 1; k < rounds.size(); ++k) meshes += rounds[k].intervals != rounds[k - 1].intervals;
  const std::string on = " on " + std::to_string(meshes) + (meshes == 1 ? " mesh" : " meshes");
  return meshes == rounds.size() ? on : " in " + std::to_string(rounds.size()) + " solves" + on;
}

// Where the mesh was refined.
std::string mesh_text(const std::vector<MeshRound>& meshes) {
  if (meshes.size() < 2) return "";
  const bool rounds = meshes.front().relaxation > 0;
  io::TextTable table({{"intervals", "", io::Align::kRight},
                       {rounds ? "contacts act from" : "status"},
                       {"iterations", "", io::Align::kRight},
                       {"cost", "", io::Align::kRight},
                       {"defect of the motion", "", io::Align::kRight},
                       {"time", "", io::Align::kRight}});
  for (const MeshRound& m : meshes) {
    const std::string from = io::significant(1e3 * m.relaxation, 3) + " mm: ";
    table.append({std::to_string(m.intervals), (rounds ? from : "") + to_string(m.status),
                  std::to_string(m.iterations), precise(m.cost), io::scientific(m.relative_defect),
                  io::duration(m.seconds)});
  }
  return "\n" + table.text();
}

ordered_json rounds_of(const std::vector<MeshRound>& meshes) {
  ordered_json rounds = ordered_json::array();
  for (const MeshRound& m : meshes) {
    rounds.push_back({{"intervals", m.intervals},
                      {"status", to_string(m.status)},
                      {"iterations", m.iterations},
                      {"cost", m.cost},
                      {"relative_defect", m.relative_defect},
                      {"passed", m.passed},
                      {"cost_error", m.cost_error},
                      {"seconds", m.seconds}});
    if (m.relaxation > 0) rounds.back()["relaxation"] = m.relaxation;
  }
  return rounds;
}

ordered_json limits_of(const SolveReport& report) {
  ordered_json excesses = ordered_json::array();
  for (const LimitExcess& e : report.excesses) {
    excesses.push_back({{"joint", e.joint},
                        {"quantity", e.quantity},
                        {"value", e.value},
                        {"limit", e.limit},
                        {"unit", e.unit},
                        {"time", e.time}});
  }
  const ordered_json kept =
      report.are_limits_checked ? ordered_json(report.excesses.empty()) : ordered_json(nullptr);
  return {{"kept", kept}, {"demanded", report.demands.limits}, {"excesses", excesses}};
}

// How it was found, and what it costs.
void tell_outcome(const SolveReport& report, io::Facts& facts) {
  const Solution& solution = report.solution;
  const NlpSolution& nlp = solution.nlp;
  facts["task"] = report.task;
  facts["robot"] = report.robot;
  facts["success"] = report.success() && report.unwritten.empty();
  facts["notes"] = report.notes;
  facts["interrupted"] = report.interrupted;
  facts.say("status", to_string(nlp.status));
  facts["status"] = to_string(nlp.status);
  facts["verdict"] = report.verdict();
  const std::string method = report.ddp ? "ddp" : to_string(nlp.method);
  facts.say("method", method + (!nlp.is_by_other_method ? ""
                                : report.ddp ? ", by exact second derivatives after Gauss-Newton got stuck"
                                             : ", after the other method got stuck"));
  facts["method"] = method;
  facts.say("iterations", std::to_string(report.iterations()) + solves_text(report.meshes));
  facts["iterations"] = report.iterations();
  facts["by_other_method"] = nlp.is_by_other_method;
  facts.say("cost", precise(solution.cost()));
  facts["cost"] = solution.cost();
  facts["duration"] = report.duration();
  if (const auto& range = report.free_time) {
    facts.say("duration found", precise(report.duration()) + " s (between " + precise(range->shortest) +
                                    " and " + precise(range->longest) + ")");
    facts["duration_range"] = {range->shortest, range->longest};
  }
  if (solution.phases.size() > 1) {
    facts.say("phases", phases_text(solution.phases));
    for (const SolvedPhase& phase : solution.phases)
      facts["phases"].push_back(
          {{"name", phase.name}, {"begin", phase.begin}, {"duration", phase.duration()}});
  }
  if (const auto& expected = report.expected) {
    facts.say("known optimum", precise(expected->cost) + " (difference " +
                                   io::scientific(solution.cost() - expected->cost) + ", allowed " +
                                   io::scientific(expected->tolerance) + ")");
    facts["expected"] = {
        {"cost", expected->cost}, {"tolerance", expected->tolerance}, {"matches", report.cost_matches()}};
  }
}

// Whether it is an optimum that keeps the constraints.
void tell_optimality(const SolveReport& report, io::Facts& facts) {
  const Verification& v = report.solution.verification;
  const KktResiduals& kkt = report.solution.kkt;
  const StationaryPoint order = report.solution.nlp.stationary_point;
  facts.say("constraint violation, relative, plain code",
            io::scientific(v.violation) + (v.worst_row.empty() ? "" : " (" + v.worst_row + ")"));
  facts["constraint_violation"] = {{"value", v.violation}, {"row", v.worst_row}};
  facts["kkt"] = {{"stationarity", kkt.stationarity},
                  {"feasibility", kkt.feasibility},
                  {"complementarity", kkt.complementarity}};
  facts["is_minimum"] = nullptr;
  if (order != StationaryPoint::kUnknown) facts["is_minimum"] = order == StationaryPoint::kMinimum;
  if (const auto& ddp = report.ddp) {
    facts.say("largest slope by a control", io::scientific(ddp->slope));
    facts.say("from the goal at the end",
              io::significant(ddp->off_goal, 3) + " (only a cost; norm over the coordinates of the goal)");
    facts["ddp"] = {
        {"slope", ddp->slope},
        {"is_minimum", ddp->is_minimum ? ordered_json(*ddp->is_minimum) : ordered_json(nullptr)},
        {"from_goal", ddp->off_goal},
        {"goal_miss", {{"what", ddp->missed}, {"share", ddp->goal_miss}, {"allowed", report.demands.goal}}},
        {"soft_goal", report.has_soft_goal}};
  } else {
    facts.say("optimality, relative, recomputed", "stationarity " + io::scientific(kkt.stationarity) +
                                                      ", feasibility " + io::scientific(kkt.feasibility) +
                                                      ", complementarity " +
                                                      io::scientific(kkt.complementarity));
  }
  facts.say("a minimum, to the second order", order_text(order));
}

// Whether it is what its controls do, and within the limits.
void tell_truth(const SolveReport& report, io::Facts& facts) {
  const Verification& v = report.solution.verification;
  facts.say("true defect, re-simulated",
            io::scientific(v.worst_defect) + " (" +
                (v.trouble.empty() ? "worst interval, in the unit of its state" : v.trouble) + ")");
  facts["integration_error"] = v.worst_defect;
  facts.say("true defect, of the motion", defect_text(report));
  facts["relative_defect"] = {{"value", v.worst_relative},
                              {"interval", v.worst_interval},
                              {"state", v.worst_state},
                              {"allowed", report.demands.integration_error}};
  facts.say("passed between points, of the motion",
            io::scientific(v.passings.worst()) + " (" +
                (v.passings.rows.empty() ? "" : v.passings.rows.front().name + ", ") + "allowed " +
                io::scientific(report.demands.between) + ")");
  facts["passed_between_points"] = {{"value", v.passings.worst()},
                                    {"row", v.passings.rows.empty() ? "" : v.passings.rows.front().name},
                                    {"allowed", report.demands.between}};
  facts.say("cost along the motion", precise(v.true_cost) + " (off by " + io::scientific(v.cost_error) +
                                         ", allowed " + io::scientific(report.demands.cost_error) + ")");
  facts["true_cost"] = {
      {"value", v.true_cost}, {"error", v.cost_error}, {"allowed", report.demands.cost_error}};
  facts.say("open-loop error at the end", io::scientific(v.miss) + report.open_loop_unit +
                                              (v.miss_state.empty() ? "" : " (" + v.miss_state + ")"));
  if (const auto& simulated = report.simulated) {
    facts.say("simulated with its contacts", simulated->sentence());
    facts["simulated"] = {{"error", simulated->error},
                          {"state", simulated->state},
                          {"off", simulated->off},
                          {"time", simulated->time},
                          {"impulse_from_a_distance", simulated->from_afar},
                          {"trouble", simulated->trouble},
                          {"allowed", report.demands.simulation}};
  }
  const std::size_t exceeded = report.excesses.size();
  facts.say("robot's limits", !report.are_limits_checked ? "not checked, as the solve was interrupted"
                              : exceeded == 0            ? "kept"
                                                         : std::to_string(exceeded) + " exceeded");
  facts["limits"] = limits_of(report);
  facts["meshes"] = rounds_of(report.meshes);
  if (!report.unwritten.empty()) facts["unwritten"] = report.unwritten;
  if (!report.refinement_trouble.empty()) facts["refinement_trouble"] = report.refinement_trouble;
  if (!v.trouble.empty()) facts["simulation_trouble"] = v.trouble;
  facts["open_loop_error"] = {{"value", v.miss},
                              {"state", v.miss_state},
                              {"unit", report.open_loop_unit.empty() ? "" : report.open_loop_unit.substr(1)}};
}

// What was made and what it took.
void tell_work(const SolveReport& report, io::Facts& facts) {
  const auto& [derivatives, build, sizes] = std::tie(report.solution.derivatives, report.build, report.sizes);
  facts["derivative_check"] = {{"first", derivatives.worst_first}, {"second", derivatives.worst_second}};
  if (derivatives.hessian_directions)
    facts["derivative_check"]["hessian_directions"] = derivatives.hessian_directions;
  facts.say("active bounds", std::to_string(report.active.size()));
  facts["active_bounds"] = report.active;
  if (report.ddp)
    facts.say("steps",
              io::with_groups(sizes.points - 1) + ", " + io::with_groups(sizes.variables) + " controls");
  else
    facts.say("program", io::with_groups(sizes.variables) + " variables, " +
                             io::with_groups(sizes.constraints) + " constraints, " +
                             io::with_groups(sizes.jacobian) + " + " + io::with_groups(sizes.hessian) +
                             " non-zeros");
  facts["sizes"] = {{"variables", sizes.variables},
                    {"constraints", sizes.constraints},
                    {"jacobian_nonzeros", sizes.jacobian},
                    {"hessian_nonzeros", sizes.hessian},
                    {"points", sizes.points},
                    {"operations_a_point", sizes.operations}};
  facts["functions"] = {{"compiled", build.compiled},
                        {"from_cache", build.from_cache},
                        {"machine_code", build.machine_code},
                        {"interpreted", build.interpreted},
                        {"sources", build.sources}};
}

void tell_times(const SolveReport& report, io::Facts& facts) {
  const BuildReport& build = report.build;
  const Timings& seconds = build.seconds;
  const DerivativeCheck& derivatives = report.solution.derivatives;
  const SolveTimes times = report.times();
  facts.time("record", seconds.record, io::with_groups(report.sizes.operations) + " operations a point");
  facts.time("derive", seconds.derive);
  facts.time("print", seconds.schedule + seconds.print);
  facts.time("compile", seconds.compile,
             std::to_string(build.compiled) + " compiled, " + std::to_string(build.from_cache) +
                 " from the cache, " + std::to_string(build.machine_code) + " as machine code, " +
                 std::to_string(build.interpreted) + " interpreted");
  facts.time("load", seconds.hash + seconds.load);
  const std::string along =
      derivatives.hessian_directions
          ? ", along " + std::to_string(derivatives.hessian_directions) + " random directions"
          : "";
  if (report.ddp)
    facts["seconds"]["check_derivatives"] = report.solution.check_seconds;
  else
    facts.time("check derivatives", report.solution.check_seconds,
               "worst relative difference beyond rounding " + io::scientific(derivatives.worst_first) +
                   ", second order " + io::scientific(derivatives.worst_second) + along);
  facts.time("solve", times.total,
             report.ddp ? ""
                        : "functions " + io::duration(times.functions) + ", Jacobian " +
                              io::duration(times.jacobian) + ", Hessian " + io::duration(times.hessian) +
                              ", linear solver and rest " + io::duration(times.solver()));
  for (const auto& [part, took] : {std::pair("functions", times.functions),
                                   {"jacobian", times.jacobian},
                                   {"hessian", times.hessian},
                                   {"linear_and_rest", times.solver()}})
    facts["seconds"][std::string("solve_") + part] = took;
  facts.time("verify", report.verify_seconds());
}

io::Facts facts_of(const SolveReport& report) {
  std::string heading = report.task + ": " + report.verdict();
  for (const std::string& note : folded(report.notes)) heading += "\nnote: " + note;
  io::Facts facts(heading);
  tell_outcome(report, facts);
  tell_optimality(report, facts);
  tell_truth(report, facts);
  tell_work(report, facts);
  tell_times(report, facts);
  facts.below(excess_text(report.excesses) + mesh_text(report.meshes) + "\n" + facts.times());
  return facts;
}

}  // namespace

std::string SolveReport::text() const { return facts_of(*this).text(); }
std::string SolveReport::json() const { return facts_of(*this).json(); }

}  // namespace dyntape
