// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/effects/effects.h>

#include <limits>
#include <map>
#include <memory>
#include <set>

#include "dynamics/all_effects.h"

namespace dyntape::dynamics::effects_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using VectorXq = VectorX<Float128>;

class EffectsOn : public ::testing::TestWithParam<unsigned long> {
 protected:
  EffectsOn() : random(GetParam()) {
    model = random_tree(random, {1 + random.below(6), GetParam() % 2 ? Base::kFloating : Base::kFixed});
    s = random_state(model, random);
    effects = all_effects(model, random);
    data = std::make_unique<Data<double>>(model);
    torques = std::make_unique<EffectTorques<double>>(model);
  }

  Random random;
  Model<double> model;
  State s;
  Effects<double> effects;
  std::unique_ptr<Data<double>> data;
  std::unique_ptr<EffectTorques<double>> torques;
};

TEST_P(EffectsOn, ForwardInvertsInverse) {
  effects.saturation.reset();  // inverse dynamics gives what is to arrive
  const VectorXd tau = inverse_dynamics(model, *data, *torques, effects, s.q, s.v, s.a);
  EXPECT_LE(relative_error(forward_dynamics(model, *data, *torques, effects, s.q, s.v, tau), s.a), 1e-11);
}

TEST_P(EffectsOn, DerivativesMatchDifferences) {
  const Model<Float128> exact = model.cast<Float128>();
  const Effects<Float128> e = effects.cast<Float128>();
  Data<Float128> data128(exact);
  EffectTorques<Float128> torques128(exact);
  const VectorXq q = s.q.cast<Float128>(), v = s.v.cast<Float128>(), tau = s.tau.cast<Float128>();
  inverse_dynamics_derivatives(model, *data, *torques, effects, s.q, s.v, s.tau);
  const MatrixXd inverse_dq = data->dtau_dq, inverse_dv = data->dtau_dv;
  forward_dynamics_derivatives(model, *data, *torques, effects, s.q, s.v, s.tau);
  const Float128 h(1e-11);
  const MatrixXd ft = data->Minv * torques->driven_slope.asDiagonal();
  MatrixXd fq(model.nv, model.nv), fv = fq, iq = fq, iv = fq, f_command = fq;
  const auto fill = [&](MatrixXd& d, int k, auto f) {
    VectorXq step = VectorXq::Zero(model.nv);
    step[k] = h;
    const VectorXq up = f(step), down = f(VectorXq(-step)), slope = (up - down) / (2 * h);
    d.col(k) = slope.cast<double>();
  };
  for (int k = 0; k < model.nv; ++k) {
    fill(fq, k, [&](const VectorXq& x) -> VectorXq {
      return forward_dynamics<Float128>(exact, data128, torques128, e, integrate<Float128>(exact, q, x), v,
                                        tau);
    });
    fill(fv, k, [&](const VectorXq& x) -> VectorXq {
      return forward_dynamics<Float128>(exact, data128, torques128, e, q, v + x, tau);
    });
    fill(f_command, k, [&](const VectorXq& x) -> VectorXq {
      return forward_dynamics<Float128>(exact, data128, torques128, e, q, v, tau + x);
    });
    fill(iq, k, [&](const VectorXq& x) -> VectorXq {
      return inverse_dynamics<Float128>(exact, data128, torques128, e, integrate<Float128>(exact, q, x), v,
                                        tau);
    });
    fill(iv, k, [&](const VectorXq& x) -> VectorXq {
      return inverse_dynamics<Float128>(exact, data128, torques128, e, q, v + x, tau);
    });
  }
  EXPECT_LE(relative_error(data->ddq_dq, fq), 1e-11);
  EXPECT_LE(relative_error(data->ddq_dv, fv), 1e-11);
  EXPECT_LE(relative_error(ft, f_command), 1e-11);
  EXPECT_LE(relative_error(inverse_dq, iq), 1e-13);
  EXPECT_LE(relative_error(inverse_dv, iv), 1e-13);
}

// Whoever walks the list meets every effect: alone it is undone by inverse dynamics, cast, and carried by acting_model
// and effect_torques together.
TEST_P(EffectsOn, EachIsTheSameWhereverTheListIsWalked) {
  for_each_effect_alone(effects, [&](const char* name, const Effects<double>& alone) {
    SCOPED_TRACE(name);
    const VectorXd a = forward_dynamics(model, *data, *torques, alone, s.q, s.v, s.tau);
    const VectorXd driven = driving_torques(model, *torques, alone, s.tau);
    EXPECT_LE(relative_error(inverse_dynamics(model, *data, *torques, alone, s.q, s.v, a), driven), 1e-10);

    const Model<double> acting = acting_model(model, alone);
    Data<double> other(acting);
    const VectorXd tau = driven + effect_torques(model, *data, *torques, alone, s.q, s.v);
    const VectorXd seen_v = alone.acting().coriolis ? s.v : VectorXd::Zero(model.nv).eval();
    EXPECT_EQ(aba(acting, other, s.q, seen_v, tau, {.added = alone.acting().added}), a);

    const Model<Float128> exact = model.cast<Float128>();
    Data<Float128> data128(exact);
    EffectTorques<Float128> torques128(exact);
    const VectorXq q = s.q.cast<Float128>(), v = s.v.cast<Float128>(), tau128 = s.tau.cast<Float128>();
    const VectorXq a128 =
        forward_dynamics<Float128>(exact, data128, torques128, alone.cast<Float128>(), q, v, tau128);
    EXPECT_LE(relative_error(a, a128.cast<double>()), 1e-11);
  });
}

// What tendons write across a tree is gone with the next derivatives.
TEST_P(EffectsOn, SlopesLeaveNoTraceInData) {
  forward_dynamics_derivatives(model, *data, *torques, effects, s.q, s.v, s.tau);
  const MatrixXd once = data->ddq_dq;
  forward_dynamics_derivatives(model, *data, *torques, effects, s.q, s.v, s.tau);
  EXPECT_EQ(data->ddq_dq, once);
  fd_derivatives(model, *data, s.q, s.v, s.tau);
  Data<double> fresh(model);
  fd_derivatives(model, fresh, s.q, s.v, s.tau);
  EXPECT_EQ(data->dtau_dq, fresh.dtau_dq);
  EXPECT_EQ(data->ddq_dv, fresh.ddq_dv);
}

// Without velocity products: the recursions are those at rest, their derivatives by v vanish, damping stays.
TEST_P(EffectsOn, WithoutVelocityProductsTheRecursionsAreThoseAtRest) {
  Effects<double> linear;
  linear.coriolis = false;
  const VectorXd zero = VectorXd::Zero(model.nv);
  Data<double> still(model);
  Effects<double> usual;
  EXPECT_EQ(forward_dynamics(model, *data, *torques, linear, s.q, s.v, s.tau),
            forward_dynamics(model, still, *torques, usual, s.q, zero, s.tau));
  linear.damping = model_damping(model);
  inverse_dynamics_derivatives(model, *data, *torques, linear, s.q, s.v, s.a);
  EXPECT_EQ(data->dtau_dv, MatrixXd(model_damping(model).asDiagonal()));
}

// Strengths of nothing are as good as absence.
TEST_P(EffectsOn, ZeroStrengthEqualsAbsence) {
  const std::set<std::string> strengths = {
      "inertia",         "rotor_inertia", "coefficient", "torque", "breakaway", "stiffness", "damping",
      "torque_constant", "force",         "moment",      "area",   "linear",    "volume",    "mass"};
  const auto weaken = [&](const ParameterInfo& info, auto& value) {
    if constexpr (requires { value *= 1e-40; }) {
      if (strengths.contains(info.name)) value *= 1e-40;
    }
    if constexpr (requires { *value *= 1e-40; }) {
      if (value && strengths.contains(info.name)) *value *= 1e-40;
    }
  };
  effects.gravity.vector.reset(), effects.saturation.reset();
  for_each_chosen_effect(effects, [&](auto& effect) {
    effect.visit_parameters(effect, weaken);
    if constexpr (requires { effect.front(); }) {
      for (auto& item : effect) item.visit_parameters(item, weaken);
    }
  });
  Data<double> plain(model);
  const VectorXd weak = forward_dynamics(model, *data, *torques, effects, s.q, s.v, s.tau),
                 none = forward_dynamics(model, plain, *torques, {}, s.q, s.v, s.tau);
  EXPECT_LE(relative_error(weak, none), 4 * std::numeric_limits<double>::epsilon());
}

// What is not chosen does not act: bit for bit the plain algorithms.
TEST_P(EffectsOn, NothingChosenIsThePlainAlgorithm) {
  Effects<double> none;
  DynamicsTerms<double> acting;
  acting.armature = false;
  Data<double> plain(model);
  EXPECT_EQ(forward_dynamics(model, *data, *torques, none, s.q, s.v, s.tau),
            aba(model, plain, s.q, s.v, s.tau, acting));
  EXPECT_EQ(inverse_dynamics(model, *data, *torques, none, s.q, s.v, s.a),
            rnea(model, plain, s.q, s.v, s.a, acting));
  EXPECT_EQ(joint_torques(model, *torques, none, s.q, s.v), VectorXd::Zero(model.nv));
  joint_torque_slopes(model, *torques, none, s.q, s.v);
  EXPECT_EQ(torques->dtau_dq, VectorXd::Zero(model.nv));
  EXPECT_EQ(torques->dtau_dv, VectorXd::Zero(model.nv));
  none.gravity = false;
  const VectorXd zero = VectorXd::Zero(model.nv);
  EXPECT_EQ(inverse_dynamics(model, *data, *torques, none, s.q, zero, zero), zero);
}

TEST_P(EffectsOn, ArmatureIsOnTheDiagonal) {
  const MatrixXd with = crba(model, *data, s.q);
  DynamicsTerms<double> acting;
  acting.armature = false;
  const VectorXd added = (with - crba(model, *data, s.q, acting)).diagonal();
  EXPECT_LE((added - model_armature(model)).norm(), 1e-14 * with.norm());
}

INSTANTIATE_TEST_SUITE_P(Seeds, EffectsOn, ::testing::Range(1UL, 11UL));

// Over many robots each effect is met and acts.
TEST(Effects, EachActsSomewhere) {
  std::map<std::string, int> acts;
  for (unsigned long seed = 1; seed <= 20; ++seed) {
    Random random(seed);
    Model<double> model = random_tree(random, {4});
    const State s = random_state(model, random);
    const Effects<double> effects = all_effects(model, random);
    Data<double> data(model);
    EffectTorques<double> torques(model);
    Effects<double> nothing;
    for_each_effect(nothing, [](auto& effect) { effect.reset(); });
    const VectorXd free = forward_dynamics(model, data, torques, nothing, s.q, s.v, s.tau);
    for_each_effect(effects, [&](const auto& effect) { EXPECT_TRUE(effect) << effect_name(effect); });
    for_each_effect_alone(effects, [&](const char* name, const Effects<double>& alone) {
      acts[name] += forward_dynamics(model, data, torques, alone, s.q, s.v, s.tau) != free;
    });
  }
  EXPECT_EQ(acts.size(), 15U);
  for (const auto& [name, times] : acts) EXPECT_GE(times, 5) << name;
}

TEST(Effects, FrictionHasItsSlopeAtRestAndItsLevelBeyond) {
  Random random(1);
  Model<double> model;
  model.add_joint(-1, random_joint(random, "slide", JointType::kPrismatic), {}, random_inertia(random));
  Effects<double> effects;
  effects.friction = CoulombFriction<double>{VectorXd::Constant(1, 5), 0.01};
  EffectTorques<double> torques(model);
  const VectorXd q = VectorXd::Zero(1);
  const auto torque = [&](double v) {
    return joint_torques<double>(model, torques, effects, q, VectorXd::Constant(1, v))[0];
  };
  EXPECT_EQ(torque(1e6), -5);
  EXPECT_EQ(torque(-1e6), 5);
  EXPECT_EQ(torque(0), 0);
  joint_torque_slopes<double>(model, torques, effects, q, q);
  EXPECT_EQ(torques.dtau_dv[0], -500);
}

TEST(Effects, WrongSizesAreNamed) {
  Random random(1);
  const Model<double> model = random_tree(random);
  Data<double> data(model);
  EffectTorques<double> torques(model);
  const VectorXd q = neutral(model), v = VectorXd::Zero(model.nv);
  Effects<double> effects;
  effects.damping = VectorXd::Zero(model.nv + 1);
  EXPECT_THROW(forward_dynamics(model, data, torques, effects, q, v, v), ArgumentError);
  effects.damping.reset();
  effects.armature = VectorXd::Zero(model.nv - 1);
  EXPECT_THROW(inverse_dynamics(model, data, torques, effects, q, v, v), ArgumentError);
}

}  // namespace
}  // namespace dyntape::dynamics::effects_test
