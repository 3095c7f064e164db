// SPDX-License-Identifier: BSD-3-Clause
//
// Scenes: every one of config/scenes moves as is known of it; what is wrong in a file is said with its place.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <set>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/run/simulate/stability.h>
#include <dyntape/interface/system/quadrature.h>
#include <dyntape/interface/system/scene_system.h>

#include "interface/run/shipped_scenes.h"
#include "source_folder.h"

namespace dyntape::scene_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Times at which a row of a motion crosses zero upwards, by the straight line between samples.
std::vector<double> crossings(const SimulatedMotion& motion, const Eigen::MatrixXd& rows, int row) {
  std::vector<double> times;
  for (int k = 1; k < motion.samples(); ++k) {
    const double a = rows(row, k - 1), b = rows(row, k);
    if (a < 0 && b >= 0)
      times.push_back(motion.t[std::size_t(k - 1)] +
                      (motion.t[std::size_t(k)] - motion.t[std::size_t(k - 1)]) * a / (a - b));
  }
  return times;
}

Matrix3d base_rotation(const SimulatedMotion& motion, int k) {
  const Eigen::Vector4d x = motion.q.col(k).segment<4>(3);
  return Eigen::Quaterniond(x[3], x[0], x[1], x[2]).toRotationMatrix();
}

TEST(Scenes, AllAreReadAndCloseTheirBalanceOfEnergy) {
  // Of contacts, whose forces begin within a step, the quadrature of the power is coarse.
  for (const auto& entry : std::filesystem::directory_iterator(test::source_folder() + "/config/scenes")) {
    Scene scene = shipped(entry.path().stem().string());
    scene.duration = std::min(scene.duration, 1.0);
    const SimulatedMotion motion = run(scene);
    EXPECT_EQ(motion.steps, scene.steps()) << scene.name;
    const bool touches = bool(scene.robot.effects.contacts);
    const double allowed = scene.integrator == Integrator::kRungeKutta4 && !touches ? 1e-8 : 2e-2;
    if (scene.integrator == Integrator::kImplicitVelocity) continue;  // below
    EXPECT_LT(motion.energy_error(), allowed * motion.energy_scale()) << scene.name;
  }
}

// It takes energy itself, of the first order in its steps.
TEST(Scenes, ImplicitVelocityLosesEnergyInProportionToItsSteps) {
  Scene scene = shipped("quadruped_standing");
  scene.duration = 1;
  std::vector<double> lost;
  for (const double step : {1e-3, 5e-4, 2.5e-4}) {
    scene.step = step;
    const SimulatedMotion motion = run(scene);
    lost.push_back(motion.energy_error() / motion.energy_scale());
  }
  EXPECT_LT(lost[0], 0.06);  // of both balances
  EXPECT_LT(lost[1], 0.6 * lost[0]);
  EXPECT_LT(lost[2], 0.6 * lost[1]);
}

TEST(Scenes, ThePendulumSwingsWithThePeriodOfItsIntegral) {
  const SimulatedMotion motion = run(shipped("pendulum"));
  // At rest at the start, it passes the bottom upwards a quarter and then a whole period later.
  const std::vector<double> up = crossings(motion, motion.q, 0);
  ASSERT_GE(up.size(), 3u);
  EXPECT_NEAR(up[2] - up[1], 2.66587094283493, 2e-6);
  EXPECT_NEAR(up[0], 0.75 * 2.66587094283493, 2e-6);
}

TEST(Scenes, TheFreeBodyFlipsAndKeepsItsMomentum) {
  Scene scene = shipped("dzhanibekov");
  const SimulatedMotion motion = run(scene);
  const std::vector<double> up = crossings(motion, motion.v, 4);
  ASSERT_GE(up.size(), 2u);
  EXPECT_NEAR(up[1] - up[0], 10.0518582763149, 1e-5);
  const Vector3d inertia(1, 2, 3);
  const auto momentum = [&](int k) {
    return Vector3d(base_rotation(motion, k) * inertia.cwiseProduct(motion.v.col(k).tail<3>()));
  };
  for (int k = 0; k < motion.samples(); k += 50)
    EXPECT_LT((momentum(k) - momentum(0)).norm(), 1e-9 * momentum(0).norm());
}

TEST(Scenes, TheBallMeetsTheGroundWhenItShould) {
  Scene scene = shipped("bouncing_ball");
  scene.sample = scene.step;
  scene.duration = 0.6;
  const SimulatedMotion motion = run(scene);
  int touch = 0;
  while (motion.q(2, touch) > 0.1) ++touch;
  EXPECT_NEAR(motion.t[std::size_t(touch)], std::sqrt(2 / 9.81), 1.01 * scene.step);
  EXPECT_NEAR(motion.v(2, touch), -std::sqrt(2 * 9.81), 2e-3);
}

// Without gravity, which acts during the contact as well.
TEST(Scenes, TheBallReboundsAsHuntAndCrossleySay) {
  Scene scene = shipped("bouncing_ball");
  scene.robot.effects.gravity = false;
  const double v = std::sqrt(2 * 9.81), d = scene.robot.effects.contacts[0].dissipation;
  scene.q[2] = 0.15;
  scene.v[2] = -v;
  scene.duration = 0.1;
  const SimulatedMotion motion = run(scene);
  double low = 0, high = 1;  // the rebound by bisection
  for (int i = 0; i < 60; ++i) {
    const double e = (low + high) / 2;
    (d * v - std::log(1 + d * v) > -d * e * v - std::log(1 - d * e * v) ? low : high) = e;
  }
  EXPECT_NEAR(motion.v(2, motion.samples() - 1) / v, low, 1e-6);
}

TEST(Scenes, TheBlockCreepsDownItsSlope) {
  const Scene scene = shipped("block_on_slope");
  const SimulatedMotion motion = run(scene);
  const int last = motion.samples() - 1;
  const double speed = motion.v.col(last).head<3>().norm();
  EXPECT_NEAR(speed / double(scene.robot.effects.contacts.slip), 0.924332294826, 1e-3);
  EXPECT_LT(motion.v.col(last).tail<3>().norm(), 1e-3);
}

TEST(Scenes, TheQuadrupedStandsOnItsFeet) {
  Scene scene = shipped("quadruped_standing");
  scene.duration = 4;
  const SimulatedMotion motion = run(scene);
  const int last = motion.samples() - 1;
  EXPECT_LT(motion.v.col(last).norm(), 0.005);
  EXPECT_GT(motion.q(2, last), 0.15);
  EXPECT_LT((base_rotation(motion, last) - Matrix3d::Identity()).norm(), 0.05);
  // What the contacts carry is the weight: with the springs' torques alone it would fall.
  dynamics::Data<double> data(scene.robot.model);
  dynamics::EffectTorques<double> torques(scene.robot.model);
  dynamics::Effects<double> feet = scene.robot.effects;
  dynamics::for_each_effect_alone(scene.robot.effects, [&](const char* name, const auto& alone) {
    if (std::string(name) == "contacts") feet = alone;
  });
  const VectorXd q = motion.q.col(last), v = motion.v.col(last);
  const VectorXd tau = dynamics::effect_torques<double>(scene.robot.model, data, torques, feet, q, v);
  double mass = 0;
  for (const auto& inertia : scene.robot.model.inertias) mass += inertia.mass;
  EXPECT_NEAR((base_rotation(motion, last) * tau.head<3>())[2], 9.81 * mass, 0.05 * 9.81 * mass);
}

TEST(Scenes, TheDroppedQuadrupedLandsAndStands) {
  const SimulatedMotion motion = run(shipped("quadruped_dropped"));
  const int last = motion.samples() - 1;
  EXPECT_GT(motion.q(2, last), 0.1);
  EXPECT_LT(motion.q(2, last), 0.3);
  for (int k = 0; k < motion.samples(); ++k) EXPECT_NEAR(motion.q.col(k).segment<4>(3).norm(), 1, 1e-13);
}

TEST(Scenes, TheWindTakesTheQuadrotorAlong) {
  const Scene scene = shipped("quadrotor_in_wind");
  const SimulatedMotion motion = run(scene);
  const auto& drag = scene.robot.effects.drag;
  const double rate = double(drag.density) * double(drag[0].area) / (2 * 0.5);
  for (int k = 0; k < motion.samples(); k += 50) {
    const double t = motion.t[std::size_t(k)];
    EXPECT_NEAR(3 - motion.v(0, k), 1 / (1. / 3 + rate * t), 1e-5) << t;
  }
  EXPECT_NEAR(motion.q(2, motion.samples() - 1), 2, 1e-9);
}

TEST(Scenes, WaterHoldsTheArmBack) {
  const SimulatedMotion motion = run(shipped("underwater_arm"));
  double dissipated = 0;
  for (const EnergyFlow& flow : motion.flows) {
    if (flow.name == "drag") dissipated = flow.work.back();
  }
  EXPECT_LT(dissipated, -0.1);
}

TEST(Scenes, TheArmComesToRestOnItsLimits) {
  const Scene scene = shipped("arm_with_friction");
  const SimulatedMotion motion = run(scene);
  const int last = motion.samples() - 1;
  EXPECT_LT(motion.v.col(last).norm(), 0.05);
  for (const auto& joint : scene.robot.model.joints) {
    EXPECT_GT(motion.q(joint.idx_q, last), joint.limits.lower - 0.2) << joint.name;
    EXPECT_LT(motion.q(joint.idx_q, last), joint.limits.upper + 0.2) << joint.name;
  }
}

TEST(Scenes, GiveTheSameBitsAgain) {
  Scene scene = shipped("quadruped_dropped");
  scene.duration = 0.3;
  const SimulatedMotion a = run(scene), b = run(scene);
  EXPECT_TRUE(a.q == b.q && a.v == b.v);
}

TEST(Scenes, PortableFunctionsMoveTheLastBitAndHaveTheSameOnesOnEveryRoute) {
  const auto moved = [](const std::string& functions, const std::string& route) {
    Scene scene = read_scene(scene_file("pendulum"),
                             {{"evaluation.functions", functions}, {"evaluation.route", route}});
    scene.evaluation.cache_folder = cache().path();
    return run(scene).v;
  };
  const Eigen::MatrixXd libm = moved("libm", "machine_code"), portable = moved("portable", "machine_code");
  EXPECT_FALSE(portable == libm);
  EXPECT_LT((portable - libm).cwiseAbs().maxCoeff(), 1e-10);
  EXPECT_TRUE(portable == moved("portable", "interpreter"));
  EXPECT_TRUE(portable == moved("portable", "compiled"));
  EXPECT_TRUE(portable == moved("sines", "compiled")) << "a pendulum has no other functions";
}

// Forces that cancel leave a rounding that is large beside velocities of nothing.
TEST(Scenes, ImplicitStepsGoOnAtRest) {
  Scene scene = shipped("bouncing_ball");
  scene.duration = 10;
  scene.step = 5e-3;
  scene.sample = 0.1;
  scene.q[2] = 0.0998;
  scene.robot.effects.contacts[0].dissipation = 1;
  for (const Integrator integrator :
       {Integrator::kImplicitVelocity, Integrator::kImplicitMidpoint, Integrator::kVariational}) {
    scene.integrator = integrator;
    const SimulatedMotion motion = simulate(scene);
    EXPECT_EQ(motion.trouble, "") << to_string(integrator);
    // It settles by what the contact takes, and implicit-velocity steps by what they take besides.
    EXPECT_EQ(motion.warning.empty(), integrator != Integrator::kImplicitVelocity) << motion.warning;
    EXPECT_EQ(motion.steps, scene.steps()) << to_string(integrator);
    EXPECT_LT(motion.v.col(motion.samples() - 1).norm(), 1e-3) << to_string(integrator);
  }
}

TEST(Scenes, FrictionThatTremblesIsNoSuccess) {
  Scene scene = shipped("pendulum");
  scene.robot.effects.gravity = false;
  scene.q[0] = 0;
  scene.v[0] = 1;
  scene.duration = 2;
  for (const double smoothing : {1e-3, 1e-4, 1e-6}) {
    for (const double torque : {5.0, 50.0}) {
      scene.robot.effects.friction =
          dynamics::CoulombFriction<double>{VectorXd::Constant(1, torque), smoothing};
      for (const Integrator integrator : {Integrator::kRungeKutta4, Integrator::kSemiImplicitEuler}) {
        scene.integrator = integrator;
        EXPECT_NE(simulate(scene).warning, "") << torque << " " << smoothing << " " << to_string(integrator);
      }
      scene.integrator = Integrator::kImplicitVelocity;
      EXPECT_EQ(simulate(scene).warning, "") << torque << " " << smoothing;
    }
  }
}

TEST(Scenes, AVerdictDoesNotDependOnWhatIsSampled) {
  Scene scene = shipped("bouncing_ball");
  scene.duration = 1.2;
  std::set<std::string> warnings;
  for (const double sample : {1e-3, 0.01, 0.012, 0.1}) {
    scene.sample = sample;
    warnings.insert(simulate(scene).warning);
  }
  EXPECT_EQ(warnings.size(), 1u);
}

// --- what is wrong is said ---

std::string complaint(const std::string& text) {
  try {
    read_scene_text(text, test::source_folder() + "/config/scenes/made_up.info");
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}
std::string pendulum_with(const std::string& effects, const std::string& method = "duration 1") {
  return "robot\n{\n urdf ../robots/pendulum.urdf\n}\neffects\n{\n" + effects + "\n}\nsimulation\n{\n" +
         method + "\n}\n";
}

TEST(Scenes, SayWhatIsWrongWithItsPlace) {
  const std::pair<std::string, std::string> cases[] = {
      {pendulum_with("joint_dampin 0.1"), "did you mean 'joint_damping'"},
      {pendulum_with("joint_damping -0.1"), "must be not negative, got '-0.1'"},
      {pendulum_with("joint_damping 0.1 0.2"), "made_up.info:7"},
      {pendulum_with("joint_friction robot"), "'smoothing'"},
      {pendulum_with("joint_friction { torque 1 }"), ""},
      {pendulum_with("joint_friction\n{\n torque 1\n smoothing 0.1\n breakaway 2\n}"), "stribeck_speed"},
      {pendulum_with("contacts\n{\n contact\n {\n frames tipp\n stiffness 1\n }\n}"), "tip"},
      {pendulum_with("wrenches\n{\n wrench\n {\n force \"0 0\"\n frames tip\n }\n}"),
       "'force' has 2 numbers"},
      {pendulum_with("gravity off", "duration 1\nstep 2"), "longer than the duration"},
      {pendulum_with("gravity off", "duration -1"), "must be positive"},
      {pendulum_with("gravity off", "duration 1\nintegrator euler"), "did you mean 'semi-implicit-euler'"},
      {pendulum_with("coriolis off", "duration 1\nintegrator variational"), "velocity products"},
      {pendulum_with("gravity maybe"), "on, off or a block"},
      {pendulum_with("gravity \"0 0 -1.62\""), "on, off or a block"},
      {pendulum_with("drag 5"), "off or a block"},
      {pendulum_with("contacts on"), "off or a block"},
      {pendulum_with("contacts\n{\n slip 0.1\n}"), "needs at least one 'contact'"},
      {pendulum_with("contacts\n{\n contact\n {\n frames \"\"\n stiffness 1\n }\n}"), "names no link"},
      {pendulum_with("gravity off", "duration 1\n}\nevaluation\n{\nlanes native"), "lanes"},
      {pendulum_with("gravity off", "duration 1\n}\nevaluation\n{\nfunctions sleef"),
       "valid are 'sines', 'libm', 'portable'"},
      {pendulum_with("gravity off", "duration 1\nstep 0.3"), "not made of whole steps"},
      {pendulum_with("gravity off", "duration 1\nsample 1e17"), "longer than the duration"},
      {pendulum_with("contacts\n{\n normal \"0 0 0\"\n contact\n {\n frames tip\n stiffness 1\n }\n}"),
       "normal of its ground is zero"},
      {pendulum_with("coriolis robot"), "on, off or a block"},
  };
  for (const auto& [text, expected] : cases) {
    const std::string said = complaint(text);
    EXPECT_NE(said, "") << text;
    EXPECT_NE(said.find(expected), std::string::npos) << text << "\n" << said;
  }
}

TEST(Scenes, SampleWholeStepsWhereNobodySaysHow) {
  for (const char* method :
       {"duration 0.3\nstep 3e-3", "duration 0.005", "duration 1\nstep 4e-3", "duration 1\nstep 0.05"}) {
    const Scene scene = read_scene_text(pendulum_with("gravity off", method),
                                        test::source_folder() + "/config/scenes/a.info");
    EXPECT_NEAR(double(scene.stride()) * scene.step, scene.sample, 1e-12) << method;
    EXPECT_LE(scene.sample, std::max(0.01, scene.step) * (1 + 1e-9)) << method;
    EXPECT_LE(scene.sample, scene.duration) << method;
  }
}

// Steps that lose much of the energy are no success, though nothing else is wrong with them.
TEST(Scenes, AnEnergyThatIsUnaccountedForIsNoSuccess) {
  Scene scene = shipped("pendulum");
  scene.integrator = Integrator::kSemiImplicitEuler;
  scene.step = 0.1, scene.sample = 0.1, scene.duration = 10;
  const SimulatedMotion motion = simulate(scene);
  EXPECT_NE(motion.warning.find("balance of energy"), std::string::npos) << motion.warning;
  EXPECT_FALSE(motion.is_whole());
}

TEST(Scenes, VelocityProductsThatAreOffStandInTheBalance) {
  Scene scene = shipped("arm_with_friction");
  scene.robot.effects.coriolis.reset();
  scene.duration = 1;
  const SimulatedMotion motion = simulate(scene);
  EXPECT_EQ(motion.warning, "");
  EXPECT_LT(motion.energy_error(), 1e-3 * motion.energy_scale());
}

TEST(Scenes, EffectsOfJointsLeaveAFloatingBaseAlone) {
  for (const char* effect :
       {"joint_limits\n{\n stiffness 100\n margin 0.05\n}", "torque_saturation 3", "joint_springs 8",
        "back_emf\n{\n torque_constant 0.1\n voltage_constant 0.1\n resistance 0.5\n}"}) {
    std::string text = pendulum_with(effect);
    text.replace(text.find("pendulum.urdf"), 13, "solo12.urdf\n base floating");
    EXPECT_EQ(complaint(text), "") << effect;
  }
}

TEST(Scenes, StepsThatAreTooLongAreRefusedWithTheLongest) {
  Scene scene = shipped("pendulum");
  scene.robot.effects.springs = dynamics::Springs<double>{VectorXd::Constant(1, 1e8), VectorXd::Zero(1)};
  for (const Integrator integrator : {Integrator::kRungeKutta4, Integrator::kSemiImplicitEuler}) {
    scene.integrator = integrator;
    try {
      simulate(scene);
      ADD_FAILURE();
    } catch (const ArgumentError& e) {
      EXPECT_NE(std::string(e.what()).find(integrator == Integrator::kRungeKutta4 ? "0.000283" : "0.0002 s"),
                std::string::npos)
          << e.what();
    }
  }
}

// Steps of a large robot take milliseconds: who interrupts a motion does not wait for a thousand of them.
TEST(Scenes, AStopIsLookedForAtEveryStep) {
  Scene scene = shipped("pendulum");
  scene.evaluation.route = Route::kInterpreter;
  std::stop_source stop;
  const SimulatedMotion motion =
      simulate(scene, {stop.get_token(), [&](const std::string&) { stop.request_stop(); }});
  EXPECT_TRUE(motion.was_stopped);
  EXPECT_LE(motion.steps, 1);
}

// What a motion finds wrong with its start is at the key of the file, or of a scene without a file at its name.
TEST(Scenes, AWrongStartHasItsPlace) {
  const auto refusal = [](const std::string& effects, const std::string& start, const std::string& step) {
    const std::string text = "robot { urdf ../robots/arm_2r.urdf }\neffects { " + effects + " }\n" + start +
                             "\nsimulation {\n duration 1\n step " + step +
                             "\n}\nevaluation { route interpreter }\n";
    try {
      simulate(read_scene_text(text, test::source_folder() + "/config/scenes/arm.info"));
    } catch (const ArgumentError& e) {
      return std::string(e.what()).substr((test::source_folder() + "/config/scenes/").size());
    }
    return std::string("nothing refused");
  };
  const std::string stiff = refusal("joint_springs { stiffness 1e6 }", "start { q 0.1 }", "0.01");
  EXPECT_TRUE(stiff.starts_with("arm.info:6:7: at the start: the fastest motion oscillates at ")) << stiff;
  EXPECT_EQ(
      refusal("gravity on", "constraints { limits { } }\nstart { q {\n shoulder 0\n elbow 90 } }", "1e-3"),
      "arm.info:6:8: joint 'elbow' starts at 90 rad, beyond its hard limit; expected -2.8 to 2.8 rad, or no "
      "'constraints.limits'; in degrees? 90 degrees are 1.5708 rad");
  Scene scene = shipped("rigid_bounce");
  scene.places = {}, scene.q[2] = 0.05;
  try {
    simulate(scene);
    ADD_FAILURE();
  } catch (const ArgumentError& e) {
    EXPECT_TRUE(std::string(e.what()).starts_with("scene \"" + scene.name + "\": the contact at 'ball'"))
        << e.what();
  }
}

TEST(Stability, OfAnOscillatorAndADamper) {
  EXPECT_NEAR(longest_step(Integrator::kSemiImplicitEuler, {0, 3.0}), 2 / 3., 1e-12);
  EXPECT_NEAR(longest_step(Integrator::kRungeKutta4, {0, 1.0}), 2 * std::sqrt(2.), 1e-4);
  EXPECT_NEAR(longest_step(Integrator::kRungeKutta4, {-1.0, 0}), 2.785293563, 1e-6);
  EXPECT_EQ(longest_step(Integrator::kImplicitMidpoint, {-1e9, 0}), HUGE_VAL);
  EXPECT_EQ(longest_step(Integrator::kRungeKutta4, {1.0, 0}), HUGE_VAL);
}

TEST(Quadrature, IsThatOfTheCubic) {
  for (int n : {2, 3, 4, 5, 9}) {
    const double h = 0.1;
    Quadrature integral(h, 1);
    std::vector<double> found;
    const auto take = [&](const VectorXd& sum) { found.push_back(sum[0]); };
    const int degree = std::min(n - 1, 3);
    for (int k = 0; k < n; ++k) integral.append(VectorXd::Constant(1, std::pow(k * h, degree)), take);
    integral.finish(take);
    ASSERT_EQ(int(found.size()), n);
    for (int k = 0; k < n; ++k)
      EXPECT_NEAR(found[std::size_t(k)], std::pow(k * h, degree + 1) / (degree + 1), 1e-15);
  }
}

// Where velocity products are off, accelerations are no longer those of a Lagrangian.
TEST(Scene, HasALagrangianOnlyWithVelocityProducts) {
  RobotScene scene{dynamics::load_urdf(test::source_folder() + "/config/robots/cart_pole.urdf")};
  EXPECT_TRUE(bool(system_of(scene).lagrangian));
  scene.effects.coriolis.reset();
  EXPECT_FALSE(bool(system_of(scene).lagrangian));
  EXPECT_TRUE(bool(system_of(scene).acceleration));
}

}  // namespace
}  // namespace dyntape::scene_test
