// SPDX-License-Identifier: BSD-3-Clause
//
// Values of a command line in place of those of a file.
#include <gtest/gtest.h>

#include <regex>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/task/task.h>
#include "interface/message_of.h"
#include "source_folder.h"

namespace dyntape::settings_test {
namespace {

const std::string kText = R"(solver {
  tolerance 1e-8
  method ipopt
}
body left {
  radius 1
}
body right {
  radius 2
}
)";

std::vector<io::Setting> settings(std::initializer_list<const char*> options) {
  std::vector<std::string> all;
  for (const char* option : options) all.emplace_back(option);
  return io::settings_of(all);
}

std::string with(std::initializer_list<const char*> options) {
  io::InfoNode root = io::parse_info(kText, "t.info");
  io::apply(settings(options), root);
  return io::write_info(root);
}

TEST(Settings, ReplaceAddAndRemove) {
  const std::string before = with({});
  EXPECT_EQ(io::parse_info(with({"solver.tolerance=1e-6"}), "t").children[0].children[0].value, "1e-6");
  EXPECT_EQ(io::parse_info(with({"body[1].radius=3"}), "t").children[2].children[0].value, "3");
  EXPECT_EQ(io::parse_info(with({"body[1].radius=3"}), "t").children[1].children[0].value, "1");
  EXPECT_EQ(io::parse_info(with({"body=middle"}), "t").children[1].value, "middle");
  EXPECT_EQ(io::parse_info(with({"body=middle"}), "t").children[1].children[0].value, "1");
  const io::InfoNode added = io::parse_info(with({"a.b.c=x y", "a.b.d=2"}), "t");
  ASSERT_EQ(added.children.back().key, "a");
  EXPECT_EQ(added.children.back().children[0].children[0].value, "x y");
  EXPECT_EQ(added.children.back().children[0].children[1].value, "2");
  EXPECT_EQ(io::parse_info(with({"solver.method="}), "t").children[0].children.size(), 1u);
  EXPECT_EQ(with({"solver.method=", "solver.method=ipopt"}), before);
  EXPECT_EQ(with({"solver.none="}), before);
}

TEST(Settings, AreReadAsWhatStandsInTheFile) {
  io::Section file =
      io::Section::parse(kText, "t.info", {}, settings({"solver.tolerance=-1", "solver.tolerence=2"}));
  io::Section solver = file.child("solver");
  solver.get<double>("tolerance", io::positive());
  solver.get_or("method", "ipopt");
  file.children("body");
  const std::string message = message_of<FileError>([&] { file.finish(); });
  EXPECT_NE(message.find("--set solver.tolerance: 'solver.tolerance' must be positive, got '-1'"),
            std::string::npos)
      << message;
  EXPECT_NE(message.find("--set solver.tolerence: unknown key 'tolerence'"), std::string::npos) << message;
}

// A key is one key by either name, in the file and in the setting.
TEST(Settings, MeetKeysOfAnotherName) {
  const std::vector<io::Renamed> renamed = {{"mesh.points", "nodes", {}},
                                            {"solver.method", "method", "old", "new"}};
  for (const char* in_file : {"points", "nodes"}) {
    for (const char* option : {"mesh.points=9", "mesh.nodes=9"}) {
      const std::string text = std::string("mesh { ") + in_file + " 7 }\nsolver { method new }\n";
      io::Section file =
          io::Section::parse(text, "a.info", renamed, io::settings_of({option, "solver.method=old"}));
      EXPECT_EQ(file.child("mesh").get<int>("nodes"), 9) << in_file << ", " << option;
      EXPECT_EQ(file.child("solver").get<std::string>("method"), "new");
      file.finish();
      EXPECT_EQ(file.replacements().size(),
                1u + (in_file == std::string("points")) + (option == std::string("mesh.points=9")));
    }
  }
}

TEST(Settings, OfABlockSayItsKeys) {
  const std::string file = test::source_folder() + "/config/tasks/arm_reaching.info";
  const std::string message = message_of<FileError>([&] { read_task(file, settings({"horizon=3"})); });
  EXPECT_NE(message.find("--set horizon: 'horizon' is a block, which takes no value '3'; its keys are "
                         "'duration', 'intervals'"),
            std::string::npos)
      << message;
}

TEST(Settings, WhatIsNoneIsRefused) {
  for (const char* wrong : {"solver", "=3", "a..b=1", ".a=1", "a.=1", "a[x]=1", "a[1=2", "a[-1]=2", "[1]=2"})
    EXPECT_NE(message_of<ArgumentError>([&] {
                settings({wrong});
              }).find("expected a path of keys, '=' and a value"),
              std::string::npos)
        << wrong;
}

// `start.q[1]=3` made the block's first `q`, so that all joints started at 3.
TEST(Settings, NumbersThatLeaveOutOthersAreRefused) {
  for (const char* wrong : {"solver.method[2]=a", "start.q[1]=3", "body[3].radius=1", "other[1]="})
    EXPECT_NE(message_of<ArgumentError>([&] { with({wrong}); }).find("counts from 0 what has this name"),
              std::string::npos)
        << wrong;
  EXPECT_EQ(message_of<ArgumentError>([] { with({"body[3].radius=1"}); }),
            "--set body[3].radius: 'body[3]' counts from 0 what has this name, and there are 2; expected at "
            "most 'body[2]'");
  EXPECT_EQ(io::parse_info(with({"body[2].radius=3"}), "t").children[3].children[0].value, "3");
}

TEST(Settings, NameTheirOption) {
  io::Section file =
      io::Section::parse("", "t.info", {}, {{"a.b", "-1", "--for"}, {"a.typo", "on", "--effects typo"}});
  file.child("a").get<double>("b", io::positive());
  const std::string message = message_of<FileError>([&] { file.finish(); });
  EXPECT_NE(message.find("--for: 'a.b' must be positive, got '-1'"), std::string::npos) << message;
  EXPECT_NE(message.find("--effects typo: unknown key 'typo' in 'a'"), std::string::npos) << message;
}

// The position was that of the file's block, which has no such key.
TEST(Settings, WhatADefaultMakesWrongIsOfTheDuration) {
  const std::string file = test::source_folder() + "/config/scenes/rigid_bounce.info";
  for (const auto& [option, begin] :
       {std::pair("simulation.duration=1e9", "--set simulation.duration: 'sample' of "),
        std::pair("simulation.sample=1e-9", "--set simulation.sample: ")}) {
    const std::string message = message_of<FileError>([&] { read_scene(file, settings({option})); });
    EXPECT_EQ(message.substr(0, std::string(begin).size()), begin) << message;
  }
}

TEST(Settings, OfATaskAndAScene) {
  const std::string folder = test::source_folder() + "/config/";
  const Task task = read_task(folder + "tasks/arm_reaching.info", settings({"horizon.intervals=7"}));
  EXPECT_EQ(task.optimise.mesh.intervals, 7);
  EXPECT_TRUE(std::regex_search(task.effective, std::regex("intervals +7"))) << task.effective;
  const Scene scene = read_scene(folder + "scenes/pendulum.info", settings({"effects.gravity=off"}));
  EXPECT_TRUE(std::regex_search(scene.effective, std::regex("gravity +off"))) << scene.effective;
}

}  // namespace
}  // namespace dyntape::settings_test
