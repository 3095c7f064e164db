// SPDX-License-Identifier: BSD-3-Clause
//
// The product with the inverse inertia as a loop: the numbers of the straight-line recording, in C and in lanes.
#include <dyntape/interface/robot/minverse_product.h>

#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_functions.h>

#include <filesystem>
#include <random>

#include "source_folder.h"

namespace dyntape::minverse_product_test {
namespace {

dynamics::Model<double> robot(const char* name, dynamics::Base base = dynamics::Base::kFloating) {
  const auto folder = std::filesystem::path(test::source_folder()) / "config" / "robots";
  return dynamics::load_urdf((folder / name).replace_extension("urdf").string(), {.base = base});
}

std::vector<double> random_numbers(std::size_t n, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> x(n);
  for (double& entry : x) entry = uniform(generator);
  return x;
}

TEST(MinverseProduct, IsTheUnrolledRecordingAsALoop) {
  for (const char* name : {"solo12", "simple_humanoid"}) {
    SCOPED_TRACE(name);
    const MinverseProduct product(dynamics::tree_of(robot(name)));
    ASSERT_TRUE(product.is_worth_a_loop());
    const auto callee = product.callee();
    const std::vector<double> in = random_numbers(callee->n_in, 11);
    std::vector<double> out(callee->n_out);
    callee->kernel()->evaluate(in.data(), out.data());
    EXPECT_EQ(out, evaluate(*callee->kernel()->unrolled(), in));
  }
}

TEST(MinverseProduct, SmallRobotsStayStraight) {
  const auto arm = robot("panda", dynamics::Base::kFixed);
  EXPECT_FALSE(MinverseProduct(dynamics::tree_of(arm)).is_worth_a_loop());
  EXPECT_THROW((void)MinverseProduct(dynamics::tree_of(robot("ur5", dynamics::Base::kFixed))).callee(),
               ArgumentError);
  EXPECT_TRUE(record_robot_function(arm, RobotFunction::kFdDerivatives).graph.callees().empty());
}

// One lane and several, against the interpreter.
TEST(MinverseProduct, GeneratedCodeHasTheBitsOfTheInterpreter) {
  const auto model = robot("solo12");
  const Function f = record_robot_function(model, RobotFunction::kFdDerivatives);
  ASSERT_EQ(f.graph.callees().size(), 1u);
  CodegenOptions options;
  options.order = Order::kValue;
  options.use_cache = false;
  options.lanes = Lanes::kNative;
  const auto compiled = CompiledFunction::make(f, options);
  CompiledFunction::Workspace workspace(compiled);
  const std::size_t count = compiled.lane_width() + 1;
  std::vector<double> x = random_numbers(count * f.n_x(), 12), y(count * f.n_y());
  for (std::size_t i = 0; i < count; ++i) {
    Eigen::Map<Eigen::Vector4d>(&x[i * f.n_x() + 3]).normalize();  // the base's quaternion
  }
  Points points;
  points.count = count;
  points.x = x.data();
  points.y = y.data();
  ASSERT_FALSE(compiled.run(Order::kValue, points, workspace));
  for (std::size_t i = 0; i < count; ++i) {
    const std::vector<double> state(x.begin() + static_cast<long>(i * f.n_x()),
                                    x.begin() + static_cast<long>((i + 1) * f.n_x()));
    const std::vector<double> lane(y.begin() + static_cast<long>(i * f.n_y()),
                                   y.begin() + static_cast<long>((i + 1) * f.n_y()));
    EXPECT_EQ(lane, evaluate(f, state)) << "point " << i;
    EXPECT_EQ(lane, compiled.evaluate(Order::kValue, state).y) << "point " << i;
  }
}

}  // namespace
}  // namespace dyntape::minverse_product_test
