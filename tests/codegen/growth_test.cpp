// SPDX-License-Identifier: BSD-3-Clause
//
// Time is linear in outputs, in parts that are alike and in how often they meet.  Times are of the processor, and
// asserted where quadratic work takes seconds: four times the size may take seven times as long.
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/passes/outline.h>
#include <dyntape/codegen/passes/repeats.h>
#include <dyntape/codegen/schedule/schedule.h>
#include <gtest/gtest.h>

#include <ctime>

namespace dyntape::growth_test {
namespace {

using Index = Eigen::Index;

template <class Work>
double seconds_of(Work&& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

template <class Make, class Work>
void expect_linear(std::size_t n, Make&& make, Work&& work) {
  const Function small = compact(make(n / 4)), large = compact(make(n));
  const double some = seconds_of([&] { work(small); });
  EXPECT_LT(seconds_of([&] { work(large); }), 7 * some + 0.2);
}

TEST(Growth, OutputsThatNothingComputes) {
  const auto leaves = [](std::size_t n) { return record("leaves", n, [](const VectorXad& x) { return x; }); };
  expect_linear(160000, leaves, [](const Function& f) { codegen::schedule(f, {{0, f.n_y()}}, 250); });
}

// The key of a library is taken of every callee, also where it is found in the cache.
TEST(Growth, CalleesOfWhichNoTwoAreAlike) {
  const auto calls = [](std::size_t n) {
    std::vector<std::shared_ptr<const Callee>> callees;
    for (std::size_t k = 0; k < n; ++k) {
      const auto factor = static_cast<double>(n + k);
      callees.push_back(
          recorded_callee(record("c", 1, [&](const VectorXad& x) { return VectorXad(factor * x); })));
    }
    return record("calls", 1, [&](const VectorXad& x) {
      VectorXad y(static_cast<Index>(n));
      for (std::size_t k = 0; k < n; ++k) y[static_cast<Index>(k)] = call(callees[k], x)[0];
      return y;
    });
  };
  expect_linear(16000, calls, [](const Function& f) { content_hash(f, 1); });
}

// Two parts with as many outputs, no two of which are made of the same operators.
Function twins(std::size_t n) {
  return record("twins", 2, [&](const VectorXad& x) {
    VectorXad y(static_cast<Index>(2 * n));
    for (std::size_t k = 0; k < n; ++k) {
      for (Index part = 0; part < 2; ++part) {
        AD v = sin(x[part]) * (2.0 + static_cast<double>(part));
        for (std::size_t bits = k + 1; bits; bits >>= 1) v = bits & 1 ? sin(v) : cos(v);
        y[2 * static_cast<Index>(k) + part] = v * (1.5 + static_cast<double>(part));
      }
    }
    return y;
  });
}

TEST(Growth, PartsThatManyWalksLeadTo) {
  EXPECT_EQ(codegen::find_repeats(compact(twins(1000))).count, 2u);
  expect_linear(40000, twins, [](const Function& f) { codegen::find_repeats(f); });
}

// A pair of long parts beside many pairs of short ones: the more there are, the smaller each.
Function couples(std::size_t pairs) {
  return record("couples", 2 * pairs + 2, [&](const VectorXad& x) {
    VectorXad y = x;
    for (Index i = 0; i < y.size(); ++i) {
      const bool is_long = i + 2 >= y.size();
      const std::size_t steps = is_long ? 4 * pairs : 16, bits = static_cast<std::size_t>(i / 2) | 1u << 14;
      for (std::size_t k = 0; k < steps; ++k)
        y[i] = (is_long ? k % 3 : bits >> k & 1) ? sin(y[i]) : cos(y[i]);
    }
    return y;
  });
}

TEST(Growth, PartsBesideManySmallerOnes) {
  EXPECT_EQ(codegen::find_repeats(compact(couples(100))).count, 2u);
  expect_linear(4000, couples, [](const Function& f) { codegen::find_repeats(f); });
}

// Four parts that meet in every step: each step is a part of its own.
Function dancers(std::size_t steps) {
  return record("dancers", 5, [&](const VectorXad& x) {
    AD body = x[4];
    for (std::size_t i = 0; i < steps; ++i) {
      AD u[4];
      for (Index k = 0; k < 4; ++k)
        u[k] = sin(body * x[k]) * cos(x[k] + body) * (1.5 + static_cast<double>(k));
      body = (u[0] + u[1]) + (u[2] + u[3]);
    }
    return VectorXad::Constant(1, body).eval();
  });
}

TEST(Growth, PartsThatMeetOften) {
  const auto prepare = [](const Function& f) {
    const Function shorter = codegen::outlined(f);
    EXPECT_FALSE(shorter.graph.callees().empty());
    codegen::schedule(shorter, {{0, 1}}, 250);
  };
  expect_linear(4000, dancers, prepare);
}

}  // namespace
}  // namespace dyntape::growth_test
