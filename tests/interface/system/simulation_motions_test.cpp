// SPDX-License-Identifier: BSD-3-Clause
//
// Steps against motions that are known: what each scheme conserves, where it is stable.
#include <algorithm>
#include <cmath>

#include "interface/temporary_cache.h"
#include "simulated_systems.h"

namespace dyntape::simulation_motions_test {
namespace {

using namespace test;

class Motions : public ::testing::Test {
 protected:
  Stepper compiled(const System& system, Integrator integrator) const {
    return Stepper(system, integrator, {.cache_folder = cache.path()});
  }
  // max |E - E0| over a motion.
  template <class Energy>
  double drift(Stepper& stepper, double h, int steps, VectorXd x, const Energy& energy) const {
    const double start = energy(x);
    double worst = 0;
    run(stepper, h, steps, x,
        [&](const VectorXd& at) { worst = std::max(worst, std::abs(energy(at) - start)); });
    return worst;
  }

  TemporaryCache cache;
};

// From th = 2 at rest; figures of an independent implementation of these schemes.
TEST_F(Motions, PendulumKeepsEnergyAsItsSchemeDoes) {
  const auto drift_of = [&](Integrator integrator, int steps) {
    Stepper stepper = compiled(pendulum(), integrator);
    return drift(stepper, 0.01, steps, Eigen::Vector2d(2, 0),
                 [](const VectorXd& x) { return 0.5 * x[1] * x[1] - kGravity * std::cos(x[0]); }) /
           kGravity;
  };
  EXPECT_NEAR(drift_of(Integrator::kSemiImplicitEuler, 1000000), 1.854e-2, 1e-5);
  EXPECT_NEAR(drift_of(Integrator::kRungeKutta4, 100000), 9.76e-7, 1e-9);
  EXPECT_NEAR(drift_of(Integrator::kRungeKutta4, 1000000), 9.71e-6, 1e-8);
  EXPECT_NEAR(drift_of(Integrator::kImplicitMidpoint, 1000000), 8.197e-5, 1e-8);
  EXPECT_NEAR(drift_of(Integrator::kVariational, 100000), 8.197e-5, 1e-8);  // on a line the same scheme
}

// The period is 4 K(sin 1) / sqrt(g).
TEST_F(Motions, PendulumReturnsAfterItsPeriod) {
  constexpr double kPeriod = 2.66587094283493;
  Stepper stepper = compiled(pendulum(), Integrator::kRungeKutta4);
  VectorXd x = Eigen::Vector2d(2, 0);
  run(stepper, kPeriod / 2000, 2000, x, [](const VectorXd&) {});
  EXPECT_NEAR(x[0], 2, 1e-11);
  EXPECT_NEAR(x[1], 0, 1e-10);
}

// Absolute angles 0.5 and -0.4; figures of an independent implementation.
TEST_F(Motions, DoublePendulumKeepsEnergy) {
  const dynamics::Model<double> model = double_pendulum();
  dynamics::Data<double> data(model);
  const auto energy = [&](const VectorXd& x) {
    return dynamics::kinetic_energy(model, data, x.head(2), x.tail(2)) +
           dynamics::potential_energy(model, data, x.head(2));
  };
  const VectorXd x = Eigen::Vector4d(0.5, -0.9, 0, 0);
  const double start = std::abs(energy(x));
  EXPECT_NEAR(start, kGravity * (2 * std::cos(0.5) + std::cos(0.4)), 1e-13);
  Stepper stepper = compiled(robot_system(model, no_torques), Integrator::kRungeKutta4);
  EXPECT_NEAR(drift(stepper, 1e-3, 1000000, x, energy) / start, 1.296e-10, 1e-12);
  EXPECT_NEAR(drift(stepper, 5e-3, 1000000, x, energy) / start, 1.995e-6, 1e-9);
}

// m = 1 g, k = 1e6 N/m: explicit steps are stable below 2 / omega = 63.2 us.
TEST_F(Motions, StiffSprings) {
  const System system = spring(1e-3, 1e6);
  const double omega = std::sqrt(1e9), start = 1e-3;
  const auto largest = [&](Integrator integrator, double h, int steps) {
    Stepper stepper = compiled(system, integrator);
    VectorXd x = Eigen::Vector2d(start, 0);
    double worst = 0;
    run(stepper, h, steps, x, [&](const VectorXd& at) { worst = std::max(worst, std::abs(at[0])); });
    return worst;
  };
  const double h = 6e-5;
  const double bound = start / std::sqrt(1 - std::pow(h * omega / 2, 2));
  EXPECT_NEAR(bound, 3.162e-3, 1e-6);
  EXPECT_LE(largest(Integrator::kSemiImplicitEuler, h, 2000), bound * (1 + 1e-10));
  EXPECT_GE(largest(Integrator::kSemiImplicitEuler, h, 2000), bound * 0.99);
  EXPECT_GE(largest(Integrator::kSemiImplicitEuler, 6.4e-5, 2000), 1e100);
  EXPECT_LE(largest(Integrator::kImplicitMidpoint, 1e-2, 2000), start * (1 + 1e-9));
  EXPECT_LE(largest(Integrator::kVariational, 1e-2, 2000), start * (1 + 1e-9));
  EXPECT_LE(largest(Integrator::kImplicitVelocity, 1e-2, 2000), start * 1e-5);
}

struct Spin {
  VectorXd x = VectorXd::Zero(13);  // position, quaternion, velocity of the free body
  Spin() {
    x[6] = 1;
    x.tail<3>() = Eigen::Vector3d(0.01, 5, 0.01);
  }
  static Eigen::Vector3d momentum(const VectorXd& x) {  // in the body
    return Eigen::Vector3d(1, 2, 3).cwiseProduct(x.tail<3>());
  }
  static double energy(const VectorXd& x) { return 0.5 * x.tail<3>().dot(momentum(x)); }
  static Eigen::Vector3d spatial_momentum(const VectorXd& x) {
    return dynamics::rotation(Eigen::Vector4d(x.segment<4>(3))) * momentum(x);
  }
};

// About its middle axis, the body turns over: omega has the period 4 K / p of Euler's equations.
TEST_F(Motions, FreeBodyTurnsOver) {
  constexpr double kPeriod = 10.0518582763149;
  Stepper stepper = compiled(robot_system(free_body(), no_torques), Integrator::kRungeKutta4);
  Spin spin;
  const VectorXd start = spin.x;
  run(stepper, kPeriod / 20000, 20000, spin.x, [](const VectorXd&) {});
  EXPECT_LE((spin.x.tail<3>() - start.tail<3>()).norm(), 1e-9);
  run(stepper, kPeriod / 20000, 10000, spin.x, [](const VectorXd&) {});
  EXPECT_LE(spin.x[11], -4.9);
}

TEST_F(Motions, FreeBodyKeepsWhatItsSchemeKeeps) {
  struct Worst {
    double energy = 0, momentum = 0, length = 0;
  };
  const auto worst_of = [&](Integrator integrator) {
    Stepper stepper = compiled(robot_system(free_body(), no_torques), integrator);
    Spin spin;
    const VectorXd start = spin.x;
    Worst worst;
    run(stepper, 1e-3, 100000, spin.x, [&](const VectorXd& x) {
      worst.energy = std::max(worst.energy, std::abs(Spin::energy(x) / Spin::energy(start) - 1));
      const Eigen::Vector3d L = Spin::spatial_momentum(start);
      worst.momentum = std::max(worst.momentum, (Spin::spatial_momentum(x) - L).norm() / L.norm());
      worst.length = std::max(worst.length, std::abs(x.segment<4>(3).norm() - 1));
    });
    return worst;
  };
  const Worst rk = worst_of(Integrator::kRungeKutta4), mid = worst_of(Integrator::kImplicitMidpoint),
              var = worst_of(Integrator::kVariational);
  for (const Worst* w : {&rk, &mid, &var}) EXPECT_LE(w->length, 1e-13);
  EXPECT_LE(rk.energy, 1e-11);
  EXPECT_LE(mid.energy, 1e-12);
  EXPECT_LE(var.energy, 1e-5);
  EXPECT_LE(var.momentum, 1e-11);
}

// Without weight and torques a robot keeps its momentum about the world's origin: the base's rows of M v, there.
TEST_F(Motions, FloatingRobotKeepsItsMomentum) {
  dynamics::Model<double> model = walker().model;
  model.gravity.setZero();
  dynamics::Data<double> data(model);
  const auto momentum = [&](const VectorXd& x) {
    const VectorXd q = x.head(model.nq), p = dynamics::crba(model, data, q) * x.tail(model.nv);
    const Eigen::Matrix3d R = dynamics::rotation(Eigen::Vector4d(q.segment<4>(3)));
    const Eigen::Vector3d linear = R * p.head<3>(), at = q.head<3>();
    VectorXd both(6);
    both << linear, R * p.segment<3>(3) + at.cross(linear);
    return both;
  };
  VectorXd start(model.nq + model.nv);
  start << dynamics::neutral(model), VectorXd::LinSpaced(model.nv, -1, 1.5);
  const auto drift_of = [&](Integrator integrator) {
    Stepper stepper(robot_system(model, no_torques), integrator, kInterpreted);
    const VectorXd before = momentum(start);
    VectorXd x = start;
    double worst = 0;
    run(stepper, 0.01, 1000, x,
        [&](const VectorXd& at) { worst = std::max(worst, (momentum(at) - before).norm() / before.norm()); });
    return worst;
  };
  EXPECT_LE(drift_of(Integrator::kVariational), 1e-12);
  EXPECT_GE(drift_of(Integrator::kImplicitMidpoint), 1e-7);
}

}  // namespace
}  // namespace dyntape::simulation_motions_test
