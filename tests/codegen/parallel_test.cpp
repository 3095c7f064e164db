// SPDX-License-Identifier: BSD-3-Clause
//
// Many points in threads: the same bits for any number of them, guards, errors, nesting.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/run/threads.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <string>
#include <thread>

#include "random_function.h"

namespace dyntape::parallel_test {
namespace {

using testing::Random;
using testing::same;

CompiledFunction compiled(const Function& f, Route route, Lanes lanes) {
  CodegenOptions options;
  options.order = Order::kFirst;
  options.route = route;
  options.use_cache = false;
  options.lanes = lanes;
  return CompiledFunction::make(f, options);
}

Function branching() {
  return record("branching", 2, 1, [](const VectorXad& x, const VectorXad& p) {
    VectorXad y(2);
    y << sin(x[0]) * p[0], x[1] / x[0];
    if (x[0] < 10.0) y[1] += 1.0;
    return y;
  });
}

TEST(ParallelThreads, AnyNumberGivesTheSameBits) {
  Random random(501);
  SCOPED_TRACE(random.seed_text());
  const Function f = testing::random_functions(random, 6, 6);
  for (const auto& [route, lanes] :
       {std::pair(Route::kInterpreter, Lanes::kNone), std::pair(Route::kCompiled, Lanes::kNone),
        std::pair(Route::kCompiled, Lanes::kNative)}) {
    const CompiledFunction c = compiled(f, route, lanes);
    const std::size_t count = 101, nj = c.jacobian_pattern().nnz();
    const auto x = testing::random_arguments(random, count * f.n_x()),
               p = testing::random_arguments(random, count * f.n_p());
    CompiledFunction::Workspace workspace(c);
    std::vector<double> y(count * f.n_y()), j(count * nj);
    EXPECT_FALSE(c.run(Order::kFirst,
                       {.count = count, .x = x.data(), .p = p.data(), .y = y.data(), .jacobian = j.data()},
                       workspace));
    for (unsigned threads : {1u, 2u, 3u, 7u, 64u}) {
      CompiledFunction::Workspace parts(c, threads);
      std::vector<double> y2(y.size(), -7), j2(j.size(), -7);
      for (int repeat = 0; repeat < 3; ++repeat)
        EXPECT_FALSE(c.run(
            Order::kFirst,
            {.count = count, .x = x.data(), .p = p.data(), .y = y2.data(), .jacobian = j2.data()}, parts));
      for (std::size_t i = 0; i < y.size(); ++i)
        ASSERT_TRUE(same(y2[i], y[i])) << threads << " threads, " << i;
      for (std::size_t i = 0; i < j.size(); ++i)
        ASSERT_TRUE(same(j2[i], j[i])) << threads << " threads, " << i;
    }
  }
}

TEST(ParallelThreads, TheFirstViolationOfAll) {
  const CompiledFunction c = compiled(branching(), Route::kCompiled, Lanes::kNative);
  CompiledFunction::Workspace workspace(c, 4);
  const std::size_t count = 90;
  std::vector<double> x(2 * count, 1.0), p = {2.0}, y(2 * count);
  const Strides shared{2, 0, 0, 2, 0, 0};
  const Points points{.count = count, .x = x.data(), .p = p.data(), .y = y.data(), .strides = &shared};
  EXPECT_FALSE(c.run(Order::kValue, points, workspace));
  for (const std::size_t at : {89, 61, 37, 2}) {
    x[2 * at] = 11;
    EXPECT_EQ(c.run(Order::kValue, points, workspace).point, at);
  }
  CompiledFunction::Workspace moved = std::move(workspace);
  EXPECT_THROW((void)c.run(Order::kValue, points, workspace), ArgumentError) << "it has moved";
  const CompiledFunction other = compiled(branching(), Route::kInterpreter, Lanes::kNone);
  CompiledFunction::Workspace foreign(other, 4);
  EXPECT_THROW((void)c.run(Order::kValue, points, foreign), ArgumentError);
}

// Blocks of points side by side are shared out whole.
TEST(ParallelThreads, PointsSideBySide) {
  const CompiledFunction c = compiled(branching(), Route::kCompiled, Lanes::kNative);
  const std::size_t width = c.lane_width(), count = 7 * width;
  std::vector<double> x(2 * count), p(count, 2.0), y(2 * count), expected(y);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = 0.25 + double(i) / double(x.size());
  Points points{.count = count, .x = x.data(), .p = p.data(), .y = expected.data(), .side_by_side = width};
  CompiledFunction::Workspace alone(c), parts(c, 3);
  EXPECT_FALSE(c.run(Order::kValue, points, alone));
  points.y = y.data();
  EXPECT_FALSE(c.run(Order::kValue, points, parts));
  EXPECT_EQ(y, expected);
  x[5 * 2 * width + 1] = 11;  // the first variable of lane 1 of block 5
  EXPECT_EQ(c.run(Order::kValue, points, parts).point, 5 * width + 1);
}

TEST(ParallelThreads, NoPointsAtAll) {
  const CompiledFunction c = compiled(branching(), Route::kCompiled, Lanes::kNative);
  CompiledFunction::Workspace workspace(c, 0);
  EXPECT_FALSE(c.run(Order::kFirst, {.count = 0}, workspace));
}

TEST(Threads, EachTaskOnceAlsoNestedAndFromSeveralThreads) {
  std::atomic<int> sum = 0;
  const auto burst = [&] {
    for (int repeat = 0; repeat < 50; ++repeat)
      codegen::run_tasks(5, [&](std::size_t k) {
        codegen::run_tasks(3, [&](std::size_t i) { sum += static_cast<int>(10 * k + i); });
      });
  };
  std::thread a(burst), b(burst);
  burst();
  a.join();
  b.join();
  EXPECT_EQ(sum, 3 * 50 * (3 * 10 * (0 + 1 + 2 + 3 + 4) + 5 * (0 + 1 + 2)));
}

TEST(Threads, WhatATaskThrowsReachesTheCaller) {
  std::atomic<int> done = 0;
  EXPECT_THROW(codegen::run_tasks(8,
                                  [&](std::size_t k) {
                                    ++done;
                                    if (k == 3) throw ArgumentError("three");
                                  }),
               ArgumentError);
  EXPECT_EQ(done, 8);
  codegen::run_tasks(2, [&](std::size_t) { ++done; });
  EXPECT_EQ(done, 10);
}

TEST(Threads, NoMoreThanTheCount) {
  std::atomic<unsigned> now = 0, most = 0;
  codegen::run_tasks(64, [&](std::size_t) {
    const unsigned at_work = ++now;
    for (unsigned seen = most; seen < at_work && !most.compare_exchange_weak(seen, at_work);) {
    }
    std::this_thread::sleep_for(std::chrono::microseconds(200));
    --now;
  });
  EXPECT_GE(most, 1u);
  EXPECT_LE(most, codegen::thread_count());
}

// The thread sanitizer ends forked children that start threads; the address sanitizer calls what they forget of their
// parent's pool a leak, and needs more addresses than the last test leaves.
#if !defined(__SANITIZE_THREAD__) && !defined(__SANITIZE_ADDRESS__)

// What happens in a child that ends as programs do, with all that static objects do at the end; -1: it did not end.
template <class Body>
int exit_code_of_child(Body body) {
  const pid_t child = fork();
  if (child == 0) {
    alarm(20);
    std::exit(body());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// 0: each of many tasks was done once.
int tasks_missed() {
  std::atomic<int> done = 0;
  for (int repeat = 0; repeat < 20; ++repeat) codegen::run_tasks(16, [&](std::size_t) { ++done; });
  return std::abs(done - 20 * 16);
}

class Forks : public ::testing::Test {
 protected:
  Forks() { setenv("DYNTAPE_THREADS", "4", 1); }
  ~Forks() override {
    if (found_) setenv("DYNTAPE_THREADS", before_.c_str(), 1);
    if (!found_) unsetenv("DYNTAPE_THREADS");
  }

 private:
  const char* const found_ = std::getenv("DYNTAPE_THREADS");
  const std::string before_ = found_ ? found_ : "";
};

TEST_F(Forks, AChildEndsAndHasThreadsOfItsOwn) {
  ASSERT_EQ(tasks_missed(), 0);
  EXPECT_EQ(exit_code_of_child([] { return 0; }), 0) << "a child that does nothing";
  EXPECT_EQ(exit_code_of_child(tasks_missed), 0);
  EXPECT_EQ(exit_code_of_child([] { return tasks_missed() + exit_code_of_child(tasks_missed); }), 0)
      << "and a child of that";
  EXPECT_EQ(tasks_missed(), 0);
}

TEST_F(Forks, WhileThePoolIsAtWork) {
  std::atomic<bool> ends = false;
  std::thread busy([&] {
    while (!ends) tasks_missed();
  });
  for (int repeat = 0; repeat < 30; ++repeat) EXPECT_EQ(exit_code_of_child(tasks_missed), 0) << repeat;
  ends = true;
  busy.join();
}

TEST_F(Forks, ThreadsThatCannotBeMadeAreDoneWithout) {
  const auto with_few_addresses = [] {
    setenv("DYNTAPE_THREADS", "64", 1);  // more than there are stacks of the parent's threads to use again
    const rlimit none_left{1, RLIM_INFINITY};
    return setrlimit(RLIMIT_AS, &none_left) == 0 ? tasks_missed() : 1;
  };
  EXPECT_EQ(exit_code_of_child(with_few_addresses), 0);
}

#endif

TEST(Threads, TheCountIsTheEnvironments) {
  const char* const found = std::getenv("DYNTAPE_THREADS");
  const std::string before = found ? found : "";
  setenv("DYNTAPE_THREADS", "3", 1);
  EXPECT_EQ(codegen::thread_count(), 3u);
  for (const char* wrong : {"0", "-1", "many", "3x", "99999"}) {
    setenv("DYNTAPE_THREADS", wrong, 1);
    EXPECT_THROW(codegen::thread_count(), ArgumentError) << wrong;
  }
  unsetenv("DYNTAPE_THREADS");
  EXPECT_GE(codegen::thread_count(), 1u);
  if (found) setenv("DYNTAPE_THREADS", before.c_str(), 1);
}

}  // namespace
}  // namespace dyntape::parallel_test
