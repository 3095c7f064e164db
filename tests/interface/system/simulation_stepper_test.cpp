// SPDX-License-Identifier: BSD-3-Clause
//
// What a stepper promises of every scheme: exact Jacobians, exact motors, the same bits, sentences.
#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/simulation/steps.h>
#include <dyntape/interface/system/run.h>

#include <array>
#include <cmath>

#include "counted_allocations.h"
#include "dynamics/random_robots.h"
#include "interface/temporary_cache.h"
#include "simulated_systems.h"

namespace dyntape::simulation_stepper_test {
namespace {

using namespace test;
using dynamics::Random;
using Eigen::MatrixXd;

// A state with commands and parameters, and its neighbours.
struct Start {
  explicit Start(const System& system, unsigned long seed) : model(system.model), random(seed) {
    const dynamics::State s = dynamics::random_state(model, random);
    const int n_m = int(lagged_motors(system).size());
    x.resize(model.nq + model.nv + n_m);
    x << s.q, s.v, random.vector(n_m);
    u = random.vector(system.n_u);
    p = random.vector(system.n_p);
  }
  auto space() const {
    return dynamics::ProductSpace(dynamics::ConfigurationSpace<double>(model),
                                  dynamics::EuclideanSpace<double>(int(x.size()) - model.nq));
  }

  dynamics::Model<double> model;
  Random random;
  VectorXd x, u, p;
};

VectorXd after(Stepper& stepper, double t, double h, const Start& s) {
  VectorXd next(stepper.nx());
  std::string why;
  EXPECT_TRUE(stepper.step(t, h, s.x.data(), s.u.data(), s.p.data(), next.data(), &why)) << why;
  return next;
}

class OfEach : public ::testing::TestWithParam<Integrator> {};  // that makes fixed steps
class OfAny : public ::testing::TestWithParam<Integrator> {};

// Central differences of order 8.
template <class F>
MatrixXd differences(int columns, const F& f) {
  constexpr std::array<double, 4> kWeights{4. / 5, -1. / 5, 4. / 105, -1. / 280};
  constexpr double kStep = 0.02;
  MatrixXd D;
  for (int c = 0; c < columns; ++c) {
    VectorXd sum;
    for (int k = 1; k <= 4; ++k) {
      const VectorXd d = VectorXd::Unit(columns, c) * (k * kStep), term = (f(d) - f(-d)) * kWeights[k - 1];
      sum = k == 1 ? term : VectorXd(sum + term);
    }
    if (c == 0) D.resize(sum.size(), columns);
    D.col(c) = sum / kStep;
  }
  if (columns == 0) D.resize(0, 0);
  return D;
}

void expect_exact_jacobians(const System& system, Integrator integrator) {
  Stepper stepper(system, integrator, kInterpreted, true);
  for (unsigned long seed = 1; seed <= 3; ++seed) {
    const Start s(system, seed);
    const double t = 0.3, h = 0.02;
    VectorXd next(stepper.nx());
    MatrixXd A, B, P;
    ASSERT_TRUE(stepper.jacobians(t, h, s.x.data(), s.u.data(), s.p.data(), next.data(), A, B, P));
    EXPECT_EQ(next, after(stepper, t, h, s));
    const auto moved = [&](const VectorXd& dx, const VectorXd& du, const VectorXd& dp) {
      Start there = s;
      if (dx.size()) there.x = s.space().integrate(s.x, dx);
      if (du.size()) there.u += du;
      if (dp.size()) there.p += dp;
      return VectorXd(s.space().difference(next, after(stepper, t, h, there)));
    };
    const VectorXd none;
    const MatrixXd by_x = differences(stepper.nt(), [&](const VectorXd&d) { return moved(d, none, none); }),
                   by_u = differences(stepper.n_u(), [&](const VectorXd&d) { return moved(none, d, none); }),
                   by_p = differences(stepper.n_p(), [&](const VectorXd&d) { return moved(none, none, d); });
    EXPECT_LE(dynamics::relative_error(A, by_x), 1e-10) << "seed " << seed;
    EXPECT_LE(dynamics::relative_error(P, by_p), 1e-10) << "seed " << seed;
    ASSERT_EQ(B.cols(), system.n_u);
    if (system.n_u == 0) continue;
    EXPECT_LE(dynamics::relative_error(B, by_u), 1e-10) << "seed " << seed;
  }
}

TEST_P(OfEach, JacobiansAreExact) { expect_exact_jacobians(walker(), GetParam()); }

// Parameters in the kinetic and the potential energy, and a term that is linear in v, which does nothing.
TEST_P(OfEach, JacobiansByParametersOfTheLagrangian) {
  System s = pendulum();
  s.n_p = 2;
  s.acceleration = [](const SystemPoint<AD>& at) {
    return VectorXad(VectorXad::Constant(1, -(1.5 + at.p[1]) / (1.5 + at.p[0]) * sin(at.q[0])));
  };
  s.lagrangian = [](const VectorXad& q, const VectorXad& v, const VectorXad& p) {
    return (1.5 + p[0]) * v[0] * v[0] * 0.5 + (1.5 + p[1]) * cos(q[0]) + 0.3 * v[0];
  };
  expect_exact_jacobians(s, GetParam());
}

// From both ends of a motion of 16, 32 steps against one of many more.
TEST_P(OfEach, ConvergesWithItsOrder) {
  const System system = walker();
  const Start s(system, 4);
  const double span = 0.2;
  const auto end_of = [&](Stepper& stepper, int steps) {
    Start at = s;
    for (int k = 0; k < steps; ++k) at.x = after(stepper, k * span / steps, span / steps, at);
    return at.x;
  };
  Stepper exact(system, Integrator::kRungeKutta4, kInterpreted), stepper(system, GetParam(), kInterpreted);
  const VectorXd reference = end_of(exact, 1024);
  const auto error = [&](int steps) {
    return s.space().difference(reference, end_of(stepper, steps)).norm();
  };
  const bool is_first =
      GetParam() == Integrator::kSemiImplicitEuler || GetParam() == Integrator::kImplicitVelocity;
  const double order = is_first ? 1 : GetParam() == Integrator::kRungeKutta4 ? 4 : 2;
  EXPECT_NEAR(std::log2(error(32) / error(64)), order, 0.15);
}

// m(t + s) = u + (m - u) exp(-s / lag), however long the step is.
TEST_P(OfAny, MotorsAreFollowedExactly) {
  System system = walker();
  const double lag = 1e-4;
  system.lag = Eigen::Vector2d(0.02, lag);
  Stepper stepper(system, GetParam(), kInterpreted);
  const Start s(system, 5);
  ASSERT_EQ(stepper.nx(), system.model.nq + system.model.nv + 2);
  for (double h : {1e-3, 1e-4, 1e-5}) {
    const VectorXd m = s.x.tail(2), next = after(stepper, 0, h, s).tail(2);
    EXPECT_NEAR(next[0], s.u[0] + (m[0] - s.u[0]) * std::exp(-h / 0.02), 1e-15);
    EXPECT_NEAR(next[1], s.u[1] + (m[1] - s.u[1]) * std::exp(-h / lag), 1e-15);
    Start halfway = s;
    halfway.x = after(stepper, 0, h / 2, s);
    EXPECT_LE((after(stepper, h / 2, h / 2, halfway).tail(2) - next).norm(), 4e-16);
  }
}

// Rows with gaps, lanes, threads and a second stepper: the bits of one step.
TEST_P(OfAny, ManyStatesHaveTheBitsOfOne) {
  const System system = walker();
  const TemporaryCache cache;
  const bool is_explicit =
      GetParam() == Integrator::kSemiImplicitEuler || GetParam() == Integrator::kRungeKutta4;
  CodegenOptions options{.route = is_explicit ? Route::kCompiled : Route::kInterpreter,
                         .functions = Functions::kPortable,
                         .cache_folder = cache.path(),
                         .flags = {"-O0"}};
  Stepper one(system, GetParam(), options);
  options.lanes = Lanes::kNative;
  Stepper many(system, GetParam(), options, false, 2);
  constexpr int kCount = 21;
  const int nx = one.nx(), wide = nx + 3;
  VectorXd x(kCount * nx), u(kCount * 2), t(kCount), next = VectorXd::Constant(kCount * wide, 7);
  const Start shared(system, 60);
  MatrixXd expected(nx, kCount);
  for (int i = 0; i < kCount; ++i) {
    Start s(system, 10 + unsigned(i));
    s.p = shared.p;
    t[i] = 0.1 * i;
    x.segment(i * nx, nx) = s.x;
    u.segment(i * 2, 2) = s.u;
    expected.col(i) = after(one, t[i], 0.01, s);
  }
  StateRows rows{.count = kCount,
                 .t = t.data(),
                 .x = x.data(),
                 .u = u.data(),
                 .p = shared.p.data(),
                 .x_next = next.data()};
  rows.stride_p = 0;
  rows.stride_next = std::size_t(wide);
  EXPECT_EQ(many.steps(0.01, rows), 0U);
  for (int i = 0; i < kCount; ++i) {
    EXPECT_EQ(next.segment(i * wide, nx), expected.col(i)) << i;
    EXPECT_EQ(next.segment(i * wide + nx, 3), VectorXd::Constant(3, 7)) << i;
  }
  x[4 * nx + 8] = std::nan("");
  x[9 * nx + 2] = std::nan("");
  std::string why;
  EXPECT_EQ(many.steps(0.01, rows, &why), 2U);
  EXPECT_NE(why.find("from t = 0.4 s by 0.01 s: q.wheel[0] is nan before it"), std::string::npos) << why;
  EXPECT_TRUE(next.segment(4 * wide, nx).array().isNaN().all());
  EXPECT_EQ(next.segment(5 * wide, nx), expected.col(5));
}

TEST_P(OfAny, ASecondStepperGivesTheSameBits) {
  const System system = walker();
  const Start s(system, 8);
  Stepper first(system, GetParam(), kInterpreted), second(system, GetParam(), kInterpreted);
  const VectorXd end = after(first, 0.5, 0.01, s);
  after(second, 0, 0.02, Start(system, 9));  // nothing of an earlier step is left
  EXPECT_EQ(after(second, 0.5, 0.01, s), end);
}

#if DYNTAPE_COUNTS_ALLOCATIONS
TEST_P(OfAny, AStepAllocatesNothing) {
  const System system = walker();
  Stepper stepper(system, GetParam(), kInterpreted);
  Start s(system, 11);
  std::string why;
  const auto step = [&] {
    return stepper.step(0.1, 0.01, s.x.data(), s.u.data(), s.p.data(), s.x.data(), &why);
  };
  ASSERT_TRUE(step());
  const long before = allocations;
  const bool done = step();
  EXPECT_EQ(allocations - before, 0);
  EXPECT_TRUE(done);
}
#endif

TEST_P(OfAny, WhatIsNotFiniteIsNamed) {
  Stepper stepper(walker(), GetParam(), kInterpreted);
  Start s(walker(), 12);
  const int v_hip = s.model.nq + 6;
  s.x[v_hip] = std::nan("");
  VectorXd next = VectorXd::Zero(stepper.nx());
  std::string why;
  EXPECT_FALSE(stepper.step(0.25, 0.01, s.x.data(), s.u.data(), s.p.data(), next.data(), &why));
  EXPECT_EQ(why, "step of \"walker\" from t = 0.25 s by 0.01 s: v.hip is nan before it");
  EXPECT_TRUE(next.array().isNaN().all());
  s.x[v_hip] = 0;
  s.u[0] = HUGE_VAL;
  EXPECT_FALSE(stepper.step(0.25, 0.01, s.x.data(), s.u.data(), s.p.data(), next.data(), &why));
  EXPECT_NE(why.find(": u[0] is inf before it"), std::string::npos) << why;
  s.u[0] = 0;
  EXPECT_FALSE(stepper.step(0.25, std::nan(""), s.x.data(), s.u.data(), s.p.data(), next.data(), &why));
  EXPECT_NE(why.find(": h is nan before it"), std::string::npos) << why;
  s.x.segment(s.model.nq, s.model.nv) *= 1e200;
  EXPECT_FALSE(stepper.step(0.25, 0.01, s.x.data(), s.u.data(), s.p.data(), next.data(), &why));
  EXPECT_TRUE(why.find(" after it") != std::string::npos || why.find("not finite") != std::string::npos)
      << why;
}

std::string name_of(const ::testing::TestParamInfo<Integrator>& scheme) {
  std::string name = to_string(scheme.param);
  std::erase(name, '-');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Schemes, OfEach, ::testing::ValuesIn(kFixedIntegrators), name_of);
INSTANTIATE_TEST_SUITE_P(Schemes, OfAny, ::testing::ValuesIn(kIntegrators), name_of);

// v' = v + h (1 + v'^2) has no solution for long steps, and v' = sqrt(-1 - v) none at all.
TEST(Stepper, AFailedNewtonIsASentence) {
  System s = spring(1, 1);
  s.name = "blow-up";
  s.acceleration = [](const SystemPoint<AD>& at) {
    return VectorXad(at.v.cwiseProduct(at.v).array() + AD(1));
  };
  Stepper stepper(s, Integrator::kImplicitVelocity, kInterpreted);
  VectorXd x = Eigen::Vector2d(0, 0);
  std::string why;
  EXPECT_TRUE(stepper.step(0, 0.4, x.data(), nullptr, nullptr, x.data(), &why)) << why;
  EXPECT_NEAR(x[1], 0.5, 1e-15);  // h v^2 - v + h = 0
  EXPECT_FALSE(stepper.step(0.4, 0.6, x.data(), nullptr, nullptr, x.data(), &why));
  EXPECT_NE(why.find("step of \"blow-up\" from t = 0.4 s by 0.6 s: "), std::string::npos) << why;
  EXPECT_NE(why.find("Newton"), std::string::npos) << why;
  EXPECT_LE(stepper.residuals(), 100);
  s.acceleration = [](const SystemPoint<AD>& at) {
    return VectorXad(VectorXad::Constant(1, sqrt(-1.0 - at.v[0])));
  };
  Stepper rooted(s, Integrator::kImplicitVelocity, kInterpreted);
  x.setZero();
  EXPECT_FALSE(rooted.step(0, 0.1, x.data(), nullptr, nullptr, x.data(), &why));
  EXPECT_NE(why.find("not finite"), std::string::npos) << why;
}

// Friction that is smoothed over little: dry friction brings a block to rest and keeps it there.
TEST(Stepper, StiffFrictionIsSolved) {
  System s = spring(1, 0);
  s.acceleration = [](const SystemPoint<AD>& at) {
    return VectorXad(VectorXad::Constant(1, -5.0 * tanh(at.v[0] / 1e-6)));
  };
  Stepper stepper(s, Integrator::kImplicitVelocity, kInterpreted);
  VectorXd x = Eigen::Vector2d(0, 1);
  run(stepper, 0.01, 15, x, [](const VectorXd&) {});
  EXPECT_NEAR(x[1], 1 - 15 * 0.05, 1e-12);
  run(stepper, 0.01, 100, x, [](const VectorXd&) {});
  EXPECT_LE(std::abs(x[1]), 1e-7);
  EXPECT_NEAR(x[0], 0.01 * (0.95 + 0.05) * 19 / 2, 1e-6);
}

TEST(Stepper, BranchesThatAreLeftAreNamed) {
  System s = spring(1, 1);
  s.acceleration = [](const SystemPoint<AD>& at) {
    if (at.q[0] < 0) return VectorXad(-at.q);
    return VectorXad(at.q * AD(-2));
  };
  for (Integrator scheme : {Integrator::kRungeKutta4, Integrator::kImplicitMidpoint}) {
    Stepper stepper(s, scheme, kInterpreted);
    VectorXd x = Eigen::Vector2d(1, 0);
    std::string why;
    EXPECT_TRUE(stepper.step(0, 0.1, x.data(), nullptr, nullptr, x.data(), &why)) << why;
    x = Eigen::Vector2d(-1, 0);
    EXPECT_FALSE(stepper.step(0, 0.1, x.data(), nullptr, nullptr, x.data(), &why));
    EXPECT_NE(why.find("simulation_stepper_test.cpp"), std::string::npos) << why;
  }
}

std::string refusal(const System& system, Integrator scheme) {
  try {
    Stepper stepper(system, scheme, kInterpreted);
  } catch (const ArgumentError& e) {
    return e.what();
  }
  return "";
}

TEST(Stepper, WrongSystemsAreRefused) {
  System s = pendulum();
  s.lagrangian = {};
  EXPECT_NE(refusal(s, Integrator::kVariational).find("has no Lagrangian"), std::string::npos);
  s.lagrangian = [](const VectorXad& q, const VectorXad& v, const VectorXad&) {
    return -sqrt(1.0 - v[0] * v[0]) - q[0];
  };
  EXPECT_NE(refusal(s, Integrator::kVariational).find("quadratic in v"), std::string::npos);
  s.acceleration = [](const SystemPoint<AD>&) { return VectorXad(VectorXad::Constant(3, AD(1))); };
  EXPECT_NE(refusal(s, Integrator::kRungeKutta4).find("has 3 entries, expected one a velocity: 1"),
            std::string::npos);
  s.acceleration = {};
  EXPECT_NE(refusal(s, Integrator::kImplicitMidpoint).find("has no acceleration"), std::string::npos);
  s = pendulum();
  s.lag = Eigen::Vector2d(0, 1);
  EXPECT_NE(refusal(s, Integrator::kRungeKutta4).find("lag has 2 entries"), std::string::npos);
  s.n_u = 2;
  s.lag[0] = -1;
  EXPECT_NE(refusal(s, Integrator::kRungeKutta4).find("expected zero or more"), std::string::npos);
  Stepper without(pendulum(), Integrator::kRungeKutta4, kInterpreted);
  VectorXd x = Eigen::Vector2d(1, 0);
  MatrixXd A, B, P;
  EXPECT_THROW(without.jacobians(0, 0.1, x.data(), nullptr, nullptr, x.data(), A, B, P), ArgumentError);
}

TEST(Stepper, ReportsWhatWasMade) {
  const TemporaryCache cache;
  const CodegenOptions options{.cache_folder = cache.path()};
  const StepperReport fresh = Stepper(pendulum(), Integrator::kImplicitMidpoint, options, true).report(),
                      again = Stepper(pendulum(), Integrator::kImplicitMidpoint, options, true).report();
  EXPECT_FALSE(fresh.from_cache);
  EXPECT_TRUE(again.from_cache);
  EXPECT_EQ(fresh.sources.size(), 5U);
  EXPECT_EQ(fresh.sources, again.sources);
  EXPECT_GT(fresh.step_operations, 0U);
  EXPECT_GT(fresh.newton_operations, 0U);
  EXPECT_GT(fresh.jacobian_operations, 0U);
}

// A motion, its inputs and two observers in the order of their calls; observers may have any of the functions.
TEST(Run, CallsMotionInputsAndObserversInOrder) {
  std::string calls;
  struct Motion {
    bool step(const StepTime& s, int u) {
      calls += "s" + std::to_string(u);
      return s.k < 4;
    }
    void advance() { calls += "n"; }
    std::string& calls;
  } motion{calls};
  struct Whole {
    bool goes_on(const StepTime& s) { return calls += "g", s.k != stop; }
    void before(const StepTime& s, int) {
      calls += "b";
      EXPECT_EQ(s.t, 7 + double(s.k) * 0.5);
    }
    void after(const StepTime&, int) { calls += "a"; }
    void reached(long k) { calls += "r" + std::to_string(k); }
    std::string& calls;
    long stop;
  } whole{calls, 9};
  struct Ends {
    void reached(long k) { last = k; }
    long last = 0;
  } ends;
  const auto inputs = [](const StepTime& s) { return int(10 * s.k); };
  EXPECT_EQ(run(motion, {.from = 1, .to = 3, .h = 0.5, .start = 7}, inputs, whole, ends), 3);
  EXPECT_EQ(calls, "gbs10anr2gbs20anr3");
  EXPECT_EQ(ends.last, 3);
  calls.clear();
  EXPECT_EQ(run(motion, {.from = 3, .to = 9, .h = 0.5, .start = 7}, inputs, whole, ends), 4);  // no step
  EXPECT_EQ(calls, "gbs30anr4gbs40");
  calls.clear();
  whole.stop = 2;
  EXPECT_EQ(run(motion, {.from = 1, .to = 9, .h = 0.5, .start = 7}, inputs, ends, whole), 2);  // stopped
  EXPECT_EQ(calls, "gbs10anr2g");
}

}  // namespace
}  // namespace dyntape::simulation_stepper_test
