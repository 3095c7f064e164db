// SPDX-License-Identifier: BSD-3-Clause
//
// Contacts from the <collision> shapes of a robot's file: which spheres they are, and that a box comes to rest on them.
#include <gtest/gtest.h>

#include <unistd.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/collisions.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/run/simulate/simulate.h>

#include "interface/message_of.h"

namespace dyntape::collision_shapes_test {
namespace {

using Eigen::Vector3d;

std::string link(const std::string& name, const std::string& shapes) {
  return "<link name='" + name +
         "'><inertial><mass value='1'/><inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/>"
         "</inertial>" +
         shapes + "</link>\n";
}
std::string collision(const std::string& geometry, const std::string& origin = "") {
  return "<collision>" + origin + "<geometry>" + geometry + "</geometry></collision>";
}

// A box whose frame is off its middle, a ball fixed to it, a can that turns on it, and a hull of a mesh that is nowhere.
const std::string kRobot =
    "<robot name='r'>" + link("box", collision("<box size='0.2 0.4 0.6'/>", "<origin xyz='0.1 0 0'/>")) +
    link("ball", collision("<sphere radius='0.05'/>")) +
    link("can", collision("<cylinder radius='0.1' length='0.3'/>", "<origin rpy='1.57079632679 0 0'/>")) +
    link("hull", collision("<mesh filename='package://nowhere/hull.stl'/>")) + link("bare", "") +
    "<joint name='glued' type='fixed'><parent link='box'/><child link='ball'/><origin xyz='0 0 1'/></joint>\n"
    "<joint name='axle' type='revolute'><parent link='box'/><child link='can'/><axis xyz='0 1 0'/>"
    "<limit lower='-1' upper='1' velocity='1' effort='1'/></joint>\n"
    "<joint name='a' type='fixed'><parent link='box'/><child link='hull'/></joint>\n"
    "<joint name='b' type='fixed'><parent link='box'/><child link='bare'/></joint></robot>";

TEST(CollisionShapes, AreSpheresAndPointsOfTheirBodies) {
  const auto robot = dynamics::read_urdf_text(kRobot, "r.urdf", {.base = dynamics::Base::kFloating});
  const auto found = dynamics::read_collisions_text(kRobot, "r.urdf", robot.model);
  EXPECT_TRUE(found.notes.empty());
  EXPECT_EQ(found.meshes, std::vector<std::string>{"hull"});
  ASSERT_EQ(found.spheres.size(), 8u + 1 + 16);
  for (std::size_t k = 0; k < 8; ++k) {
    const auto& s = found.spheres[k];
    EXPECT_EQ(s.link, "box");
    EXPECT_EQ(s.body, 0);
    EXPECT_EQ(s.radius, 0);
    EXPECT_LE(((s.center - Vector3d(0.1, 0, 0)).cwiseAbs() - Vector3d(0.1, 0.2, 0.3)).norm(), 1e-15);
  }
  EXPECT_EQ(found.spheres[8].link, "ball");
  EXPECT_EQ(found.spheres[8].body, 0);
  EXPECT_EQ(found.spheres[8].radius, 0.05);
  EXPECT_LE((found.spheres[8].center - Vector3d(0, 0, 1)).norm(), 1e-15);
  for (std::size_t k = 9; k < 25; ++k) {
    const auto& s = found.spheres[k];
    EXPECT_EQ(s.body, 1);
    EXPECT_NEAR(std::abs(s.center.y()), 0.15, 1e-11);
    EXPECT_NEAR(std::hypot(s.center.x(), s.center.z()), 0.1, 1e-11);
  }
}

class CollisionKeys : public ::testing::Test {
 protected:
  CollisionKeys()
      : path_(std::filesystem::path(::testing::TempDir()) / ("collision_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path_);
    std::ofstream(path_ / "r.urdf") << kRobot;
    std::ofstream(path_ / "box.urdf")
        << "<robot name='box'>" + link("box", collision("<box size='1 1 1'/>")) + "</robot>";
  }
  ~CollisionKeys() override { std::filesystem::remove_all(path_); }

  Scene scene(const std::string& robot, const std::string& keys) const {
    return read_scene_text(
        "robot {\n urdf " + robot + "\n base floating\n}\n" + keys +
            "\nstart {\n base {\n position \"0 0 1\"\n}\n}\nsimulation {\n duration 2\n step 1e-3\n}\n"
            "evaluation {\n route interpreter\n}\n",
        (path_ / "scene.info").string());
  }
  static std::string effects(const std::string& keys) {
    return "effects {\n contacts {\n contact {\n stiffness 1e5\n dissipation 20\n friction 0.8\n" + keys +
           "\n}\n}\n}\n";
  }
  static bool says(const std::vector<std::string>& notes, const std::string& part) {
    return std::any_of(notes.begin(), notes.end(), [&](const auto& n) { return n.find(part) != n.npos; });
  }
  std::filesystem::path path_;
};

TEST_F(CollisionKeys, AllLinksOrThoseNamedTouch) {
  const Scene all = scene("r.urdf", effects("shapes collision"));
  EXPECT_EQ(all.robot.effects.contacts.size(), 25u);
  EXPECT_TRUE(says(all.notes, "<collision> meshes of link \"hull\"")) << ::testing::PrintToString(all.notes);
  EXPECT_FALSE(says(all.notes, "<collision> of"));
  const Scene one = scene("r.urdf", effects("shapes collision\n frames \"ball\""));
  ASSERT_EQ(one.robot.effects.contacts.size(), 1u);
  EXPECT_EQ(one.robot.effects.contacts[0].radius, 0.05);
  EXPECT_EQ(one.robot.effects.contacts[0].friction, 0.8);
  EXPECT_TRUE(says(scene("r.urdf", "").notes, "<collision> of 4 links"));
  const Scene rigid = scene(
      "r.urdf", "constraints {\n contacts {\n contact {\n shapes collision\n frames \"can ball\"\n}\n}\n}");
  ASSERT_EQ(rigid.robot.constraints.rigid.contacts.size(), 17u);
  EXPECT_EQ(rigid.robot.constraints.rigid.contacts[0].name, "ball.1");
  EXPECT_EQ(rigid.robot.constraints.rigid.contacts[16].name, "can.16");
}

TEST_F(CollisionKeys, WhatTouchesNothingIsTold) {
  const auto error = [&](const std::string& keys) {
    return message_of<FileError>([&] { scene("r.urdf", effects(keys)); });
  };
  EXPECT_NE(error("shapes collision\n frames \"bare\"").find("'bare' touches nothing; expected a <sphere>"),
            std::string::npos);
  EXPECT_NE(
      error("shapes collision\n frames \"hull\"").find("'hull' touches nothing, its shape being a mesh"),
      std::string::npos);
  EXPECT_NE(error("shapes collision\n radius 0.1").find("'radius' is given beside 'shapes'"),
            std::string::npos);
  EXPECT_NE(error("shapes visual").find("cannot be 'visual'"), std::string::npos);
}

// Without the request a box falls through the ground; with it, it lies on it.
TEST_F(CollisionKeys, ADroppedBoxComesToRestOnItsShape) {
  const auto height = [&](const std::string& keys) {
    const SimulatedMotion motion = simulate(scene("box.urdf", keys));
    EXPECT_EQ(motion.trouble, "");
    return motion.q(2, motion.q.cols() - 1);
  };
  EXPECT_NEAR(height(""), 1 - 0.5 * 9.81 * 4, 1e-6);
  const double depth = std::pow(9.81 / 4 / 1e5, 2. / 3);  // four corners carry the weight
  EXPECT_NEAR(height(effects("shapes collision")), 0.5 - depth, 1e-5);
  EXPECT_NEAR(height("constraints {\n contacts {\n contact {\n shapes collision\n friction 0.8\n}\n}\n}"),
              0.5, 1e-6);
}

}  // namespace
}  // namespace dyntape::collision_shapes_test
