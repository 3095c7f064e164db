// SPDX-License-Identifier: BSD-3-Clause
//
// Reverse sweeps with few states in memory: the same bits, and as few steps as there can be.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/sensitivity/checkpoints.h>
#include "interface/message_of.h"

namespace dyntape::checkpoints_test {
namespace {

using Eigen::VectorXd;

// A step that rounds and forgets: x' = (x0 + h x1, x1 - h sin x0), whose derivatives depend on the state.
struct Pendulum {
  double h = 0.01;
  long calls = 0, last = -1;
  bool in_order = true;
  double slope_of_h = 0;

  ReversibleSteps steps(long N) {
    last = N;
    return {.forward =
                [this](long, const VectorXd& x, VectorXd& next) {
                  ++calls;
                  next = Eigen::Vector2d(x[0] + h * x[1], x[1] - h * std::sin(x[0]));
                },
            .end = [](const VectorXd& x) { return VectorXd(Eigen::Vector2d(x[1], x[0] * x[1])); },
            .back =
                [this](long k, const VectorXd& x, VectorXd& a) {
                  in_order = in_order && k == --last;
                  slope_of_h += a[0] * x[1] - a[1] * std::sin(x[0]);
                  a = Eigen::Vector2d(a[0] - h * std::cos(x[0]) * a[1], h * a[0] + a[1]);
                }};
  }
};

TEST(Checkpoints, GiveTheSameBitsHoweverManyThereAre) {
  for (const long N : {0L, 1L, 2L, 3L, 10L, 137L, 1000L}) {
    Pendulum all;
    const VectorXd x0 = Eigen::Vector2d(1, 0.3);
    const ReverseSweep reference = reverse_sweep(N, std::max(N, 1L), x0, all.steps(N));
    EXPECT_EQ(reference.forward_steps, N);
    for (const long s : {1L, 2L, 3L, 4L, 7L, 20L, 136L, 5000L}) {
      Pendulum few;
      const ReverseSweep sweep = reverse_sweep(N, s, x0, few.steps(N));
      EXPECT_TRUE(few.in_order) << N << " " << s;
      EXPECT_EQ(few.last, 0);
      EXPECT_EQ(sweep.adjoint, reference.adjoint) << N << " " << s;
      EXPECT_EQ(few.slope_of_h, all.slope_of_h) << N << " " << s;
      EXPECT_LE(sweep.stored, s);
      EXPECT_EQ(sweep.forward_steps, few.calls);
      EXPECT_EQ(sweep.forward_steps, N == 0 ? 0 : fewest_forward_steps(N, s) + 1) << N << " " << s;
    }
  }
}

// The fewest by trying every place of the second checkpoint; the formula does not know of places.
TEST(Checkpoints, TakeTheFewestStepsThereAre) {
  constexpr int kMost = 120;
  std::vector<std::vector<long>> fewest(14, std::vector<long>(kMost + 1, 0));
  for (long s = 1; s < 14; ++s) {
    for (long N = 1; N <= kMost; ++N) {
      long& best = fewest[std::size_t(s)][std::size_t(N)];
      best = N * (N - 1) / 2;
      for (long m = 1; m < N && s > 1; ++m)
        best = std::min(best, m + fewest[std::size_t(s)][std::size_t(m)] +
                                  fewest[std::size_t(s) - 1][std::size_t(N - m)]);
      EXPECT_EQ(fewest_forward_steps(N, s), best) << N << " " << s;
      Pendulum p;
      EXPECT_EQ(reverse_sweep(N, s, Eigen::Vector2d(1, 0), p.steps(N)).forward_steps, best + 1)
          << N << " " << s;
    }
  }
}

// The root of N takes two or three times N; the logarithm of N a multiple that grows with log N.
TEST(Checkpoints, TradeMemoryForSteps) {
  for (const long N : {100L, 10000L, 1000000L}) {
    const long root = std::lround(std::sqrt(double(N))), log2 = std::lround(std::log2(double(N)));
    EXPECT_EQ(fewest_forward_steps(std::numeric_limits<long>::max(), 1), std::numeric_limits<long>::max());
    EXPECT_LE(fewest_forward_steps(N, root), 3 * N);
    EXPECT_LE(fewest_forward_steps(N, log2), 8 * N);
    EXPECT_GT(fewest_forward_steps(N, log2), N);
  }
  EXPECT_EQ(fewest_forward_steps(1000000, 1), 1000000L * 999999 / 2);
  // beta(20, 7) = 888030, beta(20, 8) = 3108105: r = 8, less beta(21, 7) = 1184040.
  EXPECT_EQ(fewest_forward_steps(1000000, 20), 8000000 - 1184040);
  EXPECT_EQ(fewest_forward_steps(1L << 40, 1), std::numeric_limits<long>::max());  // more than can be counted
  EXPECT_EQ(fewest_forward_steps(1L << 60, std::numeric_limits<long>::max()), (1L << 60) - 1);
}

TEST(Checkpoints, LongRowsNeedNoStack) {
  Pendulum p{.h = 1e-6};
  const long N = 300000;
  const ReverseSweep sweep = reverse_sweep(N, 12, Eigen::Vector2d(1, 0), p.steps(N));
  EXPECT_EQ(sweep.forward_steps, fewest_forward_steps(N, 12) + 1);
  EXPECT_EQ(sweep.stored, 12);
  EXPECT_TRUE(p.in_order);
}

TEST(Checkpoints, RefuseWhatMakesNoSense) {
  Pendulum p;
  EXPECT_EQ(message_of<ArgumentError>([&] { reverse_sweep(3, 0, VectorXd::Zero(2), p.steps(3)); }),
            "a reverse sweep with 0 checkpoints: expected at least 1, that of the start");
  EXPECT_EQ(message_of<ArgumentError>([&] { reverse_sweep(-3, 1, VectorXd::Zero(2), p.steps(3)); }),
            "a reverse sweep of -3 steps: expected 0 or more");
  EXPECT_EQ(message_of<ArgumentError>([&] { reverse_sweep(3, 1, VectorXd::Zero(2), {}); }),
            "a reverse sweep needs all of forward, end and back");
}

}  // namespace
}  // namespace dyntape::checkpoints_test
