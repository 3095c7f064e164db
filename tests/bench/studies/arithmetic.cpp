// SPDX-License-Identifier: BSD-3-Clause
//
// What a number's digits buy, and what they cost: the same functions in every arithmetic there is.
#include <algorithm>
#include <cmath>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/packs/packed_robot.h>

#include "bench_lanes.h"
#include "chains.h"
#include "measure.h"
#include "study.h"
#include "wide_scalars.h"

namespace dyntape::tools {
namespace {

using dynamics::Float128;
using dynamics::Model;
using Eigen::VectorXd;
using States = std::vector<VectorXd>;

constexpr const char* kAll[] = {"float, 24 bits", "double, 53 bits", "long double, 64 bits", "113 bits"};
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kLost = 1;  // an error as large as what is wanted

struct Case {
  std::string label;
  Model<double> model;
  Wanted wanted;

  RobotFunction function() const {
    return RobotFunction(wanted == Wanted::kAccelerations ? "aba" : "fd-derivatives");
  }
};

template <class T>
std::vector<std::vector<Exact>> results(const Case& of, const States& states) {
  InScalar<T> in(of.model, of.wanted);
  std::vector<std::vector<Exact>> all;
  for (const VectorXd& state : states) in.run(state), all.push_back(in.result());
  return all;
}

// The median over the states; NaN where one of them is.
double median_error(const std::vector<std::vector<Exact>>& expected,
                    const std::vector<std::vector<Exact>>& got) {
  std::vector<double> errors;
  for (std::size_t i = 0; i < expected.size(); ++i) errors.push_back(error_of(expected[i], got[i]));
  for (double error : errors)
    if (std::isnan(error)) return error;
  return median(errors);
}

// What the templates give in each scalar, against 50 digits.  visit(name, error, run state i)
template <class Visit>
void for_each_scalar(const Case& of, const States& states, Visit&& visit) {
  const auto expected = results<Exact>(of, states);
  const auto one = [&]<class T>(const char* name, T) {
    const double error = median_error(expected, results<T>(of, states));
    InScalar<T> in(of.model, of.wanted);
    visit(name, error, [&](std::size_t i) { in.run(states[i % states.size()]); });
  };
  one(kAll[0], float()), one(kAll[1], double());
  one(kAll[2], static_cast<long double>(0)), one(kAll[3], Float128());
}

// --- Time -------------------------------------------------------------------------------------------------

void measure_generated(Study& study, const Case& of, const States& states,
                       const std::vector<std::vector<double>>& expected, int repeats) {
  const Function recorded = record_robot_function(of.model, of.function());
  const std::vector<RobotBlock> blocks = outputs(of.model, of.function());
  CodegenOptions options;
  options.order = Order::kValue, options.route = Route::kCompiled;
  const CompiledFunction f = CompiledFunction::make(recorded, options);
  CompiledFunction::Workspace workspace(f);
  std::vector<double> y(f.n_y()), errors;
  for (std::size_t i = 0; i < states.size(); ++i) {
    f.value(states[i].data(), nullptr, y.data(), workspace);
    errors.push_back(relative_error(expected[i], y.data(), blocks));
  }
  StudyRow row{"generated", of.label, "generated", double(f.operations(Order::kValue)), 0, median(errors)};
  row.seconds = median_seconds(
      [&](std::size_t i) { f.value(states[i % states.size()].data(), nullptr, y.data(), workspace); },
      repeats);
  study.rows.push_back(row);
  row.part = "time", study.rows.push_back(row);
  for (const LaneRow& lane : measure_lanes(of.model, of.function(), states, expected)) {
    if (lane.name == "the same, kept in lanes") continue;
    study.rows.push_back(
        {"generated", of.label, lane.name, double(lane.operations), lane.seconds, lane.error});
  }
}

void measure_packs(Study& study, const Case& of, const States& states,
                   const std::vector<std::vector<double>>& expected, int repeats) {
  const std::vector<RobotBlock> blocks = outputs(of.model, of.function());
  for (int lanes : {4, 8}) {
    PackedRobot packed(of.model, of.function(), lanes);
    std::vector<double> x, y(packed.n_out() * states.size()), errors;
    for (const VectorXd& state : states) x.insert(x.end(), state.begin(), state.end());
    packed.evaluate(x.data(), states.size(), y.data());
    for (std::size_t i = 0; i < states.size(); ++i)
      errors.push_back(relative_error(expected[i], &y[i * packed.n_out()], blocks));
    StudyRow row{"time", of.label, "packs of " + std::to_string(lanes), kNone, 0, median(errors)};
    row.seconds =
        median_seconds([&](std::size_t) { packed.evaluate(x.data(), states.size(), y.data()); }, repeats) /
        double(states.size());
    study.rows.push_back(row);
  }
}

void measure_times(Study& study, const Case& of, const StudyOptions& options) {
  options.watch(of.label);
  const int repeats = options.quick ? 1 : 9;
  const States states = random_states(of.model, of.function(), 8, options.seed);
  for_each_scalar(of, states, [&](const char* name, double error, const auto& run) {
    study.rows.push_back({"time", of.label, name, kNone, median_seconds(run, repeats), error});
  });
  std::vector<std::vector<double>> expected;
  for (const VectorXd& state : states) expected.push_back(reference(of.model, of.function(), state));
  measure_packs(study, of, states, expected, repeats);
  measure_generated(study, of, states, expected, repeats);
}

// --- Sweeps -----------------------------------------------------------------------------------------------

void add_errors(Study& study, const std::string& part, const Case& of, double parameter,
                const StudyOptions& options) {
  const States states = random_states(of.model, of.function(), options.quick ? 1 : 3, options.seed);
  for_each_scalar(of, states, [&](const char* name, double error, const auto&) {
    StudyRow row{part, of.label, name, parameter, kNone, error};
    if (!std::isfinite(error)) row.value = kNone, row.trouble = "is not finite";
    study.rows.push_back(row);
  });
}

void measure_chains(Study& study, const StudyOptions& options) {
  const Wanted both[] = {Wanted::kAccelerations, Wanted::kDerivatives};
  for (Wanted wanted : both) {
    const bool values = wanted == Wanted::kAccelerations;
    const int longest = options.quick ? 100 : values ? 1000 : 300;
    for (int bodies : {1, 3, 10, 30, 100, 300, 1000}) {
      if (bodies > longest || (!values && bodies > 30 && options.quick)) continue;
      options.watch("chain of " + std::to_string(bodies));
      add_errors(study, "chain", {values ? "accelerations" : "their derivatives", chain(bodies), wanted},
                 bodies, options);
    }
  }
}

// Seven bodies, the last `ratio` times as heavy as the others, with its inertia.
void measure_ratios(Study& study, const StudyOptions& options) {
  for (int decade = 0; decade <= 12; decade += options.quick ? 6 : 1) {
    options.watch("mass ratio 1e" + std::to_string(decade));
    for (bool heavy : {true, false}) {
      const double ratio = std::pow(10, decade), factor = heavy ? ratio : 1 / ratio;
      Model<double> model = chain(7);
      model.inertias.back().mass *= factor;
      model.inertias.back().I_c *= factor;
      const std::string label = heavy ? "heavy last body" : "light last body";
      add_errors(study, "ratio", {label, model, Wanted::kAccelerations}, ratio, options);
      add_errors(study, "ratio", {label + ", derivatives", model, Wanted::kDerivatives}, ratio, options);
    }
  }
}

// --- What is to be seen -----------------------------------------------------------------------------------

std::string told(const StudyRow& row) {
  return io::scientific(row.value) + " in " + io::duration(row.seconds);
}

std::string times_told(const Study& study, const std::string& label) {
  const StudyRow& plain = point(study, "time", label, kAll[1]);
  std::string text = label + ": double " + told(plain);
  for (const char* name : {kAll[0], kAll[2], kAll[3]}) {
    const StudyRow& row = point(study, "time", label, name);
    text += std::string(", ") + name + " " + told(row) + " (" +
            io::significant(row.seconds / plain.seconds, 2) + " times)";
  }
  return text + ".";
}

std::string generated_told(const Study& study, const std::string& label) {
  std::string text = label + ": ";
  for (const StudyRow& row : study.rows) {
    if (row.part != "generated" || row.subject != label) continue;
    text += (text.back() == ' ' ? "" : "; ") + row.method.substr(row.method.find(' ') + 1) + " " + told(row);
  }
  return text + " a state; packs of 8 " + told(point(study, "time", label, "packs of 8")) + ".";
}

std::string sweep_told(const Study& study, const std::string& part, const std::string& subject,
                       const std::string& unit) {
  std::string text = subject + ": ";
  for (const char* name : kAll) {
    const std::vector<StudyRow> rows = curve(study, part, subject, name);
    const auto lost =
        std::find_if(rows.begin(), rows.end(), [](const StudyRow& row) { return !(row.value < kLost); });
    const auto ends =
        std::find_if(rows.rbegin(), rows.rend(), [](const StudyRow& row) { return row.value < kLost; });
    text += std::string(name) + " " + io::scientific(rows.front().value) + " at " +
            io::shortest(rows.front().parameter);
    if (ends != rows.rend() && ends->parameter > rows.front().parameter)
      text += ", " + io::scientific(ends->value) + " at " + io::shortest(ends->parameter);
    if (lost != rows.end()) text += ", nothing left at " + io::shortest(lost->parameter);
    text += name == kAll[3] ? " " + unit + "." : "; ";
  }
  return text;
}

}  // namespace

Study outline_of_arithmetic() {
  Study study{.name = "arithmetic",
              .title = "Arithmetic: digits, and what they cost",
              .question = "In which numbers should dynamics be computed?"};
  study.parts = {{.name = "time",
                  .title = "Forward dynamics and its derivatives in every arithmetic",
                  .x_label = "time of one state [us]",
                  .y_label = "relative error [1]",
                  .x_scale = 1e6,
                  .mark = io::Mark::kPoints},
                 {.name = "generated",
                  .title = "Generated code: one state and lanes",
                  .x_label = "time of one state [us]",
                  .y_label = "relative error [1]",
                  .x_scale = 1e6,
                  .mark = io::Mark::kPoints},
                 {.name = "chain",
                  .title = "Digits are lost along a chain of bodies",
                  .x = StudyPart::kParameter,
                  .x_label = "bodies",
                  .y_label = "relative error [1]"},
                 {.name = "ratio",
                  .title = "Digits by the ratio of masses: seven bodies",
                  .x = StudyPart::kParameter,
                  .x_label = "ratio of masses [1]",
                  .y_label = "relative error [1]"}};
  return study;
}

Study study_arithmetic(const StudyOptions& options) {
  Study study = outline_of_arithmetic();
  const std::string robots = options.config + "/robots/";
  const Model<double> pendulum = dynamics::load_urdf(robots + "pendulum.urdf");
  const Model<double> arm =
      dynamics::load_urdf(robots + "panda.urdf", {.lock = {"panda_finger_joint1", "panda_finger_joint2"}});
  const Model<double> quadruped =
      dynamics::load_urdf(robots + "solo12.urdf", {.base = dynamics::Base::kFloating});
  std::vector<Case> cases = {{"pendulum", pendulum, Wanted::kAccelerations},
                             {"arm", arm, Wanted::kAccelerations},
                             {"quadruped", quadruped, Wanted::kAccelerations},
                             {"pendulum, derivatives", pendulum, Wanted::kDerivatives}};
  if (!options.quick) {
    cases.push_back({"arm, derivatives", arm, Wanted::kDerivatives});
    cases.push_back({"quadruped, derivatives", quadruped, Wanted::kDerivatives});
  }
  for (const Case& of : cases) measure_times(study, of, options);
  measure_chains(study, options);
  measure_ratios(study, options);

  for (const Case& of : cases) {
    study.parts[0].findings.push_back(times_told(study, of.label));
    study.parts[1].findings.push_back(generated_told(study, of.label));
  }
  for (const char* subject : {"accelerations", "their derivatives"})
    study.parts[2].findings.push_back(sweep_told(study, "chain", subject, "bodies"));
  for (const char* subject :
       {"heavy last body", "heavy last body, derivatives", "light last body", "light last body, derivatives"})
    study.parts[3].findings.push_back(sweep_told(study, "ratio", subject, "times the mass"));
  study.methods = {
      "Float, double, 64 bits (x87) and 113 bits (software): the same templates, compiled with dyntape, "
      "against "
      "the same in 50 digits of another library (cpp_bin_float of Boost). Generated code and packs: against "
      "113 "
      "bits rounded to double, so that they show at least half a unit of double.",
      "Errors are the largest difference over the largest entry, of derivatives for generated code and packs "
      "block by block; medians over 8 random states, the worst of them where functions are portable or in "
      "lanes, in the sweeps over 3.",
      "Packs and lanes evaluate 8 states in a call; their time is that of one of them. The parameter of "
      "generated code in the table is its number of operations."};
  study.left_out = {"Double-double: dyntape has no such scalar, and Boost 1.74 none either.",
                    "Contraction by the compiler: generated code is always compiled with -ffp-contract=off."};
  return study;
}

}  // namespace dyntape::tools
