// SPDX-License-Identifier: BSD-3-Clause
//
// Functions that are interpreted until they are compiled: the same bits from every tier, no pause while tiers
// are swapped, and an orderly end whatever the compiler does.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/store/cache.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <new>
#include <set>
#include <thread>

#include "codegen/compilers.h"
#include "codegen/random_function.h"

namespace {
thread_local std::size_t allocations = 0;
}

// Sanitizers have an operator new of their own.
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define DYNTAPE_IS_SANITIZED
#endif
#endif
#ifndef DYNTAPE_IS_SANITIZED
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* room = std::malloc(size ? size : 1)) return room;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size ? size : 1);
}
[[gnu::noinline]] void operator delete(void* room) noexcept { std::free(room); }
[[gnu::noinline]] void operator delete(void* room, std::size_t) noexcept { std::free(room); }
#endif

namespace dyntape::tiers_test {
namespace {

using testing::fake_compiler;
using testing::Random;
using testing::same;
using testing::Scratch;
using Clock = std::chrono::steady_clock;

// Enough statements for a quick tier.
Function large() {
  Random random(5);
  return testing::random_functions(random, 140, 17);
}

Function small() {
  return record("small", 2, [](const VectorXad& x) {
    VectorXad y(2);
    y << sin(x[0]) * x[1], x[0] * x[0] + x[1];
    return y;
  });
}

// Of processors without machine code, on all.
class Tiered : public ::testing::Test {
 protected:
  void SetUp() override { setenv("DYNTAPE_MACHINE_CODE", "off", 1); }
  void TearDown() override { unsetenv("DYNTAPE_MACHINE_CODE"); }
  CodegenOptions options(Order order = Order::kValue) const {
    CodegenOptions o;
    o.order = order;
    o.route = Route::kTiered;
    o.cache_folder = scratch_ / "cache";
    o.flags = {"-O2"};  // more than the quick tier has
    return o;
  }
  // What stands in a file that the fake compiler writes; waits for it.
  std::string written(const std::string& name) const {
    std::string text;
    for (int tries = 0; tries < 1000 && text.empty(); ++tries) {
      std::getline(std::ifstream(scratch_ / name), text);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return text;
  }
  const Scratch scratch_;
};

TEST_F(Tiered, EveryTierHasTheBitsOfTheInterpreter) {
  Random random(1);
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 120, 9);
  CodegenOptions interpreted = options(Order::kFirst);
  interpreted.route = Route::kInterpreter;
  const CompiledFunction reference = CompiledFunction::make(f, interpreted);
  const CompiledFunction t = CompiledFunction::make(f, options(Order::kFirst));
  EXPECT_EQ(t.tier(), Tier::kInterpreted);
  EXPECT_FALSE(t.is_settled());
  EXPECT_EQ(t.jacobian_pattern(), reference.jacobian_pattern());

  CompiledFunction::Workspace workspace(t);
  CompiledFunction::Workspace room(reference);
  std::vector<double> y(f.n_y()), expected_y(f.n_y()), j(reference.jacobian_pattern().nnz()), expected_j(j);
  std::set<Tier> met;
  for (bool last = false; !last;) {
    last = t.is_settled();
    met.insert(t.tier());
    for (int k = 0; k < 20; ++k) {
      const auto x = testing::random_arguments(random, f.n_x()),
                 p = testing::random_arguments(random, f.n_p());
      t.first_order(x.data(), p.data(), y.data(), j.data(), workspace);
      reference.first_order(x.data(), p.data(), expected_y.data(), expected_j.data(), room);
      for (std::size_t i = 0; i < y.size(); ++i)
        ASSERT_TRUE(same(y[i], expected_y[i])) << to_string(t.tier());
      for (std::size_t i = 0; i < j.size(); ++i)
        ASSERT_TRUE(same(j[i], expected_j[i])) << to_string(t.tier());
    }
  }
  EXPECT_EQ(met, (std::set<Tier>{Tier::kInterpreted, Tier::kQuick, Tier::kFinal}));
  t.wait();
  EXPECT_EQ(t.trouble(), "");
  EXPECT_EQ(t.route(), Route::kCompiled);
  EXPECT_EQ(t.jacobian_pattern(), reference.jacobian_pattern());
}

TEST_F(Tiered, ThreadsEvaluateWhileTiersAreSwapped) {
  const Function f = large();
  const CompiledFunction t = CompiledFunction::make(f, options());
  std::atomic<int> wrong = 0, evaluations = 0;
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k) {
    threads.emplace_back([&, k] {
      Random random(30 + std::uint64_t(k));
      const Interpreter reference(f);
      Interpreter::Workspace room(reference);
      const CompiledFunction copy = t;
      std::vector<double> y(f.n_y()), expected(f.n_y());
      for (bool last = false; !last;) {
        last = copy.is_settled();
        CompiledFunction::Workspace workspace(copy);  // workspaces come and go
        for (int i = 0; i < 50; ++i, ++evaluations) {
          const auto x = random.vector(f.n_x(), -2, 2), p = random.vector(f.n_p(), -2, 2);
          copy.value(x.data(), p.data(), y.data(), workspace);
          reference(x.data(), p.data(), nullptr, expected.data(), room);
          wrong += !std::equal(y.begin(), y.end(), expected.begin(), same);
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(evaluations, 4 * 100);
  EXPECT_EQ(t.tier(), Tier::kFinal);
}

TEST_F(Tiered, EvaluationsAllocateNothing) {
  const Function f = large();
  const CompiledFunction t = CompiledFunction::make(f, options());
  CompiledFunction::Workspace workspace(t);
  const std::vector<double> x(10 * f.n_x(), 0.5), p(10 * f.n_p(), 0.25);
  std::vector<double> y(10 * f.n_y());
  Points points;
  points.count = 10, points.x = x.data(), points.p = p.data(), points.y = y.data();
  for (bool last = false; !last;) {
    last = t.is_settled();
    const std::size_t before = allocations;
    t.value(x.data(), p.data(), y.data(), workspace);
    const Violation violation = t.run(Order::kValue, points, workspace);
    EXPECT_EQ(allocations, before);
    EXPECT_FALSE(violation);
  }
}

TEST_F(Tiered, ManyPointsOnEveryTier) {
  Random random(2);
  SCOPED_TRACE(random.seed_text());
  const Function f = large();
  const CompiledFunction t = CompiledFunction::make(f, options());
  CompiledFunction::Workspace workspace(t);
  const Interpreter reference(f);
  Interpreter::Workspace room(reference);
  for (bool last = false; !last;) {
    last = t.is_settled();
    for (std::size_t n : {0, 1, 2, 7, 8, 9, 25}) {
      const auto x = testing::random_arguments(random, n * f.n_x());
      const auto p = testing::random_arguments(random, f.n_p());  // the same for all
      std::vector<double> y(n * f.n_y()), expected(f.n_y());
      const Strides strides{f.n_x(), 0, 0, f.n_y(), 0, 0};
      Points points;
      points.count = n, points.x = x.data(), points.p = p.data(), points.y = y.data();
      points.strides = &strides;
      t.check(t.run(Order::kValue, points, workspace));
      for (std::size_t k = 0; k < n; ++k) {
        reference(&x[k * f.n_x()], p.data(), nullptr, expected.data(), room);
        for (std::size_t i = 0; i < f.n_y(); ++i) ASSERT_TRUE(same(y[k * f.n_y() + i], expected[i]));
      }
    }
  }
}

// Lanes and threads are those of the function, whichever tier serves.
TEST_F(Tiered, ThreadsAndLanesOnEveryTier) {
  Random random(3);
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 60, 9);
  CodegenOptions o = options(Order::kFirst);
  o.lanes = Lanes::kNative;
  o.functions = Functions::kPortable;
  CodegenOptions interpreted = o;
  interpreted.route = Route::kInterpreter;
  const CompiledFunction t = CompiledFunction::make(f, o), reference = CompiledFunction::make(f, interpreted);
  CompiledFunction::Workspace workspace(t, 3), room(reference);
  const std::size_t n = 41, nj = t.jacobian_pattern().nnz();
  std::vector<double> y(n * f.n_y()), expected_y(y), j(n * nj), expected_j(j);
  for (bool last = false; !last;) {
    last = t.is_settled();
    EXPECT_EQ(t.lane_width(), 1u) << "points are kept as the first tier wants them";
    const auto x = testing::random_arguments(random, n * f.n_x()),
               p = testing::random_arguments(random, n * f.n_p());
    Points points{.count = n, .x = x.data(), .p = p.data(), .y = y.data(), .jacobian = j.data()};
    t.check(t.run(Order::kFirst, points, workspace));
    points.y = expected_y.data(), points.jacobian = expected_j.data();
    reference.check(reference.run(Order::kFirst, points, room));
    for (std::size_t i = 0; i < y.size(); ++i) ASSERT_TRUE(same(y[i], expected_y[i])) << to_string(t.tier());
    for (std::size_t i = 0; i < j.size(); ++i) ASSERT_TRUE(same(j[i], expected_j[i])) << to_string(t.tier());
  }
  EXPECT_EQ(t.tier(), Tier::kFinal) << t.trouble();
}

TEST_F(Tiered, WhatTheCacheHasIsUsedAtOnce) {
  const Function f = large();
  const CompiledFunction cold = CompiledFunction::make(f, options());
  cold.wait();
  const auto entries = codegen::Cache::open(scratch_ / "cache")->list();
  EXPECT_EQ(entries.size(), 1u) << "the quick one is not kept";
  const CompiledFunction warm = CompiledFunction::make(f, options());
  EXPECT_TRUE(warm.is_settled());
  EXPECT_EQ(warm.tier(), Tier::kFinal);
  EXPECT_TRUE(warm.timings().cache_hit);
  // And what is compiled at once is the same entry.
  CodegenOptions at_once = options();
  at_once.route = Route::kCompiled;
  EXPECT_TRUE(CompiledFunction::make(f, at_once).timings().cache_hit);
}

TEST_F(Tiered, OnlyCached) {
  CodegenOptions o = options();
  o.only_cached = true;
  EXPECT_THROW(CompiledFunction::make(small(), o), NotCached);
  CompiledFunction::make(small(), options()).wait();
  EXPECT_EQ(CompiledFunction::make(small(), o).tier(), Tier::kFinal);
}

TEST_F(Tiered, SmallFunctionsAndThoseWithoutALevelAreCompiledOnce) {
  CodegenOptions o = options();
  o.compiler = fake_compiler(scratch_, "echo \"$@\" >> '" + scratch_ / "runs" + "'; exec cc \"$@\"");
  const auto libraries_after = [&](const Function& f) {
    const CompiledFunction t = CompiledFunction::make(f, o);
    t.wait();
    EXPECT_EQ(t.tier(), Tier::kFinal);
    std::ifstream file(scratch_ / "runs");
    std::size_t count = 0;
    for (std::string line; std::getline(file, line);) count += line.find("-shared") != std::string::npos;
    return count;
  };
  EXPECT_EQ(libraries_after(small()), 1u);
  EXPECT_EQ(libraries_after(large()), 3u) << "at -O1, then at -O2";
  o.flags.clear();
  EXPECT_EQ(libraries_after(large()), 4u);
}

TEST_F(Tiered, WithoutCompilerItIsInterpretedForGood) {
  CodegenOptions o = options();
  o.compiler = "/nowhere/cc";
  const CompiledFunction t = CompiledFunction::make(small(), o);
  EXPECT_TRUE(t.is_settled());
  EXPECT_EQ(t.tier(), Tier::kInterpreted);
  t.wait();
  EXPECT_EQ(t.trouble(), "");
  EXPECT_EQ(t.evaluate(Order::kValue, {0.5, 2}).y, evaluate(small(), {0.5, 2}));
  o.route = Route::kCompiled;
  EXPECT_THROW(CompiledFunction::make(small(), o), ToolError);
  o.compiler.clear();
  o.route = Route::kInterpreter;
  EXPECT_EQ(CompiledFunction::make(small(), o).tier(), Tier::kInterpreted);
}

TEST_F(Tiered, ACompilerThatFailsLeavesTheInterpreter) {
  CodegenOptions o = options();
  o.compiler = fake_compiler(scratch_, "echo complaint; exit 3");
  ::testing::internal::CaptureStderr();
  const CompiledFunction t = CompiledFunction::make(small(), o);
  CompiledFunction::Workspace workspace(t);
  EXPECT_THROW(t.wait(), ToolError);
  EXPECT_THROW(t.wait(), ToolError) << "it is not lost";
  EXPECT_NE(t.trouble().find("exit status 3"), std::string::npos);
  EXPECT_NE(t.trouble().find("complaint"), std::string::npos);
  EXPECT_NE(::testing::internal::GetCapturedStderr().find("\"small\" stays interpreted: the compiler ended"),
            std::string::npos);
  EXPECT_TRUE(t.is_settled());
  const double x[2] = {0.5, 2};
  double y[2];
  t.value(x, nullptr, y, workspace);
  EXPECT_EQ(y[0], std::sin(0.5) * 2);
}

TEST_F(Tiered, ACompilerThatCannotSayWhatItIs) {
  CodegenOptions o = options();
  const std::string path = scratch_ / "mute-cc";
  codegen::write_file(path, "#!/bin/sh\nexit 5\n");
  chmod(path.c_str(), 0700);
  o.compiler = path;
  const CompiledFunction t = CompiledFunction::make(small(), o);
  EXPECT_THROW(t.wait(), ToolError);
  EXPECT_EQ(t.tier(), Tier::kInterpreted);
}

TEST_F(Tiered, DestructionEndsTheCompiler) {
  CodegenOptions o = options();
  o.compiler = fake_compiler(scratch_, "echo $$ > '" + scratch_ / "process" + "'; sleep 100");
  auto t = std::make_unique<CompiledFunction>(CompiledFunction::make(small(), o));
  CompiledFunction::Workspace workspace(*t);
  const std::string process = written("process");
  ASSERT_FALSE(process.empty());
  auto copy = std::make_unique<CompiledFunction>(*t);
  t.reset();
  EXPECT_EQ(kill(std::stoi(process), 0), 0) << "a copy still wants it";
  const auto start = Clock::now();
  copy.reset();
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(5));
  EXPECT_NE(kill(std::stoi(process), 0), 0) << "the compiler is left behind";
  EXPECT_EQ(codegen::Cache::open(scratch_ / "cache")->list().size(), 0u);
}

TEST_F(Tiered, DestructionWhileAnotherOneCompiles) {
  CodegenOptions o = options();
  o.compiler = fake_compiler(scratch_, "echo $$ > '" + scratch_ / "process" + "'; sleep 100");
  const CompiledFunction busy = CompiledFunction::make(small(), o);
  ASSERT_FALSE(written("process").empty());
  const auto start = Clock::now();
  for (int k = 0; k < 10; ++k) CompiledFunction::make(large(), options());  // waits for its turn, or not yet
  EXPECT_LT(Clock::now() - start, std::chrono::seconds(20));
}

#if !defined(__SANITIZE_THREAD__)  // which ends forked children that start threads

// Its parent's threads compile, or ask a compiler what it is, and hold locks that nobody gives back in the child.
TEST_F(Tiered, AForkedChildWaitsForNoThreadOfItsParent) {
  const auto compile_in_child = [&] {
    return testing::in_child([&] {
      alarm(20);
      const CompiledFunction t = CompiledFunction::make(small(), options());
      return t.wait(), t.tier() == Tier::kFinal ? 0 : 1;
    });
  };
  const std::string slow = "echo $$ > '" + scratch_ / "process" + "'; sleep 100";
  CodegenOptions o = options();
  o.compiler = fake_compiler(scratch_, slow);
  {
    const CompiledFunction compiles = CompiledFunction::make(small(), o);
    ASSERT_FALSE(written("process").empty());
    EXPECT_EQ(compile_in_child(), 0);
  }
  unlink((scratch_ / "process").c_str());
  codegen::write_file(o.compiler, "#!/bin/sh\n" + slow + "\n");
  const CompiledFunction asks = CompiledFunction::make(small(), o);
  ASSERT_FALSE(written("process").empty());
  codegen::Cache::open(scratch_ / "cache")->clear();
  EXPECT_EQ(compile_in_child(), 0);
  kill(std::stoi(written("process")), SIGKILL);
}

#endif

TEST_F(Tiered, TheUsersStopEndsTheCompiler) {
  CodegenOptions o = options();
  std::stop_source stop;
  o.stop = stop.get_token();
  o.compiler = fake_compiler(scratch_, "echo $$ > '" + scratch_ / "process" + "'; sleep 100");
  const CompiledFunction t = CompiledFunction::make(small(), o);
  ASSERT_FALSE(written("process").empty());
  stop.request_stop();
  EXPECT_THROW(t.wait(), ToolError);
  EXPECT_NE(t.trouble().find("was interrupted"), std::string::npos) << t.trouble();
}

TEST_F(Tiered, StoppedBeforeTheCompilerStarts) {
  CodegenOptions o = options();
  std::stop_source stop;
  stop.request_stop();
  o.stop = stop.get_token();
  const CompiledFunction t = CompiledFunction::make(small(), o);
  EXPECT_THROW(t.wait(), ToolError);
  EXPECT_NE(t.trouble().find("was interrupted"), std::string::npos) << t.trouble();
}

TEST_F(Tiered, OneFunctionAtATimeIsCompiled) {
  CodegenOptions o = options();
  o.jobs = 1;
  const std::string lock = scratch_ / "lock", clash = scratch_ / "clash";
  o.compiler = fake_compiler(scratch_, "mkdir '" + lock + "' || echo clash > '" + clash +
                                           "'\nsleep 0.1\ncc \"$@\"\nrmdir '" + lock + "'");
  std::vector<CompiledFunction> functions;
  for (int k = 0; k < 3; ++k)
    functions.push_back(CompiledFunction::make(
        record("f", 1, [k](const VectorXad& x) { return VectorXad::Constant(1, x[0] * k + 3); }), o));
  for (const CompiledFunction& t : functions) t.wait();
  EXPECT_FALSE(std::ifstream(clash).good());
}

TEST_F(Tiered, EqualFunctionsAreCompiledOnce) {
  CodegenOptions o = options();
  const std::string calls = scratch_ / "calls";
  o.compiler = fake_compiler(scratch_, "case \"$*\" in *-c*) echo call >> '" + calls + "';; esac\ncc \"$@\"");
  const auto parabola = [](const VectorXad& x) { return VectorXad::Constant(1, x[0] * x[0] + 3); };
  const auto count = [&] {
    std::ifstream file(calls);
    return std::count(std::istreambuf_iterator<char>(file), {}, '\n');
  };
  CompiledFunction::make(record("first", 1, parabola), o).wait();
  const auto of_one = count();
  EXPECT_GT(of_one, 0);
  o.cache_folder = scratch_ / "other";
  std::vector<CompiledFunction> functions;
  for (const char* name : {"one", "two", "three"})
    functions.push_back(CompiledFunction::make(record(name, 1, parabola), o));
  for (const CompiledFunction& t : functions) {
    t.wait();
    EXPECT_EQ(t.tier(), Tier::kFinal) << t.trouble();
  }
  EXPECT_EQ(count(), 2 * of_one);
}

TEST_F(Tiered, WorkspacesMoveAndBelongToOneFunction) {
  const CompiledFunction a = CompiledFunction::make(small(), options()),
                         b = CompiledFunction::make(small(), options());
  CompiledFunction::Workspace of_a(a), of_b(b);
  const double x[2] = {0.5, 2};
  double y[2];
  EXPECT_THROW(a.value(x, nullptr, y, of_b), ArgumentError);
  CompiledFunction::Workspace moved = std::move(of_b);
  b.value(x, nullptr, y, moved);
  moved = std::move(of_a);
  a.value(x, nullptr, y, moved);
  EXPECT_EQ(y[1], 2.25);
  EXPECT_THROW(a.first_order(x, nullptr, y, nullptr, of_b), ArgumentError);
}

TEST_F(Tiered, GuardsAreThrownByEveryTier) {
  const CompiledFunction t = CompiledFunction::make(
      record("branch", 1,
             [](const VectorXad& x) { return VectorXad::Constant(1, x[0] > 0.0 ? x[0] : -x[0]); }),
      options());
  CompiledFunction::Workspace workspace(t);
  const double inside = 1, outside = -1;
  double y;
  for (bool last = false; !last;) {
    last = t.is_settled();
    t.value(&inside, nullptr, &y, workspace);
    EXPECT_THROW(t.value(&outside, nullptr, &y, workspace), GuardViolation);
  }
}

}  // namespace
}  // namespace dyntape::tiers_test
