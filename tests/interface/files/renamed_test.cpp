// SPDX-License-Identifier: BSD-3-Clause
//
// Files that use the names of the version before.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include <dyntape/interface/files/info/renamed.h>
#include <dyntape/interface/files/info/section.h>
#include <dyntape/interface/files/old_names.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/sweep/sweep.h>
#include <dyntape/interface/files/task/centroidal_task.h>
#include <dyntape/interface/files/task/task_keys.h>

namespace dyntape::renamed_test {
namespace {

using io::Renamed;
using io::Section;

const std::vector<Renamed> kRenamed = {{"mesh.points", "nodes", {}},
                                       {"solver.method", "method", "old", "new"}};

TEST(Renamed, OldNamesAreReadAndTold) {
  Section file = Section::parse("mesh\n{\n  points 7\n}\nsolver\n{\n  method old\n}\n", "a.info", kRenamed);
  EXPECT_EQ(file.child("mesh").get<int>("nodes"), 7);
  EXPECT_EQ(file.child("solver").get<std::string>("method"), "new");
  file.finish();
  ASSERT_EQ(file.replacements().size(), 2u);
  EXPECT_EQ(to_sentence(file.replacements()[0]).find("a.info:3:3: 'points' is now called 'nodes'"), 0u);
  EXPECT_EQ(to_sentence(file.replacements()[1]).find("a.info:7:10: 'old' is now called 'new'"), 0u);
}

TEST(Renamed, OnlyWhereThePathIsTheirs) {
  Section file = Section::parse("grid { points 7 }\npoints 3\nsolver { method other }\n", "a.info", kRenamed);
  EXPECT_TRUE(file.replacements().empty());
}

TEST(Renamed, BothNamesAreAKeyThatIsGivenTwice) {
  Section file = Section::parse("mesh\n{\n  points 7\n  nodes 8\n}\n", "a.info", kRenamed);
  file.child("mesh").get<int>("nodes");
  EXPECT_THROW(file.finish(), FileError);
}

TEST(Renamed, TextsKeepAllElse) {
  const std::string text =
      "; points of old\nmesh { \"points\"  7 } ; points\nsolver\n{\n\tmethod old ; as of old\n}\n";
  io::InfoScan scan = io::scan_info(text, "a.info");
  const auto replacements = replace_old_names(scan.root, kRenamed);
  const std::string now = replaced(text, "a.info", replacements);
  EXPECT_EQ(now, "; points of old\nmesh { \"nodes\"  7 } ; points\nsolver\n{\n\tmethod new ; as of old\n}\n");
  io::InfoScan again = io::scan_info(now, "a.info");
  EXPECT_TRUE(replace_old_names(again.root, kRenamed).empty());
  EXPECT_EQ(replaced(text, "b.info", replacements), text);
}

// Every entry of the table leads to a key of today, and from none.
TEST(Renamed, EveryNameOfTodayIsAKey) {
  std::vector<io::Question> keys;
  for (const auto& questions :
       {task_questions(), scene_questions(), sweep_questions(), centroidal_questions()})
    keys.insert(keys.end(), questions.begin(), questions.end());
  const auto asked = [&](const std::string& tail) {
    return std::find_if(keys.begin(), keys.end(), [&](const io::Question& q) {
      return q.path == tail || q.path.ends_with("." + tail);
    });
  };
  for (const Renamed& r : old_names()) {
    const std::string path(r.path), block = path.substr(0, path.rfind('.') + 1);
    const auto now = asked(block + std::string(r.now));
    ASSERT_NE(now, keys.end()) << path;
    if (r.value.empty()) {
      EXPECT_EQ(asked(path), keys.end()) << path;
    } else {
      EXPECT_NE(now->takes.find(r.value_now), std::string::npos) << path;
      EXPECT_EQ(now->takes.find(r.value), std::string::npos) << path;
    }
  }
}

}  // namespace
}  // namespace dyntape::renamed_test
