// SPDX-License-Identifier: BSD-3-Clause
//
// How many operations the robots' functions take: the shortest way is chosen, and no change makes it longer unseen.
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <random>

#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/passes/outline.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/factored_dynamics.h>
#include <dyntape/interface/robot/robot_functions.h>

#include "source_folder.h"

namespace dyntape::operation_counts_test {
namespace {

using dynamics::Base;

dynamics::Model<double> load(const char* name, Base base) {
  const auto folder = std::filesystem::path(test::source_folder()) / "config" / "robots";
  return dynamics::load_urdf((folder / name).replace_extension("urdf").string(), {.base = base});
}

struct Robot {
  const char* name;
  Base base;
};
const Robot kRobots[] = {{"pendulum", Base::kFixed},  {"arm_2r", Base::kFixed},
                         {"ur5", Base::kFixed},       {"panda", Base::kFixed},
                         {"iiwa14", Base::kFloating}, {"solo12", Base::kFloating},
                         {"talos", Base::kFloating},  {"simple_humanoid", Base::kFloating}};

TEST(OperationCounts, TheShortestWayIsTaken) {
  std::printf("%-16s %-15s %9s %9s %9s\n", "robot", "function", "analytic", "factored", "differentiated");
  for (const Robot& robot : kRobots) {
    const auto model = load(robot.name, robot.base);
    for (const char* name : {"id-derivatives", "fd-derivatives", "minverse"}) {
      SCOPED_TRACE(std::string(robot.name) + " " + name);
      const RobotFunction function(name);
      const std::size_t analytic =
          total_operations(record_robot_function(model, function, RobotSource::kAnalytic));
      std::size_t factored = SIZE_MAX, differentiated = SIZE_MAX;
      for (const Function& f : detail::record_factored(model, function))
        factored = std::min(factored, total_operations(f));
      if (is_derivative(function) && model.nv < 20)
        differentiated =
            total_operations(record_robot_function(model, function, RobotSource::kDifferentiated));
      const auto text = [](std::size_t n) { return n == SIZE_MAX ? std::string("-") : std::to_string(n); };
      std::printf("%-16s %-15s %9s %9s %9s\n", robot.name, name, text(analytic).c_str(),
                  text(factored).c_str(), text(differentiated).c_str());
      EXPECT_EQ(total_operations(record_robot_function(model, function)),
                std::min({analytic, factored, differentiated}));
    }
  }
}

// They share nothing with the plain code that solves for accelerations.
TEST(OperationCounts, FactoredRecordingsAgreeWithPlainCode) {
  for (const Robot& robot : kRobots) {
    const auto model = load(robot.name, robot.base);
    std::mt19937_64 random(21);
    const auto uniform = [&](Eigen::Index n, double bound) {
      return Eigen::VectorXd::NullaryExpr(
          n, [&] { return std::uniform_real_distribution<double>(-bound, bound)(random); });
    };
    for (const char* name : {"fd-derivatives", "minverse"}) {
      const RobotFunction function(name);
      const auto ways = detail::record_factored(model, function);
      ASSERT_FALSE(ways.empty());
      for (int i = 0; i < 3; ++i) {
        const Eigen::VectorXd q = dynamics::random_configuration<double>(model, random);
        Eigen::VectorXd state(static_cast<Eigen::Index>(ways[0].n_x()));
        state.head(model.nq) = q;
        if (state.size() > model.nq) state.tail(2 * model.nv) << uniform(model.nv, 2), uniform(model.nv, 5);
        const Eigen::VectorXd plain = evaluate_analytic(model, function, state);
        for (const Function& f : ways) {
          const std::vector<double> y = evaluate(f, state);
          Eigen::Index first = 0;
          for (const RobotBlock& block : outputs(model, function)) {
            const auto expected = plain.segment(first, block.size());
            const Eigen::Map<const Eigen::VectorXd> got(y.data() + first, block.size());
            EXPECT_LE((got - expected).cwiseAbs().maxCoeff(), 1e-11 * expected.cwiseAbs().maxCoeff())
                << robot.name << " " << block.name << ", seed 21, state " << i;
            first += block.size();
          }
          EXPECT_EQ(static_cast<std::size_t>(first), y.size());
        }
      }
    }
  }
}

// As measured when this was written, a few in a hundred up: a change that needs more has to say why.
struct Budget {
  const char* robot;
  Base base;
  const char* function;
  std::size_t operations;
};
const Budget kBudgets[] = {
    {"ur5", Base::kFixed, "rnea", 590},
    {"ur5", Base::kFixed, "aba", 1210},
    {"ur5", Base::kFixed, "id-derivatives", 2280},
    {"ur5", Base::kFixed, "fd-derivatives", 3490},
    {"panda", Base::kFixed, "rnea", 1310},
    {"panda", Base::kFixed, "aba", 2150},
    {"panda", Base::kFixed, "id-derivatives", 5250},
    {"panda", Base::kFixed, "fd-derivatives", 9290},
    {"solo12", Base::kFloating, "rnea", 2140},
    {"solo12", Base::kFloating, "aba", 3980},
    {"solo12", Base::kFloating, "id-derivatives", 7580},
    {"solo12", Base::kFloating, "fd-derivatives", 21800},
    {"simple_humanoid", Base::kFloating, "rnea", 3570},
    {"simple_humanoid", Base::kFloating, "aba", 7220},
    {"simple_humanoid", Base::kFloating, "id-derivatives", 21400},
    {"simple_humanoid", Base::kFloating, "fd-derivatives", 108300},
};

TEST(OperationCounts, StayWithinTheirBudgets) {
  std::printf("%-16s %-15s %10s\n", "robot", "function", "operations");
  for (const Budget& budget : kBudgets) {
    const std::size_t operations = total_operations(
        record_robot_function(load(budget.robot, budget.base), RobotFunction(budget.function)));
    std::printf("%-16s %-15s %10zu\n", budget.robot, budget.function, operations);
    EXPECT_LE(operations, budget.operations) << budget.robot << " " << budget.function;
    // A budget far above what is needed guards nothing.
    EXPECT_GE(operations, budget.operations * 9 / 10) << budget.robot << " " << budget.function;
  }
}

// A few sums that go from leg to leg do not keep the legs from being written once.
TEST(OperationCounts, LegsAreWrittenOnce) {
  const auto model = load("solo12", Base::kFloating);
  struct {
    RobotFunction function;
    double most;  // of the nodes is left outside of the legs
  } const kCases[] = {{RobotFunction::kIdDerivatives, 0.45}, {RobotFunction::kFdDerivatives, 0.8}};
  for (const auto& [function, most] : kCases) {
    const Function f = record_robot_function(model, function);
    const Function shorter = codegen::outlined(f);
    EXPECT_GT(shorter.graph.callees().size(), f.graph.callees().size()) << to_string(function);
    EXPECT_LT(double(shorter.graph.size()), most * double(f.graph.size())) << to_string(function);
  }
}

// What loops do is counted too.
TEST(OperationCounts, ALoopCountsWithWhatItDoes) {
  const auto model = load("simple_humanoid", Base::kFloating);
  const Function f = record_robot_function(model, RobotFunction::kFdDerivatives);
  ASSERT_EQ(f.graph.callees().size(), 1u);
  const Callee& loop = *f.graph.callees()[0];
  std::size_t stated = 0;
  for (const OperationCount& entry : count_operations(loop)) stated += entry.count;
  EXPECT_EQ(stated, total_operations(*loop.kernel()->unrolled())) << "as many as without the loop";
  std::size_t straight = 0;
  for (const Node& node : f.graph.nodes()) straight += static_cast<int>(node.op) < kTableOps;
  EXPECT_EQ(total_operations(f), straight + 1 + stated);
}

}  // namespace
}  // namespace dyntape::operation_counts_test
