// SPDX-License-Identifier: BSD-3-Clause
//
// Effects one by one, against values that are known without them.
#include <gtest/gtest.h>

#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/dynamics/model/configuration.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::effect_values_test {
namespace {

using Eigen::VectorXd;

// Massless slides along x, y and z carry a mass: a particle, q its position.
Model<double> particle(double mass) {
  Model<double> model;
  model.name = "particle";
  for (int k = 0; k < 3; ++k) {
    Joint<double> slide;
    slide.name = std::string("slide ") + "xyz"[k];
    slide.type = JointType::kPrismatic;
    slide.axis = Eigen::Vector3d::Unit(k);
    model.add_joint(k - 1, slide, {}, {k == 2 ? mass : 0, Vector3<double>::Zero(), Matrix3<double>::Zero()});
  }
  model.frames.push_back({"mass", 2, {}});
  return model;
}

Model<double> turntable() {
  Model<double> model;
  Joint<double> joint;
  joint.name = "turn";
  joint.limits = {-1, 2, JointLimits::kNone, 4};
  model.add_joint(-1, joint, {}, {1, {0.1, 0, 0}, Matrix3<double>::Identity()});
  return model;
}

struct Setting {
  explicit Setting(Model<double> m) : model(std::move(m)), data(model), torques(model) {}

  VectorXd accelerate(const VectorXd& q, const VectorXd& v) {
    return forward_dynamics<double>(model, data, torques, effects, q, v, VectorXd::Zero(model.nv));
  }
  double torque(double q, double v) {
    return effect_torques<double>(model, data, torques, effects, VectorXd::Constant(1, q),
                                  VectorXd::Constant(1, v))[0];
  }
  // A step of the classical Runge-Kutta method.
  void step(VectorXd& q, VectorXd& v, double h) {
    const VectorXd a1 = accelerate(q, v), v2 = v + h / 2 * a1, a2 = accelerate(q + h / 2 * v, v2),
                   v3 = v + h / 2 * a2, a3 = accelerate(q + h / 2 * v2, v3), v4 = v + h * a3,
                   a4 = accelerate(q + h * v3, v4);
    q += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
    v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }

  Model<double> model;
  Data<double> data;
  EffectTorques<double> torques;
  Effects<double> effects;
};

ContactBody<double> sphere(const Setting& setting, double radius, double stiffness) {
  ContactBody<double> body;
  place_at_frame(setting.model, "mass", body);
  body.radius = radius, body.stiffness = stiffness;
  return body;
}

// Rebound of a bounce without gravity: d v - ln(1 + d v) = - d e v - ln(1 - d e v), solved for e to 12 digits
// (K. Hunt, F. Crossley 1975), for every power of the penetration, stiffness and mass.
TEST(EffectValues, HuntCrossleyRebounds) {
  const double rebounds[][2] = {
      {0.1, 0.937475579950}, {0.5, 0.748434931597}, {1, 0.593624260040}, {2, 0.410719686061}};
  for (const auto& [dv, e] : rebounds) {
    for (const ContactExponent exponent :
         {ContactExponent::kOne, ContactExponent::kThreeHalves, ContactExponent::kTwo}) {
      const bool heavy = exponent == ContactExponent::kOne;
      Setting s(particle(heavy ? 3 : 0.5));
      const double v0 = 0.7;
      ContactBody<double> ball = sphere(s, 0.1, heavy ? 2000 : 1e5);
      ball.exponent = exponent, ball.dissipation = dv / v0;
      s.effects.contacts.push_back(ball);
      s.effects.gravity = false;
      VectorXd q = VectorXd::Zero(3), v = VectorXd::Zero(3);
      q[2] = 0.1, v[2] = -v0;
      const double h = 2e-6;
      int steps = 0;
      do {
        s.step(q, v, h);
        ++steps;
      } while (q[2] < 0.1 && steps < 1000000);
      EXPECT_NEAR(v[2] / v0, e, 1e-6) << "d v " << dv << ", exponent " << static_cast<int>(exponent);
      EXPECT_GT(steps, 1000);
    }
  }
}

// A block on a slope of 20 degrees, mu = 0.5, creeps with eps atanh(tan(20 deg) / mu).
TEST(EffectValues, FrictionHoldsABlockOnASlope) {
  const double angle = 20 * std::numbers::pi / 180;
  Setting s(particle(2));
  ContactBody<double> block = sphere(s, 0.1, 1e4);
  block.friction = 0.5, block.dissipation = 5;
  s.effects.contacts.push_back(block);
  s.effects.contacts.ground.normal = {-3 * std::sin(angle), 0, 3 * std::cos(angle)};  // of any length
  s.effects.contacts.slip = 1e-2;
  VectorXd q = VectorXd::Zero(3), v = VectorXd::Zero(3);
  q[2] = 0.1 / std::cos(angle);
  for (int k = 0; k < 20000; ++k) s.step(q, v, 2e-4);
  EXPECT_NEAR(v.norm() / 1e-2, 0.924332294826, 1e-9);
  EXPECT_NEAR(v[2] / v[0], std::tan(angle), 1e-9);
  EXPECT_LT(v[2], 0);
}

TEST(EffectValues, NothingActsWhereNothingTouches) {
  Setting s(particle(1));
  ContactBody<double> ball = sphere(s, 0.1, 1e4);
  ball.friction = 0.5, ball.dissipation = 1;
  s.effects.contacts.push_back(ball);
  const VectorXd v = Eigen::Vector3d(1, 2, -3);
  EXPECT_EQ(effect_torques<double>(s.model, s.data, s.torques, s.effects, Eigen::Vector3d(0, 0, 0.1), v),
            VectorXd::Zero(3));
  const VectorXd leaves = Eigen::Vector3d(0, 0, 3);  // faster than the ground follows
  EXPECT_EQ(
      effect_torques<double>(s.model, s.data, s.torques, s.effects, Eigen::Vector3d(0, 0, 0.05), leaves),
      VectorXd::Zero(3));
  for (double z : {0.0999, 0.05, -0.2}) {
    for (double w : {-5.0, 0.0, 5.0}) {
      const VectorXd f = effect_torques<double>(s.model, s.data, s.torques, s.effects,
                                                Eigen::Vector3d(0, 0, z), Eigen::Vector3d(0, 0, w));
      EXPECT_GE(f[2], 0);
    }
  }
}

// The apex of the friction cone: no normal force, with and without sliding.  No force, and derivatives that are finite and what
// differences within the ground say.
TEST(EffectValues, TheApexOfTheFrictionConeIsSmooth) {
  for (const ContactExponent exponent :
       {ContactExponent::kOne, ContactExponent::kThreeHalves, ContactExponent::kTwo}) {
    Setting s(particle(1));
    ContactBody<double> ball = sphere(s, 0.1, 1e4);
    ball.friction = 0.5, ball.dissipation = 1, ball.exponent = exponent;
    s.effects.contacts.push_back(ball);
    s.effects.gravity = false;
    const VectorXd q = Eigen::Vector3d(0, 0, 0.1), none = VectorXd::Zero(3);
    for (const Eigen::Vector3d& sliding :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(2, -1, 0), Eigen::Vector3d(1e-300, 0, 0)}) {
      const VectorXd v = sliding;
      forward_dynamics_derivatives(s.model, s.data, s.torques, s.effects, q, v, none);
      EXPECT_EQ(s.data.ddq, none);
      EXPECT_TRUE(s.data.ddq_dq.allFinite() && s.data.ddq_dv.allFinite());
      EXPECT_EQ(s.data.ddq_dv, Eigen::MatrixXd::Zero(3, 3));
      // Below it the tangential force is at most mu times the normal one.
      for (const double depth : {1e-300, 1e-18, 1e-9, 1e-3}) {
        const VectorXd f = effect_torques<double>(s.model, s.data, s.torques, s.effects,
                                                  Eigen::Vector3d(0, 0, 0.1 - depth), v);
        EXPECT_LE(f.head<2>().norm(), 0.5 * f[2] * (1 + 1e-12));
      }
    }
  }
}

// A capsule that lies is two spheres; a point is a sphere of no radius above lower ground.
TEST(EffectValues, CapsulesAreTwoSpheresAndPointsHaveNone) {
  Random random(5);
  Model<double> model;
  Joint<double> base;
  base.name = "base", base.type = JointType::kFreeFlyer;
  model.add_joint(-1, base, {}, random_inertia(random));
  model.frames.push_back({"mass", 0, random_placement(random)});
  Setting s(model);
  const State x = random_state(model, random);
  ContactBody<double> capsule = sphere(s, 0.2, 100);
  capsule.friction = 0.6, capsule.dissipation = 0.3, capsule.second_end = random.vector3(0.4);
  s.effects.contacts.ground.offset = 3;
  s.effects.contacts.push_back(capsule);
  const VectorXd both = effect_torques(s.model, s.data, s.torques, s.effects, x.q, x.v);
  ContactBody<double> end = capsule;
  end.second_end.reset(), s.effects.contacts[0] = end;
  end.X_BF.p = capsule.X_BF.R * *capsule.second_end + capsule.X_BF.p;
  s.effects.contacts.push_back(end);
  EXPECT_EQ(effect_torques(s.model, s.data, s.torques, s.effects, x.q, x.v), both);

  s.effects.contacts.resize(1);
  s.effects.contacts[0].friction = 0, s.effects.contacts[0].radius = 0;
  const VectorXd point = effect_torques(s.model, s.data, s.torques, s.effects, x.q, x.v);
  s.effects.contacts[0].radius = 0.2, s.effects.contacts.ground.offset = 2.8;
  const VectorXd round = effect_torques(s.model, s.data, s.torques, s.effects, x.q, x.v);
  EXPECT_GT(point.norm(), 1);
  EXPECT_LE(relative_error(round, point), 1e-13);
}

// Waves of no height are the plane of the same slope.
TEST(EffectValues, FlatWavesAreAPlane) {
  Random random(6);
  Ground<double> plane, waves;
  waves.kind = GroundKind::kWaves;
  waves.slope = {0.3, -0.2, 0}, waves.offset = 0.4, waves.wave = {1, 2, 0};
  plane.normal = {-0.3, 0.2, 1}, plane.offset = 0.4 / std::sqrt(1.13);
  for (int k = 0; k < 20; ++k) {
    const Vector3<double> p = random.vector3(3);
    EXPECT_NEAR(waves.below(p).distance, plane.below(p).distance, 1e-14);
    EXPECT_LE((waves.below(p).normal - plane.below(p).normal).norm(), 1e-15);
  }
}

TEST(EffectValues, StribeckFallsFromBreakawayToSliding) {
  Setting s(turntable());
  s.effects.friction = CoulombFriction<double>{VectorXd::Constant(1, 2), 1e-4, VectorXd::Constant(1, 5), 0.5};
  EXPECT_EQ(s.torque(0, 0), 0);
  EXPECT_NEAR(s.torque(0, 0.01), -(2 + 3 * std::exp(-0.0004)), 1e-14);
  EXPECT_NEAR(s.torque(0, -0.5), 2 + 3 / std::numbers::e, 1e-14);
  EXPECT_NEAR(s.torque(0, 50), -2, 1e-14);
}

TEST(EffectValues, SaturationCutsTheCommand) {
  Setting s(turntable());
  const auto driven = [&](double command) {
    return driving_torques<double>(s.model, s.torques, s.effects, VectorXd::Constant(1, command))[0];
  };
  EXPECT_EQ(driven(70), 70);  // not chosen
  s.effects.saturation = Saturation<double>{model_effort(s.model), SaturationKind::kHard};
  EXPECT_EQ(driven(3.5), 3.5);
  EXPECT_EQ(s.torques.driven_slope[0], 1);
  EXPECT_EQ(driven(70), 4);
  EXPECT_EQ(s.torques.driven_slope[0], 0);
  EXPECT_EQ(driven(-70), -4);
  EXPECT_EQ(s.torques.driven_slope[0], 0);
  s.effects.saturation->kind = SaturationKind::kSmooth;
  EXPECT_NEAR(driven(4), 4 * 0.761594155955765, 1e-14);  // tanh 1
  EXPECT_NEAR(s.torques.driven_slope[0], 0.419974341614026, 1e-14);
  s.effects.saturation->limit.setConstant(JointLimits::kNone);
  EXPECT_EQ(driven(70), 70);
}

// Outside of the margin nothing, at the limit half the margin's torque, beyond it a spring; never a pull.
TEST(EffectValues, SoftLimitsPushOnly) {
  Setting s(turntable());
  const auto one = [](double x) { return VectorXd::Constant(1, x).eval(); };
  s.effects.limits = SoftLimits<double>{one(100), one(7), one(0.2)};
  for (double q : {-0.8, 0.0, 1.8}) EXPECT_EQ(s.torque(q, 3), 0) << q;
  EXPECT_NEAR(s.torque(2, 0), -10, 1e-12);
  EXPECT_NEAR(s.torque(2.3, 0), -40, 1e-12);
  EXPECT_NEAR(s.torque(-1.3, 0), 40, 1e-12);
  EXPECT_LT(s.torque(2, 1), -10);  // against what comes on
  EXPECT_GT(s.torque(2, -1), -10);
  for (double v : {-1e3, -1.0, 1.0, 1e3}) {
    EXPECT_LT(s.torque(2.1, v), 0);
    EXPECT_GT(s.torque(-1.1, v), 0);
  }
  const double h = 1e-4;  // the second derivative at the onset: zero on both sides
  EXPECT_NEAR((s.torque(1.8 + h, 0) - 2 * s.torque(1.8, 0) + s.torque(1.8 - h, 0)) / (h * h), 0, 2);
}

// Files leave zeros where a joint has several columns: there is no motor, and no 0 / 0.
TEST(EffectValues, MotorsAreAtSingleJoints) {
  Random random(3);
  const Model<double> model = random_tree(random, {3, Base::kFloating});
  const State s = random_state(model, random);
  VectorXd at_joints = VectorXd::Zero(model.nv);
  for (const auto& joint : model.joints) {
    if (is_single(joint.type)) at_joints[joint.idx_v] = 2;
  }
  Data<double> data(model);
  EffectTorques<double> torques(model);
  for (const SaturationKind kind : {SaturationKind::kHard, SaturationKind::kSmooth}) {
    Effects<double> effects;
    effects.saturation = Saturation<double>{at_joints, kind};
    effects.back_emf = BackEmf<double>{at_joints, at_joints, at_joints, at_joints};
    forward_dynamics_derivatives(model, data, torques, effects, s.q, s.v, s.tau);
    EXPECT_TRUE(data.ddq.allFinite() && data.ddq_dv.allFinite() && torques.driven_slope.allFinite());
    EXPECT_EQ(VectorXd(torques.driven.head<6>()), VectorXd(s.tau.head<6>()));
  }
}

TEST(EffectValues, BackEmfBrakes) {
  Setting s(turntable());
  const auto one = [](double x) { return VectorXd::Constant(1, x).eval(); };
  s.effects.back_emf = BackEmf<double>{one(0.05), one(0.06), one(0.5), one(10)};
  EXPECT_NEAR(s.torque(0, 3), -100 * 0.05 * 0.06 / 0.5 * 3, 1e-14);
}

TEST(EffectValues, RotorsCountWithTheSquareOfTheirGears) {
  Setting s(turntable());
  s.effects.armature = VectorXd::Constant(1, 0.25).eval();
  s.effects.armature->rotor_inertia = VectorXd::Constant(1, 0.01);
  s.effects.armature->gear_ratio = VectorXd::Constant(1, -10);
  EXPECT_EQ(acting_model(s.model, s.effects).joints[0].armature, 1.25);
}

TEST(EffectValues, DragAndBuoyancy) {
  Setting s(particle(2));
  DragBody<double> sail;
  place_at_frame(s.model, "mass", sail);
  sail.area = 0.5, sail.linear = 0.25;
  s.effects.drag.push_back(sail);
  s.effects.drag.medium = {1, 0, 0}, s.effects.drag.density = 4, s.effects.drag.smoothing = 1e-9;
  const auto force = [&](double x, double y, double z) -> VectorXd {
    return effect_torques<double>(s.model, s.data, s.torques, s.effects, VectorXd::Zero(3),
                                  Eigen::Vector3d(x, y, z));
  };
  EXPECT_LE((force(4, 4, 0) - VectorXd(Eigen::Vector3d(-3, -4, 0) * (5 + 0.25))).norm(), 1e-13);
  EXPECT_LE(force(1, 0, 0).norm(), 1e-15);  // carried along
  s.effects.drag.reset();
  Buoy<double> buoy;
  place_at_frame(s.model, "mass", buoy);
  buoy.volume = 2.0 / 1000;
  s.effects.buoyancy.push_back(buoy);
  EXPECT_LE(s.accelerate(VectorXd::Zero(3), VectorXd::Zero(3)).norm(), 1e-14);  // 2 kg in 2 l of water hang
}

TEST(EffectValues, TendonsPullAlongTheirArms) {
  Setting s(particle(1));
  Tendon<double> tendon;
  tendon.arms = Eigen::Vector3d(0.5, 0, -1), tendon.length = 0.2, tendon.rest_length = 0.1;
  tendon.stiffness = 10, tendon.damping = 2;
  s.effects.tendons.push_back(tendon);
  const Eigen::Vector3d q(1, 5, 0.3), v(2, 5, 1);
  const auto torque = [&] {
    return VectorXd(effect_torques<double>(s.model, s.data, s.torques, s.effects, VectorXd(q), VectorXd(v)));
  };
  EXPECT_LE((torque() + VectorXd(tendon.arms * (10 * (0.1 + 0.5 - 0.3) + 2 * 0))).norm(), 1e-14);
  s.effects.tendons[0].kind = TendonKind::kTension;
  EXPECT_LE((torque() + VectorXd(tendon.arms * (10 * (0.3 - 0.0005)))).norm(), 1e-14);
  s.effects.tendons[0].rest_length = 1;
  EXPECT_EQ(torque(), VectorXd::Zero(3));  // slack
}

}  // namespace
}  // namespace dyntape::dynamics::effect_values_test
