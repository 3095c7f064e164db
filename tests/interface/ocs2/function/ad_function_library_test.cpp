// SPDX-License-Identifier: BSD-3-Clause
//
// The libraries behind the function class: flags, staleness, reuse.
#include <gtest/gtest.h>
#include <xmmintrin.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/machine/machine_code.h>
#include <dyntape/codegen/pipeline.h>

#include "ad_function_fixture.h"

namespace dyntape::ad_function_library_test {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Of what nobody gave there is nothing to say.
TEST_F(AdFunctionTest, TheDefaultFlagsAreAllPassedOn) {
  ::testing::internal::CaptureStderr();
  AdFunction(sample, 3, 2, "defaults", cache_.path()).createModels(ApproximationOrder::Zero, false);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST_F(AdFunctionTest, FlagsReachTheCompilerAndFastMathIsLeftOutOnce) {
  std::vector<std::string> flags = AdFunction::defaultCompileFlags();
  flags.push_back("-ffast-math");  // OCS2's five
  ::testing::internal::CaptureStderr();
  std::vector<std::string> manifests;
  for (int i = 0; i < 2; ++i) {
    AdFunction f(sample, 3, 2, "flags-" + std::to_string(i), cache_.path(), flags);
    f.createModels(ApproximationOrder::Zero, false);
    const auto folder = std::filesystem::path(f.statistics().sourcePath).parent_path();
    manifests.push_back(text_of(folder / "manifest.json"));
  }
  const std::string said = ::testing::internal::GetCapturedStderr();
  for (const std::string& manifest : manifests) {
    for (const char* flag : {"-O3", "-g"}) EXPECT_TRUE(contains(manifest, flag)) << manifest;
    EXPECT_FALSE(contains(manifest, "-ffast-math"));
  }
  const std::size_t first = said.find("-ffast-math");
  EXPECT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("-ffast-math", first + 1), std::string::npos) << said;
}

// A flag that is passed on and that the compiler does not know proves that it saw it.
TEST_F(AdFunctionTest, AFlagThatBreaksTheCompilationIsReportedWithTheCompilersWords) {
  AdFunction f(sample, 3, 2, "broken", cache_.path(), {"-march=nonsense"});
  const std::string message = message_of<ToolError>([&] { f.createModels(ApproximationOrder::Zero, false); });
  EXPECT_TRUE(contains(message, "-march=nonsense")) << message;
  EXPECT_TRUE(contains(message, "nonsense")) << message;
  EXPECT_FALSE(f.hasModel());
}

TEST_F(AdFunctionTest, TheFloatingPointStateOfTheCallerIsUntouched) {
  const unsigned before = _mm_getcsr();
  const AdFunction f = created(sample, 3, 2);
  f.getJacobian(kX, kP);
  EXPECT_EQ(_mm_getcsr() & 0x8040u, before & 0x8040u);  // flush to zero, denormals are zero
  volatile double denormal = 4.9e-324;
  EXPECT_NE(denormal * 1.0, 0.0);
  std::thread([&] {
    volatile double small = 2.2250738585072014e-308;
    EXPECT_NE(small * 0.5, 0.0);
  }).join();
}

// --- 0.3: a library is known by what it computes ---

TEST_F(AdFunctionTest, AStaleLibraryIsImpossible) {
  for (double factor : {2.0, 14.0, std::nextafter(14.0, 15.0)}) {
    AdFunction f =
        make([factor](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) { y = x * AD(factor); }, 1, 0,
             "same");
    f.loadModelsIfAvailable(ApproximationOrder::Zero, false);
    EXPECT_FALSE(f.statistics().timings.cache_hit);
    EXPECT_EQ(f.getFunctionValue(vector_t::Ones(1))[0], factor);
  }
}

TEST_F(AdFunctionTest, ChangedDimensionsAndOrdersAreOtherLibraries) {
  for (std::size_t n : {2u, 3u}) {
    for (auto order : {ApproximationOrder::First, ApproximationOrder::Second}) {
      AdFunction f = make(
          [](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) {
            y.resize(1);
            y[0] = x[0] * x[1];
          },
          n, 0, "product");
      f.loadModelsIfAvailable(order, false);
      EXPECT_EQ(f.getJacobian(vector_t::Ones(static_cast<Eigen::Index>(n))).cols(),
                static_cast<Eigen::Index>(n));
      if (order == ApproximationOrder::Second) {
        EXPECT_EQ(f.getHessian(0, vector_t::Ones(static_cast<Eigen::Index>(n)))(0, 1), 1);
      }
    }
  }
}

TEST_F(AdFunctionTest, ReuseAndForcedRebuild) {
  AdFunctionSettings settings;
  settings.folder = cache_.path();
  const auto create = [&](bool force) {
    settings.forceRebuild = force;
    AdFunction f(sample, 3, 2, settings);
    f.createModels(ApproximationOrder::First, false);
    EXPECT_TRUE(f.getJacobian(kX, kP).isApprox(sample_jacobian(kX, kP), 1e-14));
    return f.statistics();
  };
  const auto first = create(false), second = create(false), third = create(true);
  EXPECT_FALSE(first.timings.cache_hit);
  EXPECT_GT(first.timings.compile, 0);
  EXPECT_TRUE(second.timings.cache_hit);
  EXPECT_EQ(second.timings.compile, 0);
  EXPECT_FALSE(third.timings.cache_hit);
  EXPECT_GT(third.timings.compile, 0);
}

TEST_F(AdFunctionTest, LoadModelsTakesTheHighestOrderThatIsThereOrThrows) {
  AdFunction f = make(sample, 3, 2, "maker");
  EXPECT_TRUE(contains(message_of<NotCached>([&] { f.loadModels(false); }), "\"maker\""));
  EXPECT_FALSE(f.hasModel());
  f.createModels(ApproximationOrder::First, false);
  AdFunction g = make(sample, 3, 2, "user");  // another name, the same function
  g.loadModels(false);
  EXPECT_EQ(g.order(), ApproximationOrder::First);
  EXPECT_TRUE(g.statistics().timings.cache_hit);
  EXPECT_EQ(g.getJacobian(kX, kP), f.getJacobian(kX, kP));
  f.createModels(ApproximationOrder::Second, false);
  g.loadModels(false);
  EXPECT_EQ(g.order(), ApproximationOrder::Second);
}

// --- 0.4, 0.5: exceptions, never exits; a recording always ends ---

TEST_F(AdFunctionTest, InTiersTheFirstAnswerDoesNotWaitForTheCompiler) {
  AdFunctionSettings settings;
  settings.folder = cache_.path();
  settings.codegen.route = Route::kTiered;
  AdFunction f(sample, 3, 2, settings);
  f.createModels(ApproximationOrder::Second, false);
  const char* const at_once = codegen::MachineCode::is_possible() ? "machine code" : "interpreter";
  EXPECT_EQ(f.statistics().route, at_once);
  const vector_t w = vector_t::LinSpaced(3, -1, 1);
  const vector_t y = f.getFunctionValue(kX, kP);
  const matrix_t J = f.getJacobian(kX, kP), H = f.getHessian(w, kX, kP);
  EXPECT_TRUE(J.isApprox(sample_jacobian(kX, kP)));
  f.waitForCompiler();
  EXPECT_EQ(f.statistics().route, "compiled");
  EXPECT_EQ(f.getFunctionValue(kX, kP), y);
  EXPECT_EQ(f.getJacobian(kX, kP), J);
  EXPECT_EQ(f.getHessian(w, kX, kP), H);
  EXPECT_EQ(f.vjp(kX, kP, w), AdFunction(f).vjp(kX, kP, w));

  AdFunction again(sample, 3, 2, settings);
  again.createModels(ApproximationOrder::Second, false);
  EXPECT_TRUE(again.statistics().timings.cache_hit);
  EXPECT_EQ(again.statistics().route, "compiled");
}

TEST_F(AdFunctionTest, InTiersAFailingCompilerIsReportedWhenItIsWaitedFor) {
  const std::string compiler = cache_.path() + "/failing-cc";
  std::ofstream(compiler)
      << "#!/bin/sh\ncase \"$*\" in *-###*) echo 'fake version 1'; exit 0;; esac\nexit 7\n";
  std::filesystem::permissions(compiler, std::filesystem::perms::owner_all);
  AdFunctionSettings settings;
  settings.folder = cache_.path();
  settings.codegen.route = Route::kTiered;
  settings.codegen.compiler = compiler;
  AdFunction f(sample, 3, 2, settings);
  f.createModels(ApproximationOrder::First, false);
  EXPECT_THROW(f.waitForCompiler(), ToolError);
  EXPECT_EQ(f.statistics().route, codegen::MachineCode::is_possible() ? "machine code" : "interpreter");
  EXPECT_TRUE(f.getJacobian(kX, kP).isApprox(sample_jacobian(kX, kP)));
}

}  // namespace
}  // namespace dyntape::ad_function_library_test
