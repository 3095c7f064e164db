// SPDX-License-Identifier: BSD-3-Clause
//
// How accurate a motion is, as it is told: against runs to 1e-13, of random scenes, schemes and steps.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/report/simulation_results.h>

#include "interface/run/shipped_scenes.h"
#include "source_folder.h"

namespace dyntape::accuracy_test {
namespace {

using Eigen::VectorXd;

Scene double_pendulum(double a, double b, double duration) {
  Scene scene = shipped("pendulum");
  scene.robot.model = dynamics::load_urdf(test::source_folder() + "/config/robots/double_pendulum.urdf",
                                          {.continuous = dynamics::ContinuousJoint::kAngle});
  scene.q = VectorXd{{a, b}}, scene.v = VectorXd::Zero(2);
  scene.commands = {{0}, VectorXd::Zero(2)};
  scene.duration = duration;
  return scene;
}
VectorXd end_of(Scene scene) {
  scene.sample = scene.duration;
  const SimulatedMotion motion = simulate(scene);
  EXPECT_EQ(motion.trouble, "");
  VectorXd end(motion.q.rows() + motion.v.rows());
  end << motion.q.rightCols(1), motion.v.rightCols(1);
  return end;
}
VectorXd exact_end_of(Scene scene) {
  scene.integrator = Integrator::kAdaptive;
  scene.tolerances = {1e-13, 1e-15};
  scene.step = scene.duration;
  return end_of(scene);
}

TEST(Accuracy, IsTheErrorAtTheEnd) {
  std::mt19937_64 random(5);
  const auto between = [&](double a, double b) { return std::uniform_real_distribution(a, b)(random); };
  const std::pair<Integrator, double> schemes[] = {
      {Integrator::kRungeKutta4, 0.02},      {Integrator::kSemiImplicitEuler, 1e-3},
      {Integrator::kImplicitMidpoint, 5e-3}, {Integrator::kImplicitVelocity, 1e-3},
      {Integrator::kVariational, 5e-3},      {Integrator::kAdaptive, 0.5}};
  for (const auto& [integrator, step] : schemes) {
    for (int trial = 0; trial < 3; ++trial) {
      Scene scene = double_pendulum(between(-1, 1), between(-1, 1), 2);
      const VectorXd exact = exact_end_of(scene);
      scene.integrator = integrator, scene.step = scene.sample = step;
      if (integrator == Integrator::kAdaptive) scene.tolerances = {1e-7, 1e-10};
      const VectorXd off = (end_of(scene) - exact).cwiseAbs();
      const Accuracy told = accuracy_of(scene);
      ASSERT_EQ(told.trouble, "");
      EXPECT_FALSE(told.parts) << told.sentence();
      EXPECT_NEAR(told.q.value, off.head(2).maxCoeff(), 0.6 * off.head(2).maxCoeff())
          << to_string(integrator);
      EXPECT_NEAR(told.v.value, off.tail(2).maxCoeff(), 0.6 * off.tail(2).maxCoeff())
          << to_string(integrator);
    }
  }
}

// Radians off, of which a success says nothing by itself.
TEST(Accuracy, NearbyMotionsThatPartAreTold) {
  Scene scene = double_pendulum(2.5, 1.5, 40);
  scene.integrator = Integrator::kImplicitMidpoint, scene.step = 1e-3;
  SimulationReport report{scene, run(scene)};
  report.accuracy = accuracy_of(scene);
  const VectorXd off = (end_of(scene) - exact_end_of(scene)).cwiseAbs();
  ASSERT_GT(off.maxCoeff(), 0.1);  // it is one
  EXPECT_GT(std::max(report.accuracy->q.value, report.accuracy->v.value), 0.02);
  EXPECT_TRUE(report.accuracy->parts) << report.accuracy->apart;
  EXPECT_NE(report.text().find("nearby motions part"), std::string::npos) << report.text();
  EXPECT_NE(report.json().find("\"part\": true"), std::string::npos);
}

TEST(Accuracy, OfWhatIsRegularNothingParts) {
  for (const char* name : {"pendulum", "dzhanibekov", "rigid_bounce", "four_bar", "quadrotor_in_wind"}) {
    const Accuracy told = accuracy_of(shipped(name));
    EXPECT_EQ(told.trouble, "") << name;
    EXPECT_FALSE(told.parts) << name << " " << told.apart;
    EXPECT_LT(told.q.value, 1e-3) << name;
  }
}

// A command that is held stays held for as long, in steps of half the length.
TEST(Accuracy, HalvesStepsAndNotWhatTheMotorsAreTold) {
  Scene scene = double_pendulum(0, 0, 1);
  scene.step = scene.sample = 0.05;
  scene.commands.t = {0, 1};
  scene.commands.u = Eigen::MatrixXd{{0, 3}, {-1, 1}};
  const Accuracy told = accuracy_of(scene);
  Scene tenth = scene;  // with the staircase of the longer steps
  tenth.step = tenth.sample = 0.005;
  tenth.commands.t.clear();
  tenth.commands.u.resize(2, 40);
  for (int k = 0; k < 20; ++k) {
    for (int side = 0; side < 2; ++side) {
      tenth.commands.t.push_back((k + side) * 0.05 + (side ? -1e-9 : 1e-9));
      tenth.commands.u.col(2 * k + side) = scene.commands.at(k * 0.05 + 0.025, {});
    }
  }
  const double off = (end_of(scene) - end_of(tenth)).cwiseAbs().head(2).maxCoeff();
  EXPECT_NEAR(told.q.value, off, 0.5 * off);
}

// Kane's plate on a rod ("Mechanical Demonstration of Mathematical Stability and Instability", Int. J. of Mechanical Engineering
// Education 2(4), 1974): the rod swings from the ceiling about x, the plate turns about the rod.  Masses, inertias and start are
// those of MotionGenesis's example "chaotic babyboot", as are its figures after 10 s.
Scene plate_on_rod() {
  Scene scene = shipped("pendulum");
  scene.robot.model = dynamics::load_urdf_text(
      R"(<robot name="plate_on_rod">
  <link name="ceiling"/>
  <link name="rod">
    <inertial>
      <origin xyz="0 0 -0.075"/><mass value="0.01"/>
      <inertia ixx="5e-6" iyy="5e-6" izz="1e-6" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <link name="plate">
    <inertial>
      <origin xyz="0 0 -0.2"/><mass value="0.1"/>
      <inertia ixx="2.5e-4" iyy="5e-5" izz="2e-4" ixy="0" ixz="0" iyz="0"/>
    </inertial>
  </link>
  <joint name="a" type="continuous"><parent link="ceiling"/><child link="rod"/><axis xyz="1 0 0"/></joint>
  <joint name="b" type="continuous"><parent link="rod"/><child link="plate"/><axis xyz="0 0 1"/></joint>
</robot>)",
      "plate_on_rod.urdf", {.continuous = dynamics::ContinuousJoint::kAngle});
  scene.q = VectorXd{{M_PI / 2, M_PI / 180}}, scene.v = VectorXd::Zero(2);
  scene.commands = {{0}, VectorXd::Zero(2)};
  scene.duration = 10;
  return scene;
}
const VectorXd kPublishedEnd{
    {-61.312983340691 * M_PI / 180, -929.47789677244 * M_PI / 180, -6.7440081040646, -2.7795690128833}};
// Half a unit of the digits on which four runs by two integrators agree there: seven of the angles, six of the rates.
const VectorXd kPublishedTo{{5e-6 * M_PI / 180, 5e-5 * M_PI / 180, 5e-6, 5e-6}};

TEST(Accuracy, KanesPlateEndsWhereItIsPublishedTo) {
  Scene scene = plate_on_rod();
  for (const Integrator integrator : {Integrator::kAdaptive, Integrator::kRungeKutta4}) {
    scene.integrator = integrator;
    // At 1e-13 the adaptive steps end 1e-5 rad/s apart (standard deviation) for starts that differ in the last place, at 3e-14 1e-6.
    scene.tolerances = {3e-14, 1e-15};
    scene.step = is_adaptive(integrator) ? 10 : 1e-4;
    const VectorXd off = (end_of(scene) - kPublishedEnd).cwiseAbs();
    for (int k = 0; k < 4; ++k) EXPECT_LT(off[k], kPublishedTo[k]) << to_string(integrator) << " " << k;
  }
}

TEST(Accuracy, KanesPlateIsAsFarOffAsIsTold) {
  Scene scene = plate_on_rod();
  scene.integrator = Integrator::kAdaptive, scene.step = scene.sample = 1e-2;
  for (const double tolerance : {1e-10, 1e-11, 1e-12}) {
    scene.tolerances = {tolerance, 0.01 * tolerance};
    const VectorXd off = (end_of(scene) - kPublishedEnd).cwiseAbs();
    const Accuracy told = accuracy_of(scene);
    EXPECT_NEAR(told.q.value, off.head(2).maxCoeff(), 0.6 * off.head(2).maxCoeff()) << tolerance;
    EXPECT_NEAR(told.v.value, off.tail(2).maxCoeff(), 0.6 * off.tail(2).maxCoeff()) << tolerance;
    EXPECT_TRUE(told.parts) << told.apart;
  }
  // Its energy is the solver's between samples as well.
  const SimulationReport report{scene, run(scene)};
  EXPECT_LT(report.motion.energy_error(), 1e-8);
}

TEST(Accuracy, KanesPlateByMidpointsIsToldToBeOff) {
  Scene scene = plate_on_rod();
  scene.integrator = Integrator::kImplicitMidpoint, scene.step = scene.sample = 1e-3;
  SimulationReport report{scene, run(scene)};
  report.accuracy = accuracy_of(scene);
  const VectorXd off = (end_of(scene) - kPublishedEnd).cwiseAbs();
  ASSERT_GT(off.head(2).maxCoeff(), 1);  // rad
  EXPECT_GT(report.accuracy->q.value, 0.3);
  EXPECT_TRUE(report.accuracy->parts) << report.accuracy->apart;
  EXPECT_NE(report.text().find("nearby motions part"), std::string::npos) << report.text();
}

}  // namespace
}  // namespace dyntape::accuracy_test
