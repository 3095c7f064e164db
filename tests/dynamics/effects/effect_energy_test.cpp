// SPDX-License-Identifier: BSD-3-Clause
//
// Where energy comes from and goes to, effect by effect.
#include <gtest/gtest.h>

#include <dyntape/dynamics/effects/effects.h>

#include "dynamics/all_effects.h"
#include "dynamics/exact_robot.h"

namespace dyntape::dynamics::effect_energy_test {
namespace {

using Eigen::VectorXd;

class EffectEnergy : public ExactRobot {
 protected:
  EffectEnergy() : ExactRobot(6, 7) {
    effects = all_effects(model, random);
    exact = model.cast<Float128>();
    torques = std::make_unique<EffectTorques<double>>(model);
  }
  // With nothing but what `name` is.
  Effects<double> alone(const std::string& name) const {
    Effects<double> found;
    for_each_effect_alone(effects, [&](const char* other, const Effects<double>& e) {
      if (other == name) found = e;
    });
    return found;
  }
  double power(const Effects<double>& e, const VectorXd& v) {
    return effect_power(model, *data, *torques, e, s.q, v, s.tau);
  }

  Effects<double> effects;
  std::unique_ptr<EffectTorques<double>> torques;
};

TEST_P(EffectEnergy, WhatDissipatesNeverSupplies) {
  effects.drag.medium.setZero();
  for (const char* name : {"joint damping", "joint friction", "back-EMF", "drag"}) {
    const Effects<double> e = alone(name);
    for (int k = 0; k < 20; ++k)
      EXPECT_LE(power(e, random.vector(model.nv, 5)), 0) << name << ", state " << k;
  }
}

// Contacts, limits and tendons store and dissipate: what they take at v and at - v together is no supply.
TEST_P(EffectEnergy, DampersOfStoresNeverSupply) {
  for (const char* name : {"contacts", "joint limits", "tendons"}) {
    const Effects<double> e = alone(name);
    for (int k = 0; k < 20; ++k) {
      const VectorXd v = random.vector(model.nv, 5);
      const double forth = power(e, v), back = power(e, -v);
      EXPECT_LE(forth + back, 1e-13 * (std::abs(forth) + std::abs(back))) << name << ", state " << k;
    }
  }
}

// The power of what stores only is the fall of its energy.
TEST_P(EffectEnergy, StoresGiveBackWhatTheyHold) {
  for (Tendon<double>& tendon : effects.tendons) tendon.damping = 0;
  for (ContactBody<double>& body : effects.contacts) body.dissipation = body.friction = 0;
  effects.contacts.ground.kind = GroundKind::kPlane;
  effects.limits->damping.setZero();
  for (const char* name : {"gravity", "joint springs", "joint limits", "tendons", "buoyancy", "contacts"}) {
    const Effects<double> e = alone(name);
    const Effects<Float128> e128 = e.cast<Float128>();
    const VectorXd slope =
        tangent_difference(exact, q, [&](const VectorXq& x) {
          return VectorXq::Constant(1, stored_energy<Float128>(exact, *data128, e128, x)).eval();
        }).transpose();
    for (int k = 0; k < 3; ++k) {
      const VectorXd v = random.vector(model.nv, 3);
      EXPECT_NEAR(power(e, v), -slope.dot(v), 1e-12 * (0.1 + slope.norm() * v.norm())) << name;
    }
  }
}

// d/dt of the kinetic energy is the command's power and that of all effects; it adds up effect by effect.
TEST_P(EffectEnergy, BalanceCloses) {
  const Effects<Float128> e = effects.cast<Float128>();
  EffectTorques<Float128> torques128(exact);
  const VectorXq acceleration = forward_dynamics<Float128>(exact, *data128, torques128, e, q, v, tau);
  const auto energy = [&](const Float128& t) {
    return kinetic_energy<Float128>(exact, *data128, integrate<Float128>(exact, q, VectorXq(v * t)),
                                    VectorXq(v + acceleration * t), e.acting());
  };
  const Float128 h(1e-11);
  const Float128 up = energy(h), down = energy(-h);
  const double rate = static_cast<double>((up - down) / (2 * h)), all = power(effects, s.v);
  EXPECT_NEAR(rate, s.v.dot(s.tau) + all, 1e-11 * (1 + std::abs(rate) + std::abs(all)));
  double sum = 0, size = 1;
  for_each_effect_alone(effects, [&](const char*, const Effects<double>& e_alone) {
    const double one = power(e_alone, s.v);
    sum += one, size += std::abs(one);
  });
  EXPECT_NEAR(sum, all, 1e-13 * size);
}

INSTANTIATE_TEST_SUITE_P(Seeds, EffectEnergy, ::testing::Range(1UL, 21UL));

}  // namespace
}  // namespace dyntape::dynamics::effect_energy_test
