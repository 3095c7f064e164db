// SPDX-License-Identifier: BSD-3-Clause
//
// How the cost of the dynamics grows with the number of bodies.
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "chains.h"
#include "measure.h"
#include "study.h"

namespace dyntape::tools {
namespace {

using dynamics::Model;

constexpr const char* kFunctions[] = {"rnea", "crba", "aba", "minverse", "id-derivatives", "fd-derivatives"};
constexpr int kFewest = 8;
constexpr int kFirstOfFit = 64;  // below, what every call costs flattens the line

double seconds_of(const Model<double>& model, const RobotFunction& function, int repeats,
                  std::uint64_t seed) {
  const auto states = random_states(model, function, 8, seed);
  detail::RobotWorkspace<double> work(model, function);
  std::vector<detail::RobotState<double>> prepared;
  for (const auto& state : states) {
    work.read(state.data());
    prepared.push_back(work.state);
  }
  return median_seconds([&](std::size_t i) { work.run(prepared[i % prepared.size()]); }, repeats);
}

}  // namespace

Study outline_of_slopes() {
  Study study{.name = "slopes",
              .title = "How the cost of the dynamics grows with the robot",
              .question = "What do twice as many bodies cost?"};
  study.parts = {{.name = "time",
                  .title = "Time of one evaluation in plain double",
                  .x = StudyPart::kParameter,
                  .x_label = "bodies",
                  .y_label = "time [us]"}};
  return study;
}

Study study_slopes(const StudyOptions& options) {
  Study study = outline_of_slopes();
  const int largest = options.quick ? 128 : 1024;
  for (auto make : {chain, binary_tree}) {
    const std::string shape = make(1).name;
    for (const char* name : kFunctions) {
      options.watch(shape + ", " + name);
      std::vector<double> sizes, seconds;
      for (int bodies = kFewest; bodies <= largest; bodies *= 2) {
        sizes.push_back(bodies);
        seconds.push_back(seconds_of(make(bodies), RobotFunction(name), options.quick ? 1 : 9, options.seed));
        study.rows.push_back({"time", shape, name, sizes.back(), seconds.back(), seconds.back() * 1e6});
      }
      study.parts[0].findings.push_back(
          shape + ", " + name + ": slope " + io::significant(fitted_slope(sizes, seconds, kFirstOfFit), 3) +
          ", " + io::duration(seconds.front()) + " for " + std::to_string(kFewest) + " bodies, " +
          io::duration(seconds.back()) + " for " + std::to_string(largest) + ".");
    }
  }
  study.methods = {
      "Chains and binary trees of revolute joints; the algorithms as templates on double, nothing compiled "
      "at run time.",
      "Slopes are those of log time over log bodies by least squares, from " + std::to_string(kFirstOfFit) +
          " bodies on; below, what every call costs flattens the line."};
  study.left_out = {
      "Compiled functions: code without loops grows as the slopes of operations do (study compile)."};
  return study;
}

}  // namespace dyntape::tools
