// SPDX-License-Identifier: BSD-3-Clause
//
// What solutions of differential dynamic programming change by with parameters and start: against differences of solves, between
// DdpSolver and DdpBatch, and each against itself in other company.
#include <gtest/gtest.h>

#include <random>

#include <dyntape/interface/control/batch/ddp_batch.h>
#include <dyntape/interface/control/solve/ddp_sensitivities.h>

#include "interface/control/ocp_problems.h"
#include "interface/temporary_cache.h"

namespace dyntape::ddp_sensitivities_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kIntervals = 25;

// A pendulum that is led to an angle: a parameter of the dynamics, two of the cost of the end, one of the running cost that may
// be a function of time.
Problem led_pendulum(double limit = HUGE_VAL) {
  Problem p("led pendulum", {"th", "w"}, {"u"}, 1, {});
  const Parameter gravity = p.parameters.add("gravity", 9.81),
                  goal = p.parameters.add("goal", Eigen::Vector2d(2.0, 0.5)),
                  reference = p.parameters.add("reference", 0.3);
  p.rate = [gravity](const auto& s) {
    using std::sin;
    using T = std::decay_t<decltype(s.t)>;
    return vector(s.x[1], T(s.u[0] - gravity(s)[0] * sin(s.x[0])));
  };
  p.add(running_squares("effort", [](const auto& s) { return (0.1 * s.u).eval(); }));
  p.add(running_squares("follow", [reference](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(s.x[0] - reference(s)[0]));
  }));
  p.add(terminal_squares("there", [goal](const auto& s) { return (10.0 * (s.x - goal(s))).eval(); }));
  p.start << 0.2, -0.1;
  p.u.lower[0] = -limit, p.u.upper[0] = limit;
  return p;
}

DdpOptions options_of(SensitivitiesOf of, DdpHessian hessian = DdpHessian::kExact) {
  return {.intervals = kIntervals,
          .hessian = hessian,
          .tolerance = 1e-11,
          .evaluation = test::kInterpreted,
          .verify = false,
          .sensitivities = of};
}

// Four starts, and all parameters a little different.
DdpBatchValues some_values(int count) {
  std::mt19937_64 numbers(5);
  const auto number = [&] { return double(numbers() >> 11) * 0x1p-53 - 0.5; };
  const MatrixXd parameters = Eigen::Vector4d(9.81, 2.0, 0.5, 0.3).replicate(1, count) +
                              0.4 * MatrixXd::NullaryExpr(4, count, number);
  return {.starts = MatrixXd::NullaryExpr(2, count, number), .parameters = parameters};
}

// Differences of solutions beside the one with these values, by entry `entry` of (parameters, start).
MotionDerivatives differences(const DdpBatch& batch, const DdpBatchValues& values, Index i) {
  constexpr double kStep = 1e-4;
  const Index n_p = values.parameters.rows(), count = n_p + values.starts.rows();
  DdpBatchValues beside{values.starts.col(i).replicate(1, 2 * count),
                        values.parameters.col(i).replicate(1, 2 * count)};
  for (Index j = 0; j < count; ++j) {
    for (const int side : {0, 1}) {
      double& entry = j < n_p ? beside.parameters(j, 2 * j + side) : beside.starts(j - n_p, 2 * j + side);
      entry += side == 0 ? kStep : -kStep;
    }
  }
  const std::vector<DdpSolution> all = batch.solve(beside);
  MotionDerivatives found{MatrixXd(all[0].x.size(), count), MatrixXd(all[0].u.size(), count),
                          VectorXd(count)};
  for (Index j = 0; j < count; ++j) {
    const DdpSolution &up = all[std::size_t(2 * j)], &down = all[std::size_t(2 * j + 1)];
    EXPECT_TRUE(up.success() && down.success());
    found.x.col(j) = (up.x - down.x).reshaped() / (2 * kStep);
    found.u.col(j) = (up.u - down.u).reshaped() / (2 * kStep);
    found.cost[j] = (up.cost - down.cost) / (2 * kStep);
  }
  return found;
}

double off(const MatrixXd& a, const MatrixXd& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

// Differences of step e are off by a multiple of e^2 = 1e-8, and by the tolerance over e, 1e-7.
void expect_near_differences(const DdpSensitivities& s, const MotionDerivatives& by, bool with_motion) {
  constexpr double kOff = 1e-6;
  const Index n_p = s.parameters.cost.size(), n_x = s.start.cost.size();
  EXPECT_LT(off(s.parameters.cost, by.cost.head(n_p)), kOff);
  EXPECT_LT(off(s.start.cost, by.cost.tail(n_x)), kOff);
  if (!with_motion) return;
  EXPECT_LT(off(s.parameters.x, by.x.leftCols(n_p)), kOff);
  EXPECT_LT(off(s.parameters.u, by.u.leftCols(n_p)), kOff);
  EXPECT_LT(off(s.start.x, by.x.rightCols(n_x)), kOff);
  EXPECT_LT(off(s.start.u, by.u.rightCols(n_x)), kOff);
}

bool at_limit(const DdpSolution& s, double limit) { return (s.u.array().abs() >= limit).any(); }

TEST(DdpSensitivities, AreSlopesOfSolutions) {
  constexpr int kCount = 3;
  for (const double limit : {HUGE_VAL, 8.0}) {
    const Problem p = led_pendulum(limit);
    const DdpBatch solves(p, options_of(SensitivitiesOf::kNothing));
    const DdpBatchValues values = some_values(kCount);
    for (const DdpHessian hessian : {DdpHessian::kExact, DdpHessian::kGaussNewton}) {
      const std::vector<DdpSolution> all =
          DdpBatch(p, options_of(SensitivitiesOf::kMotion, hessian)).solve(values);
      for (int i = 0; i < kCount; ++i) {
        const DdpSolution& s = all[std::size_t(i)];
        ASSERT_TRUE(s.success()) << to_string(s.status);
        ASSERT_TRUE(s.sensitivities.good()) << to_string(s.sensitivities.status);
        EXPECT_EQ(at_limit(s, limit), limit < HUGE_VAL);
        expect_near_differences(s.sensitivities, differences(solves, values, i), true);
      }
    }
  }
}

TEST(DdpSensitivities, SolverAndBatchAgree) {
  for (const SensitivitiesOf of : {SensitivitiesOf::kCost, SensitivitiesOf::kMotion}) {
    const Problem p = led_pendulum(8);
    DdpBatch batch(p, options_of(of));
    const DdpSolution together = batch.solve({.starts = p.start})[0], alone = batch.solver().solve();
    const DdpSensitivities &a = together.sensitivities, &b = alone.sensitivities;
    ASSERT_TRUE(a.good() && b.good());
    EXPECT_LT(off(a.parameters.cost, b.parameters.cost), 1e-9);
    EXPECT_LT(off(a.start.cost, b.start.cost), 1e-9);
    EXPECT_LT(off(a.start.cost, alone.adjoint.col(0)), 1e-9);
    EXPECT_EQ(a.parameters.x.size() == 0, of == SensitivitiesOf::kCost);
    EXPECT_EQ(b.parameters.x.size() == 0, of == SensitivitiesOf::kCost);
    if (of == SensitivitiesOf::kCost) continue;
    EXPECT_LT(off(a.parameters.x, b.parameters.x), 1e-7);
    EXPECT_LT(off(a.parameters.u, b.parameters.u), 1e-7);
    EXPECT_LT(off(a.start.x, b.start.x), 1e-7);
    EXPECT_LT(off(a.start.u, b.start.u), 1e-7);
    EXPECT_LT((b.start.u.topRows(1) - alone.policy[0].K).norm(), 1e-7 * b.start.u.norm());
  }
}

TEST(DdpSensitivities, ControlsAtTheirLimitsStay) {
  const DdpSolution s = solve_with_ddp(led_pendulum(8), options_of(SensitivitiesOf::kMotion));
  ASSERT_TRUE(s.sensitivities.good());
  int held = 0;
  for (Index k = 0; k < kIntervals; ++k) {
    const bool is_held = std::abs(s.u(0, k)) == 8;
    held += is_held;
    EXPECT_EQ(s.sensitivities.parameters.u.row(k).isZero(0), is_held);
    EXPECT_EQ(s.sensitivities.start.u.row(k).isZero(0), is_held);
  }
  EXPECT_GT(held, 0);
}

// By a shift at all times.
TEST(DdpSensitivities, OfParametersThatAreFunctionsOfTime) {
  constexpr double kStep = 1e-4;
  const auto shifted = [](double by) {
    Problem p = led_pendulum();
    p.parameters.set("reference", [by](double t) { return VectorXd::Constant(1, std::sin(3 * t) + by); });
    return p;
  };
  const DdpSolution s = solve_with_ddp(shifted(0), options_of(SensitivitiesOf::kMotion)),
                    up = solve_with_ddp(shifted(kStep), options_of(SensitivitiesOf::kNothing)),
                    down = solve_with_ddp(shifted(-kStep), options_of(SensitivitiesOf::kNothing));
  ASSERT_TRUE(s.sensitivities.good());
  const MotionDerivatives& by = s.sensitivities.parameters;
  EXPECT_LT(off(by.x.col(3), (up.x - down.x).reshaped() / (2 * kStep)), 1e-6);
  EXPECT_LT(off(by.u.col(3), (up.u - down.u).reshaped() / (2 * kStep)), 1e-6);
  EXPECT_NEAR(by.cost[3], (up.cost - down.cost) / (2 * kStep), 1e-6 * std::abs(by.cost[3]));
}

void expect_same_bits(const DdpSensitivities& a, const DdpSensitivities& b) {
  EXPECT_EQ(a.status, b.status);
  for (const auto part : {&DdpSensitivities::parameters, &DdpSensitivities::start}) {
    EXPECT_EQ((a.*part).x, (b.*part).x);
    EXPECT_EQ((a.*part).u, (b.*part).u);
    EXPECT_EQ((a.*part).cost, (b.*part).cost);
  }
}

TEST(DdpSensitivities, SameBitsInAnyCompanyAndAnyNumberOfThreads) {
  constexpr int kCount = 19;
  const TemporaryCache cache;
  const DdpBatchValues values = some_values(kCount);
  const CodegenOptions compiled{
      .functions = Functions::kPortable, .lanes = Lanes::kNative, .cache_folder = cache.path()};
  for (const CodegenOptions& evaluation : {test::kInterpreted, compiled}) {
    DdpOptions options = options_of(SensitivitiesOf::kMotion);
    options.evaluation = evaluation;
    const DdpBatch batch(led_pendulum(8), options), threads(led_pendulum(8), options, 3);
    const std::vector<DdpSolution> all = batch.solve(values), shared = threads.solve(values);
    const std::vector<DdpSolution> turned = batch.solve(
        {.starts = values.starts.rowwise().reverse(), .parameters = values.parameters.rowwise().reverse()});
    for (int i = 0; i < kCount; ++i) {
      const DdpSensitivities& s = all[std::size_t(i)].sensitivities;
      EXPECT_TRUE(s.good()) << i << " " << to_string(s.status);
      const DdpBatchValues own{values.starts.col(i), values.parameters.col(i)};
      expect_same_bits(s, batch.solve(own)[0].sensitivities);
      expect_same_bits(s, shared[std::size_t(i)].sensitivities);
      expect_same_bits(s, turned[std::size_t(kCount - 1 - i)].sensitivities);
    }
  }
}

// What differs in status differs in nothing else.
TEST(DdpSensitivities, SayWhereThereAreNone) {
  DdpOptions options = options_of(SensitivitiesOf::kMotion);
  options.max_iterations = 0;
  const DdpBatch batch(led_pendulum(), options);
  DdpBatchValues values = some_values(2);
  values.starts(0, 1) = 1e300;
  for (const DdpSolution& s : batch.solve(values)) {
    EXPECT_FALSE(s.success());
    EXPECT_EQ(s.sensitivities.status, SensitivityStatus::kNotASolution);
    EXPECT_EQ(s.sensitivities.parameters.u.rows(), kIntervals);
    EXPECT_EQ(s.sensitivities.parameters.x.rows(), 2 * (kIntervals + 1));
    EXPECT_TRUE(s.sensitivities.parameters.x.array().isNaN().all());
    EXPECT_TRUE(s.sensitivities.start.cost.array().isNaN().all());
  }
  EXPECT_EQ(solve_with_ddp(led_pendulum(), options).sensitivities.status, SensitivityStatus::kNotASolution);
}

// Two motors that push the same mass: only the sum of their forces is known, of one problem and of many, with limits or without.
TEST(DdpSensitivities, OfTheMotionAreNoneWhereControlsShareAForce) {
  for (const double limit : {HUGE_VAL, 10.0}) {
    Problem p("pair", {"p", "v"}, {"a", "b"}, 1,
              [](const auto& s) { return vector(s.x[1], s.u[0] + s.u[1]); });
    const Parameter force = p.parameters.add("force", 1.0);
    p.add(running_squares("off", [force](const auto& s) { return vector(s.u[0] + s.u[1] - force(s)[0]); }));
    p.start << 0, 0;
    p.u.lower.setConstant(-limit), p.u.upper.setConstant(limit);
    DdpBatch batch(p, options_of(SensitivitiesOf::kMotion));
    const DdpSolution together = batch.solve({.starts = p.start})[0], alone = batch.solver().solve();
    for (const DdpSolution* s : {&together, &alone}) {
      ASSERT_TRUE(s->converged());
      EXPECT_EQ(s->sensitivities.status, SensitivityStatus::kNoStrictMinimum) << limit;
      EXPECT_TRUE(s->sensitivities.parameters.u.array().isNaN().all()) << limit;
      EXPECT_NEAR(s->sensitivities.parameters.cost[0], 0, 1e-9) << limit;
    }
  }
}

// A mass that is pushed along a line, whose limit is exactly what the free solution takes at first.
TEST(DdpSensitivities, SayThatALimitIsWeaklyHeld) {
  const auto pushed = [](double limit) {
    Problem p("pushed", {"p", "v"}, {"u"}, 1, [](const auto& s) { return vector(s.x[1], s.u[0]); });
    p.add(running_squares("effort", [](const auto& s) { return s.u; }));
    const Parameter place = p.parameters.add("place", 1.0);
    p.add(terminal_squares("off", [place](const auto& s) {
      using T = std::decay_t<decltype(s.t)>;
      return vector(T(10.0 * (s.x[0] - place(s)[0])), T(s.x[1]));
    }));
    p.start << 0, 0;
    p.u.upper[0] = limit;
    return p;
  };
  const double most = solve_with_ddp(pushed(HUGE_VAL), options_of(SensitivitiesOf::kNothing)).u.maxCoeff();
  const Problem p = pushed(most);
  const DdpSolution alone = solve_with_ddp(p, options_of(SensitivitiesOf::kMotion)),
                    one = DdpBatch(p, options_of(SensitivitiesOf::kMotion)).solve({.starts = p.start})[0];
  for (const DdpSolution* s : {&alone, &one}) {
    ASSERT_TRUE(s->success());
    EXPECT_EQ(s->sensitivities.status, SensitivityStatus::kWeaklyActive);
    EXPECT_TRUE(s->sensitivities.parameters.x.allFinite());
  }
}

// At rest between two places that are equally good: a stationary point, and no minimum.
TEST(DdpSensitivities, OfTheMotionAreNoneAtASaddle) {
  Problem p("between", {"p"}, {"u"}, 1, [](const auto& s) { return vector(s.u[0]); });
  const Parameter place = p.parameters.add("place", 1.0);
  p.add(running_squares("effort", [](const auto& s) { return (0.1 * s.u).eval(); }));
  p.add(terminal_squares("off", [place](const auto& s) {
    using T = std::decay_t<decltype(s.t)>;
    return vector(T(s.x[0] * s.x[0] - place(s)[0]));
  }));
  p.start << 0;
  DdpSolution at_rest;
  at_rest.status = SolveStatus::kSolved;
  at_rest.x = MatrixXd::Zero(1, kIntervals + 1), at_rest.u = MatrixXd::Zero(1, kIntervals);
  const DdpSensitivities s = DdpDerivatives(p, options_of(SensitivitiesOf::kMotion)).at(p, at_rest);
  EXPECT_EQ(s.status, SensitivityStatus::kNoStrictMinimum);
  EXPECT_TRUE(s.parameters.x.array().isNaN().all());
  EXPECT_NEAR(s.parameters.cost[0], 2, 1e-12);  // of (0 - place)^2
}

// Without parameters, and where nothing is asked for.
TEST(DdpSensitivities, OfTheStartAlone) {
  Problem p = test::soft_swing_up(12);
  const DdpSolution s = solve_with_ddp(p, options_of(SensitivitiesOf::kMotion));
  ASSERT_TRUE(s.sensitivities.good());
  EXPECT_EQ(s.sensitivities.parameters.x.cols(), 0);
  EXPECT_EQ(s.sensitivities.start.x.cols(), 4);
  const DdpSolution without = solve_with_ddp(p, options_of(SensitivitiesOf::kNothing));
  EXPECT_EQ(without.u, s.u);
  EXPECT_EQ(without.sensitivities.start.x.size(), 0);
}

}  // namespace
}  // namespace dyntape::ddp_sensitivities_test
