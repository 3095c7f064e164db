// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/simulation_results.h>

#include <nlohmann/json.hpp>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/text_file.h>
#include <dyntape/interface/files/scene/folded_notes.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/result_folder.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/report/player/player.h>
#include <dyntape/interface/run/simulate/effect_costs.h>

namespace dyntape {

namespace {

using nlohmann::ordered_json;

constexpr const char *kMotion = "motion.csv", *kReport = "report.json", *kEffective = "effective.info",
                     *kCurves = "trajectory.svg", *kEnergy = "energy.svg", *kForces = "forces.svg",
                     *kPlayer = "motion.html";

std::string word_of(const EnergyFlow& flow) {
  std::string word = flow.name;
  for (char& c : word) c = c == ' ' ? '_' : c;
  return word;
}

std::string per_second(double simulated, double seconds) {
  return seconds > 0 ? io::significant(simulated / seconds, 3) + " times real time" : "";
}

}  // namespace

std::vector<std::string> simulation_files() {
  return {kMotion, kReport, kEffective, kCurves, kEnergy, kForces, kPlayer};
}

io::CsvTable motion_table(const Scene& scene, const SimulatedMotion& motion) {
  std::vector<std::string> names = {"t"};
  for (const char* block : {"q", "v"}) {
    const std::vector<std::string> entries = entry_names(scene.robot.model, block);
    names.insert(names.end(), entries.begin(), entries.end());
  }
  for (const std::string& joint : driven_names(scene.robot)) names.push_back("tau." + joint);
  names.insert(names.end(), {"energy.kinetic", "energy.stored"});
  for (const EnergyFlow& flow : motion.flows) names.push_back("work." + word_of(flow));
  io::CsvTable table(names);
  std::vector<double> row;
  for (int k = 0; k < motion.samples(); ++k) {
    row.assign(1, motion.t[std::size_t(k)]);
    for (const Eigen::MatrixXd* part : {&motion.q, &motion.v, &motion.drive}) {
      for (Eigen::Index i = 0; i < part->rows(); ++i) row.push_back((*part)(i, k));
    }
    row.push_back(motion.kinetic[std::size_t(k)]);
    row.push_back(motion.stored[std::size_t(k)]);
    for (const EnergyFlow& flow : motion.flows) row.push_back(flow.work[std::size_t(k)]);
    table.append(row);
  }
  return table;
}

std::string SimulationReport::verdict() const {
  const std::string reached = io::with_digits(double(motion.steps) * scene.step, 6);
  if (motion.was_stopped) return "stopped after " + reached + " s of its motion";
  if (!motion.trouble.empty()) return "ended " + motion.trouble;
  return "simulated " + reached + " s" +
         (motion.warning.empty() ? "" : ", not to be trusted: " + motion.warning);
}

namespace {

// Of the whole, or of each mechanism.
void append_balances(io::TextTable& facts, const std::vector<MechanismBalance>& balances) {
  for (const MechanismBalance& balance : balances) {
    const std::string whose = balances.size() > 1 ? ", " + balance.name : "";
    facts.append(
        {"energy balance" + whose + " off by",
         io::scientific(balance.error) + " J of " + io::significant(balance.moved, 3) + " J that moved"});
    constexpr double kWorthAWord = 1e-3;
    if (balance.part() < kWorthAWord) continue;
    facts.append({balance.taken > 0 ? "lost by the steps" : "gained by the steps",
                  io::scientific(std::abs(balance.taken)) + " J by the end; " +
                      io::significant(100 * balance.part(), 2) + " % of what moved were missing at most"});
  }
}

ordered_json json_of(const MechanismBalance& balance) {
  return {{"error", balance.error}, {"moved", balance.moved}, {"taken_by_steps", balance.taken}};
}

ordered_json json_of(const Accuracy& accuracy) {
  ordered_json j = {{"sentence", accuracy.sentence()}};
  if (!accuracy.trouble.empty()) return j;
  for (const auto& [name, error] : {std::pair("position", &accuracy.q), {"velocity", &accuracy.v}})
    j[name] = {{"error", error->value}, {"unit", error->unit}, {"joint", error->joint}};
  j["nearby_motions"] = {{"apart", accuracy.apart}, {"part", accuracy.parts}};
  return j;
}

}  // namespace

std::string SimulationReport::text() const {
  io::TextTable facts({{"quantity"}, {"value"}});
  const double simulated = double(motion.steps) * scene.step;
  facts.append({"integrator", std::string(to_string(scene.integrator)) + ", steps of " +
                                  io::duration(scene.step) + ", " + io::with_groups(motion.steps)});
  const bool adapts = is_adaptive(scene.integrator);
  facts.append({adapts ? "one rate" : "one step", io::with_groups(long(motion.operations)) + " operations"});
  if (adapts)
    facts.append({"took", io::with_groups(motion.effort.internal_steps) + " internal steps, " +
                              io::with_groups(motion.effort.rates) + " rates, " +
                              io::with_groups(motion.effort.jacobians) + " Jacobians"});
  facts.append({"ready after", io::duration(motion.build_seconds)});
  facts.append(
      {"computed in", io::duration(motion.step_seconds) + ", " + per_second(simulated, motion.step_seconds)});
  if (motion.assembled_by > 0)
    facts.append({"start, to close loops", "moved by " + io::significant(motion.assembled_by, 3)});
  if (motion.slowed_by > 1e-12)
    facts.append(
        {"start, velocity", "changed by " + io::significant(motion.slowed_by, 3) + " to keep loops closed"});
  if (motion.loop_error > 0) facts.append({"loops open by", io::scientific(motion.loop_error) + " m or rad"});
  if (!scene.robot.constraints.rigid.empty()) {
    facts.append({"impacts", io::with_groups(motion.impacts)});
    facts.append({"passed its ground by", io::scientific(motion.deepest) + " m or rad"});
  }
  append_balances(facts, motion.balances);
  std::string text = scene.name + ": " + verdict() + "\n\n" + facts.text();
  io::TextTable flows(
      {{"energy"}, {"at the start", "J", io::Align::kRight}, {"at the end", "J", io::Align::kRight}});
  flows.append(
      {"kinetic", io::with_digits(motion.kinetic.front(), 5), io::with_digits(motion.kinetic.back(), 5)});
  flows.append(
      {"stored", io::with_digits(motion.stored.front(), 5), io::with_digits(motion.stored.back(), 5)});
  for (const EnergyFlow& flow : motion.flows)
    flows.append({"work of " + flow.name, "0", io::with_digits(flow.work.back(), 5)});
  text += "\n" + flows.text();
  if (accuracy) text += "accuracy: " + accuracy->sentence() + "\n";
  for (const std::string& note : folded(scene.notes)) text += "note: " + note + "\n";
  return text;
}

std::string SimulationReport::json() const {
  ordered_json j;
  j["scene"] = scene.name;
  j["robot"] = scene.robot.model.name;
  j["success"] = success() && unwritten.empty();
  j["verdict"] = verdict();
  j["integrator"] = to_string(scene.integrator);
  j["step"] = scene.step;
  j["steps"] = motion.steps;
  j["operations"] = motion.operations;
  if (is_adaptive(scene.integrator)) {
    j["tolerances"] = {{"relative", scene.tolerances.relative}, {"absolute", scene.tolerances.absolute}};
    j["effort"] = {{"internal_steps", motion.effort.internal_steps},
                   {"rates", motion.effort.rates},
                   {"jacobians", motion.effort.jacobians}};
  }
  j["seconds"] = {{"build", motion.build_seconds}, {"steps", motion.step_seconds}};
  if (!scene.robot.constraints.loops.empty())
    j["loops"] = {{"assembled_by", motion.assembled_by},
                  {"slowed_by", motion.slowed_by},
                  {"open_by", motion.loop_error}};
  if (!scene.robot.constraints.rigid.empty())
    j["rigid"] = {{"impacts", motion.impacts}, {"deepest", motion.deepest}};
  j["energy"] = json_of(worst_of(motion.balances));
  if (motion.balances.size() > 1) {
    for (const MechanismBalance& balance : motion.balances)
      j["energy"]["mechanisms"][balance.name] = json_of(balance);
  }
  for (const EnergyFlow& flow : motion.flows) j["energy"]["work"][flow.name] = flow.work.back();
  if (accuracy) j["accuracy"] = json_of(*accuracy);
  j["notes"] = scene.notes;
  j["sources"] = motion.sources;
  j["unwritten"] = unwritten;
  return j.dump(2) + "\n";
}

void write_results(SimulationReport& report, const std::string& folder, const std::stop_token& stop) {
  io::ResultFolder results(folder, report.unwritten);
  const SimulatedMotion& motion = report.motion;
  results.write(kMotion, [&](const std::string& path) {
    io::write_csv(path, motion_table(report.scene, motion), io::NonFinite::kAllow);
  });
  results.write(kEffective,
                [&](const std::string& path) { write_file_atomically(path, report.scene.effective); });
  for (const auto& [file, plot] :
       {std::pair(kCurves, &state_plot), {kEnergy, &energy_plot}, {kForces, &force_plot}}) {
    const io::Plot picture = plot(report.scene, motion);
    if (picture.panels.empty() || motion.was_stopped || stop.stop_requested()) {
      results.remove(file);  // of an earlier motion
      if (!picture.panels.empty() && !motion.was_stopped)
        report.unwritten.push_back(results.path(file) + ": not drawn, interrupted");
      continue;
    }
    results.write(file, [&](const std::string& path) { io::draw(picture, path, "gnuplot", stop); });
  }
  results.remove(kPlayer);  // of an earlier motion
  if (!motion.was_stopped) {
    results.write(kPlayer, [&](const std::string& path) {
      const PlayerInput player = scene_player(report.scene, motion, stop);
      if (stop.stop_requested()) throw FileError(path + ": not drawn, interrupted");
      write_player(player, path);
    });
  }
  results.write(kReport, [&](const std::string& path) { write_file_atomically(path, report.json()); });
}

std::string explain(const Scene& scene, const std::stop_token& stop) {
  std::string text = "Scene \"" + scene.name + "\" (" + scene.file + ")\n" +
                     robot_text(scene.robot, scene.urdf, scene.notes);
  const FunctionCost all = scene_cost(scene.robot, scene.evaluation, true);
  text += "\nAccelerations: " + io::with_groups(all.value.operations) + " operations, " +
          io::duration(all.value.seconds) + "; with their Jacobian " +
          io::with_groups(all.jacobian.operations) + ", " + io::duration(all.jacobian.seconds) + "\n\n";
  text += effects_text(effect_costs(scene.robot, scene.evaluation, true)) + constraints_text(scene.robot);
  text += "\nAccuracy: " + accuracy_of(scene, stop).sentence() + "\n";
  return text + "\nThe scene as it was understood:\n\n" + scene.effective;
}

}  // namespace dyntape
