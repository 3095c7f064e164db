// SPDX-License-Identifier: BSD-3-Clause
//
// What accuracy costs in time, for every route to the derivatives of forward dynamics.
#include <algorithm>
#include <chrono>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_evaluator.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "bench_lanes.h"
#include "measure.h"
#include "other_routes.h"
#include "study.h"

namespace dyntape::tools {
namespace {

struct Subject {
  std::string label;
  dynamics::Model<double> model;
};

const RobotFunction kFunction = RobotFunction::kFdDerivatives;

std::vector<Subject> subjects(const std::string& folder) {
  using dynamics::load_urdf;
  const std::string robots = folder + "/robots/";
  return {{"pendulum", load_urdf(robots + "pendulum.urdf")},
          {"arm (7 joints)",
           load_urdf(robots + "panda.urdf", {.lock = {"panda_finger_joint1", "panda_finger_joint2"}})},
          {"quadruped (18 degrees of freedom)",
           load_urdf(robots + "solo12.urdf", {.base = dynamics::Base::kFloating})}};
}

// Routes to the derivatives of one robot at random states.
class Routes {
 public:
  Routes(const Subject& subject, const StudyOptions& options)
      : robot_(subject),
        states_(random_states(subject.model, kFunction, options.quick ? 3 : 20, options.seed)),
        repeats_(options.quick ? 3 : 15) {
    for (const auto& state : states_) expected_.push_back(reference(robot_.model, kFunction, state));
  }

  // Median over the states of the error; time of one evaluation.
  template <class Evaluate>
  void add(Study& study, const std::string& route, double step, Evaluate&& evaluate) const {
    std::vector<double> errors, by_q, result(expected_[0].size());
    const std::vector<RobotBlock> blocks = outputs(robot_.model, kFunction);
    for (std::size_t i = 0; i < states_.size(); ++i) {
      evaluate(states_[i], result.data());
      errors.push_back(relative_error(expected_[i], result.data(), blocks));
      by_q.push_back(relative_error(expected_[i], result.data(), {blocks.front()}));
    }
    StudyRow row{"time", robot_.label, route, step};
    row.value = median(errors);
    row.seconds = median_seconds([&](std::size_t i) { evaluate(states_[i % states_.size()], result.data()); },
                                 repeats_);
    study.rows.push_back(row);
    row.part = "step", row.value = median(by_q);
    if (!std::isnan(step)) study.rows.push_back(row);
  }

  void add_route(Study& study, RobotRoute route, double step) const {
    RobotEvaluatorOptions evaluator;
    if (!std::isnan(step)) evaluator.step = step;
    RobotEvaluator evaluate(robot_.model, kFunction, route, evaluator);
    add(study, to_string(route), step,
        [&](const Eigen::VectorXd& state, double* result) { evaluate.evaluate(state.data(), result); });
  }

  // The analytic code in single precision.
  void add_float(Study& study) const {
    const dynamics::Model<float> narrow = robot_.model.cast<float>();
    detail::RobotWorkspace<float> work(narrow, kFunction);
    Eigen::VectorXf x;
    std::vector<float> y(expected_[0].size());
    add(study, "analytic, float", kNone, [&](const Eigen::VectorXd& state, double* result) {
      x = state.cast<float>();
      work.evaluate(x.data(), y.data());
      std::copy(y.begin(), y.end(), result);
    });
  }

  void add_others(Study& study, bool quick) const {
    for (int k = -10; k <= -2; k += quick ? 4 : 1) {
      const double step = std::pow(10.0, 0.5 * k);
      ByFourthOrder fourth(robot_.model, step);
      add(study, "fd-fourth-order", step,
          [&](const Eigen::VectorXd& state, double* result) { fourth.evaluate(state, result); });
    }
    ByJets jets(robot_.model);
    add(study, "jets", kNone,
        [&](const Eigen::VectorXd& state, double* result) { jets.evaluate(state, result); });
    try {
      ByComplexStep complex(robot_.model);
      add(study, "complex step", kNone,
          [&](const Eigen::VectorXd& state, double* result) { complex.evaluate(state, result); });
    } catch (const ArgumentError& refused) {
      study.rows.push_back(
          {.part = "time", .subject = robot_.label, .method = "complex step", .trouble = refused.what()});
    }
  }

  // Generated kernels of several states at once, a state's share.
  void add_lanes(Study& study) const {
    for (const LaneRow& lanes : measure_lanes(robot_.model, kFunction, states_, expected_)) {
      const bool kept = lanes.name.find("kept") != std::string::npos;
      if (!kept && lanes.name.find("lanes") == std::string::npos) continue;  // one after the other
      study.rows.push_back({"time", robot_.label,
                            kept ? "generated, states kept in lanes" : "generated, lanes", kNone,
                            lanes.seconds, lanes.error});
    }
  }

  // Calls after which making a library has paid, over the analytic code and over the tape.
  std::string break_even(const Study& study) const {
    RobotEvaluatorOptions cold;
    cold.codegen.use_cache = false;
    const auto start = std::chrono::steady_clock::now();
    const RobotEvaluator made(robot_.model, kFunction, RobotRoute::kGenerated, cold);
    const double making = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const auto seconds = [&](const char* route) { return point(study, "time", robot_.label, route).seconds; };
    const auto calls = [&](const char* route) {
      const double gain = seconds(route) - seconds("generated");
      return gain > 0 ? io::with_groups((long long)(std::ceil(making / gain))) : "never";
    };
    return robot_.label + ": a library is made in " + io::duration(making) + " and has paid after " +
           calls("analytic") + " evaluations over the analytic code, " + calls("tape") + " over the tape.";
  }

  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();  // no step

 private:
  const Subject& robot_;
  std::vector<Eigen::VectorXd> states_;
  std::vector<std::vector<double>> expected_;
  int repeats_;
};

// The most accurate point of a route.
StudyRow best(const Study& study, const std::string& subject, const std::string& route,
              const std::string& part = "time") {
  const std::vector<StudyRow> rows = curve(study, part, subject, route);
  return *std::min_element(rows.begin(), rows.end(),
                           [](const StudyRow& a, const StudyRow& b) { return a.value < b.value; });
}

}  // namespace

Study outline_of_routes() {
  Study study{.name = "routes",
              .title = "Routes to derivatives: error against time",
              .question = "What do more digits of the derivatives of forward dynamics cost?"};
  study.parts = {{.name = "step",
                  .title = "Differences: no step is good enough",
                  .x = StudyPart::kParameter,
                  .x_label = "step [rad, m]",
                  .y_label = "relative error of d FD/dq [1]"},
                 {.name = "time",
                  .title = "Derivatives of forward dynamics: error against 113 bits",
                  .x_label = "time of one evaluation [us]",
                  .y_label = "relative error [1]",
                  .x_scale = 1e6,
                  .mark = io::Mark::kPoints}};
  return study;
}

Study study_routes(const StudyOptions& options) {
  Study study = outline_of_routes();
  const std::vector<Subject> robots = subjects(options.config);
  std::vector<std::string> paid;
  for (const Subject& subject : robots) {
    const Routes routes(subject, options);
    for (RobotRoute route : {RobotRoute::kFdForward, RobotRoute::kFdCentral}) {
      options.watch(subject.label + ", " + to_string(route));
      for (int k = -24; k <= -2; k += options.quick ? 3 : 1)
        routes.add_route(study, route, std::pow(10.0, 0.5 * k));
    }
    for (RobotRoute route : {RobotRoute::kAnalytic, RobotRoute::kTape, RobotRoute::kGenerated}) {
      options.watch(subject.label + ", " + to_string(route));
      routes.add_route(study, route, Routes::kNone);
    }
    routes.add_float(study);
    options.watch(subject.label + ", jets, complex step, fourth order");
    routes.add_others(study, options.quick);
    routes.add_lanes(study);
    paid.push_back(routes.break_even(study));
  }
  for (const Subject& subject : robots) {
    const auto told = [&](const std::string& route) {
      const StudyRow row = best(study, subject.label, route);
      return route + " " + io::scientific(row.value) + " in " + io::duration(row.seconds);
    };
    study.parts[1].findings.push_back(subject.label + ": " + told("fd-forward") + ", " + told("fd-central") +
                                      ", " + told("fd-fourth-order") + ", " + told("jets") + ", " +
                                      told("analytic, float") + ", " + told("analytic") + ", " +
                                      told("tape") + ", " + told("generated") + ".");
    const auto floor = [&](const std::string& route) {
      const StudyRow row = best(study, subject.label, route, "step");
      return io::scientific(row.value) + " with a step of " + io::scientific(row.parameter);
    };
    study.parts[0].findings.push_back(subject.label + ": d FD/dq is never nearer than " +
                                      floor("fd-forward") + " by forward differences, " +
                                      floor("fd-central") + " by central ones, " + floor("fd-fourth-order") +
                                      " by those of fourth order; nobody knows that step beforehand.");
  }
  study.parts[1].findings.insert(study.parts[1].findings.end(), paid.begin(), paid.end());
  study.left_out = {
      "The sparse and the reverse sweep of the tape: both blocks by q and v of a robot are nearly full, and "
      "there are "
      "fewer results than variables by three only."};
  study.methods = {
      "Errors are relative to the largest entry of a block, medians over random states, against the analytic "
      "code in 113 "
      "bits; times are of one state, repeated.",
      "Differences move configurations along their tangents, so that quaternions stay of unit length."};
  return study;
}

}  // namespace dyntape::tools
