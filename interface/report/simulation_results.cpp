// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/report/simulation_results.h>

#include <cmath>
#include <tuple>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/scene/folded_notes.h>
#include <dyntape/interface/files/scene/start_notes.h>
#include <dyntape/interface/io/facts.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/result_folder.h>
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
  io::CsvColumns table;
  table.add("t", motion.t);
  table.add(entry_names(scene.robot.model, "q"), motion.q);
  table.add(entry_names(scene.robot.model, "v"), motion.v);
  std::vector<std::string> torques = driven_names(scene.robot);
  for (std::string& name : torques) name = "tau." + name;
  table.add(torques, motion.drive);
  table.add("energy.kinetic", motion.kinetic);
  table.add("energy.stored", motion.stored);
  for (const EnergyFlow& flow : motion.flows) table.add("work." + word_of(flow), flow.work);
  return table.table();
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
void say_balances(io::Facts& facts, const std::vector<MechanismBalance>& balances) {
  for (const MechanismBalance& balance : balances) {
    const std::string whose = balances.size() > 1 ? ", " + balance.name : "";
    facts.say("energy balance" + whose + " off by",
              io::scientific(balance.error) + " J of " + io::significant(balance.moved, 3) + " J that moved");
    constexpr double kWorthAWord = 1e-3;
    if (balance.part() < kWorthAWord) continue;
    facts.say(balance.taken > 0 ? "lost by the steps" : "gained by the steps",
              io::scientific(std::abs(balance.taken)) + " J by the end; " +
                  io::significant(100 * balance.part(), 2) + " % of what moved were missing at most");
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

void tell_steps(const SimulationReport& report, io::Facts& facts) {
  const auto& [scene, motion] = std::tie(report.scene, report.motion);
  const double simulated = double(motion.steps) * scene.step;
  facts["scene"] = scene.name;
  facts["robot"] = scene.robot.model.name;
  facts["success"] = report.success() && report.unwritten.empty();
  facts["verdict"] = report.verdict();
  facts.say("integrator", std::string(to_string(scene.integrator)) + ", steps of " +
                              io::duration(scene.step) + ", " + io::with_groups(motion.steps));
  facts["integrator"] = to_string(scene.integrator);
  facts["step"] = scene.step;
  facts["steps"] = motion.steps;
  const bool adapts = is_adaptive(scene.integrator);
  facts.say(adapts ? "one rate" : "one step", io::with_groups(long(motion.operations)) + " operations");
  facts["operations"] = motion.operations;
  if (adapts) {
    const auto& [internal, rates, jacobians] = motion.effort;
    facts.say("took", io::with_groups(internal) + " internal steps, " + io::with_groups(rates) + " rates, " +
                          io::with_groups(jacobians) + " Jacobians");
    facts["tolerances"] = {{"relative", scene.tolerances.relative}, {"absolute", scene.tolerances.absolute}};
    facts["effort"] = {{"internal_steps", internal}, {"rates", rates}, {"jacobians", jacobians}};
  }
  facts.say("ready after", io::duration(motion.build_seconds));
  facts.say("computed in",
            io::duration(motion.step_seconds) + ", " + per_second(simulated, motion.step_seconds));
  facts["seconds"] = {{"build", motion.build_seconds}, {"steps", motion.step_seconds}};
}

void tell_constraints(const SimulationReport& report, io::Facts& facts) {
  const SimulatedMotion& motion = report.motion;
  if (motion.assembled_by > 0)
    facts.say("start, to close loops", "moved by " + io::significant(motion.assembled_by, 3));
  if (motion.slowed_by > 1e-12)
    facts.say("start, velocity",
              "changed by " + io::significant(motion.slowed_by, 3) + " to keep loops closed");
  if (motion.loop_error > 0) facts.say("loops open by", io::scientific(motion.loop_error) + " m or rad");
  if (!report.scene.robot.constraints.loops.empty())
    facts["loops"] = {{"assembled_by", motion.assembled_by},
                      {"slowed_by", motion.slowed_by},
                      {"open_by", motion.loop_error}};
  if (report.scene.robot.constraints.rigid.empty()) return;
  facts.say("impacts", io::with_groups(motion.impacts));
  facts.say("passed its ground by", io::scientific(motion.deepest) + " m or rad");
  facts["rigid"] = {{"impacts", motion.impacts}, {"deepest", motion.deepest}};
}

void tell_energy(const SimulatedMotion& motion, io::Facts& facts) {
  say_balances(facts, motion.balances);
  ordered_json& energy = facts["energy"];
  energy = json_of(worst_of(motion.balances));
  if (motion.balances.size() > 1) {
    for (const MechanismBalance& balance : motion.balances)
      energy["mechanisms"][balance.name] = json_of(balance);
  }
  io::TextTable flows(
      {{"energy"}, {"at the start", "J", io::Align::kRight}, {"at the end", "J", io::Align::kRight}});
  for (const auto& [name, values] : {std::pair("kinetic", &motion.kinetic), {"stored", &motion.stored}})
    flows.append({name, io::with_digits(values->front(), 5), io::with_digits(values->back(), 5)});
  for (const EnergyFlow& flow : motion.flows) {
    flows.append({"work of " + flow.name, "0", io::with_digits(flow.work.back(), 5)});
    energy["work"][flow.name] = flow.work.back();
  }
  facts.below("\n" + flows.text());
}

io::Facts facts_of(const SimulationReport& report) {
  io::Facts facts(report.scene.name + ": " + report.verdict());
  tell_steps(report, facts);
  tell_constraints(report, facts);
  tell_energy(report.motion, facts);
  if (report.accuracy) {
    facts.below("accuracy: " + report.accuracy->sentence() + "\n");
    facts["accuracy"] = json_of(*report.accuracy);
  }
  const std::vector<std::string> notes = notes_of(report.scene);
  for (const std::string& note : folded(notes)) facts.below("note: " + note + "\n");
  facts["notes"] = notes;
  facts["sources"] = report.motion.sources;
  facts["unwritten"] = report.unwritten;
  return facts;
}

}  // namespace

std::string SimulationReport::text() const { return facts_of(*this).text(); }
std::string SimulationReport::json() const { return facts_of(*this).json(); }

void write_results(SimulationReport& report, const std::string& folder, const std::stop_token& stop) {
  io::ResultFolder results(folder, report.unwritten);
  const SimulatedMotion& motion = report.motion;
  results.write_table(kMotion, motion_table(report.scene, motion));
  results.write_text(kEffective, report.scene.effective);
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
  results.write_text(kReport, report.json());
}

std::string explain(const Scene& scene, const std::stop_token& stop) {
  std::string text = "Scene \"" + scene.name + "\" (" + scene.file + ")\n" +
                     robot_text(scene.robot, scene.urdf, notes_of(scene));
  const FunctionCost all = scene_cost(scene.robot, scene.evaluation, true);
  text += "\nAccelerations: " + io::with_groups(all.value.operations) + " operations, " +
          io::duration(all.value.seconds) + "; with their Jacobian " +
          io::with_groups(all.jacobian.operations) + ", " + io::duration(all.jacobian.seconds) + "\n\n";
  text += effects_text(effect_costs(scene.robot, scene.evaluation, true)) + constraints_text(scene.robot);
  text += "\nAccuracy: " + accuracy_of(scene, stop).sentence() + "\n";
  return text + "\nThe scene as it was understood:\n\n" + scene.effective;
}

}  // namespace dyntape
