// SPDX-License-Identifier: BSD-3-Clause
//
// Every fault that the URDF reader knows, with the line that its message must name, and the oddities that it
// only notes.
#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <gtest/gtest.h>

#include "dynamics/robot_files.h"

namespace dyntape::dynamics::urdf_faults_test {
namespace {

// A valid file of which tests break one line.
const std::vector<std::string> kLines = {
    "<robot name='r'>",                                                                  // 1
    "<link name='base'/>",                                                               // 2
    "<joint name='hip' type='revolute'>",                                                // 3
    "<parent link='base'/>",                                                             // 4
    "<child link='leg'/>",                                                               // 5
    "<origin xyz='0 0 1' rpy='0 0 0'/>",                                                 // 6
    "<axis xyz='0 0 1'/>",                                                               // 7
    "<limit lower='-1' upper='1' velocity='1' effort='1'/>",                             // 8
    "</joint>",                                                                          // 9
    "<link name='leg'>",                                                                 // 10
    "<inertial><origin xyz='0 0 0'/>",                                                   // 11
    "<mass value='1'/>",                                                                 // 12
    "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>",                        // 13
    "</inertial>",                                                                       // 14
    "<visual><geometry><box size='1 1 1'/></geometry></visual>",                         // 15
    "</link>",                                                                           // 16
    "<joint name='knee' type='fixed'><parent link='leg'/><child link='foot'/></joint>",  // 17
    "<link name='foot'/>",                                                               // 18
    "</robot>"};                                                                         // 19

std::string with_line(int number, const std::string& line) {
  std::string text;
  for (size_t i = 0; i < kLines.size(); ++i)
    text += (static_cast<int>(i) + 1 == number ? line : kLines[i]) + "\n";
  return text;
}

std::string error_of(const std::string& text, const UrdfOptions& options = {}) {
  try {
    load_urdf_text(text, "t.urdf", options);
  } catch (const FileError& e) {
    return e.what();
  }
  return "";
}

struct Fault {
  const char* name;
  int line;             // the line that is replaced
  const char* with;     // by this
  const char* message;  // what the message must begin with
};

class Faults : public ::testing::TestWithParam<Fault> {};

TEST_P(Faults, AreNamedWithTheirLine) {
  const std::string message = error_of(with_line(GetParam().line, GetParam().with));
  EXPECT_EQ(message.substr(0, std::string(GetParam().message).size()), GetParam().message) << message;
  EXPECT_EQ(message.find('\n'), message.npos) << "one sentence: " << message;
}

const Fault kFaults[] = {
    {"NotWellFormed", 16, "</lnk>", "t.urdf:10: not well-formed XML: <link> is closed by another name"},
    {"RobotNotClosed", 19, "",
     "t.urdf:1: not well-formed XML: the file ends before the element that begins here"},
    {"CommentNotClosed", 18, "<!-- foot", "t.urdf:18: not well-formed XML: the file ends before the comment"},
    {"AttributeWithoutQuotes", 12, "<mass value=1/>", "t.urdf:12: not well-formed XML: an attribute"},
    {"OtherRoot", 1, "<sdf name='r'>", "t.urdf:1: not well-formed XML"},
    {"NoRobotName", 1, "<robot>", "t.urdf:1: <robot> has no name"},
    {"LinkWithoutName", 18, "<link/>", "t.urdf:18: <link> has no name"},
    {"LinkTwice", 18, "<link name='leg'/>", "t.urdf:18: link \"leg\" is there already (line 10)"},
    {"JointTwice", 17, "<joint name='hip' type='fixed'><parent link='leg'/><child link='foot'/></joint>",
     "t.urdf:17: joint \"hip\" is there already (line 3)"},
    {"UnknownParent", 4, "<parent link='bass'/>",
     "t.urdf:4: joint \"hip\" has the parent \"bass\", and there is no such link; did you mean 'base'?"},
    {"UnknownChild", 5, "<child link='lag'/>",
     "t.urdf:5: joint \"hip\" has the child \"lag\", and there is no such link; did you mean 'leg'?"},
    {"NoParent", 4, "", "t.urdf:3: joint \"hip\" has no <parent link=\"...\"/>"},
    {"NoChild", 5, "", "t.urdf:3: joint \"hip\" has no <child link=\"...\"/>"},
    {"ParentWithoutLink", 4, "<parent/>", "t.urdf:4: joint \"hip\": <parent> needs the attribute \"link\""},
    {"OwnParent", 4, "<parent link='leg'/>", "t.urdf:3: joint \"hip\" makes a loop"},
    {"TwoParents", 17, "<joint name='knee' type='fixed'><parent link='base'/><child link='leg'/></joint>",
     "t.urdf:17: link \"leg\" has two parents: joint \"knee\" and joint \"hip\" (line 3)"},
    {"TwoRoots", 17, "", "t.urdf:18: link \"foot\" is a second root beside link \"base\" (line 2)"},
    {"LoopWithoutRoot", 4, "<parent link='foot'/>",
     "t.urdf:3: joint \"hip\" carries link \"leg\", which hangs on a loop"},
    {"NoType", 3, "<joint name='hip'>", "t.urdf:3: joint \"hip\" has no type"},
    {"UnknownType", 3, "<joint name='hip' type='revolut'>",
     "t.urdf:3: joint \"hip\" has the type \"revolut\"; expected revolute, continuous, prismatic, planar or "
     "fixed; "
     "did "
     "you mean 'revolute'?"},
    {"ZeroAxis", 7, "<axis xyz='0 0 0'/>", "t.urdf:7: joint \"hip\" has a zero axis"},
    {"AxisWithoutDirection", 7, "<axis/>", "t.urdf:7: joint \"hip\": <axis> needs the attribute \"xyz\""},
    {"NoLimit", 8, "", "t.urdf:3: joint \"hip\" has no <limit>"},
    {"NoEffort", 8, "<limit lower='-1' upper='1' velocity='1'/>",
     "t.urdf:8: joint \"hip\": <limit> needs the attribute \"effort\""},
    {"NegativeVelocity", 8, "<limit lower='-1' upper='1' velocity='-1' effort='1'/>",
     "t.urdf:8: joint \"hip\" has the velocity limit -1; expected zero or more"},
    {"LimitsReversed", 8, "<limit lower='1' upper='-1' velocity='1' effort='1'/>",
     "t.urdf:8: joint \"hip\" has lower limit 1 above upper limit -1"},
    {"MassNaN", 12, "<mass value='nan'/>", "t.urdf:12: <mass value=\"nan\">: \"nan\" is not a finite number"},
    {"MassWord", 12, "<mass value='abc'/>", "t.urdf:12: <mass value=\"abc\">: \"abc\" is not a number"},
    {"MassTrailing", 12, "<mass value='1kg'/>", "t.urdf:12: <mass value=\"1kg\">: \"1kg\" is not a number"},
    {"MassComma", 12, "<mass value='1,5'/>", "t.urdf:12: <mass value=\"1,5\">: \"1,5\" is not a number"},
    {"MassEmpty", 12, "<mass value=''/>", "t.urdf:12: <mass value=\"\">: expected 1 number"},
    {"MassInfinite", 12, "<mass value='inf'/>", "t.urdf:12: <mass value=\"inf\">: \"inf\" is not a finite"},
    {"MassOverflow", 12, "<mass value='1e999'/>",
     "t.urdf:12: <mass value=\"1e999\">: \"1e999\" is out of the range"},
    {"MassTwice", 12, "<mass value='1' value='2'/>", "t.urdf:12: "},
    {"MassNegative", 12, "<mass value='-1'/>", "t.urdf:12: link \"leg\" has the mass -1 kg"},
    {"MassMissing", 12, "", "t.urdf:11: link \"leg\" has <inertial> without <mass>"},
    {"MassWithoutValue", 12, "<mass/>", "t.urdf:12: link \"leg\": <mass> needs the attribute \"value\""},
    {"InertiaMissing", 13, "", "t.urdf:11: link \"leg\" has <inertial> without <inertia>"},
    {"InertiaEntryMissing", 13, "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0'/>",
     "t.urdf:13: link \"leg\": <inertia> needs the attribute \"izz\""},
    {"InertiaNegative", 13, "<inertia ixx='-1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>",
     "t.urdf:13: link \"leg\" has an inertia that no body has: its smallest principal moment is -1 kg m^2"},
    {"InertiaIndefinite", 13, "<inertia ixx='1' ixy='2' ixz='0' iyy='1' iyz='0' izz='1'/>",
     "t.urdf:13: link \"leg\" has an inertia that no body has: its smallest principal moment is -1 kg m^2"},
    {"OriginInfinite", 6, "<origin xyz='0 0 -inf'/>",
     "t.urdf:6: <origin xyz=\"0 0 -inf\">: \"-inf\" is not a finite"},
    {"OriginShort", 6, "<origin xyz='0 0'/>", "t.urdf:6: <origin xyz=\"0 0\">: expected 3 numbers"},
    {"RollNaN", 6, "<origin rpy='nan 0 0'/>", "t.urdf:6: <origin rpy=\"nan 0 0\">: \"nan\" is not a finite"},
    {"CentreNaN", 11, "<inertial><origin xyz='0 nan 0'/>", "t.urdf:11: <origin xyz=\"0 nan 0\">"},
};

INSTANTIATE_TEST_SUITE_P(Urdf, Faults, ::testing::ValuesIn(kFaults),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(UrdfFaults, TheUnbrokenFileLoads) {
  const UrdfRobot robot = read_urdf_text(with_line(0, ""), "t.urdf");
  EXPECT_EQ(robot.model.nv, 1);
  EXPECT_TRUE(robot.notes.empty()) << robot.notes.front();
}

TEST(UrdfFaults, WholeFiles) {
  EXPECT_EQ(error_of("").substr(0, 8), "t.urdf:1");
  EXPECT_EQ(error_of("<sdf version='1.7'/>"),
            "t.urdf:1: the root element is <sdf>, an SDF file (of Gazebo); expected <robot>, a URDF file, as "
            "the PyPI package robot_descriptions has it of many robots that are described in other formats");
  EXPECT_EQ(error_of("<robot name='r'/>"), "t.urdf:1: robot \"r\" has no <link>; expected at least one");
  EXPECT_EQ(error_of(std::string("<robot\0", 7)).substr(0, 30), "t.urdf: contains a zero byte; ");
  EXPECT_EQ(error_of(with_line(2, "<link name='b\xe9'/>")).substr(0, 55),
            "t.urdf:2: a <link> has a name that is not UTF-8; expect");
  std::string deep;
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  EXPECT_EQ(error_of(deep).substr(0, 8), "t.urdf:1");
  EXPECT_THROW(load_urdf(robot_file("no_such_robot")), FileError);
  EXPECT_THROW(load_urdf(robot_file("..")), FileError);
}

TEST(UrdfFaults, ALoopBesideTheRoot) {
  const std::string message = error_of(
      "<robot name='r'>\n<link name='base'/>\n<link name='a'/>\n<link name='b'/>\n"
      "<joint name='ab' type='fixed'><parent link='a'/><child link='b'/></joint>\n"
      "<joint name='ba' type='fixed'><parent link='b'/><child link='a'/></joint>\n</robot>");
  EXPECT_EQ(message,
            "t.urdf:6: joint \"ba\" carries link \"a\", which hangs on a loop of joints and on no root; "
            "expected a tree");
}

TEST(UrdfFaults, TruncatedAnywhereIsAnErrorNeverACrash) {
  const std::string text = with_line(0, "");
  for (size_t size = 0; size + 10 < text.size(); size += 3)
    EXPECT_NE(error_of(text.substr(0, size)), "") << size << " bytes";
}

TEST(UrdfFaults, MessagesStayOnOneLine) {
  const std::string two =
      "<joint name='kn\nee' type='fixed'><parent link='leg'/><child link='foot'/></joint>";
  EXPECT_EQ(
      error_of(with_line(17, two)),
      "t.urdf:17: a <joint> has a name that holds a line break or another control character; expected one "
      "line");
  EXPECT_EQ(error_of(with_line(12, "<mass value='a\nb'/>")),
            "t.urdf:12: <mass value=\"a b\">: \"a\" is not a number");
}

TEST(UrdfFaults, RootJointIsTaken) {
  std::string text = with_line(3, "<joint name='root_joint' type='revolute'>");
  EXPECT_EQ(error_of(text), "");
  EXPECT_EQ(error_of(text, {.base = Base::kFloating}).substr(0, 36),
            "t.urdf:3: joint \"root_joint\" has the");
}

std::string notes_of(const std::string& text, const UrdfOptions& options = {}) {
  std::string all;
  for (const std::string& note : read_urdf_text(text, "t.urdf", options).notes) all += note + "\n";
  return all;
}

TEST(UrdfFaults, OdditiesAreNotes) {
  EXPECT_EQ(notes_of(with_line(13, "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='3'/>")),
            "t.urdf:13: link \"leg\" has an inertia that no rigid body has: principal moments 1, 1, 3, the "
            "largest above the sum of the others\n");
  EXPECT_EQ(notes_of(with_line(12, "<mass value='0'/>")),
            "t.urdf:13: link \"leg\" has rotational inertia but no mass\n");
  EXPECT_EQ(notes_of(with_line(7, "<axis xyz='0 0 3'/>")),
            "t.urdf:7: joint \"hip\" has an axis of length 3, scaled to 1\n");
  EXPECT_EQ(notes_of(with_line(8, "<limit upper='1' velocity='1' effort='1'/>")),
            "t.urdf:8: joint \"hip\" gives no lower limit, which reads as 0\n");
  EXPECT_EQ(notes_of(with_line(9, "<mimic joint='knee'/></joint>")),
            "t.urdf:9: joint \"hip\" mimics \"knee\"; it is read as an independent joint\n");
  EXPECT_EQ(notes_of(with_line(9, "<axis xyz='1 0 0'/></joint>")),
            "t.urdf:9: joint \"hip\" has <axis> more than once; only the first counts\n");
  EXPECT_EQ(notes_of(with_line(13, "<inertia ixx='-1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'/>"),
                     {.accept_nonphysical_inertia = true})
                .substr(0, 62),
            "t.urdf:13: link \"leg\" has an inertia that no body has: its sma");
}

TEST(UrdfFaults, WhatIsLegal) {
  // A point mass, a massless link with a joint before it, a thin rod.
  EXPECT_EQ(notes_of(with_line(13, "<inertia ixx='0' ixy='0' ixz='0' iyy='0' iyz='0' izz='0'/>")), "");
  EXPECT_EQ(notes_of(with_line(13, "<inertia ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='0'/>")), "");
  EXPECT_EQ(notes_of(with_line(6, "<origin xyz=' +1\n .5\t-2e-1 '/>")), "");
}

}  // namespace
}  // namespace dyntape::dynamics::urdf_faults_test
