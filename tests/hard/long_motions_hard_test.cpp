// SPDX-License-Identifier: BSD-3-Clause
//
// Motions of a million steps, stiff parts, clocks, bounces without end.
#include <gtest/gtest.h>

#include <cmath>

#include <dyntape/interface/run/simulate/simulate.h>

#include "interface/system/simulated_systems.h"
#include "interface/temporary_cache.h"
#include "source_folder.h"

namespace dyntape::long_motions_hard_test {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using test::run;

const TemporaryCache& cache() {
  static const TemporaryCache cache;
  return cache;
}

std::string name_of(Integrator integrator) {
  std::string name = to_string(integrator);
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

// --- A million steps -----------------------------------------------------------------------------------------

struct Keeps {
  Integrator integrator;
  double energy, momentum;  // relative, over a million steps
};

class AMillionSteps : public ::testing::TestWithParam<Keeps> {};

// H09, X09 | naive: explicit Euler on the four numbers of a quaternion has a length of 3.49 after 1e5 steps; who
// never normalises drifts | holds: the length is 1 to 1e-13 after a million steps of a body that turns over, though
// nobody normalises | routes: C
// H60 | naive: Euler steps multiply the energy by 5.5 and turn the angular momentum away | holds: each scheme keeps
// energy and spatial momentum as its order and its invariants say | routes: C
TEST_P(AMillionSteps, KeepTheLengthEnergyAndMomentum) {
  Stepper stepper(test::robot_system(test::free_body(), test::no_torques), GetParam().integrator,
                  {.cache_folder = cache().path()});
  VectorXd x = VectorXd::Zero(13);
  x[6] = 1, x.tail<3>() << 0.01, 5, 0.01;
  const Vector3d inertia(1, 2, 3);
  const auto momentum = [&](const VectorXd& at) {
    return Vector3d(dynamics::rotation(Eigen::Vector4d(at.segment<4>(3))) *
                    inertia.cwiseProduct(at.tail<3>()));
  };
  const auto energy = [&](const VectorXd& at) {
    return 0.5 * at.tail<3>().dot(inertia.cwiseProduct(at.tail<3>()));
  };
  const double start = energy(x);
  const Vector3d L = momentum(x);
  double length = 0, energies = 0, momenta = 0;
  long k = 0;
  run(stepper, 1e-3, 1000000, x, [&](const VectorXd& at) {
    if (++k % 50 != 0) return;
    length = std::max(length, std::abs(at.segment<4>(3).norm() - 1));
    energies = std::max(energies, std::abs(energy(at) / start - 1));
    momenta = std::max(momenta, (momentum(at) - L).norm() / L.norm());
  });
  EXPECT_LE(length, 1e-13);
  EXPECT_LE(energies, GetParam().energy);
  EXPECT_LE(momenta, GetParam().momentum);
  std::printf("%s: length %.1e, energy %.1e, momentum %.1e\n", to_string(GetParam().integrator), length,
              energies, momenta);
}

INSTANTIATE_TEST_SUITE_P(By, AMillionSteps,
                         ::testing::Values(Keeps{Integrator::kRungeKutta4, 1e-10, 1e-10},
                                           Keeps{Integrator::kImplicitMidpoint, 1e-11, 1e-3},
                                           Keeps{Integrator::kVariational, 1e-5, 1e-10}),
                         [](const auto& info) { return name_of(info.param.integrator); });

// --- Clocks --------------------------------------------------------------------------------------------------

Scene pendulum(const std::string& rest) {
  Scene scene = read_scene_text("robot\n{\n  urdf ../robots/pendulum.urdf\n}\n" + rest,
                                test::source_folder() + "/config/scenes/made_up.info");
  scene.evaluation = test::kInterpreted;
  return scene;
}

// X10 | naive: a time that is summed is 1e-8 s late after 1e8 steps of 1 us, and a step too many or too few is made |
// holds: time is the number of the step times its length: right to half a unit in the last place at each sample, and
// 0.1 s, 0.7 s, 1e5 s are the number of steps that people mean | routes: simulation
TEST(Clocks, TimeIsCountedNotSummed) {
  for (const double step : {1e-3, 1e-4, 1e-6, 1 / 3e3, 0.07}) {
    for (const long count : {1L, 3L, 7L, 1000L, 99999L, 100000000L}) {
      Scene scene;
      scene.step = step, scene.duration = step * double(count);
      EXPECT_EQ(scene.steps(), count) << step;
      scene.duration = std::nextafter(scene.duration, HUGE_VAL);
      EXPECT_EQ(scene.steps(), count) << step;
    }
  }
  Scene scene =
      pendulum("start\n{\n  q 0.1\n}\nsimulation\n{\n  duration 20\n  step 1e-3\n  sample 1e-3\n}\n");
  const SimulatedMotion motion = simulate(scene);
  ASSERT_EQ(motion.samples(), 20001);
  double sum = 0, worst = 0;
  for (int k = 0; k < motion.samples(); ++k, sum += 1e-3) {
    EXPECT_EQ(motion.t[std::size_t(k)], double(k) * 1e-3);
    worst = std::max(worst, std::abs(sum - double(k) * 1e-3));
  }
  EXPECT_GT(worst, 1e-12);  // what a sum would be off by
}

// X10 | naive: what depends on time is evaluated at a summed time | holds: a system that is pushed by sin(1e3 t)
// moves late, after 1e8 steps of 1 us, as it does in closed form, with the time of each step its number times the
// length | routes: interpreter
TEST(Clocks, LateStepsSeeTheirTime) {
  System s{"pushed"};
  s.model.add_joint(-1, test::joint(dynamics::JointType::kPrismatic, {1, 0, 0}, "slide"), {},
                    test::point_mass(1, {0, 0, 0}));
  s.acceleration = [](const SystemPoint<AD>& at) {
    return VectorXad(VectorXad::Constant(1, sin(1000.0 * at.t)));
  };
  Stepper stepper(s, Integrator::kRungeKutta4, test::kInterpreted);
  const double h = 1e-6;
  const long first = 100000000;
  VectorXd x = VectorXd::Zero(2);
  for (long k = first; k < first + 2000; ++k) {
    ASSERT_TRUE(stepper.step(double(k) * h, h, x.data(), nullptr, nullptr, x.data()));
  }
  const auto antiderivative = [](long double t) { return -std::cos(1000 * t) / 1000; };
  EXPECT_NEAR(x[1], double(antiderivative(100.002L) - antiderivative(100.0L)), 1e-14);
}

// --- Stiffness -----------------------------------------------------------------------------------------------

struct Damper {
  double ratio;  // step over m / d
  bool explicit_holds;
};

class Dampers : public ::testing::TestWithParam<Damper> {};

// H43, X01 | naive: explicit steps longer than 2 m / d of a damper explode in silence | holds: explicit schemes are
// refused at the start, with the longest step, wherever they would be unstable; implicit ones come to rest at a
// thousand million times that length | routes: simulation, interpreter
TEST_P(Dampers, ExplicitStepsAreRefusedOrStable) {
  const double inertia = 1, step = 1e-2, d = GetParam().ratio * inertia / step;
  for (const Integrator integrator : {Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint,
                                      Integrator::kImplicitVelocity, Integrator::kAdaptiveStiff}) {
    Scene scene = pendulum(
        "effects\n{\n  gravity off\n}\nstart\n{\n  q 0.1\n  v 1\n}\nsimulation\n{\n  duration 2\n  step "
        "1e-2\n}\n");
    scene.integrator = integrator;
    dynamics::Data<double> data(scene.robot.model);
    const double moved = dynamics::crba(scene.robot.model, data, scene.q)(0, 0);
    scene.robot.effects.damping = dynamics::Damping<double>{VectorXd::Constant(1, d * moved)};
    if (integrator == Integrator::kSemiImplicitEuler && !GetParam().explicit_holds) {
      EXPECT_THROW(simulate(scene), ArgumentError) << d;
      continue;
    }
    const SimulatedMotion motion = simulate(scene);
    EXPECT_EQ(motion.trouble, "") << to_string(integrator);
    double most = 0;
    for (int k = 0; k < motion.samples(); ++k) most = std::max(most, std::abs(motion.v(0, k)));
    EXPECT_LE(most, 1 + 1e-9) << to_string(integrator);
    if (integrator == Integrator::kImplicitVelocity || integrator == Integrator::kAdaptiveStiff) {
      EXPECT_LE(std::abs(motion.v(0, motion.samples() - 1)), 1e-9) << to_string(integrator);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Dampers,
                         ::testing::Values(Damper{1.9, true}, Damper{2.1, false}, Damper{1e3, false},
                                           Damper{1e9, false}),
                         [](const auto& info) { return "number_" + std::to_string(info.index); });

class Lags : public ::testing::TestWithParam<double> {};

// H45 | naive: an Euler filter of a motor with a lag below the step diverges, exp(-h / lag) - 1 is taken in single
// digits above it | holds: the motor is exp(-t / lag) from its command to rounding, in one step or in a thousand, by
// every scheme, with lags from 1e-9 to 1e9 s | routes: interpreter
TEST_P(Lags, AreFollowedExactlyWhateverTheStep) {
  System s{"motor"};
  s.model.add_joint(-1, test::joint(dynamics::JointType::kPrismatic, {1, 0, 0}, "slide"), {},
                    test::point_mass(1, {0, 0, 0}));
  s.n_u = 1, s.lag = VectorXd::Constant(1, GetParam());
  s.acceleration = [](const SystemPoint<AD>& at) { return VectorXad(at.drive); };
  s.lagrangian = [](const VectorXad&, const VectorXad& v, const VectorXad&) { return 0.5 * v[0] * v[0]; };
  s.forces = [](const SystemPoint<AD>& at) { return VectorXad(at.drive); };
  const double u = 2, total = 1e-3;
  for (const Integrator integrator : kIntegrators) {
    Stepper stepper(s, integrator, test::kInterpreted);
    for (const int steps : {1, 1000}) {
      Vector3d x(0, 0, -1);
      for (int k = 0; k < steps; ++k) {
        std::string why;
        ASSERT_TRUE(stepper.step(k * total / steps, total / steps, x.data(), &u, nullptr, x.data(), &why))
            << why;
      }
      const double expected = u + (-1 - u) * std::exp(-total / GetParam());
      EXPECT_NEAR(x[2], expected, 2e-13) << to_string(integrator) << ", " << steps << " steps";
      EXPECT_LE(std::abs(x[1]), u * total * (1 + 1e-9));  // the motor never overshoots
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Seconds, Lags, ::testing::Values(1e-9, 1e-4, 1.0, 1e9),
                         [](const auto& info) { return "number_" + std::to_string(info.index); });

// H49 | naive: sign(v) chatters, and the period of stick and slip depends on the step | holds: a block that a spring
// drags over a floor with breakaway sticks and slips with the same period, to 1 %, for steps from 1e-4 to 1e-5 s, by
// explicit and implicit steps | routes: C
TEST(StickSlip, ThePeriodDoesNotDependOnTheStep) {
  System s{"dragged block"};
  s.model.add_joint(-1, test::joint(dynamics::JointType::kPrismatic, {1, 0, 0}, "slide"), {},
                    test::point_mass(1, {0, 0, 0}));
  s.acceleration = [](const SystemPoint<AD>& at) {
    const AD v = at.v[0], fall = v / 0.05;
    const AD friction = (3.0 + 2.0 * exp(-(fall * fall))) * tanh(v / 1e-3);
    return VectorXad(VectorXad::Constant(1, 50.0 * (0.1 * at.t - at.q[0]) - friction));
  };
  std::vector<double> periods;
  for (const auto& [integrator, h] : {std::pair{Integrator::kRungeKutta4, 1e-4},
                                      {Integrator::kRungeKutta4, 1e-5},
                                      {Integrator::kImplicitMidpoint, 1e-4}}) {
    Stepper stepper(s, integrator, {.cache_folder = cache().path()});
    Eigen::Vector2d x(0, 0);
    std::vector<double> slips;
    double before = 0;
    for (long k = 0; k < std::lround(12 / h); ++k) {
      ASSERT_TRUE(stepper.step(double(k) * h, h, x.data(), nullptr, nullptr, x.data()));
      if (before < 0.1 && x[1] >= 0.1) slips.push_back(double(k) * h);
      before = x[1];
    }
    ASSERT_GE(slips.size(), 5u) << to_string(integrator) << " " << h;
    periods.push_back((slips.back() - slips[1]) / double(slips.size() - 2));
  }
  EXPECT_NEAR(periods[1], periods[0], 0.01 * periods[0]);
  EXPECT_NEAR(periods[2], periods[0], 0.01 * periods[0]);
}

// --- Walls and bounces ---------------------------------------------------------------------------------------

struct Hit {
  double speed, step;
  int least_whole;  // of five schemes, those that must get through
};

class SoftWalls : public ::testing::TestWithParam<Hit> {};

// X07 | naive: a wall of springs that is hit at speed is passed within a step, or gives back more than it took |
// holds: a soft limit of a joint that is hit at 1 to 1e4 rad/s throws it back no faster than it came, or the
// simulation refuses, or says that its steps are too long: never a motion that is called whole and gained energy |
// routes: simulation, interpreter
TEST_P(SoftWalls, GiveBackNoMoreThanTheyTook) {
  int whole = 0;
  for (const Integrator integrator :
       {Integrator::kRungeKutta4, Integrator::kSemiImplicitEuler, Integrator::kImplicitMidpoint,
        Integrator::kImplicitVelocity, Integrator::kAdaptive}) {
    Scene scene =
        pendulum("effects\n{\n  gravity off\n}\nstart\n{\n  q 0\n}\nsimulation\n{\n  duration 1\n}\n");
    scene.integrator = integrator;
    scene.robot.model.joints[0].limits.lower = -1, scene.robot.model.joints[0].limits.upper = 1;
    const auto all = [](double value) { return VectorXd::Constant(1, value); };
    scene.robot.effects.limits = dynamics::SoftLimits<double>{all(1e4), all(5), all(0.05)};
    scene.v[0] = GetParam().speed, scene.step = GetParam().step;
    scene.duration = std::max(scene.step, 1.5 / GetParam().speed), scene.sample = scene.step;
    try {
      const SimulatedMotion motion = simulate(scene);
      if (!motion.is_whole()) continue;
      ++whole;
      const int last = motion.samples() - 1;
      EXPECT_LE(motion.energy(last), motion.energy(0) * (1 + 0.02)) << to_string(integrator);
      EXPECT_LE(std::abs(motion.v(0, last)), GetParam().speed * 1.01) << to_string(integrator);
    } catch (const ArgumentError& e) {
      EXPECT_NE(std::string(e.what()).find("step"), std::string::npos) << e.what();
    }
  }
  EXPECT_GE(whole, GetParam().least_whole);
}

INSTANTIATE_TEST_SUITE_P(Of, SoftWalls,
                         ::testing::Values(Hit{1, 1e-3, 3}, Hit{100, 1e-4, 5}, Hit{1e4, 1e-6, 5},
                                           Hit{1e4, 1e-4, 1}, Hit{100, 1e-2, 1}),
                         [](const auto& info) { return "number_" + std::to_string(info.index); });

// X11 | naive: a ball that bounces ever faster takes events without end before it lies (Zeno) | holds: a ball on
// rigid ground lies still after 9 times its first fall, however long the steps, at rest to rounding | routes:
// simulation, interpreter
TEST(Bounces, EndInFiniteTime) {
  for (const double step : {1e-3, 1e-2}) {
    Scene scene = read_scene(test::source_folder() + "/config/scenes/rigid_bounce.info");
    scene.evaluation = test::kInterpreted;
    scene.step = step, scene.duration = 6;
    const SimulatedMotion motion = simulate(scene);
    ASSERT_EQ(motion.trouble, "") << step;
    const int last = motion.samples() - 1;
    EXPECT_LE(motion.v.col(last).norm(), 1e-12) << step;
    EXPECT_NEAR(motion.q(2, last), 0.1, 1e-9) << step;
    EXPECT_GE(motion.impacts, 10);
    EXPECT_LE(motion.impacts, 1000);
  }
}

}  // namespace
}  // namespace dyntape::long_motions_hard_test
