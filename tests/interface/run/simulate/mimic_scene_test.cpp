// SPDX-License-Identifier: BSD-3-Clause
//
// Scenes of robots whose mimic joints follow their leaders: against closed forms, and what is wrong in their files.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/report/simulation_results.h>
#include <dyntape/interface/run/simulate/accuracy.h>
#include <dyntape/interface/run/simulate/effect_costs.h>
#include <dyntape/interface/run/simulate/simulate.h>

#include "interface/message_of.h"
#include "interface/run/tied_robots.h"
#include "source_folder.h"

namespace dyntape::mimic_scene_test {
namespace {

using Eigen::VectorXd;
using test::Pendulums;
using test::Sliders;
using test::tied_scene;

constexpr const char* kSchemes[] = {"runge-kutta-4",     "semi-implicit-euler",
                                    "implicit-midpoint", "implicit-velocity",
                                    "adaptive",          "adaptive-stiff"};

SimulatedMotion sound(const Scene& scene) {
  SimulatedMotion motion = simulate(scene);
  EXPECT_EQ(motion.trouble, "");
  EXPECT_EQ(motion.warning, "");
  return motion;
}

Scene swinging(const Pendulums& of, const std::string& simulation, const std::string& more = "") {
  return tied_scene(of.urdf(),
                    "start { q { a 0.8 } v { a -0.5 } }\nsimulation { " + simulation + " }\n" + more);
}

// The leader alone in its own equation, by Runge-Kutta's steps of a hundredth.
Eigen::Vector2d exact_end(const Pendulums& of, double duration) {
  long double a = 0.8L, w = -0.5L;
  const auto rate = [&](long double at) { return (long double)(of.torque(double(at)) / of.inertia()); };
  const int n = 20000;
  const long double h = (long double)duration / n;
  for (int k = 0; k < n; ++k) {
    const long double k1 = rate(a), k2 = rate(a + h / 2 * w), k3 = rate(a + h / 2 * (w + h / 2 * k1)),
                      k4 = rate(a + h * (w + h / 2 * k2));
    a += h * w + h * h / 6 * (k1 + k2 + k3);
    w += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return {double(a), double(w)};
}

void expect_tied(const SimulatedMotion& motion, int follower, double ratio, double offset) {
  for (int k = 0; k < motion.samples(); ++k) {
    EXPECT_NEAR(motion.q(follower, k), ratio * motion.q(0, k) + offset, 1e-11) << motion.t[std::size_t(k)];
    EXPECT_NEAR(motion.v(follower, k), ratio * motion.v(0, k), 1e-11) << motion.t[std::size_t(k)];
  }
}

// (m_a + r^2 m_b) a'' = u - g (m_a + r m_b).
TEST(MimicScenes, SlidersMoveWithTheMassOfBoth) {
  const Sliders of;
  const double u = 4, a = (u - 9.81 * (of.m_a + of.ratio * of.m_b)) / of.mass(), T = 0.5;
  for (const char* scheme : kSchemes) {
    const Scene scene = tied_scene(of.urdf(),
                                   "start { q { a 0.1 } v { a 0.2 } }\ncommands { torque { a 4 } }\n"
                                   "simulation { duration 0.5  integrator " +
                                       std::string(scheme) + " }");
    const SimulatedMotion motion = sound(scene);
    const std::string name = scheme;
    const bool is_euler = name == "semi-implicit-euler" || name == "implicit-velocity";
    const double allowed = name.starts_with("adaptive") ? 1e-5 : 1e-10;
    EXPECT_NEAR(motion.v(0, motion.samples() - 1), 0.2 + a * T, allowed) << scheme;
    EXPECT_NEAR(motion.q(0, motion.samples() - 1), 0.1 + 0.2 * T + a * T * T / 2, is_euler ? 2e-3 : allowed)
        << scheme;
    expect_tied(motion, 1, of.ratio, of.offset);
    ASSERT_EQ(motion.flows.front().name, "motors");
    const double moved = motion.q(0, motion.samples() - 1) - 0.1;
    if (is_euler) continue;
    EXPECT_NEAR(motion.flows.front().work.back(), u * moved, 10 * allowed) << scheme;
  }
}

TEST(MimicScenes, PendulumsSwingAsTheirOneEquationSays) {
  const Pendulums of;
  const Eigen::Vector2d end = exact_end(of, 2);
  for (const auto& [scheme, allowed] : {std::pair("runge-kutta-4", 1e-9),
                                        {"implicit-midpoint", 1e-5},
                                        {"adaptive", 1e-6},
                                        {"adaptive-stiff", 1e-6}}) {
    const SimulatedMotion motion = sound(
        swinging(of, "duration 2  integrator " + std::string(scheme) +
                         (std::string(scheme).starts_with("adaptive") ? " relative_tolerance 1e-10" : "")));
    EXPECT_NEAR(motion.q(0, motion.samples() - 1), end[0], allowed) << scheme;
    EXPECT_NEAR(motion.v(0, motion.samples() - 1), end[1], 10 * allowed) << scheme;
    expect_tied(motion, 1, of.ratio, of.offset);
  }
}

// Both are one mechanism, and no power goes through the rule.
TEST(MimicScenes, EnergyStays) {
  const Pendulums of;
  const SimulatedMotion motion = sound(swinging(of, "duration 20"));
  ASSERT_EQ(motion.balances.size(), 1u);
  for (int k = 0; k < motion.samples(); ++k)
    ASSERT_NEAR(motion.energy(k) - motion.energy(0),
                of.energy(motion.q(0, k), motion.v(0, k)) - of.energy(motion.q(0, 0), motion.v(0, 0)), 1e-9);
  EXPECT_NEAR(motion.energy(motion.samples() - 1), motion.energy(0), 1e-8);
}

// Damping of both: d_a + r^2 d_b at the leader.
TEST(MimicScenes, EffectsAtFollowersActOnTheirLeaders) {
  const Sliders of;
  const Scene scene =
      tied_scene(of.urdf(),
                 "effects { gravity off  joint_damping { a 0.3  b 0.5 } }\nstart { v { a 1 } }\n"
                 "simulation { duration 1 }");
  const SimulatedMotion motion = sound(scene);
  const double rate = (0.3 + of.ratio * of.ratio * 0.5) / of.mass();
  EXPECT_NEAR(motion.v(0, motion.samples() - 1), std::exp(-rate), 1e-9);
}

// A follower that meets a limit stops its leader, whichever of the two has it.
TEST(MimicScenes, HardLimitsOfFollowersReflectBoth) {
  for (const bool at_follower : {true, false}) {
    Sliders of;
    of.ratio = 2, of.offset = 0;
    (at_follower ? of.limit_b : of.limit_a) =
        at_follower ? "lower='-100' upper='0.5'" : "lower='-100' upper='0.25'";
    const Scene scene = tied_scene(of.urdf(),
                                   "effects { gravity off }\nconstraints { limits { restitution 0.5 } }\n"
                                   "start { v { a 1 } }\nsimulation { duration 0.5 }");
    const SimulatedMotion motion = sound(scene);
    const int last = motion.samples() - 1;
    EXPECT_NEAR(motion.v(0, last), -0.5, 1e-9);
    EXPECT_NEAR(motion.v(1, last), -1, 1e-9);
    EXPECT_NEAR(motion.q(0, last), 0.25 - 0.5 * 0.25, 1e-6);
    EXPECT_NEAR(motion.kinetic[std::size_t(last)], of.mass() * 0.125, 1e-9);
  }
}

// Both limits at once, as of a gripper that closes: dependent rows.
TEST(MimicScenes, RestsOnTheLimitsOfBoth) {
  Sliders of;
  of.ratio = 1, of.offset = 0;
  of.limit_a = of.limit_b = "lower='0' upper='0.04'";
  const Scene scene = tied_scene(of.urdf(),
                                 "constraints { limits { restitution 0 } }\nstart { q { a 0.03 } }\n"
                                 "simulation { duration 0.5 }");
  const SimulatedMotion motion = sound(scene);
  EXPECT_NEAR(motion.q(0, motion.samples() - 1), 0, 1e-8);
  EXPECT_NEAR(motion.v(0, motion.samples() - 1), 0, 1e-12);
}

// The loop closes at the start by moving leaders, and holds; energy stays.
TEST(MimicScenes, LoopsOfTiedRobotsClose) {
  const Scene scene =
      tied_scene(test::crank_with_follower(),
                 "constraints { loops { loop { frames \"rod_end d_link\"  type point } } }\n"
                 "start { q { a -0.4  c 0.3  d 0.65 }  v { a 2  c 0  d 0 } }\nsimulation { duration 2 }");
  const SimulatedMotion motion = sound(scene);
  EXPECT_GT(motion.assembled_by, 1e-3);
  EXPECT_LT(motion.loop_error, 1e-6);
  const dynamics::Model<double>& model = scene.robot.model;
  expect_tied(motion, model.joints[std::size_t(model.joint_index("b"))].idx_q, -2, 0.3);
  EXPECT_EQ(motion.balances.size(), 1u);
  EXPECT_NEAR(motion.energy(motion.samples() - 1), motion.energy(0), 1e-6);
}

TEST(MimicScenes, CostsAndAccuracyAreOfTheTiedRobot) {
  Scene scene = swinging(Pendulums(), "duration 1");
  RobotScene free = scene.robot;
  free.mimics.clear();
  EXPECT_NE(scene_cost(scene.robot, scene.evaluation, false).value.operations,
            scene_cost(free, scene.evaluation, false).value.operations);
  const Accuracy told = accuracy_of(scene);
  EXPECT_EQ(told.trouble, "");
  EXPECT_LT(told.q.value, 1e-8);
}

TEST(MimicScenes, TablesHaveTheFollowersToo) {
  const Scene scene = swinging(Pendulums(), "duration 0.1");
  const SimulatedMotion motion = sound(scene);
  const io::CsvTable table = motion_table(scene, motion);
  EXPECT_EQ(table.column("q.b").back(), motion.q(1, motion.samples() - 1));
  EXPECT_EQ(table.column("v.b").back(), motion.v(1, motion.samples() - 1));
  EXPECT_EQ(table.column("tau.a").back(), 0);
}

std::string panda(const std::string& robot, const std::string& rest) {
  return message_of<Error>([&] {
    (void)read_scene_text("robot { urdf panda.urdf  " + robot + " }\n" + rest + "simulation { duration 1 }",
                          test::source_folder() + "/config/robots/made_up.info");
  });
}

TEST(MimicScenes, FilesSayWhetherJointsFollow) {
  const std::string path = test::source_folder() + "/config/robots/made_up.info";
  const auto read = [&](const std::string& robot) {
    return read_scene_text(
        "robot { urdf panda.urdf  " + robot + " }\nstart { q 0 }\nsimulation { duration 1 }", path);
  };
  const Scene tied = read("mimic true"), free = read("");
  ASSERT_EQ(tied.robot.mimics.size(), 1u);
  EXPECT_EQ(tied.robot.mimics[0].leader, "panda_finger_joint1");
  EXPECT_EQ(driven_names(tied.robot).size(), 8u);
  const auto tells = [](const Scene& scene, const std::string& what) {
    return std::any_of(scene.notes.begin(), scene.notes.end(),
                       [&](const std::string& note) { return note.find(what) != std::string::npos; });
  };
  EXPECT_FALSE(tells(tied, "mimics"));
  EXPECT_TRUE(tells(free,
                    "joint \"panda_finger_joint2\" mimics \"panda_finger_joint1\"; it is read as an "
                    "independent joint; 'robot.mimic true' has it follow"));
  EXPECT_NE(tied.effective.find("  mimic "), std::string::npos) << tied.effective;
}

TEST(MimicScenes, FollowersHaveNothingOfTheirOwn) {
  const auto told = [](const std::string& rest, const std::string& sentence) {
    const std::string message = panda("mimic true", rest);
    EXPECT_NE(message.find(sentence), std::string::npos) << message;
  };
  told("start { v { panda_finger_joint2 1 } }\n",
       "joint 'panda_finger_joint2' follows 'panda_finger_joint1' and has no value of its own; expected one "
       "for "
       "'panda_finger_joint1'");
  told("actuated \"panda_finger_joint2\"\n",
       "joint 'panda_finger_joint2' follows 'panda_finger_joint1', whose motor moves it; expected "
       "'panda_finger_joint1'");
  told("start { q \"0 0 0 0 0 0 0 0 0\" }\n", "8");
  EXPECT_NE(message_of<Error>([] {
              (void)swinging(Pendulums(), "duration 1  integrator variational");
            }).find("'variational' has no joints that follow others"),
            std::string::npos);
}

}  // namespace
}  // namespace dyntape::mimic_scene_test
