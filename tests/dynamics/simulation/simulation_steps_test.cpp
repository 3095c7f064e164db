// SPDX-License-Identifier: BSD-3-Clause
//
// Steps of the schemes: their orders on random robots with floating bases and joints of all types, in 113 bits, and what
// they are where the space is a vector space.
#include <gtest/gtest.h>

#include <dyntape/dynamics/algorithms/energy.h>
#include <dyntape/dynamics/simulation/steps.h>
#include <dyntape/dynamics/simulation/variational.h>

#include <cmath>
#include <functional>

#include "dynamics/exact_robot.h"

namespace dyntape::dynamics::simulation_steps_test {
namespace {

using Eigen::VectorXd;
using Phaseq = Phase<Float128>;

TEST(RungeKutta, OnLinesItIsTheClassicalOne) {
  Random random(5);
  const int n = 4;
  const Eigen::MatrixXd M = Eigen::MatrixXd::Random(n, n);
  const auto rate = [&](const double& s, const VectorXd& x) {
    VectorXd dx = M * x;
    for (int i = 0; i < n; ++i) dx[i] += std::sin(x[i] + s);
    return dx;
  };
  const EuclideanSpace<double> space(n);
  for (int trial = 0; trial < 100; ++trial) {
    const VectorXd x = random.vector(n);
    const double h = random.uniform(0.01, 0.5);
    const VectorXd k1 = rate(0, x), k2 = rate(h * 0.5, x + k1 * (h * 0.5)),
                   k3 = rate(h * 0.5, x + k2 * (h * 0.5)), k4 = rate(h, x + k3 * h);
    const VectorXd classical = x + (k1 + (k2 + k3) * 2 + k4) * (h / 6);
    EXPECT_EQ(runge_kutta_4(space, rate, h, x), classical);
  }
}

// A rotation at a steady rate is followed exactly.
TEST(RungeKutta, SteadyScrewsAreExact) {
  Model<double> model;
  Joint<double> joint;
  joint.type = JointType::kFreeFlyer;
  model.add_joint(-1, joint, {}, Inertia<double>{1, {0, 0, 0}, Matrix3<double>::Identity()});
  Random random(6);
  const ConfigurationSpace<double> space(model);
  for (int trial = 0; trial < 20; ++trial) {
    const VectorXd q = random_configuration(model, random.engine), v = random.vector(6, 3);
    const VectorXd end = runge_kutta_4(
        space, [&](double, const VectorXd&) { return v; }, 0.7, q);
    EXPECT_LE((end - space.integrate(q, v * 0.7)).norm(), 1e-14);
  }
}

class Schemes : public ExactRobot {
 public:
  Schemes() : ExactRobot(5, 3), energy(std::make_unique<EnergyGradients<Float128>>(exact)), space(exact) {}

  // Forward dynamics with torques that depend on time.
  VectorXq acceleration(const Float128& t, const VectorXq& at, const VectorXq& v) {
    return aba<Float128>(exact, *data128, at, v, torque(t));
  }
  VectorXq torque(const Float128& t) const { return tau * cos(Float128(3) * t); }
  auto from(const Float128& t) {
    return [this, t](const Float128& s, const VectorXq& at, const VectorXq& v) {
      return acceleration(t + s, at, v);
    };
  }
  VectorXq momentum(const VectorXq& at, const VectorXq& v) {
    kinetic_energy_gradients<Float128>(exact, *data128, *energy, at, v);
    return energy->dT_dv;
  }
  VectorXq velocity(const VectorXq& at, const VectorXq& momentum) {
    const MatrixXq M = crba<Float128>(exact, *data128, at);
    return M.partialPivLu().solve(momentum);
  }

  Phaseq runge_kutta(const Float128& t, const Float128& h, const Phaseq& x) {
    const ProductSpace both(space, EuclideanSpace<Float128>(exact.nv));
    VectorXq y(exact.nq + exact.nv);
    y << x.q, x.v;
    const VectorXq end = runge_kutta_4(
        both,
        [&](const Float128& s, const VectorXq& z) {
          VectorXq rate(2 * exact.nv);
          rate << z.tail(exact.nv), acceleration(t + s, z.head(exact.nq), z.tail(exact.nv));
          return rate;
        },
        h, y);
    return {end.head(exact.nq), end.tail(exact.nv)};
  }
  Phaseq euler(const Float128& t, const Float128& h, const Phaseq& x) {
    return semi_implicit_euler(space, from(t), h, x);
  }
  // z = z - f(z) until nothing moves: enough for short steps.
  static VectorXq fixed_point(VectorXq z, const std::function<VectorXq(const VectorXq&)>& f) {
    for (int k = 0; k < 60; ++k) {
      const VectorXq change = f(z);
      z -= change;
      if (change.norm() < 1e-28 * (1 + z.norm())) return z;
    }
    ADD_FAILURE() << "no solution";
    return z;
  }
  Phaseq midpoint(const Float128& t, const Float128& h, const Phaseq& x) {
    const VectorXq dv = fixed_point(VectorXq::Zero(exact.nv), [&](const VectorXq& z) {
      return implicit_midpoint_residual(space, from(t), h, x, z);
    });
    return implicit_midpoint_end(space, h, x, dv);
  }
  Phaseq in_velocity(const Float128& t, const Float128& h, const Phaseq& x) {
    const VectorXq dv = fixed_point(VectorXq::Zero(exact.nv), [&](const VectorXq& z) {
      return implicit_velocity_residual(space, from(t), h, x, z);
    });
    return implicit_velocity_end(space, h, x, dv);
  }
  Phaseq variational(const Float128& t, const Float128& h, const Phaseq& x) {
    const auto derivatives = [&](const VectorXq& at, const VectorXq& v) {
      const VectorXq p = momentum(at, v), by_q = energy->dT_dq;
      const VectorXq g = generalized_gravity<Float128>(exact, *data128, at);
      return LagrangianDerivatives<Float128>{by_q - g + torque(t + h / 2), p};
    };
    const VectorXq p = momentum(x.q, x.v);
    const VectorXq xi = fixed_point(x.v * h, [&](const VectorXq& z) -> VectorXq {
      return velocity(x.q, VectorXq(discrete_momenta(space, derivatives, h, x.q, z).before - p)) * h;
    });
    const VectorXq end = space.integrate(x.q, xi);
    return {end, velocity(end, discrete_momenta(space, derivatives, h, x.q, xi).after)};
  }

  using Step = Phaseq (Schemes::*)(const Float128&, const Float128&, const Phaseq&);
  Phaseq after(Step step, int steps) {
    const Float128 span = Float128(1) / 16, h = span / steps;
    Phaseq x{q, v};
    for (int k = 0; k < steps; ++k) x = (this->*step)(h * k, h, x);
    return x;
  }
  double distance(const Phaseq& a, const Phaseq& b) const {
    return double(space.difference(a.q, b.q).norm()) + double((a.v - b.v).norm());
  }
  // Twice as many steps: the error shrinks by 2^order.
  double order(Step step, int steps, const Phaseq& reference) {
    return std::log2(distance(after(step, steps), reference) / distance(after(step, 2 * steps), reference));
  }

  std::unique_ptr<EnergyGradients<Float128>> energy;
  ConfigurationSpace<Float128> space;
};

TEST_P(Schemes, OrdersOfConvergence) {
  const Phaseq reference = after(&Schemes::runge_kutta, 512);
  EXPECT_NEAR(order(&Schemes::runge_kutta, 64, reference), 4, 0.2) << "seed " << GetParam();
  EXPECT_NEAR(order(&Schemes::euler, 64, reference), 1, 0.1) << "seed " << GetParam();
  EXPECT_NEAR(order(&Schemes::in_velocity, 64, reference), 1, 0.1) << "seed " << GetParam();
  EXPECT_NEAR(order(&Schemes::midpoint, 32, reference), 2, 0.05) << "seed " << GetParam();
  EXPECT_NEAR(order(&Schemes::variational, 32, reference), 2, 0.05) << "seed " << GetParam();
}

INSTANTIATE_TEST_SUITE_P(Seeds, Schemes, ::testing::Range(1UL, 7UL));

}  // namespace
}  // namespace dyntape::dynamics::simulation_steps_test
