// SPDX-License-Identifier: BSD-3-Clause
//
// How far frames get by lengths alone, and goals that lie beyond.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/motion/inverse_kinematics.h>
#include <dyntape/interface/run/solve/solve.h>

#include "source_folder.h"

namespace dyntape::reach_test {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

const std::string kConfig = test::source_folder() + "/config/";

// No configuration leaves the sphere, and straight arms come near its edge.
TEST(Reach, NoConfigurationLeavesTheSphere) {
  for (const char* robot : {"arm_2r", "panda", "ur5", "iiwa14", "cart_pole", "pendulum"}) {
    const std::string file = kConfig + "robots/" + robot + ".urdf";
    const auto model = dynamics::load_urdf(file);
    const std::string frame = model.frames.back().name;
    const Reach reach = reach_of(model, frame);
    dynamics::Data<double> data(model);
    std::mt19937_64 random(4);
    for (int k = 0; k < 500; ++k) {
      const VectorXd q = dynamics::random_configuration(model, random);
      dynamics::forward_kinematics(model, data, q);
      const Vector3d p = dynamics::frame_placement(model, data, model.frame_index(frame)).p;
      EXPECT_LE((p - reach.centre).norm(), reach.radius * (1 + 1e-12)) << robot << " " << frame;
    }
  }
}

TEST(Reach, OfTheTwoLinkArmIsItsLength) {
  const auto model = dynamics::load_urdf(kConfig + "robots/arm_2r.urdf");
  const std::string tip = model.frames.back().name;
  const Reach reach = reach_of(model, tip);
  dynamics::Data<double> data(model);
  dynamics::forward_kinematics(model, data, VectorXd(VectorXd::Zero(model.nq)));
  const Vector3d straight = dynamics::frame_placement(model, data, model.frame_index(tip)).p;
  EXPECT_NEAR((straight - reach.centre).norm(), reach.radius, 1e-12);
  const Vector3d outwards = (straight - reach.centre).normalized();
  const auto why = [&](double factor) {
    return why_unreachable(model, {tip, Vector3d(reach.centre + factor * reach.radius * outwards)},
                           "the goal");
  };
  EXPECT_EQ(why(1), "");
  EXPECT_EQ(why(1.01).find("the goal is "), 0u);
  EXPECT_EQ(why(2).find("metres"), std::string::npos);
  EXPECT_NE(why(1000).find("; positions are in metres"), std::string::npos) << why(1000);
  EXPECT_EQ(why_unreachable(model, {tip, {}, Eigen::Matrix3d::Identity()}, "the goal"), "");
}

// A goal in millimetres: the first line says so.
TEST(Reach, AFailedSolveSaysFirstThatItsGoalIsBeyond) {
  const Task task = read_task(kConfig + "tasks/arm_around_obstacles.info",
                              io::settings_of({"goal.frame.position=400 350 300", "horizon.intervals=4",
                                               "solver.max_iterations=20"}));
  ASSERT_NE(task.unreachable, "");
  const SolveReport report = solve_task(task);
  EXPECT_FALSE(report.success());
  EXPECT_EQ(report.verdict().find(
                "Out of reach: the place of 'panda_hand' at its goal is 610 m from joint 'panda_joint1'"),
            0u)
      << report.verdict();
}

}  // namespace
}  // namespace dyntape::reach_test
