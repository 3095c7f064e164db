// SPDX-License-Identifier: BSD-3-Clause
//
// Loops on a device: the bits of steps by the interpreter, states kept, parts of states and steps, guards, NaN, errors.
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/device_loop.h>
#include <dyntape/codegen/pipeline.h>
#include <gtest/gtest.h>

#include <cmath>

#include "codegen/random_function.h"
#include "device_support.h"

namespace dyntape::device_loop_test {
namespace {

using testing::Random;
using testing::same;

CodegenOptions plain() {
  CodegenOptions options;
  options.order = Order::kValue;
  options.use_cache = false;
  return options;
}

// A pendulum with a motor, whose friction changes where it turns over: parameters h, and a torque and a gain of its own.
Function pendulum(bool with_call = false) {
  return record("pendulum", 2, 3, [&](const VectorXad& x, const VectorXad& p) {
    AD torque = p[1] - p[2] * x[1];
    if (x[0] < 3) torque = torque + 0.1;
    if (with_call) {
      const auto load = recorded_callee(record("load", 2, [](const VectorXad& y) {
        return VectorXad::Constant(1, y[0] * cos(y[1]) / (2 + sin(y[0]))).eval();
      }));
      torque = torque + call(load, x)[0] - call(load, VectorXad(2 * x))[0];
    }
    VectorXad next(2);
    next[1] = x[1] + p[0] * (torque - 9.81 * sin(x[0]));
    next[0] = x[0] + p[0] * next[1];
    return next;
  });
}

struct Case {
  std::size_t count = 0, steps = 0, every = 1;
  bool own_parameters = true;  // or the same for all states
};

// The motion of each state by the interpreter, as the header says it.
std::vector<double> interpreted(const Function& f, std::size_t shared, const Case& c, std::vector<double> x,
                                const std::vector<double>& both, const std::vector<double>& own) {
  CodegenOptions options = plain();
  options.route = Route::kInterpreter;
  const CompiledFunction step = CompiledFunction::make(f, options);
  CompiledFunction::Workspace workspace(step);
  const std::size_t n = f.n_x(), rest = f.n_p() - shared;
  std::vector<double> states;
  for (std::size_t s = 0; s < c.count; ++s) {
    double* here = &x[s * n];
    for (std::size_t k = 0; k < c.steps; ++k) {
      std::vector<double> p(both.begin() + long(k * shared), both.begin() + long((k + 1) * shared)), y(n);
      const double* of_state = own.data() + (c.own_parameters ? s * c.steps * rest : 0) + k * rest;
      p.insert(p.end(), of_state, of_state + rest);
      const Points points{.x = here, .p = p.data(), .y = y.data()};
      bool sound = !step.run(Order::kValue, points, workspace);
      for (const std::vector<double>& all : {p, y, std::vector<double>(here, here + n)})
        for (const double v : all) sound = sound && std::isfinite(v);
      for (std::size_t i = 0; i < n; ++i) here[i] = sound ? y[i] : std::nan("");
      if ((k + 1) % c.every == 0) states.insert(states.end(), here, here + n);
    }
  }
  return states;
}

void expect_same_bits(const Function& f, std::size_t shared, const Case& c, Random& random,
                      const DeviceRunOptions& how = {}) {
  const std::size_t rest = f.n_p() - shared, rows = c.own_parameters ? c.count : 1;
  std::vector<double> x = random.vector(c.count * f.n_x(), -3, 2.9), both(c.steps * shared, 0.02),
                      own = random.vector(rows * c.steps * rest, -0.5, 0.5);
  if (c.count > 5) x[5 * f.n_x()] = std::nan("");
  if (c.own_parameters && rest > 0 && c.count > 7)
    own[(7 * c.steps + 1) * rest] = HUGE_VAL;  // its second step
  std::vector<double> states(c.count * (c.steps / c.every) * f.n_x(), 7.0);
  DeviceLoop::make(f, {.shared = shared}, plain(), how)
      .run({.count = c.count,
            .steps = c.steps,
            .every = c.every,
            .x = x.data(),
            .shared = both.data(),
            .p = own.data(),
            .states = states.data(),
            .stride_x = f.n_x(),
            .stride_p = c.own_parameters ? c.steps * rest : 0});
  const std::vector<double> expected = interpreted(f, shared, c, x, both, own);
  ASSERT_EQ(states.size(), expected.size());
  std::size_t not_finite = 0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    ASSERT_TRUE(same(states[i], expected[i])) << i << ": " << states[i] << ", interpreted " << expected[i];
    not_finite += !std::isfinite(states[i]);
  }
  EXPECT_LT(not_finite, states.size());
  EXPECT_TRUE(not_finite > 0 || c.count <= 5);
}

TEST(DeviceLoop, StatesHaveTheInterpretersBits) {
  DYNTAPE_NEED_DEVICE;
  Random random(91);
  SCOPED_TRACE(random.seed_text());
  expect_same_bits(pendulum(), 1, {.count = 200, .steps = 60}, random);
  expect_same_bits(pendulum(), 1, {.count = 200, .steps = 60, .every = 7}, random);
  expect_same_bits(pendulum(), 1, {.count = 200, .steps = 60, .every = 60}, random);
  expect_same_bits(pendulum(), 1, {.count = 1, .steps = 5}, random);
  expect_same_bits(pendulum(), 1, {.count = 70, .steps = 9, .own_parameters = false}, random);
}

TEST(DeviceLoop, PartsChangeNothing) {
  DYNTAPE_NEED_DEVICE;
  Random random(92);
  SCOPED_TRACE(random.seed_text());
  const Case c{.count = 300, .steps = 50, .every = 6};
  expect_same_bits(pendulum(), 1, c, random, {.most_states = 64});
  expect_same_bits(pendulum(), 1, c, random, {.most_steps = 4});  // launches that keep no state
  expect_same_bits(pendulum(), 1, c, random, {.most_states = 64, .most_steps = 13});
  expect_same_bits(pendulum(), 1, c, random, {.piece_statements = 5});
}

TEST(DeviceLoop, SharedParametersAloneAndNone) {
  DYNTAPE_NEED_DEVICE;
  Random random(93);
  SCOPED_TRACE(random.seed_text());
  expect_same_bits(pendulum(), 3, {.count = 20, .steps = 30, .every = 2}, random);
  expect_same_bits(pendulum(), 0, {.count = 20, .steps = 30, .every = 2}, random);
  const Function map =
      record("map", 1, [](const VectorXad& x) { return VectorXad::Constant(1, sin(3 * x[0]) + 0.2).eval(); });
  expect_same_bits(map, 0, {.count = 20, .steps = 100, .every = 10}, random);
}

// Parameters of all steps, of each state or for all, and an output that only has to be finite.
TEST(DeviceLoop, ConstantsAndFurtherOutputs) {
  DYNTAPE_NEED_DEVICE;
  Random random(95);
  SCOPED_TRACE(random.seed_text());
  const Function damped = record("damped", 1, 3, [](const VectorXad& x, const VectorXad& p) {
    VectorXad y(2);
    y << x[0] - p[0] * (p[2] * x[0] - p[1]), 1 / (x[0] - 5);
    return y;
  });
  const std::size_t count = 90, steps = 12;
  std::vector<double> x = random.vector(count, -2, 2);
  const std::vector<double> h(steps, 0.1), own = random.vector(count * steps, -1, 1),
                                           gains = random.vector(count, 0, 3);
  x[8] = 5;  // where the other output is infinite
  for (const bool for_all : {false, true}) {
    std::vector<double> states(count * steps);
    DeviceLoop::make(damped, {.shared = 1, .constants = 1}, plain(), {.most_states = 50, .most_steps = 5})
        .run({.count = count,
              .steps = steps,
              .x = x.data(),
              .shared = h.data(),
              .p = own.data(),
              .constants = gains.data(),
              .states = states.data(),
              .stride_x = 1,
              .stride_p = steps,
              .stride_constants = for_all ? 0u : 1u});
    for (std::size_t s = 0; s < count; ++s) {
      double v = x[s];
      for (std::size_t k = 0; k < steps; ++k) {
        v = v - 0.1 * (gains[for_all ? 0 : s] * v - own[s * steps + k]);
        if (s == 8) v = std::nan("");
        ASSERT_TRUE(same(states[s * steps + k], v)) << s << ", " << k;
      }
    }
  }
}

TEST(DeviceLoop, CallsInside) {
  DYNTAPE_NEED_DEVICE;
  Random random(94);
  SCOPED_TRACE(random.seed_text());
  expect_same_bits(pendulum(true), 1, {.count = 70, .steps = 20, .every = 5}, random);
}

TEST(DeviceLoop, Single) {
  DYNTAPE_NEED_DEVICE;
  const Function map = record("halves", 1, 1, [](const VectorXad& x, const VectorXad& p) {
    return VectorXad::Constant(1, x[0] * p[0] + 0.1).eval();
  });
  const std::vector<double> x = {1, 2}, p = {0.5, 0.5, 0.5};
  std::vector<double> y(2);
  DeviceLoop::make(map, {.shared = 1}, plain(), {.single = true})
      .run({.count = 2,
            .steps = 3,
            .every = 3,
            .x = x.data(),
            .shared = p.data(),
            .states = y.data(),
            .stride_x = 1});
  for (std::size_t s = 0; s < 2; ++s) {
    float v = float(x[s]);
    for (int k = 0; k < 3; ++k) v = v * 0.5f + 0.1f;
    EXPECT_EQ(y[s], double(v));
  }
}

TEST(DeviceLoop, AStopEndsItBetweenLaunches) {
  DYNTAPE_NEED_DEVICE;
  std::stop_source stop;
  stop.request_stop();
  const std::vector<double> x = {1, 2}, p(3 * 1000, 0.1);
  std::vector<double> y(2 * 1000, 7.0);
  DeviceLoop::make(pendulum(), {.shared = 3}, plain())
      .run({.count = 1, .steps = 1000, .x = x.data(), .shared = p.data(), .states = y.data(), .stride_x = 2},
           stop.get_token());
  EXPECT_EQ(y, std::vector<double>(2 * 1000, 7.0));
}

// A device is not needed for its text.
TEST(DeviceLoopText, HasOneKernelWithTheArraysThatItNeeds) {
  const auto text_with = [](std::size_t shared, std::size_t constants) {
    return generate_device(pendulum(), plain(),
                           {.language = codegen::DeviceLanguage::kCuda,
                            .loop = codegen::LoopParameters{shared, constants}})
        .source.text;
  };
  const std::string all = text_with(1, 1);
  EXPECT_NE(
      all.find("DT_ENTRY void pendulum_loop(DT_GLOBAL real* DT_RESTRICT x, DT_GLOBAL const real* DT_RESTRICT "
               "shared, DT_GLOBAL const real* DT_RESTRICT p, DT_GLOBAL const real* DT_RESTRICT constants, "
               "DT_GLOBAL real* DT_RESTRICT states, "),
      std::string::npos);
  EXPECT_EQ(all.find("pendulum_value"), std::string::npos);
  EXPECT_NE(
      text_with(0, 3).find("DT_RESTRICT x, DT_GLOBAL const real* DT_RESTRICT constants, DT_GLOBAL real*"),
      std::string::npos);
  EXPECT_NE(text_with(3, 0).find("DT_RESTRICT x, DT_GLOBAL const real* DT_RESTRICT shared, DT_GLOBAL real*"),
            std::string::npos);
}

TEST(DeviceLoopErrors, FunctionsThatAreNoSteps) {
  DYNTAPE_NEED_DEVICE;
  const Function f =
      record("sum", 2, [](const VectorXad& x) { return VectorXad::Constant(1, x.sum()).eval(); });
  try {
    (void)DeviceLoop::make(f, {}, plain());
    FAIL() << "no ArgumentError";
  } catch (const ArgumentError& e) {
    EXPECT_STREQ(e.what(),
                 "loop of \"sum\": 2 variables, 1 outputs; expected the value of a function with as many "
                 "outputs or more, "
                 "without weights");
  }
  EXPECT_THROW(DeviceLoop::make(pendulum(), {.shared = 1}, plain()).run({.count = 1, .steps = 1, .every = 0}),
               ArgumentError);
}

}  // namespace
}  // namespace dyntape::device_loop_test
