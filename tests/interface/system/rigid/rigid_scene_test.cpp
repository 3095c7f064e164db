// SPDX-License-Identifier: BSD-3-Clause
//
// Loops, rigid contacts and hard limits against what is known of them.
#include <gtest/gtest.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/interface/motion/robot_problem.h>
#include <dyntape/interface/system/assembly.h>
#include <dyntape/interface/system/rigid/rigid_step.h>
#include <dyntape/interface/system/scene_system.h>

#include "interface/run/shipped_scenes.h"
#include "source_folder.h"

namespace dyntape::rigid_scene_test {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kGravity = 9.81;

VectorXd state_of(const Scene& scene) {
  VectorXd x(scene.q.size() + scene.v.size());
  x << scene.q, scene.v;
  return x;
}

// A stepper with contacts, as simulate has it, of which impacts can be seen.
struct Steps {
  explicit Steps(const Scene& scene)
      : stepper(system_of(scene.robot), scene.integrator, scene.evaluation,
                RigidStepper::needs_jacobians(scene.integrator)),
        rigid(scene.robot, stepper, scene.integrator, scene.evaluation),
        u(VectorXd::Zero(stepper.n_u())),
        x(state_of(scene)),
        h(scene.step) {
    rigid.start(x);
  }
  void operator()(long k) {
    VectorXd next;
    std::string why;
    ASSERT_TRUE(rigid.step(double(k) * h, h, x, u, next, &why)) << why;
    x = next;
  }
  Stepper stepper;
  RigidStepper rigid;
  VectorXd u, x;
  double h;
};

// The box of tumbling_box.info on a plane that rises by an angle towards -x, touching with all corners.
Scene box_on_slope(double angle, double friction) {
  Scene scene = shipped("tumbling_box");
  const Vector3d normal(std::sin(angle), 0, std::cos(angle));
  for (auto& contact : scene.robot.constraints.rigid.contacts) {
    contact.normal = normal;
    contact.friction = friction;
  }
  scene.q.setZero();
  scene.q.head<3>() = 0.05 * normal;
  scene.q[4] = std::sin(angle / 2), scene.q[6] = std::cos(angle / 2);
  scene.v.setZero();
  return scene;
}
double mass_of(const Scene& scene) {
  double mass = 0;
  for (const auto& inertia : scene.robot.model.inertias) mass += inertia.mass;
  return mass;
}

TEST(RigidScenes, ABallBouncesWhenAndAsHighAsItShould) {
  Scene scene = shipped("rigid_bounce");
  Steps steps(scene);
  const double t0 = std::sqrt(2 / kGravity), e = 0.8;
  std::vector<double> times;
  for (long k = 0; k < 5000; ++k) {
    steps(k);
    for (const RigidImpact& impact : steps.rigid.impacts()) times.push_back(impact.t);
    const double energy = steps.x.tail<6>().head<3>().squaredNorm() / 2 + kGravity * (steps.x[2] - 0.1);
    if (times.size() <= 10) {
      ASSERT_NEAR(energy, kGravity * std::pow(e, 2 * double(times.size())), 1e-10) << times.size();
    }
  }
  ASSERT_GE(times.size(), 20u);
  double expected = t0;
  for (int k = 0; k < 20; ++k) {
    EXPECT_NEAR(times[std::size_t(k)], expected, 1e-9) << k;
    expected += 2 * t0 * std::pow(e, k + 1);
  }
  EXPECT_NEAR(times.back(), 9 * t0, 1e-3);  // and then it lies
  EXPECT_NEAR(steps.x[2], 0.1, 1e-10);
  EXPECT_LT(steps.x.tail<6>().norm(), 1e-12);
}

TEST(RigidScenes, ABlockSticksToItsSlopeWithoutCreep) {
  for (const Integrator integrator : kIntegrators) {
    Scene scene = box_on_slope(0.3490658503988659, 0.5);
    scene.integrator = integrator;
    scene.duration = 2;
    const SimulatedMotion motion = run(scene);
    const VectorXd last = motion.q.col(motion.samples() - 1);
    EXPECT_LT((last - scene.q).head<3>().norm(), 1e-12) << to_string(integrator);
    EXPECT_LT((last - scene.q).tail<4>().norm(), 1e-12) << to_string(integrator);
    EXPECT_NEAR(upward_force(scene, motion.reactions.col(motion.samples() - 1)),
                2 * kGravity * std::cos(0.3490658503988659), 1e-9)
        << to_string(integrator);
  }
}

TEST(RigidScenes, ABlockSlidesDownAsCoulombSays) {
  const double angle = 0.5, mu = 0.2, a = kGravity * (std::sin(angle) - mu * std::cos(angle));
  Scene scene = box_on_slope(angle, mu);
  scene.duration = 2;
  const SimulatedMotion motion = run(scene);
  const int last = motion.samples() - 1;
  EXPECT_NEAR((motion.q.col(last) - scene.q).head<3>().norm(), a * 2 * 2 / 2, 1e-9);
  EXPECT_NEAR(motion.v.col(last).head<3>().norm(), a * 2, 1e-10);
  EXPECT_LT(motion.energy_error(), 1e-9 * motion.energy_scale());
}

// Solid sphere, speed v0 without spin: it slides, then rolls with 5/7 v0 from t = 2 v0 / (7 mu g) on.
TEST(RigidScenes, ASlidingSphereBeginsToRoll) {
  const double mu = 0.3, v0 = 2, until = 2 * v0 / (7 * mu * kGravity);
  Scene scene = shipped("rigid_bounce");
  auto& contact = scene.robot.constraints.rigid.contacts[0];
  contact.friction = mu;
  contact.restitution = 0;
  scene.q[2] = 0.1;
  scene.v[0] = v0;
  Steps steps(scene);
  double began = 0;
  for (long k = 0; k < 1000; ++k) {
    const VectorXd before = steps.x;
    steps(k);
    const double slip = steps.rigid.functions().near(steps.x).u.tail<2>().norm();
    if (slip > 1e-9) began = double(k + 1) * scene.step;
    if (slip > 1e-9) {
      EXPECT_NEAR(slip, v0 - 3.5 * mu * kGravity * double(k + 1) * scene.step, 1e-9);
    }
  }
  EXPECT_NEAR(began, until, scene.step);
  const Vector3d axis_free = steps.x.segment<3>(7);
  EXPECT_NEAR(axis_free.norm(), 5. / 7 * v0, 1e-10);  // its axes turn within a step: h^4
  EXPECT_NEAR(steps.x[2], 0.1, 1e-10);
  // Where it is: it slid, then rolled.
  const double slid = v0 * until - mu * kGravity * until * until / 2;
  EXPECT_NEAR(steps.x[0], slid + 5. / 7 * v0 * (1 - until), 1e-5);
}

// Where nothing presses, what is slow bounces as what is fast, in steps of any length.
TEST(RigidScenes, SlowElasticBallsBounceWhereNothingPresses) {
  for (const double step : {1e-6, 1e-3}) {
    Scene scene = shipped("rigid_bounce");
    for (auto& contact : scene.robot.constraints.rigid.contacts) contact.restitution = 1;
    scene.robot.effects.gravity.reset();
    scene.q[2] = 0.1 + 1e-9;
    scene.v[2] = -9e-6;
    scene.step = step, scene.sample = 10 * step, scene.duration = std::max(1000 * step, 0.01);
    const SimulatedMotion motion = run(scene);
    EXPECT_EQ(motion.impacts, 1) << step;
    EXPECT_NEAR(motion.v(2, motion.samples() - 1), 9e-6, 1e-15) << step;
  }
}

// Its velocities are not those of its positions, by the order of the step: what is stored says so.
TEST(RigidScenes, AnElasticBallThatFallsLowerByItsStepsIsNoSuccess) {
  for (const Integrator integrator : {Integrator::kSemiImplicitEuler, Integrator::kRungeKutta4}) {
    Scene scene = shipped("rigid_bounce");
    for (auto& contact : scene.robot.constraints.rigid.contacts) contact.restitution = 1;
    scene.integrator = integrator;
    scene.step = scene.sample = 1e-2;
    const SimulatedMotion motion = simulate(scene);
    const int last = motion.samples() - 1;
    const double lost = motion.energy(0) - motion.energy(last);
    const bool is_exact = integrator == Integrator::kRungeKutta4;
    EXPECT_GE(motion.energy_error(), 0.99 * std::abs(lost)) << to_string(integrator);
    EXPECT_EQ(motion.warning.empty(), is_exact) << motion.warning;
    if (is_exact) {
      EXPECT_LT(std::abs(lost), 1e-9);
    }
  }
}

TEST(RigidScenes, ImpactsOnlyTakeEnergyAndNothingSinks) {
  const Scene scene = shipped("tumbling_box");
  Steps steps(scene);
  for (long k = 0; k < scene.steps(); ++k) {
    steps(k);
    for (const RigidImpact& impact : steps.rigid.impacts())
      EXPECT_LE(impact.p.dot(impact.u_sum), 1e-13 * (1 + impact.p.norm()));
    EXPECT_GT(steps.rigid.functions().near(steps.x).gap.minCoeff(), -2e-6);
  }
  EXPECT_GT(steps.rigid.functions().near(steps.x).gap.minCoeff(), -1e-10);
}

// It falls from 1 rad against a stop at the bottom; quarter and half periods are elliptic integrals.
// Two bodies that touch each other alone: momentum stays, Newton's restitution says how they part, and what moved is of both.
TEST(RigidScenes, AFingerHitsABlock) {
  constexpr double kFinger = 0.5, kBlock = 2, kSpeed = 1;
  for (const double e : {0.0, 0.5, 1.0}) {
    Scene scene = shipped("finger_and_block");
    scene.robot.constraints.rigid.contacts.front().restitution = e;
    const SimulatedMotion motion = run(scene);
    const double together = kFinger * kSpeed / (kFinger + kBlock);
    const Eigen::Vector2d v = motion.v.rightCols<1>();
    EXPECT_NEAR(v[0], together - e * kSpeed * kBlock / (kFinger + kBlock), 1e-12) << e;
    EXPECT_NEAR(v[1], together + e * kSpeed * kFinger / (kFinger + kBlock), 1e-12) << e;
    const double gap = 0.15, after = scene.duration - gap / kSpeed;
    EXPECT_NEAR(motion.q(1, motion.samples() - 1), v[1] * after, 1e-9) << e;
    EXPECT_EQ(motion.balances.size(), 1u);
    EXPECT_LT(motion.energy_error(), 1e-12);
  }
}

TEST(RigidScenes, APendulumMeetsItsStopOnTime) {
  Scene scene = shipped("pendulum");
  scene.robot.model.joints[0].limits.lower = 0;
  const double e = 0.7;
  scene.robot.constraints.rigid.stops = dynamics::hard_stops(scene.robot.model, e);
  scene.q[0] = 1;
  Steps steps(scene);
  std::vector<double> times;
  for (long k = 0; k < 8000; ++k) {
    steps(k);
    for (const RigidImpact& impact : steps.rigid.impacts()) times.push_back(impact.t);
    EXPECT_GT(steps.x[0], -1e-10);
  }
  double modulus = std::sin(0.5), expected = std::comp_ellint_1(modulus) / std::sqrt(kGravity);
  ASSERT_GE(times.size(), 8u);
  for (int k = 0; k < 8; ++k) {
    EXPECT_NEAR(times[std::size_t(k)], expected, 1e-9) << k;
    modulus *= e;  // sin^2(a / 2) is the energy
    expected += 2 * std::comp_ellint_1(modulus) / std::sqrt(kGravity);
  }
}

// --- loops ---

// The four-bar linkage as one angle: rods on circles, by the cosine theorem, and nothing of the engine.
struct FourBar {
  struct Place {
    Eigen::Vector2d crank, coupler, rocker;  // centres
    double crank_angle, coupler_angle, rocker_angle;
  };
  static Place at(double theta) {
    const double a = 0.3, b = 0.8, c = 0.6;
    const Eigen::Vector2d B(a * std::cos(theta), a * std::sin(theta)), D(0.7, 0), BD = D - B;
    const double length = BD.norm(), turn = std::acos((b * b + length * length - c * c) / (2 * b * length));
    const double coupler = std::atan2(BD.y(), BD.x()) + turn;
    const Eigen::Vector2d C = B + b * Eigen::Vector2d(std::cos(coupler), std::sin(coupler)), CD = D - C;
    return {B / 2, (B + C) / 2, (C + D) / 2, theta, coupler, std::atan2(CD.y(), CD.x())};
  }
  static double potential(double theta) {
    const Place p = at(theta);
    return kGravity * (0.3 * p.crank.y() + 0.8 * p.coupler.y() + 0.6 * p.rocker.y());
  }
  static double inertia(double theta) {
    const double d = 1e-5;
    const Place p = at(theta + d), m = at(theta - d);
    const auto turned = [&](double x, double y) { return std::remainder(x - y, 2 * M_PI) / (2 * d); };
    return 0.3 * ((p.crank - m.crank) / (2 * d)).squaredNorm() +
           0.8 * ((p.coupler - m.coupler) / (2 * d)).squaredNorm() +
           0.6 * ((p.rocker - m.rocker) / (2 * d)).squaredNorm() +
           0.00225 * std::pow(turned(p.crank_angle, m.crank_angle), 2) +
           0.8 * 0.64 / 12 * std::pow(turned(p.coupler_angle, m.coupler_angle), 2) +
           0.018 * std::pow(turned(p.rocker_angle, m.rocker_angle), 2);
  }
  static double acceleration(double theta, double rate) {
    const double d = 1e-4;
    const double slope = (inertia(theta + d) - inertia(theta - d)) / (2 * d);
    const double pull = (potential(theta + d) - potential(theta - d)) / (2 * d);
    return (-slope * rate * rate / 2 - pull) / inertia(theta);
  }
};

TEST(Loops, AFourBarLinkageStaysClosedAndMovesAsOneAngle) {
  Scene scene = shipped("four_bar");
  scene.sample = 0.1;
  const SimulatedMotion motion = run(scene);
  EXPECT_GT(motion.assembled_by, 0);
  EXPECT_LT(motion.assembled_by, 1e-3);
  EXPECT_EQ(motion.slowed_by, 0);
  EXPECT_LT(motion.loop_error, 1e-9);
  for (int k = 0; k < motion.samples(); ++k)
    EXPECT_LT(loop_error(scene.robot, motion.q.col(k)), 1e-9) << motion.t[std::size_t(k)];
  for (int k = 0; k < motion.samples(); ++k) EXPECT_NEAR(motion.energy(k), motion.energy(0), 1e-6);
  double theta = motion.q(0, 0), rate = 0;
  const double h = 1e-3;
  for (int k = 0; k < 3000; ++k) {
    const auto f = [](double y, double w) { return FourBar::acceleration(y, w); };
    const double k1 = f(theta, rate), k2 = f(theta + h / 2 * rate, rate + h / 2 * k1),
                 k3 = f(theta + h / 2 * rate + h * h / 4 * k1, rate + h / 2 * k2),
                 k4 = f(theta + h * rate + h * h / 2 * k2, rate + h * k3);
    theta += h * rate + h * h / 6 * (k1 + k2 + k3);
    rate += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    if ((k + 1) % 1000 == 0) {
      EXPECT_NEAR(motion.q(0, (k + 1) / 100), theta, 1e-5) << k;
    }
  }
}

TEST(Loops, EveryFixedStepKeepsThem) {
  Scene scene = shipped("four_bar");
  scene.duration = 2;
  for (const Integrator integrator : {Integrator::kSemiImplicitEuler, Integrator::kRungeKutta4,
                                      Integrator::kImplicitMidpoint, Integrator::kImplicitVelocity}) {
    scene.integrator = integrator;
    const SimulatedMotion motion = run(scene);
    const double error = loop_error(scene.robot, motion.q.col(motion.samples() - 1));
    EXPECT_LT(error, 1e-3) << to_string(integrator);
  }
  scene.integrator = Integrator::kVariational;
  EXPECT_THROW(simulate(scene), ArgumentError);
}

// Flat, the linkage may go on as a parallelogram or crossed: its rank falls, and no number leaves the finite ones.
TEST(Loops, AFlatParallelogramIsNoNaN) {
  Scene scene = shipped("four_bar");
  auto& model = scene.robot.model;
  model.X_PJ[2].p.x() = 0.7;  // coupler as long as the ground
  model.frames[std::size_t(model.frame_index("rocker_end"))].X_BF.p.x() = 0.3;
  scene.robot.constraints.loops = {
      dynamics::loop_constraint(model, model.frame_index("rocker_end"), model.frame_index("ground_pin"), 3)};
  scene.q << 0, 0, -M_PI;
  scene.v << 3, -3, 3;
  scene.duration = 0.5;
  const SimulatedMotion motion = simulate(scene);
  EXPECT_TRUE(motion.q.allFinite() && motion.v.allFinite());
}

TEST(Loops, OneThatCannotCloseIsRefused) {
  Scene scene = shipped("four_bar");
  auto& model = scene.robot.model;
  model.frames[std::size_t(model.frame_index("ground_pin"))].X_BF.p.x() = 5;
  scene.robot.constraints.loops = {
      dynamics::loop_constraint(model, model.frame_index("rocker_end"), model.frame_index("ground_pin"), 3)};
  try {
    simulate(scene);
    FAIL();
  } catch (const ArgumentError& e) {
    EXPECT_NE(std::string(e.what()).find("rocker_end to ground_pin does not close"), std::string::npos)
        << e.what();
  }
}

// --- robots ---

Scene rigid_quadruped() {
  Scene scene = shipped("quadruped_standing");
  scene.robot.effects.contacts.reset();
  for (const char* foot : {"FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"}) {
    dynamics::RigidContact contact;
    contact.name = foot;
    dynamics::place_at_frame(scene.robot.model, foot, contact);
    contact.radius = 0.016;
    contact.friction = 0.7;
    scene.robot.constraints.rigid.contacts.push_back(contact);
  }
  return scene;
}

TEST(RigidScenes, AQuadrupedStandsOnRigidFeet) {
  for (const Integrator integrator : {Integrator::kImplicitVelocity, Integrator::kRungeKutta4}) {
    Scene scene = rigid_quadruped();
    scene.integrator = integrator;
    scene.duration = 6;
    const SimulatedMotion motion = run(scene);
    const int last = motion.samples() - 1;
    EXPECT_LT(motion.v.col(last).norm(), 1e-3) << to_string(integrator);
    EXPECT_NEAR(upward_force(scene, motion.reactions.col(last)), kGravity * mass_of(scene),
                1e-3 * kGravity * mass_of(scene));
    dynamics::Data<double> data(scene.robot.model);
    for (int k = 0; k < motion.samples(); ++k) {
      const auto rows = dynamics::unilateral_rows<double>(scene.robot.model, data,
                                                          scene.robot.constraints.rigid, motion.q.col(k));
      EXPECT_GT(rows.gap.minCoeff(), -1e-6) << k;
      if (k == last) {
        EXPECT_LT(rows.gap.cwiseAbs().maxCoeff(), 1e-9);
      }
    }
  }
}

TEST(RigidScenes, GiveTheSameBitsAgain) {
  Scene scene = shipped("tumbling_box");
  scene.duration = 1;
  const SimulatedMotion a = run(scene), b = run(scene);
  EXPECT_TRUE(a.q == b.q && a.v == b.v && a.reactions == b.reactions);
}

TEST(RigidScenes, WithoutConstraintsNothingIsAdded) {
  const System plain = system_of(shipped("pendulum").robot);
  EXPECT_EQ(plain.n_p, 0);
  EXPECT_TRUE(plain.lagrangian);
}

TEST(RigidScenes, WhatStartsBelowItsGroundIsRefused) {
  Scene scene = shipped("rigid_bounce");
  scene.q[2] = 0.05;
  ASSERT_TRUE(scene.places.of_keys.contains("start"));
  try {
    simulate(scene);
    FAIL();
  } catch (const ArgumentError& e) {
    EXPECT_EQ(std::string(e.what()),
              scene.places.at("start", "") +
                  ": the contact at 'ball' is 0.05 m below its ground; expected at most 1e-6, or to be clear "
                  "of it");
  }
}

// The rounding of a file's numbers, 4e-10 m or 9e-7 m: the ball stands, and is on its ground in the end.
TEST(RigidScenes, WhatStartsHardlyBelowItsGroundStands) {
  for (const double below : {4e-10, 2e-9, 9e-7}) {
    Scene scene = shipped("rigid_bounce");
    scene.q[2] = 0.1 - below, scene.duration = 0.1;
    const SimulatedMotion motion = run(scene);
    const int last = motion.samples() - 1;
    EXPECT_NEAR(motion.q(2, last), 0.1, 1e-9) << below;
    EXPECT_NEAR(motion.v(2, last), 0, 1e-9) << below;
    EXPECT_NEAR(upward_force(scene, motion.reactions.col(last)), kGravity, 1e-6) << below;
    EXPECT_LT(motion.energy_error(), 2 * kGravity * below + 1e-12) << below;
  }
}

TEST(RigidScenes, OptimalControlRefusesConstraints) {
  const Scene scene = shipped("four_bar");
  EXPECT_THROW(robot_problem(scene.robot, {}), ArgumentError);
}

// Feet that are held from both sides: a joint between limits that a contact drives it against.
TEST(RigidScenes, WhatIsWedgedStandsStill) {
  Scene scene = shipped("pendulum");
  auto& model = scene.robot.model;
  model.joints[0].limits.lower = -0.5, model.joints[0].limits.upper = 0.5;
  scene.robot.constraints.rigid.stops = dynamics::hard_stops(model, 0.0);
  scene.q[0] = 0.5;
  scene.robot.effects.springs.emplace();
  scene.robot.effects.springs->stiffness = VectorXd::Constant(1, 40.0);
  scene.robot.effects.springs->rest = VectorXd::Constant(1, 2.0);
  scene.duration = 1;
  const SimulatedMotion motion = run(scene);
  EXPECT_NEAR(motion.q(0, motion.samples() - 1), 0.5, 1e-12);
  EXPECT_NEAR(motion.reactions(1, motion.samples() - 1), 40 * 1.5 - kGravity * std::sin(0.5), 1e-8);
}

// --- what is wrong is said ---

std::string complaint(const std::string& constraints) {
  try {
    read_scene_text("robot\n{\n urdf ../robots/four_bar.urdf\n}\nconstraints\n{\n" + constraints +
                        "\n}\nsimulation\n{\n duration 1\n integrator variational\n}\n",
                    test::source_folder() + "/config/scenes/made_up.info");
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(RigidScenes, SayWhatIsWrongWithItsPlace) {
  const auto loop = [](const std::string& keys) { return "loops\n{\nloop\n{\n" + keys + "\n}\n}"; };
  const auto contact = [](const std::string& keys) { return "contacts\n{\ncontact\n{\n" + keys + "\n}\n}"; };
  const std::pair<std::string, std::string> cases[] = {
      {loop("frames \"rocker_end ground_pn\""), "ground_pin"},
      {loop("frames \"rocker_end\""), "names 1 link, expected two"},
      {loop("frames \"rocker_end rocker\""), "fixed to the same body"},
      {loop("type point"), "frames"},
      {loop("frames \"rocker_end ground_pin\"\nholds weld"), "point"},
      {loop("frames \"rocker_end ground_pin\"\nstiffness -1"), "zero or more"},
      {loop("frames \"rocker_end ground_pin\""), "'variational' has no loops"},
      {"loops\n{\n}", "at least one 'loop'"},
      {contact("frames rockr_end"), "rocker_end"},
      {contact("frames ground_pin"), "fixed to the world"},
      {contact("frames rocker_end\nrestitution 1.5"), "between 0 and 1"},
      {contact("frames rocker_end\nfriction -0.1"), "zero or more"},
      {contact("frames rocker_end\nnormal \"0 0 0\""), "is zero"},
      {contact("frames rocker_end\nstiffness 3"), "stiffness"},
      {contact("frames rocker_end\nplane_of crnk"), "crank"},
      {contact("frames rocker_end\nplane_of rocker"), "moves with its plane"},
      {contact("frames rocker_end\nplane_of ground_pin"), "fixed to the world"},
      {contact("frames rocker_end\nplane_of \"\""), "names 0 links, expected one"},
      {"limits\n{\nrestitutio 0\n}", "did you mean 'restitution'"},
      {"contact\n{\n}", "unknown key 'contact'"},
  };
  for (const auto& [text, expected] : cases) {
    const std::string said = complaint(text);
    EXPECT_NE(said.find(expected), std::string::npos) << text << "\n" << said;
    EXPECT_NE(said.find("made_up.info:"), std::string::npos) << said;
  }
  EXPECT_EQ(complaint(contact("frames rocker_end\nfriction 0.5\nradius 0.01")), "");
}

}  // namespace
}  // namespace dyntape::rigid_scene_test
