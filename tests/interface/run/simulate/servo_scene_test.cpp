// SPDX-License-Identifier: BSD-3-Clause
//
// Motors that follow a table: their work is that of a torque that is held over a step, and where a step is too long for them
// the scene is refused with the longest that is not.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/run/simulate/simulate.h>
#include <dyntape/interface/run/simulate/stability.h>
#include <dyntape/interface/run/simulate/step_work.h>

#include "interface/message_of.h"

namespace dyntape::servo_scene_test {
namespace {

using Eigen::VectorXd;

struct Servo {
  double inertia, stiffness, damping, step, duration;
  std::string axis = "0 0 1";  // gravity does nothing
};

// A hinge that is pulled towards one radian.
Scene servo_scene(const Servo& s, Integrator integrator = Integrator::kRungeKutta4) {
  const std::string izz = io::shortest(s.inertia);
  Scene scene;
  scene.name = "servo";
  scene.robot.model = dynamics::load_urdf_text(
      "<robot name=\"servo\"><link name=\"world\"/><link name=\"arm\"><inertial><origin xyz=\"0 0.1 0\"/>"
      "<mass value=\"1\"/><inertia ixx=\"" +
          izz + "\" ixy=\"0\" ixz=\"0\" iyy=\"" + izz + "\" iyz=\"0\" izz=\"" + izz +
          "\"/></inertial></link><joint name=\"steer\" type=\"revolute\"><parent link=\"world\"/><child "
          "link=\"arm\"/><axis xyz=\"" +
          s.axis + "\"/><limit lower=\"-10\" upper=\"10\" effort=\"5\" velocity=\"100\"/></joint></robot>",
      "servo.urdf");
  scene.q = scene.v = VectorXd::Zero(1);
  scene.commands.t = {0, 20};
  scene.commands.u = Eigen::MatrixXd::Zero(1, 2);
  scene.commands.followed = Commands::Followed{VectorXd::Constant(1, s.stiffness),
                                               VectorXd::Constant(1, s.damping),
                                               Eigen::MatrixXd::Ones(1, 2),
                                               Eigen::MatrixXd::Zero(1, 2),
                                               {0, 1}};
  scene.step = s.step, scene.sample = s.step, scene.duration = s.duration;
  scene.integrator = integrator;
  scene.evaluation.route = Route::kInterpreter;
  return scene;
}
double moment_of_inertia(const Servo& s) { return s.inertia + 0.01; }

TEST(ServoScene, WorkIsThatOfTheTorquesThatAreHeld) {
  std::mt19937_64 random(1);
  const auto between = [&](double a, double b) { return std::uniform_real_distribution(a, b)(random); };
  for (int trial = 0; trial < 20; ++trial) {
    Servo s{between(0.1, 1), between(1, 30), trial % 2 ? 0 : between(0, 1), 1e-3, 10};
    const SimulatedMotion motion = simulate(servo_scene(s));
    ASSERT_TRUE(motion.is_whole()) << motion.trouble << motion.warning;
    // A held torque and nothing else: parabolas, whose work is the kinetic energy.
    double q = 0, v = 0;
    for (int k = 0; k + 1 < motion.samples(); ++k) {
      const double u = s.stiffness * (1 - q) - s.damping * v, a = u / moment_of_inertia(s);
      q += s.step * v + s.step * s.step / 2 * a, v += s.step * a;
    }
    EXPECT_NEAR(motion.q(0, motion.samples() - 1), q, 1e-9);
    EXPECT_NEAR(motion.flows[0].work.back(), moment_of_inertia(s) * v * v / 2, 1e-9 * motion.energy_scale());
    EXPECT_LT(motion.energy_error(), 1e-10 * motion.energy_scale());
  }
}

// With gravity, what the motors can give, and motors that lag.  Runge-Kutta steps see a lag at their stages, well only where
// it is longer than they are.
TEST(ServoScene, TheBalanceClosesWithWhateverElseActs) {
  for (const double lag : {0.0, 1e-6, 1e-3, 0.1}) {
    for (const Integrator integrator : {Integrator::kRungeKutta4, Integrator::kAdaptive}) {
      if (integrator == Integrator::kRungeKutta4 && lag > 0 && lag < 0.1) continue;
      Scene scene = servo_scene({0.3, 20, 0.5, 5e-3, 2, "1 0 0"}, integrator);
      if (lag > 0) scene.robot.lag = VectorXd::Constant(1, lag);
      if (lag == 0) scene.robot.effects.saturation = dynamics::Saturation<double>{VectorXd::Constant(1, 5)};
      const SimulatedMotion motion = simulate(scene);
      ASSERT_TRUE(motion.is_whole()) << lag << " " << motion.trouble << motion.warning;
      EXPECT_LT(motion.energy_error(), 1e-6 * motion.energy_scale()) << lag << " " << to_string(integrator);
    }
  }
}

// Straight lines of a table, each step a torque of its own.
TEST(ServoScene, AndOfATableThatIsNotFollowed) {
  Scene scene = servo_scene({0.3, 0, 0, 5e-3, 2, "1 0 0"});
  scene.commands.followed.reset();
  scene.commands.t = {0, 1, 2};
  scene.commands.u = Eigen::MatrixXd{{0, 3, -2}};
  const SimulatedMotion motion = simulate(scene);
  ASSERT_TRUE(motion.is_whole());
  EXPECT_LT(motion.energy_error(), 1e-8 * motion.energy_scale());
}

// A double integrator whose torque is held: |z| < 1 while h < 2 d / k and h d / m < 2.
TEST(ServoScene, StepsThatAreTooLongAreRefusedWithTheLongest) {
  std::mt19937_64 random(2);
  const auto decade = [&](double a, double b) {
    return std::pow(10, std::uniform_real_distribution(a, b)(random));
  };
  for (int trial = 0; trial < 50; ++trial) {
    Servo s{0.19, decade(2, 5), decade(0, 3), 0, 0};
    const double longest = std::min(2 * s.damping / s.stiffness, 2 * moment_of_inertia(s) / s.damping);
    for (const Integrator integrator : {Integrator::kRungeKutta4, Integrator::kImplicitMidpoint}) {
      s.duration = 1e7 * longest;
      s.step = 0.97 * longest;
      const Scene holds = servo_scene(s, integrator);
      if (integrator == Integrator::kImplicitMidpoint) {
        EXPECT_EQ(stability_trouble(holds, holds.q, holds.v), "") << s.stiffness << " " << s.damping;
      }
      s.step = 1.03 * longest;
      const Scene grows = servo_scene(s, integrator);
      EXPECT_NE(stability_trouble(grows, grows.q, grows.v), "") << s.stiffness << " " << s.damping;
    }
  }
  const std::string said = message_of<ArgumentError>([] {
    simulate(servo_scene({0.19, 78957, 176, 5e-3, 1}));
  });
  EXPECT_NE(said.find("at most 0.00227 s"), std::string::npos) << said;
  // What stands on its head falls, whatever the step is.
  Scene falls = servo_scene({0.19, 1, 1, 1e-3, 100, "1 0 0"});
  falls.q[0] = -M_PI / 2;
  EXPECT_EQ(stability_trouble(falls, VectorXd::Constant(1, -M_PI / 2), falls.v), "");
}

TEST(ServoScene, MomentsOfADecayAreIntegrals) {
  for (const double z : {0.0, 1e-9, 0.3, 0.999, 1.0, 1.001, 5.0, 700.0, 1e6}) {
    const Eigen::Vector3d moments = moments_of_decay(z);
    // x^n exp(-z x) in pieces that are short beside 1 / z, by the middles.
    const double end = std::min(1.0, 60 / std::max(z, 1.0));
    const int pieces = 200000;
    Eigen::Vector3d sums = Eigen::Vector3d::Zero();
    for (int i = 0; i < pieces; ++i) {
      const double x = (i + 0.5) / pieces * end;
      sums += std::exp(-z * x) * end / pieces * Eigen::Vector3d(1, x, x * x);
    }
    for (int n = 0; n < 3; ++n) EXPECT_NEAR(moments[n], sums[n], 1e-7 * sums[n]) << z << " " << n;
  }
}

}  // namespace
}  // namespace dyntape::servo_scene_test
