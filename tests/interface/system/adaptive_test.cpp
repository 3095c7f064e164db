// SPDX-License-Identifier: BSD-3-Clause
//
// Adaptive steps against motions that are known: errors follow tolerances, sensitivities, events, failures.
#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/simulation/state_space.h>
#include <dyntape/dynamics/urdf/urdf.h>

#include <cmath>
#include <numbers>
#include <thread>

#include "dynamics/random_robots.h"
#include "interface/temporary_cache.h"
#include "simulated_systems.h"
#include "source_folder.h"

namespace dyntape::adaptive_test {
namespace {

using namespace test;
using dynamics::Random;
using Eigen::MatrixXd;

constexpr Integrator kBoth[] = {Integrator::kAdaptive, Integrator::kAdaptiveStiff};
constexpr double kPendulumPeriod = 2.66587094283493;  // from 2 rad at rest: 4 K(sin 1) / sqrt(g)

struct State {
  VectorXd x, u, p;
};

VectorXd after(Stepper& stepper, double t, double h, const State& s) {
  VectorXd next(stepper.nx());
  std::string why;
  EXPECT_TRUE(stepper.step(t, h, s.x.data(), s.u.data(), s.p.data(), next.data(), &why)) << why;
  return next;
}

State start_of(const System& system, unsigned long seed, double size = 1) {
  Random random(seed);
  const dynamics::State s = dynamics::random_state(system.model, random);
  const int n_m = int(lagged_motors(system).size());
  State start{VectorXd(system.model.nq + system.model.nv + n_m), random.vector(system.n_u),
              random.vector(system.n_p)};
  start.x << s.q, size * s.v, random.vector(n_m);
  return start;
}

// --- errors ---

// A tenth of the tolerance gives a tenth of the error, over eight decades.
TEST(Adaptive, ErrorsFollowTheTolerance) {
  for (const Integrator integrator : kBoth) {
    for (double relative = 1e-4; relative > 0.5e-12; relative /= 10) {
      Stepper stepper(pendulum(), integrator, kInterpreted, false, 1, {relative, 1e-3 * relative});
      const VectorXd end = after(stepper, 0, kPendulumPeriod, {Eigen::Vector2d(2, 0), {}, {}});
      EXPECT_LE((end - Eigen::Vector2d(2, 0)).norm(), 1000 * relative) << to_string(integrator);
    }
  }
}

TEST(Adaptive, EnergyDriftsWithTheTolerance) {
  for (const double relative : {1e-7, 1e-10, 1e-13}) {
    Stepper stepper(pendulum(), Integrator::kAdaptive, kInterpreted, false, 1, {relative, 1e-3 * relative});
    VectorXd x = Eigen::Vector2d(2, 0);
    const auto energy = [&] { return 0.5 * x[1] * x[1] - kGravity * std::cos(x[0]); };
    const double before = energy();
    run(stepper, 100, 1, x, [](const VectorXd&) {});
    EXPECT_LE(std::abs(energy() - before), 3e4 * relative);
  }
}

// About its middle axis the body turns over, 8 turns in a period: one step, or many.
TEST(Adaptive, ABodyThatTurnsManyTimes) {
  constexpr double kPeriod = 10.0518582763149;
  const System body = robot_system(free_body(), no_torques);
  VectorXd start = VectorXd::Zero(13);
  start[6] = 1;
  start.tail<3>() = Eigen::Vector3d(0.01, 5, 0.01);
  Stepper fine(body, Integrator::kRungeKutta4, kInterpreted);
  VectorXd reference = start;
  run(fine, kPeriod / 20000, 20000, reference, [](const VectorXd&) {});
  for (const Integrator integrator : kBoth) {
    Stepper stepper(body, integrator, kInterpreted, false, 1, {1e-12, 1e-15});
    for (const int steps : {1, 3, 100}) {
      VectorXd x = start;
      run(stepper, kPeriod / steps, steps, x, [](const VectorXd&) {});
      EXPECT_LE((x.tail<3>() - start.tail<3>()).norm(), 2e-8) << to_string(integrator) << steps;
      EXPECT_LE((x - reference).norm(), 5e-8) << to_string(integrator) << steps;
      EXPECT_LE(std::abs(x.segment<4>(3).norm() - 1), 4e-16);
    }
  }
}

// Alone about an axis: the coordinates are straight, and the turn as long as one likes.
TEST(Adaptive, AThousandTurns) {
  const System body = robot_system(free_body(), no_torques);
  VectorXd x = VectorXd::Zero(13);
  x[6] = 1;
  x[12] = 2 * std::numbers::pi * 100;
  Stepper stepper(body, Integrator::kAdaptive, kInterpreted, false, 1, {1e-12, 1e-15});
  run(stepper, 10.00125, 1, x, [](const VectorXd&) {});  // an eighth of a turn besides
  const double half = std::numbers::pi / 8;
  EXPECT_NEAR(std::abs(x[5]), std::sin(half), 1e-8);
  EXPECT_NEAR(std::abs(x[6]), std::cos(half), 1e-8);
}

// A spring and damper of 1e8 beside a motion of one second: Adams' steps stay as short as what has decayed.
TEST(Adaptive, StiffPartsTakeFewSteps) {
  System s = spring(1, 0);
  s.model.add_joint(0, joint(dynamics::JointType::kPrismatic, {0, 1, 0}, "slow"), {},
                    point_mass(1, {0, 0, 0}));
  s.acceleration = [](const SystemPoint<AD>& at) {
    VectorXad a(2);
    a << -1e8 * at.q[0] - 2e4 * at.v[0] + 1e8 * at.q[1], -at.q[1];
    return a;
  };
  const State start{Eigen::Vector4d(1, 1, 0, 0), {}, {}};
  long effort[2];
  for (int k = 0; k < 2; ++k) {
    Stepper stepper(s, kBoth[k], kInterpreted, false, 1, {1e-6, 1e-9});
    const VectorXd end = after(stepper, 0, 1, start);
    EXPECT_NEAR(end[1], std::cos(1.0), 1e-4);
    EXPECT_NEAR(end[0], end[1] + std::sin(1.0) * 2e-4, 1e-4);  // follows, d / k late
    effort[k] = stepper.effort().internal_steps;
  }
  EXPECT_LE(effort[1], 400);
  EXPECT_GE(effort[0], 5000);
}

// Van der Pol's equation as the IVP test set has it, mu = 1000: its published solution at t = 2.
TEST(Adaptive, VanDerPol) {
  System s = spring(1, 0);
  s.name = "van der Pol";
  s.acceleration = [](const SystemPoint<AD>& at) {
    const AD x = at.q[0], v = at.v[0];
    return VectorXad(VectorXad::Constant(1, ((1.0 - x * x) * v - x) * 1e6));
  };
  Stepper stepper(s, Integrator::kAdaptiveStiff, kInterpreted, false, 1, {1e-9, 1e-12});
  const VectorXd end = after(stepper, 0, 2, {Eigen::Vector2d(2, 0), {}, {}});
  EXPECT_NEAR(end[0], 1.706167732170483, 1e-7);
  EXPECT_NEAR(end[1], -0.8928097010247975, 1e-7);
  EXPECT_LE(stepper.effort().internal_steps, 10000);
  Stepper adams(s, Integrator::kAdaptive, kInterpreted);
  std::string why;
  VectorXd x = Eigen::Vector2d(2, 0);
  EXPECT_FALSE(adams.step(0, 2, x.data(), nullptr, nullptr, x.data(), &why));
  EXPECT_NE(why.find("step of \"van der Pol\" from t = 0 s by 2 s: 100000 internal steps lead only to t = "),
            std::string::npos)
      << why;
  EXPECT_NE(why.find("adaptive-stiff"), std::string::npos) << why;
}

// A floating base with all kinds of joints, motors and time: as Runge-Kutta in many steps, forwards and backwards.
TEST(Adaptive, AgreesWithRungeKutta) {
  const System system = walker();
  const State s = start_of(system, 3);
  Stepper fine(system, Integrator::kRungeKutta4, kInterpreted);
  for (const double h : {0.5, -0.3}) {
    State at = s;
    for (int k = 0; k < 8000; ++k) at.x = after(fine, 0.2 + k * h / 8000, h / 8000, at);
    for (const Integrator integrator : kBoth) {
      Stepper stepper(system, integrator, kInterpreted, false, 1, {1e-12, 1e-15});
      EXPECT_LE((after(stepper, 0.2, h, s) - at.x).norm() / at.x.norm(), 3e-9) << to_string(integrator) << h;
    }
  }
}

// --- nothing before a call matters ---

TEST(Adaptive, ACallDependsOnNothingBeforeIt) {
  System system = walker();
  system.events = [](const SystemPoint<AD>& at) { return VectorXad(VectorXad::Constant(1, at.q[2] + 0.5)); };
  for (const Integrator integrator : kBoth) {
    Stepper fresh(system, integrator, kInterpreted, true), used(system, integrator, kInterpreted, true);
    const State s = start_of(system, 8);
    const VectorXd expected = after(fresh, 0.5, 0.1, s);
    MatrixXd A, B, P, A2, B2, P2;
    VectorXd next = expected, other(used.nx());
    for (unsigned seed = 20; seed < 26; ++seed) {
      State before = start_of(system, seed, seed % 3 == 0 ? 100 : 1);
      if (seed == 23) before.u[0] = 1e30;  // whatever becomes of it
      (void)used.step(0.1 * seed, seed % 2 ? 0.3 : 1e-6, before.x.data(), before.u.data(), before.p.data(),
                      other.data());
      (void)used.jacobians(0, 0.02, before.x.data(), before.u.data(), before.p.data(), other.data(), A, B, P);
      ASSERT_EQ(after(used, 0.5, 0.1, s), expected) << to_string(integrator) << seed;
    }
    ASSERT_TRUE(used.jacobians(0.5, 0.1, s.x.data(), s.u.data(), s.p.data(), next.data(), A, B, P));
    EXPECT_EQ(next, expected);
    ASSERT_TRUE(fresh.jacobians(0.5, 0.1, s.x.data(), s.u.data(), s.p.data(), next.data(), A2, B2, P2));
    EXPECT_EQ(A, A2);
    EXPECT_EQ(B, B2);
    EXPECT_EQ(P, P2);
  }
}

// --- sensitivities ---

struct Slopes {
  MatrixXd A, B, P;
};

Slopes slopes_of(Stepper& stepper, double t, double h, const State& s) {
  Slopes derivatives;
  VectorXd next(stepper.nx());
  std::string why;
  EXPECT_TRUE(stepper.jacobians(t, h, s.x.data(), s.u.data(), s.p.data(), next.data(), derivatives.A,
                                derivatives.B, derivatives.P, &why))
      << why;
  return derivatives;
}

// Products of the exact Jacobians of many short steps of Runge-Kutta.
Slopes products(const System& system, double t, double h, State s, int steps) {
  Stepper stepper(system, Integrator::kRungeKutta4, kInterpreted, true);
  Slopes all{MatrixXd::Identity(stepper.nt(), stepper.nt()), MatrixXd::Zero(stepper.nt(), stepper.n_u()),
             MatrixXd::Zero(stepper.nt(), stepper.n_p())};
  for (int k = 0; k < steps; ++k) {
    const double dt = h / steps, at = t + k * dt;
    const Slopes one = slopes_of(stepper, at, dt, s);
    all.A = (one.A * all.A).eval();
    all.B = (one.A * all.B + one.B).eval();
    all.P = (one.A * all.P + one.P).eval();
    s.x = after(stepper, at, dt, s);
  }
  return all;
}

void expect_slopes(const System& system, const State& s, double h, int steps, double most) {
  const Slopes expected = products(system, 0.3, h, s, steps);
  for (const Integrator integrator : kBoth) {
    Stepper stepper(system, integrator, kInterpreted, true, 1, {1e-11, 1e-14});
    const Slopes got = slopes_of(stepper, 0.3, h, s);
    EXPECT_LE((got.A - expected.A).norm(), most * expected.A.norm()) << system.name << to_string(integrator);
    EXPECT_LE((got.B - expected.B).norm(), most * expected.B.norm()) << system.name << to_string(integrator);
    EXPECT_LE((got.P - expected.P).norm(), most * expected.P.norm()) << system.name << to_string(integrator);
  }
}

TEST(Adaptive, SensitivitiesAreThoseOfTheMotion) {
  const System two = robot_system(double_pendulum(), no_torques),
               body = robot_system(free_body(), no_torques);
  expect_slopes(pendulum(), {Eigen::Vector2d(2, 0), {}, {}}, 1, 1000, 3e-9);
  expect_slopes(two, {Eigen::Vector4d(0.5, -0.9, 0, 1), {}, {}}, 1, 1000, 3e-9);
  VectorXd spin = VectorXd::Zero(13);
  spin[6] = 1;
  spin.tail<6>() << 1, -0.5, 0.3, 0.1, 5, 0.2;
  expect_slopes(body, {spin, {}, {}}, 2, 2000, 3e-9);  // the centre moves three times
  expect_slopes(walker(), start_of(walker(), 4), 0.2, 200, 3e-8);
}

// Where nothing moves, the first try is as long as the state alone allows, and much too long for its sensitivities.
TEST(Adaptive, SensitivitiesAtRest) {
  const double w = std::sqrt(kGravity);
  for (const Integrator integrator : kBoth) {
    for (const Tolerances& t : {Tolerances{}, {1e-12, 1e-15}, {1e-14, 1e-18}, {1e-10, 1e-20}}) {
      Stepper stepper(pendulum(), integrator, kInterpreted, true, 1, t);
      for (const double h : {1.0, 10.0, -10.0}) {
        MatrixXd expected(2, 2);
        expected << std::cos(w * h), std::sin(w * h) / w, -w * std::sin(w * h), std::cos(w * h);
        const Slopes got = slopes_of(stepper, 0, h, {Eigen::Vector2d(0, 0), {}, {}});
        EXPECT_LE((got.A - expected).norm(), 1e5 * t.relative) << to_string(integrator) << h;
      }
    }
  }
}

TEST(Adaptive, SensitivitiesOfAQuadruped) {
  const std::string urdf = test::source_folder() + "/config/robots/solo12.urdf";
  const dynamics::Model<double> model = dynamics::read_urdf(urdf, {.base = dynamics::Base::kFloating}).model;
  const System system = robot_system(
      model,
      [](const SystemPoint<AD>& at) {
        VectorXad tau = at.v * AD(-0.02);
        tau.tail(12) += at.drive;
        return tau;
      },
      12);
  expect_slopes(system, start_of(system, 5, 0.3), 0.02, 20, 1e-6);
}

// By differences of steps that are a hundred times more accurate than their distance.
TEST(Adaptive, SensitivitiesAreDifferences) {
  const System system = walker();
  const State s = start_of(system, 6);
  const double h = 0.1;
  Stepper stepper(system, Integrator::kAdaptive, kInterpreted, true, 1, {1e-13, 1e-16});
  const Slopes got = slopes_of(stepper, 0, h, s);
  const dynamics::ProductSpace space(dynamics::ConfigurationSpace<double>(system.model),
                                     dynamics::EuclideanSpace<double>(system.model.nv + 1));
  const VectorXd end = after(stepper, 0, h, s);
  const auto along = [&](double e, int column) {
    State there = s;
    if (column < stepper.nt()) there.x = space.integrate(s.x, VectorXd::Unit(stepper.nt(), column) * e);
    if (column >= stepper.nt())
      (column < stepper.nt() + 2 ? there.u : there.p)[(column - stepper.nt()) % 2] += e;
    return VectorXd(space.difference(end, after(stepper, 0, h, there)));
  };
  MatrixXd all(stepper.nt(), stepper.nt() + 4);
  all << got.A, got.B, got.P;
  for (int column = 0; column < all.cols(); ++column) {
    const auto centred = [&](double e) { return VectorXd((along(e, column) - along(-e, column)) / (2 * e)); };
    const VectorXd slope = (4 * centred(1e-3) - centred(2e-3)) / 3;
    EXPECT_LE((all.col(column) - slope).norm(), 1e-8 * (1 + slope.norm())) << column;
  }
}

// --- events ---

System ball() {
  System s = spring(1, 0);
  s.name = "ball";
  s.acceleration = [](const SystemPoint<AD>& at) {
    return VectorXad(VectorXad::Constant(1, at.t * 0. - kGravity));
  };
  s.events = [](const SystemPoint<AD>& at) { return VectorXad(at.q); };
  return s;
}

// From 1 m, restitution 0.8: impacts at sqrt(2 / g) (1 + 2 (e + e^2 + ...)).
TEST(Adaptive, ImpactsOfABall) {
  constexpr double kRestitution = 0.8;
  for (const Integrator integrator : kBoth) {
    for (const double step : {0.01, 0.3, 20.0}) {
      Stepper stepper(ball(), integrator, kInterpreted, false, 1, {1e-13, 1e-16});
      VectorXd x = Eigen::Vector2d(1, 0);
      double t = 0, expected = std::sqrt(2 / kGravity), flight = expected;
      for (int bounce = 0; bounce < 10;) {
        std::string why;
        ASSERT_TRUE(stepper.step(t, step, x.data(), nullptr, nullptr, x.data(), &why)) << why;
        if (!stepper.event()) {
          t += step;
          continue;
        }
        t = stepper.event()->t;
        EXPECT_EQ(stepper.event()->entry, 0);
        EXPECT_LE(std::abs(t / expected - 1), 1e-10) << to_string(integrator) << step << " bounce " << bounce;
        EXPECT_LE(x[0], 0);
        EXPECT_GE(x[0], -1e-13);
        x[1] *= -kRestitution;
        flight *= kRestitution;
        expected += 2 * flight;
        ++bounce;
      }
    }
  }
}

TEST(Adaptive, TheFirstOfSeveralEvents) {
  System s = ball();
  s.events = [](const SystemPoint<AD>& at) {
    VectorXad g(3);
    g << at.q[0] - 0.5, at.q[0] - (0.5 + 1e-9), 10.0 - at.t;
    return g;
  };
  Stepper stepper(s, Integrator::kAdaptive, kInterpreted, false, 1, {1e-12, 1e-15});
  VectorXd x = Eigen::Vector2d(1, 0);
  ASSERT_TRUE(stepper.step(0, 5, x.data(), nullptr, nullptr, x.data()));
  ASSERT_TRUE(stepper.event());
  EXPECT_EQ(stepper.event()->entry, 1);
  const double first = stepper.event()->t;
  EXPECT_NEAR(first, std::sqrt(2 * (0.5 - 1e-9) / kGravity), 1e-11);
  ASSERT_TRUE(stepper.step(first, 5, x.data(), nullptr, nullptr, x.data()));
  ASSERT_TRUE(stepper.event());
  EXPECT_EQ(stepper.event()->entry, 0);
  EXPECT_NEAR(stepper.event()->t - first, 1e-9 / std::sqrt(kGravity), 1e-13);
  ASSERT_TRUE(stepper.step(stepper.event()->t, 20, x.data(), nullptr, nullptr, x.data()));
  ASSERT_TRUE(stepper.event());
  EXPECT_EQ(stepper.event()->entry, 2);  // of time alone
  EXPECT_EQ(stepper.event()->t, 10);
}

// Whatever the rounding, an event at the end of a step is that of this step or of the next, and of one of them.
TEST(Adaptive, AnEventAtTheEndOfAStepHappensOnce) {
  Stepper stepper(ball(), Integrator::kAdaptive, kInterpreted, false, 1, {1e-12, 1e-15});
  const double impact = std::sqrt(2 / kGravity);
  for (int ulps = -20; ulps <= 20; ++ulps) {
    VectorXd x = Eigen::Vector2d(1, 0);
    const double step = impact * (1 + ulps * 0x1p-52);
    int events = 0;
    double t = 0;
    for (int k = 0; k < 4; ++k) {
      ASSERT_TRUE(stepper.step(t, k == 0 ? step : 0.1, x.data(), nullptr, nullptr, x.data()));
      events += stepper.event().has_value();
      t = stepper.event() ? stepper.event()->t : t + (k == 0 ? step : 0.1);
    }
    EXPECT_EQ(events, 1) << ulps;
  }
}

// A throw that falls short of a height by a little, or goes beyond it; and starts on the ground, upwards.
TEST(Adaptive, Grazing) {
  for (const double beyond : {-1e-6, 1e-4}) {
    System s = ball();
    s.events = [=](const SystemPoint<AD>& at) { return VectorXad(VectorXad::Constant(1, 1.0 - at.q[0])); };
    Stepper stepper(s, Integrator::kAdaptive, kInterpreted, false, 1, {1e-10, 1e-13});
    VectorXd x = Eigen::Vector2d(0, std::sqrt(2 * kGravity * (1 + beyond)));
    ASSERT_TRUE(stepper.step(0, 0.6, x.data(), nullptr, nullptr, x.data()));
    EXPECT_EQ(stepper.event().has_value(), beyond > 0) << beyond;
  }
  Stepper stepper(ball(), Integrator::kAdaptive, kInterpreted);
  VectorXd x = Eigen::Vector2d(0, 3);
  ASSERT_TRUE(stepper.step(0, 0.5, x.data(), nullptr, nullptr, x.data()));
  EXPECT_FALSE(stepper.event());
  x = Eigen::Vector2d(0, -3);  // already below: not an event either
  ASSERT_TRUE(stepper.step(0, 0.5, x.data(), nullptr, nullptr, x.data()));
  EXPECT_FALSE(stepper.event());
}

// With the time of the event held: of a free fall [1 t; 0 1].
TEST(Adaptive, JacobiansOfAStepThatEnded) {
  Stepper stepper(ball(), Integrator::kAdaptive, kInterpreted, true);
  const Slopes derivatives = slopes_of(stepper, 0, 5, {Eigen::Vector2d(1, 0), {}, {}});
  ASSERT_TRUE(stepper.event());
  EXPECT_NEAR(derivatives.A(0, 1), stepper.event()->t, 1e-12);
  EXPECT_NEAR(derivatives.A(0, 0), 1, 1e-14);
  EXPECT_NEAR(derivatives.A(1, 1), 1, 1e-14);
}

TEST(Adaptive, EventsOfFixedStepsAreRefused) {
  try {
    Stepper stepper(ball(), Integrator::kRungeKutta4, kInterpreted);
    FAIL();
  } catch (const ArgumentError& e) {
    EXPECT_STREQ(
        e.what(),
        "system \"ball\" has events, at which steps of the scheme runge-kutta-4 do not end; expected "
        "adaptive or adaptive-stiff");
  }
}

// --- what is refused, and little motion ---

TEST(Adaptive, ToleranceThatAreNoneAreRefused) {
  for (const Tolerances& t :
       {Tolerances{0, 1e-9}, {1e-16, 1e-9}, {1, 1e-9}, {std::nan(""), 1e-9}, {1e-6, 0}, {1e-6, HUGE_VAL}})
    EXPECT_THROW(Stepper(pendulum(), Integrator::kAdaptive, kInterpreted, false, 1, t), ArgumentError);
}

// A step that would take minutes.
TEST(Adaptive, AStopIsHeardWithinAStep) {
  std::stop_source source;
  CodegenOptions options = kInterpreted;
  System s = spring(1e-12, 1);  // a million oscillations a second
  options.stop = source.get_token();
  Stepper stepper(s, Integrator::kAdaptiveStiff, options, false, 1, {1e-10, 1e-10});
  std::jthread stops([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    source.request_stop();
  });
  VectorXd x = Eigen::Vector2d(1, 0);
  std::string why;
  EXPECT_FALSE(stepper.step(0, 1000, x.data(), nullptr, nullptr, x.data(), &why));
  EXPECT_NE(why.find("stopped at t = "), std::string::npos) << why;
}

TEST(Adaptive, NoMotionAndLittleMotion) {
  Stepper stepper(walker(), Integrator::kAdaptiveStiff, kInterpreted, true);
  const State s = start_of(walker(), 9);
  EXPECT_LE((after(stepper, 0, 0, s) - s.x).norm(), 1e-15);
  const Slopes none = slopes_of(stepper, 0, 0, s);
  EXPECT_EQ(none.A, MatrixXd::Identity(stepper.nt(), stepper.nt()));
  for (const double h : {5e-324, -1e-200, 1e-149, 1e-100, 1e-20, 1e-12})
    EXPECT_LE((after(stepper, 0, h, s) - s.x).norm(), 1e-9) << h;
}

TEST(Adaptive, Reports) {
  const TemporaryCache cache;
  const CodegenOptions options{.cache_folder = cache.path()};
  Stepper stepper(pendulum(), Integrator::kAdaptiveStiff, options, true);
  EXPECT_FALSE(stepper.report().from_cache);
  EXPECT_GT(stepper.report().newton_operations, stepper.report().step_operations);
  EXPECT_GT(stepper.report().jacobian_operations, 0U);
  EXPECT_TRUE(Stepper(pendulum(), Integrator::kAdaptiveStiff, options, true).report().from_cache);
  after(stepper, 0, 1, {Eigen::Vector2d(1, 0), {}, {}});
  EXPECT_GT(stepper.effort().rates, stepper.effort().internal_steps);
  EXPECT_GT(stepper.effort().jacobians, 0);
}

}  // namespace
}  // namespace dyntape::adaptive_test
