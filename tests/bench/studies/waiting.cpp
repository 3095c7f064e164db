// SPDX-License-Identifier: BSD-3-Clause
#include "waiting.h"

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/system/process.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_functions.h>

#include "measure.h"
#include "model_json.h"

namespace dyntape::tools {
namespace {

const RobotFunction kFunction = RobotFunction::kFdDerivatives;

struct Subject {
  std::string label, file;
  dynamics::UrdfOptions options;
};

std::vector<Subject> subjects(bool quick) {
  std::vector<Subject> all = {
      {"arm (7 joints)", "panda.urdf", {.lock = {"panda_finger_joint1", "panda_finger_joint2"}}},
      {"quadruped (18 degrees of freedom)", "solo12.urdf", {.base = dynamics::Base::kFloating}},
      {"humanoid (35 degrees of freedom)", "simple_humanoid.urdf", {.base = dynamics::Base::kFloating}}};
  if (quick) all.resize(1);
  return all;
}

// A way to evaluate: what it is called, the options that choose it.
struct Way {
  std::string name;
  Route route = Route::kCompiled;
  std::vector<std::string> flags = {};
};

const std::vector<Way>& ways() {
  static const std::vector<Way> all = {
      {"interpreter", Route::kInterpreter},   {"machine code", Route::kMachineCode},
      {"gcc -O0", Route::kCompiled, {"-O0"}}, {"gcc -O1", Route::kCompiled, {"-O1"}},
      {"gcc -O2", Route::kCompiled, {"-O2"}}, {"gcc -O3", Route::kCompiled, {"-O3"}}};
  return all;
}

StudyRow measure(const Function& recorded, const Way& way, const std::vector<Eigen::VectorXd>& states) {
  CodegenOptions options;
  options.order = Order::kValue;
  options.route = way.route;
  options.flags = way.flags;
  options.use_cache = false;
  std::vector<double> y(recorded.n_y());
  const auto start = std::chrono::steady_clock::now();
  const CompiledFunction function = CompiledFunction::make(recorded, options);
  CompiledFunction::Workspace workspace(function);
  function.value(states[0].data(), nullptr, y.data(), workspace);
  StudyRow row{.part = "waiting", .subject = "", .method = way.name};
  row.value = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  row.seconds = median_seconds(
      [&](std::size_t i) { function.value(states[i % states.size()].data(), nullptr, y.data(), workspace); });
  if (function.route() != way.route) row.trouble = std::string("is ") + to_string(function.route()) + " here";
  return row;
}

// CasADi with its own jit, in a folder that is removed.  `why`: what is missing.
std::vector<StudyRow> measure_casadi(const dynamics::Model<double>& model, bool quick, std::string& why) {
  namespace fs = std::filesystem;
  const std::string python = DYNTAPE_PEERS_FOLDER "/bin/python";
  if (access(python.c_str(), X_OK) != 0)
    return why = "no CasADi: tests/bench/run installs it", std::vector<StudyRow>{};
  const fs::path folder = fs::temp_directory_path() / ("dyntape_casadi_jit_" + std::to_string(getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "robot.json") << model_json(model);
  codegen::Command command;
  command.arguments = {"/usr/bin/env",
                       "-C",
                       folder,
                       python,
                       DYNTAPE_BENCH_FOLDER "/peers/casadi_jit.py",
                       folder / "robot.json",
                       "fd-derivatives",
                       quick ? "-O0" : "-O0,-O1,-O3"};
  const codegen::Outcome done = codegen::run_all({command}, {1, 1800.0})[0];
  fs::remove_all(folder);
  std::vector<StudyRow> rows;
  std::istringstream lines(done.output);
  for (std::string line; std::getline(lines, line);) {
    const auto said = nlohmann::json::parse(line, nullptr, false);
    if (!said.is_object()) continue;
    rows.push_back(
        {.part = "waiting", .subject = "", .method = "CasADi jit " + said["flags"].get<std::string>()});
    rows.back().seconds = said["evaluate_s"], rows.back().value = said["made_s"];
  }
  if (rows.empty()) why = "no CasADi: " + done.output.substr(0, 200);
  return rows;
}

// "after N evaluations", when `row` has paid for what it takes longer to make than `other`.
std::string paid(const StudyRow& row, const StudyRow& other) {
  const double later = row.value - other.value, gain = other.seconds - row.seconds;
  if (gain <= 0) return "never";
  return later <= 0 ? "at once"
                    : "after " + io::with_groups((long long)std::ceil(later / gain)) + " evaluations";
}

}  // namespace

StudyPart outline_of_waiting() {
  return {.name = "waiting",
          .title = "Derivatives of forward dynamics: the wait for each way to evaluate",
          .x_label = "time of one evaluation [us]",
          .y_label = "from the recording to the first result [s]",
          .x_scale = 1e6,
          .mark = io::Mark::kPoints};
}

void study_waiting(Study& study, StudyPart& part, const StudyOptions& options) {
  std::string why;
  for (const Subject& subject : subjects(options.quick)) {
    const dynamics::Model<double> model =
        dynamics::load_urdf(options.config + "/robots/" + subject.file, subject.options);
    const Function recorded = record_robot_function(model, kFunction);
    const std::vector<Eigen::VectorXd> states = random_states(model, kFunction, 16, options.seed);
    std::vector<StudyRow> rows;
    for (const Way& way : ways()) {
      options.watch(subject.label + ", " + way.name);
      rows.push_back(measure(recorded, way, states));
    }
    options.watch(subject.label + ", CasADi jit");
    for (const StudyRow& row : measure_casadi(model, options.quick, why)) rows.push_back(row);
    const StudyRow interpreter = rows[0], machine = rows[1];
    for (StudyRow& row : rows) {
      row.subject = subject.label;
      study.rows.push_back(row);
      std::string said = row.method + ": there after " + io::duration(row.value) + ", " +
                         io::duration(row.seconds) + " an evaluation";
      if (row.method == machine.method) said += "; has paid over the interpreter " + paid(row, interpreter);
      if (&row > &rows[1])
        said += "; has paid over the interpreter " + paid(row, interpreter) + ", over machine code " +
                paid(row, machine);
      part.findings.push_back(subject.label + ", " + said + ".");
    }
  }
  if (!why.empty()) study.left_out.push_back(why + ".");
}

}  // namespace dyntape::tools
