// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "run.h"

using dyntape::test::config;
using dyntape::test::run_dyntape;

namespace info_test {

TEST(Info, TellsIndicesInJson) {
  const auto run = run_dyntape({"info", config("robots/solo12.urdf"), "--base", "floating", "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto info = nlohmann::json::parse(run.out);
  EXPECT_EQ(info["nq"], 19);
  EXPECT_EQ(info["nv"], 18);
  EXPECT_NEAR(info["mass"].get<double>(), 2.50000279, 1e-12);
  int q = 0, v = 0;
  for (const auto& joint : info["joints"]) {  // indices are consecutive, in the order of the list
    EXPECT_EQ(joint["idx_q"], q);
    EXPECT_EQ(joint["idx_v"], v);
    q += joint["nq"].get<int>();
    v += joint["nv"].get<int>();
  }
  EXPECT_EQ(q, 19);
  EXPECT_EQ(v, 18);
}

TEST(Info, LocksJoints) {
  const auto run = run_dyntape(
      {"info", config("robots/panda.urdf"), "--lock", "panda_finger_joint1,panda_finger_joint2", "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_EQ(nlohmann::json::parse(run.out)["nv"], 7);
}

TEST(Info, FollowersHaveTheEntriesOfTheirLeader) {
  const std::string panda = config("robots/panda.urdf");
  const auto run = run_dyntape({"info", panda, "--mimic", "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  const auto info = nlohmann::json::parse(run.out);
  EXPECT_EQ(info["nq"], 8);
  EXPECT_EQ(info["nv"], 8);
  const auto& follower = info["joints"].back();
  EXPECT_EQ(follower["name"], "panda_finger_joint2");
  EXPECT_EQ(follower["nv"], 0);
  EXPECT_EQ(follower["idx_v"], 7);
  EXPECT_EQ(follower["mimic"]["joint"], "panda_finger_joint1");
  EXPECT_EQ(follower["mimic"]["multiplier"], 1);
  EXPECT_NE(
      run_dyntape({"info", panda, "--mimic"}).out.find("mimic: panda_finger_joint2 = panda_finger_joint1"),
      std::string::npos);
  EXPECT_NE(run_dyntape({"info", panda}).out.find("read as an independent joint; --mimic has it follow"),
            std::string::npos);
}

TEST(Info, PrintsTheTree) {
  const auto run = run_dyntape({"info", config("robots/solo12.urdf"), "--base", "floating"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("├─ FL_HAA"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("free"), std::string::npos) << run.out;
}

TEST(Info, SaysWhatIsWrongInOneSentence) {
  const auto missing = run_dyntape({"info", "no_such_robot.urdf"});
  EXPECT_EQ(missing.status, 1);
  EXPECT_NE(missing.err.find("no_such_robot.urdf"), std::string::npos) << missing.err;
  const auto joint = run_dyntape({"info", config("robots/panda.urdf"), "--lock", "panda_finger_join1"});
  EXPECT_EQ(joint.status, 1);
  EXPECT_NE(joint.err.find("panda_finger_joint1"), std::string::npos) << joint.err;  // the nearest name
}

TEST(CommandLine, RefusesWhatItDoesNotKnow) {
  EXPECT_EQ(run_dyntape({"frobnicate"}).status, 2);
  EXPECT_EQ(run_dyntape({}).status, 2);
  EXPECT_EQ(run_dyntape({"info"}).status, 2);
  EXPECT_EQ(run_dyntape({"info", config("robots/panda.urdf"), "--base", "flying"}).status, 2);
  EXPECT_EQ(run_dyntape({"info", config("robots/panda.urdf"), "--snap", "right"}).status, 2);
}

TEST(CommandLine, HelpTeaches) {
  const auto help = run_dyntape({"--help"});
  EXPECT_EQ(help.status, 0);
  for (const char* command :
       {"info", "eval", "generate", "bench", "solve", "study", "check-config", "cache", "doctor"}) {
    EXPECT_NE(help.out.find(command), std::string::npos) << command;
    EXPECT_EQ(run_dyntape({command, "--help"}).status, 0) << command;
  }
}

// Links are listed by the joint that carries them; what is said of many places in the same words is one line.
TEST(Info, ListsLinksAndFoldsNotes) {
  const dyntape::test::Scratch scratch;
  std::ofstream file(scratch / "arm.urdf");
  file << "<robot name='arm'>\n<link name='base'/>\n";
  for (int k = 0; k < 5; ++k) {
    const std::string parent = k == 0 ? "base" : "link" + std::to_string(k - 1);
    file << "<joint name='j" << k << "' type='continuous'><origin rpy='1.57079632 0 0'/><parent link='"
         << parent << "'/><child link='link" << k << "'/></joint>\n<link name='link" << k << "'/>\n";
  }
  file << "<joint name='weld' type='fixed'><parent link='link4'/><child link='tool'/></joint><link "
          "name='tool'/></robot>";
  file.close();
  const auto run = run_dyntape({"info", scratch / "arm.urdf"});
  ASSERT_EQ(run.status, 0) << run.err;
  EXPECT_NE(run.out.find("link4 tool"), std::string::npos) << run.out;
  EXPECT_NE(run.out.find("(the world)"), std::string::npos) << run.out;
  EXPECT_NE(
      run.out.find("arm.urdf:3: 5 rotations and axes snapped to a right angle, by at most 6.795e-09 rad"),
      std::string::npos)
      << run.out;
  const auto notes = [](const std::string& text) {
    std::size_t count = 0;
    for (std::size_t at = text.find("note: "); at != text.npos; at = text.find("note: ", at + 1)) ++count;
    return count;
  };
  EXPECT_EQ(notes(run.out), 1u) << run.out;
  EXPECT_EQ(notes(run_dyntape({"info", scratch / "arm.urdf", "--verbose"}).out), 5u);
}

}  // namespace info_test
