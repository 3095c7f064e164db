// SPDX-License-Identifier: BSD-3-Clause
//
// Of a robot's file everything acts, or is named as left out, in scenes, tasks and sweeps; planar joints are placed by files.
#include <gtest/gtest.h>

#include <unistd.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/files/scene/start_notes.h>
#include <dyntape/interface/files/sweep/sweep.h>
#include <dyntape/interface/files/task/task.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/run/simulate/simulate.h>
#include <dyntape/interface/run/solve/solve.h>

#include "interface/message_of.h"
#include "interface/temporary_cache.h"
#include "source_folder.h"

namespace dyntape::left_out_test {
namespace {

using Eigen::VectorXd;

const char* const kBody =
    "<inertial><origin xyz=\"0 0 -0.2\"/><mass value=\"1\"/><inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" "
    "iyy=\"0.1\" "
    "iyz=\"0\" izz=\"0.1\"/></inertial>";

struct Fault {
  const char *in_joint, *in_link, *in_robot;
  const char* named;     // in the notes of scenes
  bool of_tasks = true;  // likewise of tasks, which hold limits
};

std::string robot_with(const Fault& f) {
  return std::string("<robot name=\"r\"><link name=\"world\"/><link name=\"arm\">") + kBody + f.in_link +
         "</link><joint name=\"hinge\" type=\"continuous\"><parent link=\"world\"/><child "
         "link=\"arm\"/><axis "
         "xyz=\"1 0 0\"/>" +
         f.in_joint + "</joint>" + f.in_robot + "</robot>";
}

class Folder {
 public:
  Folder() : path_(std::filesystem::path(::testing::TempDir()) / ("left_out_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return (path_ / name).string();
  }

 private:
  std::filesystem::path path_;
};

bool any_has(const std::vector<std::string>& notes, const std::string& words) {
  return std::any_of(notes.begin(), notes.end(),
                     [&](const std::string& note) { return note.find(words) != note.npos; });
}
const char* const kSimulation = "simulation\n{\n duration 0.1\n}\nevaluation\n{\n route interpreter\n}\n";
const char* const kTask =
    "robot\n{\n urdf r.urdf\n}\nhorizon\n{\n duration 1\n intervals 10\n}\nstart\n{\n q 0\n}\ngoal\n{\n q "
    "1\n}\ncosts\n{\n control 1\n}\nevaluation\n{\n route interpreter\n}\n";

TEST(LeftOut, WhatDoesNotActIsNamedInEachKindOfFile) {
  const Fault faults[] = {
      {"<dynamics damping=\"0.5\"/>", "", "",
       "damping of 'hinge' ('effects { joint_damping robot }' has it act)"},
      {"<dynamics friction=\"0.2\"/>", "", "", "friction of 'hinge'"},
      {"<limit effort=\"3\" velocity=\"2\"/>", "", "", "effort limits of 'hinge'", false},
      {"<limit effort=\"3\" velocity=\"2\"/>", "", "", "velocity limits of 'hinge'", false},
      {"<safety_controller k_velocity=\"1\"/>", "", "", "<safety_controller> of joint \"hinge\""},
      {"<calibration rising=\"1\"/>", "", "", "<calibration> of joint \"hinge\""},
      {"", "<collision><geometry><sphere radius=\"1\"/></geometry></collision>", "",
       "<collision> of link \"arm\""},
      {"", "", "<transmission name=\"t\"/>", "<transmission>"},
      {"", "", "<gazebo reference=\"arm\"/><gazebo/>", "2 times <gazebo>"},
      {"", "<self_collision_checking/>", "", "<self_collision_checking> of link \"arm\""}};
  const Folder folder;
  const std::string plain = robot_with({"", "", "", ""});
  const std::string scene_text = std::string("robot\n{\n urdf r.urdf\n}\n") + kSimulation;
  folder.write("r.urdf", plain);
  const std::string scene = folder.write("scene.info", scene_text), task = folder.write("task.info", kTask);
  const std::string sweep = folder.write(
      "sweep.info",
      "scene scene.info\nsamples 2\nvary\n{\n value\n {\n parameter start.q\n from 0\n to 1\n }\n}\n");
  EXPECT_EQ(read_scene(scene).notes, std::vector<std::string>{});
  EXPECT_EQ(read_task(task).notes, std::vector<std::string>{});
  for (const Fault& fault : faults) {
    folder.write("r.urdf", robot_with(fault));
    EXPECT_TRUE(any_has(read_scene(scene).notes, fault.named)) << fault.named;
    EXPECT_TRUE(any_has(read_sweep(sweep).scene.notes, fault.named)) << fault.named;
    EXPECT_EQ(any_has(read_task(task).notes, fault.named), fault.of_tasks) << fault.named;
  }
}

// Both were simulated without a word.
TEST(StartNotes, SayWhatIsSeldomMeant) {
  const std::string folder = test::source_folder() + "/config/scenes/";
  const auto notes = [&](const std::string& scene, const std::vector<std::string>& set) {
    return notes_of_start(read_scene(folder + scene, io::settings_of(set)));
  };
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    EXPECT_EQ(notes(entry.path().filename().string(), {}), std::vector<std::string>{}) << entry.path();
  const std::vector<std::string> deep = notes("bouncing_ball.info", {"effects.contacts.contact.radius=100"});
  ASSERT_EQ(deep.size(), 1u);
  EXPECT_TRUE(deep[0].starts_with("at the start the contacts push with ")) << deep[0];
  EXPECT_TRUE(deep[0].ends_with("a contact of radius 100 m is 98.9 m below the ground")) << deep[0];
  EXPECT_EQ(
      notes("bouncing_ball.info", {"effects.contacts.contact.radius=100", "start.base.position=0 0 101"}),
      std::vector<std::string>{});
  EXPECT_EQ(notes("arm_with_friction.info", {"start.q=90"}).size(), 1u);
  EXPECT_TRUE(
      any_has(notes("arm_with_friction.info", {"start.q=90"}), "beyond the limits of the robot's file"));
  EXPECT_EQ(notes("arm_with_friction.info", {"start.q=90", "constraints.limits.restitution=0"}),
            std::vector<std::string>{});  // refused
}

TEST(LeftOut, WhatActsIsNot) {
  const Folder folder;
  folder.write("r.urdf",
               robot_with({"<dynamics damping=\"0.5\" friction=\"0.2\"/><limit effort=\"3\" velocity=\"2\"/>",
                           "", "", ""}));
  const Scene scene = read_scene(folder.write(
      "scene.info",
      std::string("robot\n{\n urdf r.urdf\n}\neffects\n{\n joint_damping robot\n torque_saturation robot\n "
                  "joint_friction\n {\n torque robot\n smoothing 0.01\n }\n}\n") +
          kSimulation));
  EXPECT_FALSE(any_has(scene.notes, "damping of")) << scene.notes.front();
  EXPECT_FALSE(any_has(scene.notes, "friction of"));
  EXPECT_FALSE(any_has(scene.notes, "effort limits"));
  EXPECT_TRUE(any_has(scene.notes, "velocity limits"));
  // The remedy of the note: half of the kinetic energy is 0.0677 J after 2 s.
  folder.write(
      "r.urdf",
      "<robot name=\"r\"><link name=\"world\"/><link name=\"arm\"><inertial><mass value=\"1\"/><inertia "
      "ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link><joint name=\"hinge\" "
      "type=\"continuous\"><parent link=\"world\"/><child link=\"arm\"/><axis xyz=\"0 0 1\"/><dynamics "
      "damping=\"0.5\"/></joint></robot>");
  Scene damped = read_scene(folder.write(
      "scene.info",
      std::string("robot\n{\n urdf r.urdf\n}\neffects\n{\n joint_damping robot\n}\nstart\n{\n v 1\n}\n") +
          "simulation\n{\n duration 2\n}\nevaluation\n{\n route interpreter\n}\n"));
  EXPECT_NEAR(simulate(damped).kinetic.back(), 0.5 * std::exp(-2.0), 1e-9);
}

TEST(LeftOut, AMimicIsNamedBySolve) {
  const Folder folder;
  folder.write(
      "r.urdf",
      robot_with({"", "", "", ""})
          .replace(robot_with({"", "", "", ""}).find("</robot>"), 8,
                   std::string("<link name=\"b\">") + kBody +
                       "</link><joint name=\"follows\" type=\"continuous\"><parent link=\"arm\"/><child "
                       "link=\"b\"/><axis xyz=\"1 0 0\"/><mimic joint=\"hinge\"/></joint></robot>"));
  const Task task = read_task(folder.write("task.info", kTask));
  ASSERT_TRUE(any_has(task.notes, "\"follows\" mimics \"hinge\""));
  const SolveReport report = solve_task(task);
  EXPECT_TRUE(report.success()) << report.verdict();
  EXPECT_NE(report.text().find("\"follows\" mimics \"hinge\""), std::string::npos);
  EXPECT_NE(report.json().find("mimics"), std::string::npos);
}

// --- planar joints ---

std::string planar_robot(const std::string& more) {
  return std::string("<robot name=\"r\"><link name=\"world\"/><link name=\"cart\">") + kBody +
         "</link><joint name=\"base\" type=\"planar\"><parent link=\"world\"/><child link=\"cart\"/><axis "
         "xyz=\"0 0 1\"/></joint>" +
         more + "</robot>";
}
const std::string kArm = std::string("<link name=\"arm\">") + kBody +
                         "</link><joint name=\"j\" type=\"revolute\"><parent link=\"cart\"/><child "
                         "link=\"arm\"/><origin xyz=\"0.3 0 0\"/><axis xyz=\"0 0 1\"/><limit lower=\"-3\" "
                         "upper=\"3\" effort=\"10\" velocity=\"10\"/></joint>";

// Nothing acts in the plane: it goes straight on and turns evenly, in axes of the world.
TEST(PlanarJoints, StartWhereAFileSaysAndMove) {
  std::mt19937_64 random(4);
  const auto any = [&] { return std::uniform_real_distribution(-2.0, 2.0)(random); };
  const Folder folder;
  folder.write("r.urdf", planar_robot(""));
  for (int trial = 0; trial < 5; ++trial) {
    const double x = any(), y = any(), turn = any(), vx = any(), vy = any(), rate = any();
    const auto text = [](double a) { return io::shortest(a); };
    const Scene scene = read_scene(folder.write(
        "scene.info", "robot\n{\n urdf r.urdf\n}\nstart\n{\n planar\n {\n joint base\n position \"" +
                          text(x) + " " + text(y) + "\"\n turn " + text(turn) + "\n velocity \"" + text(vx) +
                          " " + text(vy) + "\"\n angular_velocity " + text(rate) + "\n }\n}\n" +
                          kSimulation));
    const SimulatedMotion motion = simulate(scene);
    ASSERT_TRUE(motion.is_whole());
    const VectorXd end = motion.q.rightCols(1);
    const double c = std::cos(turn), s = std::sin(turn), t = 0.1;
    EXPECT_NEAR(end[0], x + t * (c * vx - s * vy), 1e-9);
    EXPECT_NEAR(end[1], y + t * (s * vx + c * vy), 1e-9);
    EXPECT_NEAR(std::atan2(end[3], end[2]), std::remainder(turn + t * rate, 2 * M_PI), 1e-9);
    const Scene again = read_scene_text(scene.effective, folder.write("again.info", ""));
    EXPECT_TRUE(again.q == scene.q && again.v == scene.v);
  }
}

TEST(PlanarJoints, OfAGoalAreOpenUnlessItSaysWhere) {
  const Folder folder;
  folder.write("r.urdf", planar_robot(kArm));
  const Task open = read_task(folder.write("task.info", kTask));
  EXPECT_TRUE(open.problem.goal.head(4).array().isNaN().all()) << open.problem.goal;
  EXPECT_EQ(open.problem.goal[4], 1);
  const SolveReport report = solve_task(open);
  EXPECT_TRUE(report.success()) << report.verdict();
  std::string text = kTask;
  text.replace(text.find("goal\n{\n"), 7, "goal\n{\n planar\n {\n position \"0.5 0\"\n turn 0.25\n }\n");
  const Task placed = read_task(folder.write("task.info", text));
  EXPECT_EQ(placed.problem.goal[0], 0.5);
  EXPECT_EQ(placed.problem.goal.segment(5, 3), VectorXd::Zero(3));
  // Its direction is an equation at the end, as orientations are.
  EXPECT_EQ(placed.problem.terms.size(), open.problem.terms.size() + 1);
}

TEST(PlanarJoints, WrongWordsAreSaid) {
  const Folder folder;
  folder.write("r.urdf", planar_robot(kArm));
  const auto said = [&](const std::string& start) {
    return message_of<FileError>([&] {
      read_scene(
          folder.write("scene.info", "robot\n{\n urdf r.urdf\n}\nstart\n{\n" + start + "}\n" + kSimulation));
    });
  };
  EXPECT_NE(said(" planar\n {\n joint bass\n }\n").find("'base'"), std::string::npos);
  EXPECT_NE(said(" planar\n {\n }\n planar\n {\n }\n").find("twice"), std::string::npos);
  EXPECT_NE(said(" planar\n {\n position \"1 2 3\"\n }\n").find("two axes"), std::string::npos);
  EXPECT_NE(said(" q \"1 2\"\n").find("the robot has 1 joint of one degree of freedom"), std::string::npos);
  folder.write("r.urdf", robot_with({"", "", "", ""}));
  EXPECT_NE(said(" planar\n {\n }\n").find("no planar joint"), std::string::npos);
}

}  // namespace
}  // namespace dyntape::left_out_test
