// SPDX-License-Identifier: BSD-3-Clause
//
// Slips of the pen in task files that a solve would stumble over late: each is told at once, in one sentence, with its place.
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>

#include "task_text.h"

namespace dyntape::refused_keys_test {
namespace {

class RefusedKeys : public test::TaskText {
 protected:
  RefusedKeys() : TaskText("refused-keys") {}

  // One problem, at the line of `slip`.
  void says(const std::string& slip, const std::string& sentence) {
    const std::string said = message();
    const auto line = 1 + std::count(text_.begin(), text_.begin() + std::ptrdiff_t(text_.find(slip)), '\n');
    EXPECT_NE(said.find("task.info:" + std::to_string(line) + ":"), std::string::npos)
        << line << ": " << said;
    EXPECT_NE(said.find(sentence), std::string::npos) << said;
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 0) << said;
  }
  void change(const std::string& old, const std::string& with, const std::string& slip,
              const std::string& sentence) {
    const std::string kept = text_;
    replace(old, with);
    says(slip, sentence);
    text_ = kept;
  }
};

TEST_F(RefusedKeys, SizesThatNothingHas) {
  load("quadruped_jump");
  change("friction 0.6", "friction 1e300", "1e300",
         "'contacts.friction' must be positive and at most 1000, got '1e300'");
  change("duration  0.3", "duration  1e300", "1e300",
         "'horizon.duration' must be positive and at most 1e+07, got '1e300'");
  change("duration  0.3", "duration  0.3\n  min_duration 1\n max_duration 1e300", "1e300",
         "'horizon.max_duration' must be between 0 and 1e+07, got '1e300'");
  change("duration 0.25", "duration 1e300", "1e300",
         "duration' must be positive and at most 1e+07, got '1e300'");
  change("phase landing {", "phase landing {\n foothold_offset { FL_FOOT \"1e300 0 0\" }", "1e300",
         "'FL_FOOT' must be between -1e+06 and 1e+06, got '1e300'");
  load("humanoid_squat");
  std::smatch corner;
  ASSERT_TRUE(std::regex_search(text_, corner, std::regex("from +\"[^\"]*\"")));
  change(corner.str(), "from \"1e300 0 0\"", "1e300", "'from' must be between -1e+06 and 1e+06, got '1e300'");
}

// What is large and yet may be is read.
TEST_F(RefusedKeys, SizesThatMayBe) {
  load("quadruped_jump");
  replace("friction 0.6", "friction 1000");
  replace("duration  0.3", "duration  1e7");
  replace("phase landing {", "phase landing {\n foothold_offset { FL_FOOT \"0.05 0 0\" }");
  EXPECT_EQ(message(), "nothing thrown");
}

TEST_F(RefusedKeys, JointsThatAreLeftOpen) {
  load("quadruped_jump");
  change("free \"FL_HAA", "free \"FL_HA", "FL_HA F",
         "names 'FL_HA', which is unknown; did you mean 'FL_HAA'?");
  change("phase push_off {",
         "phase push_off {\n goal { q 0\n free \"FL_HA\"\n base { position \"0 0 0.24\" } }", "FL_HA\"",
         "names 'FL_HA', which is unknown; did you mean 'FL_HAA'?");
}

TEST_F(RefusedKeys, JointsWithoutAValue) {
  load("cart_pole_swing_up");
  const std::string none = "'start.q' leaves joint 'pivot' without a value; expected one for every joint";
  change("    slider 0\n    pivot  0", "    slider 0", "q\n  {\n    slider 0\n", none);
  change("    slider 0\n    pivot  0", "", "q\n  {\n\n",
         "'start.q' leaves joints 'slider', 'pivot' without a value; expected one for every joint");
  change("    slider 0\n    pivot  0", "    slider 0\n    pivt 0", "pivt 0", "did you mean 'pivot'?");
}

TEST_F(RefusedKeys, TwoWaypointsAtOneInstant) {
  load("two_link_arm_reaching");
  const auto waypoint = [](const std::string& name, const std::string& at, const std::string& what) {
    return "  waypoint " + name + " {\n   at " + at + "\n   " + what + "\n  }\n";
  };
  const std::string q = "q \"0 1\"", hand = "frame hand { position \"0.5 0 0.5\" }",
                    turned = "frame hand { orientation \"0 1 0\" }",
                    elbow = "frame forearm { position \"0.5 0 0.5\" }";
  const std::string plain = text_;
  for (const auto& [first, second, is_twice] : {std::tuple(q, q, true),
                                                {q, hand, true},
                                                {hand, hand, true},
                                                {hand, turned, false},
                                                {hand, elbow, false}}) {
    text_ = plain + "waypoints {\n" + waypoint("a", "0.5", first) + waypoint("b", "0.50", second) + "}\n";
    if (is_twice)
      says("0.50", "'b' says where the motion passes at 0.5, as 'a' does at that instant");
    else
      EXPECT_EQ(message(), "nothing thrown") << first << second;
    text_ = plain + "waypoints {\n" + waypoint("a", "0.5", first) + waypoint("b", "0.6", second) + "}\n";
    EXPECT_EQ(message(), "nothing thrown") << first << second;
  }
}

TEST_F(RefusedKeys, PseudospectralRowsOfSeveralIntervals) {
  load("two_link_arm_reaching");
  change("transcription\n{", "transcription\n{\n  scheme pseudospectral-16", "pseudospectral",
         "the scheme \"pseudospectral-16\" is of one interval, got 40");
}

}  // namespace
}  // namespace dyntape::refused_keys_test
