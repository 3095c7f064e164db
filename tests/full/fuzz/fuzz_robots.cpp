// SPDX-License-Identifier: BSD-3-Clause
#include "fuzz_robots.h"

#include <algorithm>

#include <dyntape/dynamics/algorithms/inertia_condition.h>
#include <dyntape/interface/robot/robot_evaluator.h>
#include <dyntape/interface/robot/robot_rows.h>

#include "dynamics/random_robots.h"
#include "measure.h"

namespace dyntape::testing {
namespace {

constexpr const char* kFunctions[] = {"rnea", "crba", "aba", "minverse", "id-derivatives", "fd-derivatives"};

dynamics::Model<double> robot_of(std::uint64_t seed, int most_joints) {
  dynamics::Random random(seed);
  return dynamics::random_tree(random, {.joints = 1 + random.below(most_joints),
                                        .base = seed % 2 ? dynamics::Base::kFloating : dynamics::Base::kFixed,
                                        .chain = seed % 5 == 0,
                                        .inner_free_flyers = seed % 7 == 0});
}

bool solves(const std::string& name) {
  return name == "aba" || name == "minverse" || name == "fd-derivatives";
}

// Block by block, and where a block all but vanishes by the largest of all.
double error_of(const std::vector<double>& expected, const Eigen::VectorXd& got,
                const std::vector<RobotBlock>& blocks) {
  const Eigen::Map<const Eigen::VectorXd> exact(expected.data(), got.size());
  const double of_all = (got - exact).lpNorm<Eigen::Infinity>() / exact.lpNorm<Eigen::Infinity>();
  return of_all <= 0x1p-48 ? 0 : tools::relative_error(expected, got.data(), blocks);
}

std::string failure_of(std::uint64_t seed, int most_joints) {
  const dynamics::Model<double> model = robot_of(seed, most_joints);
  const double condition = dynamics::worst_inertia_condition(model);
  for (const std::string name : kFunctions) {
    const RobotFunction function(name);
    const Eigen::VectorXd state = tools::random_states(model, function, 1, seed).front();
    const std::vector<double> expected = tools::reference(model, function, state);
    const double allowed = 1e-13 * model.nv * (solves(name) ? std::max(1.0, condition) : 1.0);
    for (const RobotRoute route : {RobotRoute::kAnalytic, RobotRoute::kTape}) {
      RobotEvaluatorOptions options;
      options.codegen.route = Route::kInterpreter;
      const Eigen::VectorXd got = RobotEvaluator(model, function, route, options)(state);
      const double error = error_of(expected, got, outputs(model, function));
      if (!(error <= allowed))
        return name + ", " + to_string(route) + ", of " + std::to_string(model.njoints()) +
               " joints is off by " + std::to_string(error / 0x1p-52) + " eps at a condition of " +
               std::to_string(condition);
    }
  }
  return "";
}

}  // namespace

std::string robot_failure(std::uint64_t seed) {
  constexpr int kMostJoints = 12;
  const std::string failure = failure_of(seed, kMostJoints);
  if (failure.empty()) return "";
  for (int joints = 1; joints < kMostJoints; ++joints) {  // a smaller one that fails says more
    const std::string still = failure_of(seed, joints);
    if (!still.empty()) return still + " (of at most " + std::to_string(joints) + ")";
  }
  return failure;
}

std::string compiled_robot_failure(std::uint64_t seed) {
  const dynamics::Model<double> model = robot_of(seed, 8);
  for (const std::string name : kFunctions) {
    const RobotFunction function(name);
    RobotEvaluatorOptions options;
    options.codegen.use_cache = false, options.codegen.jobs = 1;
    RobotEvaluator compiled(model, function, RobotRoute::kGenerated, options);
    options.codegen.route = Route::kInterpreter;
    RobotEvaluator interpreted(model, function, RobotRoute::kGenerated, options);
    for (const Eigen::VectorXd& state : tools::random_states(model, function, 10, seed)) {
      if (compiled(state) != interpreted(state))
        return name + ": compiled code differs from the interpreter in a bit";
    }
  }
  return "";
}

}  // namespace dyntape::testing
