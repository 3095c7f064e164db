// SPDX-License-Identifier: BSD-3-Clause
//
// The kernels of a function: the same bits in each, skipped outputs, many points, guards, threads, errors.
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <gtest/gtest.h>

#include <cstring>
#include <span>
#include <thread>

#include "random_function.h"

namespace dyntape::kernels_test {
namespace {

using testing::Random;
using testing::same;

// A chain of links with all joints coupled; smooth, so that all derivatives are finite.
Function chain(std::size_t n) {
  return record("chain", n, 2, [n](const VectorXad& x, const VectorXad& p) {
    VectorXad y(n);
    AD angle = 0.0, sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      angle += x[i];
      sum += p[0] * sin(angle) + p[1] * exp(-x[i] * x[i]) * cos(angle);
      y[i] = sum * x[n - 1 - i] + hypot(x[i], p[1]);
    }
    return y;
  });
}

CodegenOptions options_for(Order order, Route route, std::size_t piece_statements = 400) {
  CodegenOptions options;
  options.order = order;
  options.route = route;
  options.use_cache = false;
  options.piece_statements = piece_statements;
  return options;
}

class Kernels : public ::testing::TestWithParam<std::tuple<Route, std::size_t>> {
 protected:
  CompiledFunction make(const Function& f, Order order = Order::kSecond) const {
    return CompiledFunction::make(f, options_for(order, std::get<0>(GetParam()), std::get<1>(GetParam())));
  }
};

TEST_P(Kernels, EachGivesTheSameBits) {
  Random random(11);
  SCOPED_TRACE(random.seed_text());
  const Function f = chain(6);
  const CompiledFunction c = make(f);
  const Derivatives first = derive(f, Order::kFirst), second = derive(f, Order::kSecond);
  EXPECT_EQ(c.jacobian_pattern(), second.jacobian);
  EXPECT_EQ(c.jacobian_pattern(), first.jacobian);
  EXPECT_EQ(c.hessian_pattern(), second.hessian);
  CompiledFunction::Workspace workspace(c);
  for (int k = 0; k < 50; ++k) {
    const auto x = random.vector(6, -2, 2), p = random.vector(2, -2, 2), w = random.vector(6, -1, 1);
    const auto y = evaluate(f, x, p), d1 = evaluate(first.function, x, p),
               d2 = evaluate(second.function, x, p, w);
    std::vector<double> y0(6), y1(6), y2(6), j1(first.jacobian.nnz()), j2 = j1, h(second.hessian.nnz());
    c.value(x.data(), p.data(), y0.data(), workspace);
    c.first_order(x.data(), p.data(), y1.data(), j1.data(), workspace);
    c.second_order(x.data(), p.data(), w.data(), y2.data(), j2.data(), h.data(), workspace);
    EXPECT_EQ(y0, y);
    EXPECT_EQ(y1, y);
    EXPECT_EQ(y2, y);
    EXPECT_TRUE(std::equal(j1.begin(), j1.end(), d1.begin() + 6));
    EXPECT_TRUE(std::equal(j2.begin(), j2.end(), d2.begin() + 6));
    EXPECT_TRUE(std::equal(h.begin(), h.end(), d2.begin() + 6 + std::ptrdiff_t(j2.size())));
  }
  // Together they cost less than apart: what they share is computed once.
  EXPECT_LT(c.operations(Order::kSecond), total_operations(f) +
                                              total_operations(sparse_jacobian(f).function) +
                                              total_operations(sparse_hessian(f).function));
}

TEST_P(Kernels, OutputsThatAreNullAreSkipped) {
  Random random(12);
  SCOPED_TRACE(random.seed_text());
  const Function f = chain(5);
  const CompiledFunction c = make(f);
  CompiledFunction::Workspace workspace(c);
  const auto x = random.vector(5, -2, 2), p = random.vector(2, -2, 2), w = random.vector(5, -1, 1);
  const auto all = c.evaluate(Order::kSecond, x, p, w);
  for (int mask = 0; mask < 8; ++mask) {
    std::vector<double> y(all.y.size(), -7), j(all.jacobian.size(), -7), h(all.hessian.size(), -7);
    c.second_order(x.data(), p.data(), w.data(), mask & 1 ? y.data() : nullptr, mask & 2 ? j.data() : nullptr,
                   mask & 4 ? h.data() : nullptr, workspace);
    EXPECT_EQ(y, mask & 1 ? all.y : std::vector<double>(y.size(), -7));
    EXPECT_EQ(j, mask & 2 ? all.jacobian : std::vector<double>(j.size(), -7));
    EXPECT_EQ(h, mask & 4 ? all.hessian : std::vector<double>(h.size(), -7));
  }
}

TEST_P(Kernels, ManyPointsWithAndWithoutGaps) {
  Random random(13);
  SCOPED_TRACE(random.seed_text());
  const Function f = chain(4);
  const CompiledFunction c = make(f);
  CompiledFunction::Workspace workspace(c);
  const std::size_t lanes = 7, nj = c.jacobian_pattern().nnz(), nh = c.hessian_pattern().nnz();
  for (const std::size_t gap : {0, 3}) {
    const Strides s{4 + gap, 0, 4 + gap, 4 + gap, nj + gap, nh + gap};  // one set of parameters for all
    const auto x = random.vector(lanes * s.x, -2, 2), p = random.vector(2, -2, 2),
               w = random.vector(lanes * s.w, -1, 1);
    std::vector<double> y(lanes * s.y, -7), j(lanes * s.jacobian, -7), h(lanes * s.hessian, -7);
    EXPECT_FALSE(c.run(Order::kSecond,
                       {lanes, x.data(), p.data(), w.data(), y.data(), j.data(), h.data(), &s, nullptr},
                       workspace));
    for (std::size_t i = 0; i < lanes; ++i) {
      const auto part = [&](const std::vector<double>& v, std::size_t stride, std::size_t n) {
        return std::vector<double>(v.begin() + std::ptrdiff_t(i * stride),
                                   v.begin() + std::ptrdiff_t(i * stride + n));
      };
      const auto one = c.evaluate(Order::kSecond, part(x, s.x, 4), p, part(w, s.w, 4));
      EXPECT_EQ(part(y, s.y, 4), one.y);
      EXPECT_EQ(part(j, s.jacobian, nj), one.jacobian);
      EXPECT_EQ(part(h, s.hessian, nh), one.hessian);
      for (std::size_t k = 4; k < s.y; ++k) EXPECT_EQ(y[i * s.y + k], -7) << "written beyond its end";
    }
  }
  // Null strides: the lanes follow each other.
  const auto x = random.vector(lanes * 4, -2, 2), p = random.vector(lanes * 2, -2, 2);
  std::vector<double> y(lanes * 4), y0(4);
  EXPECT_FALSE(c.run(Order::kValue,
                     {lanes, x.data(), p.data(), nullptr, y.data(), nullptr, nullptr, nullptr, nullptr},
                     workspace));
  for (std::size_t i = 0; i < lanes; ++i) {
    c.value(x.data() + 4 * i, p.data() + 2 * i, y0.data(), workspace);
    EXPECT_TRUE(std::equal(y0.begin(), y0.end(), y.begin() + std::ptrdiff_t(4 * i)));
  }
}

// Three comparisons; which of them fail depends on x.
Function guarded() {
  return record("guarded", 3, [](const VectorXad& x) {
    AD y = x[0];
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 10; ++k) y = sin(y) + x[i];  // so that pieces lie between the guards
      if (x[2 - i] * 1.0 + y * 0.0 < 2.0) y += 1.0;
    }
    return VectorXad::Constant(1, y).eval();
  });
}

TEST_P(Kernels, TheFirstViolatedGuardIsReported) {
  const Function f = guarded();
  ASSERT_EQ(f.guards.size(), 3u);
  const CompiledFunction c = make(f, Order::kFirst);
  CompiledFunction::Workspace workspace(c);
  double y = 0, j[3];
  std::vector<double> points;
  std::vector<std::uint32_t> expected;
  for (int mask = 0; mask < 8; ++mask) {
    const std::vector<double> x = {mask & 4 ? 3.0 : 0.5, mask & 2 ? 3.0 : 0.4, mask & 1 ? 3.0 : 0.3};
    points.insert(points.end(), x.begin(), x.end());
    expected.push_back(mask & 1 ? 1 : mask & 2 ? 2 : mask & 4 ? 3 : 0);
    for (Order order : {Order::kValue, Order::kFirst})
      EXPECT_EQ(
          c.run(order, {1, x.data(), nullptr, nullptr, &y, j, nullptr, nullptr, nullptr}, workspace).guard,
          expected.back());
    Violation alone;
    if (c.run_without_workspace(Order::kFirst, {.x = x.data(), .y = &y, .jacobian = j}, alone)) {
      EXPECT_EQ(alone.guard, expected.back());
    }
    if (mask == 0) continue;
    try {
      c.value(x.data(), nullptr, &y, workspace);
      FAIL() << "no GuardViolation for mask " << mask;
    } catch (const GuardViolation& e) {
      EXPECT_EQ(e.what(), describe_guard(f, expected.back()));
      EXPECT_NE(std::string(e.what()).find("kernels_test.cpp"), std::string::npos);
    }
  }
  std::vector<std::uint32_t> status(8, 77);
  std::vector<double> many(8);
  const Points batch{8,       points.data(), nullptr, nullptr,      many.data(),
                     nullptr, nullptr,       nullptr, status.data()};
  const Violation violation = c.run(Order::kValue, batch, workspace);
  EXPECT_EQ(status, expected);
  EXPECT_EQ(violation.point, 1u);
  Points silent = batch;
  silent.status = nullptr;
  EXPECT_EQ(c.run(Order::kValue, silent, workspace).point, 1u);
  EXPECT_THROW(c.check(violation, 8), GuardViolation);
}

TEST_P(Kernels, ThreadsWithTheirOwnWorkspaces) {
  const Function f = chain(8);
  const CompiledFunction c = make(f);
  std::vector<std::thread> threads;
  std::vector<int> wrong(4, 0);
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      Random random(20 + std::uint64_t(t));
      const CompiledFunction copy = c;
      CompiledFunction::Workspace workspace(copy);
      Interpreter interpreter(f);
      Interpreter::Workspace reference(interpreter);
      std::vector<double> y(8), expected(8);
      for (int k = 0; k < 200; ++k) {
        const auto x = random.vector(8, -2, 2), p = random.vector(2, -2, 2);
        copy.first_order(x.data(), p.data(), y.data(), nullptr, workspace);
        interpreter(x.data(), p.data(), nullptr, expected.data(), reference);
        wrong[std::size_t(t)] += y != expected;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, std::vector<int>(4, 0));
}

TEST_P(Kernels, ShortFunctionsNeedNoWorkspace) {
  const Function f = chain(4);
  const CompiledFunction c = make(f);
  const std::vector<double> x{0.5, -1, 0.25, 2}, p{1.5, 0.75}, w{1, 2, 3, 4};
  const auto expected = c.evaluate(Order::kSecond, x, p, w);
  const auto run = [&](Order order, auto&& check) {
    std::vector<double> y(4, -1), jacobian(c.jacobian_pattern().nnz()), hessian(c.hessian_pattern().nnz());
    Violation violation{7, 7};
    const bool ran = c.run_without_workspace(order,
                                             {.x = x.data(),
                                              .p = p.data(),
                                              .w = w.data(),
                                              .y = y.data(),
                                              .jacobian = jacobian.data(),
                                              .hessian = hessian.data()},
                                             violation);
    if (c.route() == Route::kInterpreter) {
      EXPECT_FALSE(ran);
    }
    if (ran) {
      EXPECT_TRUE(!violation && y == expected.y && check(jacobian, hessian));
    } else {
      EXPECT_EQ(y, std::vector<double>(4, -1));
    }
    return ran;
  };
  run(Order::kValue, [](auto&...) { return true; });
  run(Order::kFirst, [&](auto& J, auto&) { return J == expected.jacobian; });
  const auto second = [&](auto& J, auto& H) { return J == expected.jacobian && H == expected.hessian; };
  run(Order::kSecond, second);
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k)
    threads.emplace_back([&] {
      for (int repeat = 0; repeat < 100; ++repeat) run(Order::kSecond, second);
    });
  for (std::thread& thread : threads) thread.join();
  const CompiledFunction values = make(f, Order::kValue);
  Violation violation;
  EXPECT_THROW((void)values.run_without_workspace(Order::kFirst, {}, violation), ArgumentError);
}

TEST_P(Kernels, BlocksThatAreNotUsedAreNotRead) {
  const Function f = record("unused", 2, 3, [](const VectorXad& x, const VectorXad&) {
    return VectorXad::Constant(1, x[1] * x[1]).eval();
  });
  const CompiledFunction c = make(f, Order::kFirst);
  CompiledFunction::Workspace workspace(c);
  const double x[2] = {1, 3};
  double y = 0, j[1] = {0};
  c.first_order(x, nullptr, &y, j, workspace);
  EXPECT_EQ(y, 9);
  EXPECT_EQ(j[0], 6);
}

TEST_P(Kernels, WeightsOfTheFunctionPrecedeThoseOfTheHessian) {
  const Function f = jvp(chain(3));  // (x, p, dx) -> J dx
  const CompiledFunction c = make(f);
  ASSERT_EQ(c.n_w(), 3u);
  Random random(14);
  const auto x = random.vector(3, -1, 1), p = random.vector(2, -1, 1), w = random.vector(6, -1, 1);
  const Derivatives d = derive(f, Order::kSecond);
  const auto expected = evaluate(d.function, x, p, w);
  const auto found = c.evaluate(Order::kSecond, x, p, w);
  EXPECT_TRUE(std::equal(found.y.begin(), found.y.end(), expected.begin()));
  EXPECT_EQ(found.y, c.evaluate(Order::kValue, x, p, std::span(w).first(3)).y);
  EXPECT_TRUE(std::equal(found.hessian.rbegin(), found.hessian.rend(), expected.rbegin()));
  CompiledFunction::Workspace workspace(c);
  double y[3];
  EXPECT_THROW(c.value(x.data(), p.data(), y, workspace), ArgumentError);
}

template <class Call>
std::string message_of(Call&& call) {
  try {
    call();
  } catch (const ArgumentError& e) {
    return e.what();
  }
  return "no ArgumentError";
}

TEST_P(Kernels, WrongUseIsNamed) {
  const CompiledFunction c = make(chain(2), Order::kValue), other = make(chain(3), Order::kValue);
  CompiledFunction::Workspace workspace(c);
  double buffer[10] = {0};
  const std::string order = message_of([&] { c.first_order(buffer, buffer, buffer, buffer, workspace); });
  EXPECT_NE(order.find("order 0"), std::string::npos) << order;
  EXPECT_NE(order.find("order 1"), std::string::npos) << order;
  EXPECT_NE(message_of([&] { (void)c.jacobian_pattern(); }).find("order 1"), std::string::npos);
  EXPECT_NE(message_of([&] { (void)c.hessian_pattern(); }).find("order 2"), std::string::npos);
  EXPECT_NE(message_of([&] { other.value(buffer, buffer, buffer, workspace); }).find("workspace"),
            std::string::npos);
  EXPECT_EQ(message_of([&] {
              c.evaluate(Order::kValue, {1.0}, {1, 2});
            }),
            "evaluate: x has 1 entries, function \"chain\" expects 2");
}

INSTANTIATE_TEST_SUITE_P(Routes, Kernels,
                         ::testing::Values(std::tuple(Route::kInterpreter, std::size_t{400}),
                                           std::tuple(Route::kCompiled, std::size_t{400}),
                                           std::tuple(Route::kCompiled, std::size_t{12})));

}  // namespace
}  // namespace dyntape::kernels_test
