// SPDX-License-Identifier: BSD-3-Clause
//
// The report for people and for programs.
#include <cmath>
#include <nlohmann/json.hpp>

#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/run/solve/solve_report.h>

namespace dyntape {

namespace {

using nlohmann::ordered_json;

std::string precise(double value) { return io::with_digits(value, 12); }

// JSON has no NaN and no infinity.
ordered_json number(double value) {
  return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr);
}

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
                      {"cost", number(m.cost)},
                      {"relative_defect", number(m.relative_defect)},
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
  return {{"kept", report.excesses.empty()}, {"demanded", report.demands.limits}, {"excesses", excesses}};
}

}  // namespace

std::string SolveReport::text() const {
  const NlpSolution& nlp = solution.nlp;
  const Verification& v = solution.verification;
  io::TextTable facts({{"quantity"}, {"value"}});
  facts.append({"status", to_string(nlp.status)});
  if (nlp.is_by_other_method)
    facts.append({"found by", std::string(ddp ? "exact second derivatives" : "the other method") +
                                  ", where " + (ddp ? "Gauss-Newton" : "the one asked for") + " got stuck"});
  facts.append({"iterations", std::to_string(nlp.iterations())});
  facts.append({"cost", precise(solution.cost())});
  if (free_time) {
    facts.append({"duration found", precise(duration()) + " s (between " + precise(free_time->shortest) +
                                        " and " + precise(free_time->longest) + ")"});
  }
  if (solution.phases.size() > 1) facts.append({"phases", phases_text(solution.phases)});
  if (expected) {
    facts.append({"known optimum", precise(expected->cost) + " (difference " +
                                       io::scientific(solution.cost() - expected->cost) + ", allowed " +
                                       io::scientific(expected->tolerance) + ")"});
  }
  facts.append({"constraint violation, relative, plain code",
                io::scientific(v.violation) + (v.worst_row.empty() ? "" : " (" + v.worst_row + ")")});
  if (ddp) {
    facts.append({"largest slope by a control", io::scientific(ddp->slope)});
    facts.append({"from the goal at the end",
                  io::significant(ddp->off_goal, 3) + " (costs draw to it; norm over what it gives)"});
  } else {
    facts.append({"optimality, relative, recomputed",
                  "stationarity " + io::scientific(solution.kkt.stationarity) + ", feasibility " +
                      io::scientific(solution.kkt.feasibility) + ", complementarity " +
                      io::scientific(solution.kkt.complementarity)});
  }
  facts.append({"a minimum, to the second order", order_text(nlp.stationary_point)});
  facts.append(
      {"true defect, re-simulated",
       io::scientific(v.worst_defect) + " (" +
           (v.trouble.empty() ? "worst interval, in the unit of the state that it is of" : v.trouble) + ")"});
  facts.append({"true defect, of the motion", defect_text(*this)});
  facts.append({"open-loop error at the end", io::scientific(v.miss) + open_loop_unit +
                                                  (v.miss_state.empty() ? "" : " (" + v.miss_state + ")")});
  if (simulated) facts.append({"simulated with its contacts", simulated->sentence()});
  facts.append({"robot's limits", excesses.empty() ? "kept" : std::to_string(excesses.size()) + " exceeded"});
  facts.append({"active bounds", std::to_string(active.size())});
  if (ddp)
    facts.append(
        {"steps", io::with_groups(sizes.points - 1) + ", " + io::with_groups(sizes.variables) + " controls"});
  else
    facts.append({"program", io::with_groups(sizes.variables) + " variables, " +
                                 io::with_groups(sizes.constraints) + " constraints, " +
                                 io::with_groups(sizes.jacobian) + " + " + io::with_groups(sizes.hessian) +
                                 " non-zeros"});
  const Timings& seconds = build.seconds;
  io::TextTable times({{"step"}, {"time", "", io::Align::kRight}, {"remark"}});
  const std::string origin = std::to_string(build.compiled) + " compiled, " +
                             std::to_string(build.from_cache) + " from the cache, " +
                             std::to_string(build.machine_code) + " as machine code, " +
                             std::to_string(build.interpreted) + " interpreted";
  times.append(
      {"record", io::duration(seconds.record), io::with_groups(sizes.operations) + " operations a point"});
  times.append({"derive", io::duration(seconds.derive), ""});
  times.append({"print", io::duration(seconds.schedule + seconds.print), ""});
  times.append({"compile", io::duration(seconds.compile), origin});
  times.append({"load", io::duration(seconds.hash + seconds.load), ""});
  if (!ddp)
    times.append({"check derivatives", io::duration(solution.check_seconds),
                  "worst relative difference beyond rounding " +
                      io::scientific(solution.derivatives.worst_first) + ", second order " +
                      io::scientific(solution.derivatives.worst_second) +
                      (solution.derivatives.hessian_directions
                           ? ", along " + std::to_string(solution.derivatives.hessian_directions) +
                                 " random directions"
                           : "")});
  times.append({"solve", io::duration(nlp.times.total),
                ddp ? ""
                    : "functions " + io::duration(nlp.times.functions) + ", Jacobian " +
                          io::duration(nlp.times.jacobian) + ", Hessian " + io::duration(nlp.times.hessian) +
                          ", linear solver and rest " + io::duration(nlp.times.solver())});
  times.append({"verify", io::duration(solution.verify_seconds), ""});
  std::string text = task + ": " + verdict() + "\n\n" + facts.text() + excess_text(excesses) +
                     mesh_text(meshes) + "\n" + times.text();
  for (const std::string& note : notes) text += "note: " + note + "\n";
  return text;
}

std::string SolveReport::json() const {
  const NlpSolution& nlp = solution.nlp;
  const Verification& v = solution.verification;
  const Timings& seconds = build.seconds;
  ordered_json j;
  j["task"] = task;
  j["robot"] = robot;
  j["success"] = success() && unwritten.empty();
  j["notes"] = notes;
  j["interrupted"] = interrupted;
  j["status"] = to_string(nlp.status);
  j["verdict"] = verdict();
  j["iterations"] = nlp.iterations();
  j["by_other_method"] = nlp.is_by_other_method;
  j["cost"] = number(solution.cost());
  j["duration"] = number(duration());
  if (free_time) j["duration_range"] = {free_time->shortest, free_time->longest};
  for (const SolvedPhase& phase : solution.phases) {
    if (solution.phases.size() > 1)
      j["phases"].push_back({{"name", phase.name}, {"begin", phase.begin}, {"duration", phase.duration()}});
  }
  if (expected) {
    j["expected"] = {
        {"cost", expected->cost}, {"tolerance", expected->tolerance}, {"matches", cost_matches()}};
  }
  j["constraint_violation"] = {{"value", number(v.violation)}, {"row", v.worst_row}};
  j["kkt"] = {{"stationarity", number(solution.kkt.stationarity)},
              {"feasibility", number(solution.kkt.feasibility)},
              {"complementarity", number(solution.kkt.complementarity)}};
  const StationaryPoint order = nlp.stationary_point;
  j["is_minimum"] = order == StationaryPoint::kUnknown ? ordered_json(nullptr)
                                                       : ordered_json(order == StationaryPoint::kMinimum);
  if (ddp)
    j["ddp"] = {
        {"slope", number(ddp->slope)},
        {"is_minimum", ddp->is_minimum ? ordered_json(*ddp->is_minimum) : ordered_json(nullptr)},
        {"from_goal", number(ddp->off_goal)},
        {"goal_miss",
         {{"what", ddp->missed}, {"share", number(ddp->goal_miss)}, {"allowed", number(demands.goal)}}},
        {"soft_goal", has_soft_goal}};
  j["integration_error"] = number(v.worst_defect);
  j["relative_defect"] = {{"value", number(v.worst_relative)},
                          {"interval", v.worst_interval},
                          {"state", v.worst_state},
                          {"allowed", number(demands.integration_error)}};
  if (simulated)
    j["simulated"] = {{"error", number(simulated->error)},
                      {"state", simulated->state},
                      {"off", number(simulated->off)},
                      {"time", simulated->time},
                      {"impulse_from_a_distance", simulated->from_afar},
                      {"trouble", simulated->trouble},
                      {"allowed", number(demands.simulation)}};
  j["limits"] = limits_of(*this);
  j["meshes"] = rounds_of(meshes);
  if (!unwritten.empty()) j["unwritten"] = unwritten;
  if (!refinement_trouble.empty()) j["refinement_trouble"] = refinement_trouble;
  if (!v.trouble.empty()) j["simulation_trouble"] = v.trouble;
  j["open_loop_error"] = {{"value", number(v.miss)},
                          {"state", v.miss_state},
                          {"unit", open_loop_unit.empty() ? "" : open_loop_unit.substr(1)}};
  j["derivative_check"] = {{"first", number(solution.derivatives.worst_first)},
                           {"second", number(solution.derivatives.worst_second)}};
  if (solution.derivatives.hessian_directions)
    j["derivative_check"]["hessian_directions"] = solution.derivatives.hessian_directions;
  j["active_bounds"] = active;
  j["sizes"] = {{"variables", sizes.variables},
                {"constraints", sizes.constraints},
                {"jacobian_nonzeros", sizes.jacobian},
                {"hessian_nonzeros", sizes.hessian},
                {"points", sizes.points},
                {"operations_a_point", sizes.operations}};
  j["functions"] = {{"compiled", build.compiled},
                    {"from_cache", build.from_cache},
                    {"machine_code", build.machine_code},
                    {"interpreted", build.interpreted},
                    {"sources", build.sources}};
  j["seconds"] = {{"record", seconds.record},
                  {"derive", seconds.derive},
                  {"print", seconds.schedule + seconds.print},
                  {"compile", seconds.compile},
                  {"load", seconds.hash + seconds.load},
                  {"check_derivatives", solution.check_seconds},
                  {"solve", nlp.times.total},
                  {"solve_functions", nlp.times.functions},
                  {"solve_jacobian", nlp.times.jacobian},
                  {"solve_hessian", nlp.times.hessian},
                  {"solve_linear_and_rest", nlp.times.solver()},
                  {"verify", solution.verify_seconds}};
  return j.dump(2) + "\n";
}

}  // namespace dyntape
