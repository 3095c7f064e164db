// SPDX-License-Identifier: BSD-3-Clause
//
// What the derivatives of forward dynamics of a robot with 38 degrees of freedom cost to make.
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/robot/robot_functions.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <iostream>

#include "source_folder.h"

namespace dyntape::large_robot_test {
namespace {

TEST(LargeRobot, IsCompiledWithinAGigabyte) {
  const auto file = std::filesystem::path(test::source_folder()) / "config" / "robots" / "talos.urdf";
  const auto model = dynamics::load_urdf(file.string(), {.base = dynamics::Base::kFloating});
  ASSERT_GE(model.nv, 38);
  const Function f = record_robot_function(model, RobotFunction::kFdDerivatives);
  CodegenOptions options;
  options.order = Order::kValue;
  options.use_cache = false;
  options.route = Route::kCompiled;
  options.compile_bytes = std::size_t{1} << 30;  // of address space; a compiler that wants more fails
  EXPECT_EQ(CompiledFunction::make(f, options).route(), Route::kCompiled);
  // Compilers leave their trace as well: the kernel counts the largest of what has been waited for.
  for (int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage used{};
    getrusage(who, &used);
    std::cout << (who == RUSAGE_SELF ? "process " : "compilers ") << used.ru_maxrss / 1024 << " MB\n";
    EXPECT_LT(used.ru_maxrss, 300 * 1024);
  }
}

}  // namespace
}  // namespace dyntape::large_robot_test
