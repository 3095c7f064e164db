// SPDX-License-Identifier: BSD-3-Clause
//
// Files with faults that do not change how the robot moves, as public ones have them: the robot is read, with a note.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/dynamics/urdf/visuals.h>

namespace dyntape::dynamics::urdf_drawings_test {
namespace {

constexpr char kInertia[] = "ixx='1' ixy='0' ixz='0' iyy='1' iyz='0' izz='1'";

std::string arm(const std::string& in_link, const std::string& in_robot = "",
                const std::string& inertia = kInertia) {
  return "<robot name='r'>\n" + in_robot +
         "\n<link name='base'/>\n"
         "<joint name='hip' type='continuous'><parent link='base'/><child link='leg'/><axis xyz='0 1 "
         "0'/></joint>\n"
         "<link name='leg'>\n" +
         in_link + "\n<inertial><mass value='2'/><inertia " + inertia + "/></inertial></link></robot>";
}

struct Drawing {
  const char* name;
  std::string in_link, in_robot, note;
};

class Drawings : public ::testing::TestWithParam<Drawing> {};

const Drawing kDrawings[] = {
    {"MaterialWithoutName", "<visual><geometry><sphere radius='1'/></geometry><material/></visual>", "", ""},
    {"EmptyCollision", "<collision/>", "", ""},
    {"EmptyVisual", "<visual/>", "", ""},
    {"EmptyGeometry", "<visual><geometry/></visual>", "", ""},
    {"UnknownGeometry", "<collision><geometry><blob/></geometry></collision>", "", ""},
    {"BoxOfTwo", "<visual><geometry><box size='1 2'/></geometry></visual>", "",
     "t.urdf:6: <box size=\"1 2\">: expected 3 numbers separated by blanks, got 2; this only draws"},
    {"NaN", "<collision><geometry><sphere radius='nan'/></geometry></collision>", "",
     "t.urdf:6: <sphere radius=\"nan\">"},
    {"ColorOfThree", "", "<material name='red'><color rgba='1 0 0'/></material>", ""},
    {"ColorOfThreeWithin", "<visual><geometry/><material name='m'><color rgba='1 0 0'/></material></visual>",
     "", "t.urdf:6: <color rgba=\"1 0 0\">: expected 4 numbers"},
    {"OneScale", "<visual><geometry><mesh filename='a.stl' scale='0.001'/></geometry></visual>", "",
     "t.urdf:6: <mesh scale=\"0.001\"> of link \"leg\": expected three numbers"},
    {"Xacro", "<collision><geometry><mesh filename='a.stl' scale='${s} 1 1'/></geometry></collision>", "",
     "t.urdf:6: <mesh scale=\"${s} 1 1\"> is left of xacro"},
};

INSTANTIATE_TEST_SUITE_P(Urdf, Drawings, ::testing::ValuesIn(kDrawings),
                         [](const auto& info) { return std::string(info.param.name); });

TEST_P(Drawings, TheRobotIsReadAndDrawnAsFarAsItGoes) {
  const Drawing& drawing = GetParam();
  const std::string text = arm(drawing.in_link, drawing.in_robot);
  const UrdfRobot robot = read_urdf_text(text, "t.urdf"), plain = read_urdf_text(arm(""), "t.urdf");
  EXPECT_EQ(robot.model.nv, 1);
  EXPECT_EQ(robot.model.inertias[0].mass, plain.model.inertias[0].mass);
  EXPECT_EQ(robot.model.inertias[0].I_c, plain.model.inertias[0].I_c);
  bool found = drawing.note.empty();
  for (const std::string& note : robot.notes) found = found || note.find(drawing.note) == 0;
  EXPECT_TRUE(found) << (robot.notes.empty() ? "no note" : robot.notes.front());
  EXPECT_NO_THROW(read_visuals_text(text, "t.urdf", robot.model));
}

TEST(Drawings, FaultsAreCountedAndTheFirstIsQuoted) {
  std::string shapes;
  for (int k = 0; k < 7; ++k) shapes += "<collision><geometry><box size='1 2'/></geometry></collision>\n";
  const UrdfRobot robot = read_urdf_text(arm(shapes), "t.urdf");
  ASSERT_EQ(robot.notes.size(), 1u);
  EXPECT_EQ(robot.notes[0].find("t.urdf:6: <box"), 0u);
  EXPECT_NE(robot.notes[0].find(", and 6 more like it;"), std::string::npos) << robot.notes[0];
}

TEST(Drawings, WhatIsNotDrawnIsNotedAndItsLinkIncomplete) {
  const std::string text =
      arm("<visual><geometry><box size='1 2'/></geometry></visual><visual><geometry><sphere "
          "radius='1'/></geometry></visual>");
  const UrdfVisuals visuals = read_visuals_text(text, "t.urdf", load_urdf_text(text, "t.urdf"));
  EXPECT_EQ(visuals.shapes.size(), 1u);
  EXPECT_EQ(visuals.incomplete, std::vector<std::string>{"leg"});
  ASSERT_EQ(visuals.notes.size(), 1u);
  EXPECT_EQ(visuals.notes[0].find("t.urdf:6: "), 0u);
}

// XML's blanks are blanks in any attribute of numbers.
TEST(UrdfBlanks, AroundNumbersAreNoFault) {
  const Model<double> plain = load_urdf_text(arm(""), "t.urdf");
  const Model<double> odd =
      load_urdf_text(arm("", "", "ixx=' 1' ixy='0 ' ixz='\n0\n' iyy='\t1' iyz=' 0 ' izz='1\r\n'"), "t.urdf");
  EXPECT_EQ(odd.inertias[0].I_c, plain.inertias[0].I_c);
}

TEST(UrdfInertia, MomentsBelowRoundingAreNone) {
  const auto with = [](const std::string& inertia) { return read_urdf_text(arm("", "", inertia), "t.urdf"); };
  EXPECT_TRUE(with("ixx='-1.3e-22' ixy='0' ixz='0' iyy='1e-20' iyz='0' izz='3e-20'").notes.empty());
  EXPECT_THROW(with("ixx='-1e-8' ixy='0' ixz='0' iyy='1e-6' iyz='0' izz='1e-6'"), FileError);
}

// The base that a file says floats is that of Base::kFloating.
TEST(UrdfFloating, AJointOfTheRootIsTheFloatingBase) {
  const std::string leg = "<link name='leg'><inertial><mass value='2'/><inertia " + std::string(kInertia) +
                          "/></inertial></link>";
  const std::string hip =
      "<joint name='hip' type='continuous'><parent link='trunk'/><child link='leg'/></joint>";
  const std::string trunk = "<link name='trunk'><inertial><mass value='9'/><inertia " +
                            std::string(kInertia) + "/></inertial></link>";
  const std::string file =
      "<robot name='r'><link name='world'/><joint name='free' type='floating'>"
      "<parent link='world'/><child link='trunk'/></joint>" +
      trunk + hip + leg + "</robot>";
  const Model<double> wanted = load_urdf_text("<robot name='r'>" + trunk + hip + leg + "</robot>", "t.urdf",
                                              {.base = Base::kFloating});
  for (const Base base : {Base::kFixed, Base::kFloating}) {
    const Model<double> model = load_urdf_text(file, "t.urdf", {.base = base});
    EXPECT_EQ(model.nq, wanted.nq);
    EXPECT_EQ(model.nv, wanted.nv);
    EXPECT_EQ(model.joints[0].type, JointType::kFreeFlyer);
    EXPECT_EQ(model.joints[0].name, "free");
    for (int i = 0; i < model.njoints(); ++i) EXPECT_EQ(model.inertias[i].mass, wanted.inertias[i].mass);
  }
  const std::string deep = "<robot name='r'>" + trunk + hip + leg +
                           "<link name='toe'/><joint name='loose' type='floating'><parent link='leg'/>"
                           "<child link='toe'/></joint></robot>";
  EXPECT_THROW(load_urdf_text(deep, "t.urdf"), FileError);
}

TEST(UrdfRoots, OtherFormatsAreTold) {
  try {
    load_urdf_text("<mujoco model='m'/>", "t.xml");
    FAIL();
  } catch (const FileError& e) {
    EXPECT_NE(std::string(e.what()).find(
                  "an MJCF file (of MuJoCo); expected <robot>, a URDF file, as the PyPI package"),
              std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace dyntape::dynamics::urdf_drawings_test
