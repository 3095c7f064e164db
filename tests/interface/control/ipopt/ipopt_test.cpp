// SPDX-License-Identifier: BSD-3-Clause
//
// The choice of the method, and a solve that is stopped while the linear solver is busy.
#include <gtest/gtest.h>

#include <chrono>
#include <numeric>
#include <thread>

#include <dyntape/interface/control/ipopt/ipopt.h>

namespace ipopt_test {
namespace {

using namespace dyntape;
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

// f = (sum x)^2 / 2 + sum x^4 / 4 - sum x: its dense Hessian takes the linear solver long.
class Dense : public Nlp {
 public:
  explicit Dense(std::size_t n) {
    shape_.x_lower.assign(n, -10);
    shape_.x_upper.assign(n, 10);
    shape_.jacobian.cols = n;
    std::vector<std::vector<std::uint32_t>> rows(n);
    for (std::size_t i = 0; i < n; ++i) {
      rows[i].resize(i + 1);
      std::iota(rows[i].begin(), rows[i].end(), 0u);
    }
    shape_.hessian = pattern_from_rows(rows, n);
  }

  const NlpShape& shape() const override { return shape_; }
  bool objective(const double* x, double& value) override {
    const double sum = std::accumulate(x, x + shape_.n(), 0.0);
    value = sum * sum / 2 - sum;
    for (std::size_t i = 0; i < shape_.n(); ++i) value += x[i] * x[i] * x[i] * x[i] / 4;
    return note();
  }
  bool gradient(const double* x, double* gradient) override {
    const double sum = std::accumulate(x, x + shape_.n(), 0.0);
    for (std::size_t i = 0; i < shape_.n(); ++i) gradient[i] = sum + x[i] * x[i] * x[i] - 1;
    return note();
  }
  bool constraints(const double*, double*) override { return note(); }
  bool jacobian(const double*, double*) override { return note(); }
  bool hessian(const double* x, double sigma, const double*, double* nonzeros) override {
    for (std::size_t k = 0; k < shape_.hessian.nnz(); ++k) {
      const auto row = shape_.hessian.row[k];
      nonzeros[k] = sigma * (row == shape_.hessian.col[k] ? 1 + 3 * x[row] * x[row] : 1);
    }
    return note();
  }

  int calls = 0;

 private:
  bool note() { return ++calls; }
  NlpShape shape_;
};

// A chain of one stage, or the same program without a word about stages.
class Chain : public Dense {
 public:
  explicit Chain(bool has_stages) : Dense(2), chain_(Dense::shape()) {
    if (has_stages) chain_.stages = {0};
  }
  const NlpShape& shape() const override { return chain_; }

 private:
  NlpShape chain_;
};

TEST(Method, IsRiccatiUnlessOnlyIpoptCan) {
  const auto method = [](bool has_stages, const SolverOptions& options) {
    Chain program(has_stages);
    const NlpSolution s = solve_nlp(program, {1, 1}, options);
    EXPECT_EQ(s.status, SolveStatus::kSolved);
    EXPECT_EQ(s.method, s.attempts.back().method);
    return s.method;
  };
  EXPECT_EQ(method(true, {}), NlpMethod::kRiccati);
  EXPECT_EQ(method(false, {}), NlpMethod::kIpopt);
  EXPECT_EQ(method(true, {.limited_memory = true}), NlpMethod::kIpopt);
  EXPECT_EQ(method(true, {.print_level = 1}), NlpMethod::kIpopt);
  EXPECT_EQ(method(true, {.extra = {{"mu_strategy", "adaptive"}}}), NlpMethod::kIpopt);
  EXPECT_EQ(method(true, {.method = NlpMethod::kIpopt}), NlpMethod::kIpopt);
  EXPECT_EQ(method(false, {.method = NlpMethod::kRiccati}), NlpMethod::kRiccati);
}

TEST(Ipopt, ARequestDoesNotWaitForTheLinearSolver) {
  Dense large(2500);
  const std::vector<double> start(large.shape().n(), 1.0);
  std::stop_source stop;
  int told = 0;
  SolverOptions options{.stop = stop.get_token()};
  options.watch = [&](const IterationRecord&) { ++told; };
  Clock::time_point requested;
  std::thread impatient([&] {
    std::this_thread::sleep_for(700ms);
    requested = Clock::now();
    stop.request_stop();
  });
  const NlpSolution s = solve_with_ipopt(large, start, options);
  const auto waited = Clock::now() - requested;
  impatient.join();
  EXPECT_LT(waited, 600ms);
  EXPECT_EQ(s.status, SolveStatus::kStopped);
  ASSERT_EQ(s.x.size(), start.size());
  double objective = 0;
  large.objective(s.x.data(), objective);
  EXPECT_DOUBLE_EQ(s.objective, objective);
  EXPECT_EQ(int(s.log.size()), told);

  // Nothing is asked any more, while the next solve waits for its turn.
  const int calls = large.calls, told_then = told;
  Dense small(3);
  EXPECT_EQ(solve_with_ipopt(small, {1, 2, 3}).status, SolveStatus::kSolved);
  EXPECT_EQ(large.calls, calls);
  EXPECT_EQ(told, told_then);
}

TEST(Ipopt, WhatCanBeStoppedSolvesAlike) {
  Dense problem(20);
  std::stop_source stop;
  const std::vector<double> start(20, 0.3);
  const NlpSolution plain = solve_with_ipopt(problem, start);
  const NlpSolution threaded = solve_with_ipopt(problem, start, {.stop = stop.get_token()});
  EXPECT_EQ(threaded.status, SolveStatus::kSolved);
  EXPECT_EQ(threaded.x, plain.x);
  EXPECT_EQ(threaded.iterations(), plain.iterations());
}

}  // namespace

}  // namespace ipopt_test
