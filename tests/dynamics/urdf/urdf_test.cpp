// SPDX-License-Identifier: BSD-3-Clause
//
// What the URDF reader builds, what it makes exact, and that nothing is printed.
// Faulty files: urdf_faults_test.cpp.
#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/dynamics/model/model_operations.h>
#include <dyntape/dynamics/urdf/rotation_snap.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <locale>
#include <random>
#include <thread>

#include "dynamics/robot_files.h"

namespace dyntape::dynamics::urdf_test {
namespace {

using Matrix3d = Matrix3<double>;
using Vector3d = Vector3<double>;

std::string inertial(double mass, const std::string& origin = "") {
  return "<inertial>" + origin + "<mass value='" + std::to_string(mass) +
         "'/><inertia ixx='.1' ixy='0' ixz='0' iyy='.1' iyz='0' izz='.1'/></inertial>";
}

// Two moving joints named so that file order, name order and depth differ, and a fixed one between.
std::string branched() {
  return "<robot name='r'><link name='base'>" + inertial(1) + "</link>" +
         "<joint name='z' type='revolute'><parent link='base'/><child link='lz'/><axis xyz='0 0 2'/>"
         "<limit lower='-1' upper='2' velocity='3' effort='4'/><dynamics damping='.5' "
         "friction='.25'/></joint>"
         "<link name='lz'>" +
         inertial(2) + "</link>" +
         "<joint name='a_fix' type='fixed'><parent link='base'/><child link='tool'/><origin xyz='1 0 0' "
         "rpy='0 0 1.5707963267948966'/></joint><link name='tool'>" +
         inertial(3, "<origin xyz='0 1 0'/>") +
         "</link><joint name='m' type='continuous'><parent link='tool'/><child link='lm'/>"
         "<origin xyz='0 0 1'/></joint><link name='lm'>" +
         inertial(4) + "</link></robot>";
}

std::vector<std::string> joint_names(const Model<double>& model) {
  std::vector<std::string> names;
  for (const auto& joint : model.joints) names.push_back(joint.name);
  return names;
}

bool has_note(const UrdfRobot& robot, const std::string& part) {
  for (const std::string& note : robot.notes)
    if (note.find(part) != note.npos) return true;
  return false;
}

TEST(Urdf, NumbersJointsDepthFirstByName) {
  const Model<double> model = load_urdf_text(branched(), "t.urdf");
  EXPECT_EQ(joint_names(model), (std::vector<std::string>{"m", "z"}));
  EXPECT_EQ(model.nq, 3);
  EXPECT_EQ(model.nv, 2);
  EXPECT_EQ(model.joints[0].type, JointType::kContinuous);
  EXPECT_EQ(model.joints[0].axis, Vector3d::UnitX());  // the default of URDF
  EXPECT_EQ(model.joints[0].limits.upper, JointLimits::kNone);
  EXPECT_EQ(model.joints[1].axis, Vector3d::UnitZ());
  EXPECT_EQ(model.joints[1].limits.lower, -1);
  EXPECT_EQ(model.joints[1].limits.upper, 2);
  EXPECT_EQ(model.joints[1].limits.velocity, 3);
  EXPECT_EQ(model.joints[1].limits.effort, 4);
  EXPECT_EQ(model.joints[1].damping, 0.5);
  EXPECT_EQ(model.joints[1].friction, 0.25);
  EXPECT_EQ(model.X_PJ[0].p, Vector3d(1, 0, 1));
  const Frame<double>& tool = model.frames[model.frame_index("tool")];
  EXPECT_EQ(tool.body, -1);
  EXPECT_EQ(tool.X_BF.p, Vector3d(1, 0, 0));
}

TEST(Urdf, MergesFixedLinksIntoTheFloatingBase) {
  const Model<double> model = load_urdf_text(branched(), "t.urdf", {.base = Base::kFloating});
  EXPECT_EQ(joint_names(model), (std::vector<std::string>{"root_joint", "m", "z"}));
  EXPECT_EQ(model.nq, 10);
  EXPECT_EQ(model.nv, 8);
  // base 1 kg at the origin, tool 3 kg at (1, 0, 0) + Rz(90 deg) (0, 1, 0) = (0, 0, 0)
  EXPECT_EQ(model.inertias[0].mass, 4);
  EXPECT_LT(model.inertias[0].com.norm(), 1e-15);
  EXPECT_LT((model.inertias[0].I_c - 0.2 * Matrix3d::Identity()).norm(), 1e-15);
  EXPECT_EQ(model.frames.size(), 4u);
}

TEST(Urdf, ContinuousJointAsAngle) {
  const Model<double> model = load_urdf_text(branched(), "t.urdf", {.continuous = ContinuousJoint::kAngle});
  EXPECT_EQ(model.nq, 2);
  EXPECT_EQ(model.joints[0].type, JointType::kRevolute);
  EXPECT_EQ(model.joints[0].limits.lower, -JointLimits::kNone);
}

TEST(Urdf, LocksJointsAtZero) {
  const Model<double> model = load_urdf_text(branched(), "t.urdf", {.base = Base::kFloating, .lock = {"m"}});
  EXPECT_EQ(joint_names(model), (std::vector<std::string>{"root_joint", "z"}));
  EXPECT_EQ(model.inertias[0].mass, 8);
  EXPECT_EQ(model.frames[model.frame_index("lm")].body, 0);
  EXPECT_THROW(load_urdf_text(branched(), "t.urdf", {.lock = {"mm"}}), ArgumentError);
}

TEST(Urdf, TurnsTheInertialFrame) {
  const auto read = [](const std::string& rpy, double snap) {
    const std::string text = "<robot name='r'><link name='a'><inertial><origin xyz='1 2 3' rpy='" + rpy +
                             "'/><mass value='2'/><inertia ixx='1' ixy='.1' ixz='.2' iyy='1.5' iyz='.3' "
                             "izz='2'/></inertial></link></robot>";
    return read_urdf_text(text, "t.urdf", {.base = Base::kFloating, .snap = snap});
  };
  Matrix3d I;
  I << 1, .1, .2, .1, 1.5, .3, .2, .3, 2;
  const Matrix3d R = (Eigen::AngleAxisd(0.3, Vector3d::UnitZ()) * Eigen::AngleAxisd(-0.2, Vector3d::UnitY()) *
                      Eigen::AngleAxisd(0.1, Vector3d::UnitX()))
                         .toRotationMatrix();
  const Inertia<double> turned = read("0.1 -0.2 0.3", 1e-8).model.inertias[0];
  EXPECT_LT((turned.I_c - R * I * R.transpose()).norm(), 1e-15);
  EXPECT_EQ(turned.com, Vector3d(1, 2, 3));
  // About x by a right angle: y becomes z, z becomes -y.
  Matrix3d quarter;
  quarter << 1, -.2, .1, -.2, 2, -.3, .1, -.3, 1.5;
  const UrdfRobot snapped = read("1.57079632679 0 0", 1e-8);
  EXPECT_EQ(snapped.model.inertias[0].I_c, quarter);
  EXPECT_TRUE(has_note(snapped, "link \"a\" has a rotation snapped"));
  EXPECT_NE(read("1.57079632679 0 0", 0).model.inertias[0].I_c, quarter);
}

TEST(Urdf, RootAtAnotherLink) {
  const Model<double> model = load_urdf_text(branched(), "t.urdf", {.root = "lz"});
  EXPECT_EQ(joint_names(model), (std::vector<std::string>{"z", "m"}));
  EXPECT_EQ(model.inertias[0].mass, 4);
  EXPECT_EQ(model.joints[0].axis, -Vector3d::UnitZ());
  EXPECT_EQ(model.frames[model.frame_index("lz")].body, -1);
  EXPECT_THROW(load_urdf_text(branched(), "t.urdf", {.root = "nowhere"}), ArgumentError);
}

TEST(Urdf, ChainOfThreeHundredAndOfTenThousand) {
  for (const int n : {300, 10000}) {
    std::string text = "<robot name='chain'><link name='l0'/>";
    for (int i = 1; i <= n; ++i) {
      const std::string k = std::to_string(i);
      text += "<joint name='j" + k + "' type='prismatic'><parent link='l" + std::to_string(i - 1) +
              "'/><child link='l" + k +
              "'/><limit lower='0' upper='1' velocity='1' effort='1'/></joint><link name='l" + k + "'/>";
    }
    EXPECT_EQ(load_urdf_text(text + "</robot>", "chain.urdf").nv, n);
  }
}

TEST(Urdf, RightAnglesWithFewDigits) {
  const auto with_rpy = [](const std::string& rpy) {
    return "<robot name='r'><link name='a'/><joint name='j' type='revolute'><parent link='a'/><child "
           "link='b'/>"
           "<origin rpy='" +
           rpy +
           "'/><axis xyz='0 1e-10 1'/><limit lower='0' upper='1' velocity='1' effort='1'/>"
           "</joint><link name='b'/></robot>";
  };
  Matrix3d exact;
  exact << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const UrdfRobot eleven = read_urdf_text(with_rpy("1.57079632679 0 0"), "t.urdf");
  EXPECT_EQ(eleven.model.X_PJ[0].R, exact);
  EXPECT_EQ(eleven.model.joints[0].axis, Vector3d::UnitZ());
  EXPECT_TRUE(
      has_note(eleven, "t.urdf:1: joint \"j\" has a rotation snapped to a right angle, by 4.897e-12 rad"));
  EXPECT_TRUE(has_note(eleven, "has an axis snapped to"));

  const UrdfRobot literal = read_urdf_text(with_rpy("1.57079632679 0 0"), "t.urdf", {.snap = 0});
  EXPECT_EQ(literal.model.X_PJ[0].R(1, 1), std::cos(1.57079632679));
  EXPECT_TRUE(has_note(literal, "off a right angle, kept as written"));

  const UrdfRobot four = read_urdf_text(with_rpy("1.5708 0 0"), "t.urdf");
  EXPECT_NE(four.model.X_PJ[0].R, exact);
  EXPECT_TRUE(has_note(four, "3.673e-06 rad off a right angle"));
  EXPECT_EQ(load_urdf_text(with_rpy("1.5708 0 0"), "t.urdf", {.snap = 1e-5}).X_PJ[0].R, exact);

  const UrdfRobot full = read_urdf_text(with_rpy("1.5707963267948966 0 0"), "t.urdf", {.snap = 1e-11});
  EXPECT_EQ(full.model.X_PJ[0].R, exact);
  EXPECT_FALSE(has_note(full, "rotation"));
  EXPECT_THROW(read_urdf_text(with_rpy("0 0 0"), "t.urdf", {.snap = -1}), ArgumentError);
  EXPECT_THROW(read_urdf_text(with_rpy("0 0 0"), "t.urdf", {.snap = 0.5}), ArgumentError);
}

TEST(RotationSnap, EqualsTheProductOfThreeRotations) {
  const int seed = 1;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> angle(-7, 7);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d rpy(angle(random), angle(random), angle(random));
    const Matrix3d expected =
        (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
         Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
            .toRotationMatrix();
    ASSERT_LT((rotation_from_rpy(rpy, 1e-8).R - expected).cwiseAbs().maxCoeff(), 2e-15) << "seed " << seed;
  }
}

TEST(RotationSnap, EveryRightAngleIsExact) {
  for (int r = -5; r <= 5; ++r)
    for (int p = -5; p <= 5; ++p)
      for (int y = -5; y <= 5; ++y) {
        const Vector3d rpy = M_PI_2 * Vector3d(r, p, y) + 3e-9 * Vector3d(1, -1, 1);
        const SnappedRotation s = rotation_from_rpy(rpy, 1e-8);
        ASSERT_TRUE((s.R * s.R.transpose()).isIdentity(0));
        ASSERT_EQ(s.R.determinant(), 1);
        ASSERT_EQ(s.R, s.R.array().round().matrix());
        ASSERT_NEAR(s.moved, 3e-9, 1e-14);
        ASSERT_FALSE(s.R.array().isNaN().any());
        ASSERT_LT((s.R - rotation_from_rpy(rpy, 0).R).cwiseAbs().maxCoeff(), 1e-8);
      }
}

TEST(RotationSnap, GimbalLock) {
  // Neither roll nor yaw is a right angle, their difference is.
  const SnappedRotation s = rotation_from_rpy({0.3, M_PI_2, 0.3 + 1e-12}, 1e-8);
  EXPECT_EQ(s.R, s.R.array().round().matrix());
  EXPECT_GT(s.moved, 1e-13);
}

TEST(RotationSnap, AxesKeepTheirDirection) {
  EXPECT_EQ(axis_from_direction({0, 0, -3}, 0).axis, -Vector3d::UnitZ());
  EXPECT_EQ(axis_from_direction({1e-320, 0, 0}, 0).axis, Vector3d::UnitX());
  EXPECT_EQ(axis_from_direction({1e300, 1e290, 0}, 1e-8).axis, Vector3d::UnitX());
  EXPECT_NEAR(axis_from_direction({1e-4, 0, -1}, 1e-8).near, 1e-4, 1e-8);
  EXPECT_LT((axis_from_direction({1, 1, 1}, 1e-8).axis - Vector3d::Constant(1 / std::sqrt(3.))).norm(),
            1e-15);
}

// No check of ours: urdfdom's own message, at the joint that it names.
constexpr char kRefusedByUrdfdom[] =
    "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='continuous'><parent link='a'/>"
    "<child link='b'/><axis xyz='1 0 0'/><dynamics/></joint></robot>";

TEST(Urdf, OwnRobotsLoadInSilence) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  for (const std::string& name : robot_names())
    for (const Base base : {Base::kFixed, Base::kFloating})
      for (const double snap : {0.0, 1e-8})
        EXPECT_NO_THROW(load_urdf(robot_file(name), {.base = base, .snap = snap}));
  EXPECT_THROW(load_urdf_text(kRefusedByUrdfdom, "t.urdf"), FileError);
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

// A cart in a plane with an arm on it; `axis` is the normal of the plane.
std::string cart(const std::string& axis) {
  return "<robot name='cart'><link name='ground'/>\n<joint name='drive' type='planar'><parent link='ground'/>"
         "<child link='cart'/><origin xyz='1 2 3' rpy='0.3 0 0.2'/>" +
         axis + "</joint><link name='cart'>" + inertial(2, "<origin xyz='.1 .2 .3'/>") +
         "</link><joint name='arm' type='revolute'><parent link='cart'/><child link='tip'/>"
         "<origin xyz='0 .5 0'/><axis xyz='0 1 0'/><limit lower='-1' upper='1' velocity='1' "
         "effort='1'/></joint>"
         "<link name='tip'>" +
         inertial(1, "<origin xyz='0 0 .4'/>") + "</link></robot>";
}

// Where a joint's axis is not z the plane is turned, and what hangs on the body stays where it was.
TEST(Urdf, PlanarJointsAboutAnyAxisCarryTheSameBodies) {
  const UrdfRobot upright = read_urdf_text(cart("<axis xyz='0 0 1'/>"), "t.urdf");
  const Model<double>& flat = upright.model;
  EXPECT_EQ(flat.joints[0].type, JointType::kPlanar);
  EXPECT_TRUE(upright.notes.empty());
  for (const std::string axis :
       {"<axis xyz='1 0 0'/>", "", "<axis xyz='0 0 -1'/>", "<axis xyz='.6 0 -.8'/>"}) {
    const UrdfRobot robot = read_urdf_text(cart(axis), "t.urdf");
    const Model<double>& model = robot.model;
    ASSERT_EQ(model.nq, 5);
    EXPECT_TRUE(has_note(robot, "t.urdf:2: joint \"drive\" moves in the plane normal to ("));
    const Model<double> held = lock_joints(model, {"drive"}, neutral(model));
    const Model<double> held_flat = lock_joints(flat, {"drive"}, neutral(flat));
    EXPECT_LT((held.X_PJ[0].R - held_flat.X_PJ[0].R).norm(), 1e-15);
    EXPECT_LT((held.X_PJ[0].p - held_flat.X_PJ[0].p).norm(), 1e-15);
    EXPECT_LT((held.inertias[0].com - held_flat.inertias[0].com).norm(), 1e-15);
    const auto com = [](const Model<double>& m) {
      return Vector3d(m.X_PJ[0].R * m.inertias[0].com + m.X_PJ[0].p);
    };
    EXPECT_LT((com(model) - com(flat)).norm(), 1e-15);
    // The body's z is the axis, in the frame of the joint that the file gives.
    const Vector3d normal = axis.empty() || axis[11] == '1' ? Vector3d(1, 0, 0)
                            : axis[11] == '0'               ? Vector3d(0, 0, -1)
                                                            : Vector3d(.6, 0, -.8);
    const Matrix3d turned = flat.X_PJ[0].R.transpose() * model.X_PJ[0].R;
    EXPECT_LT((turned.col(2) - normal).norm(), 1e-15);
    EXPECT_LT((turned * turned.transpose() - Matrix3d::Identity()).norm(), 1e-15);
    EXPECT_NEAR(turned.determinant(), 1, 1e-15);
  }
}

struct CommaNumbers : std::numpunct<char> {
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\1"; }
};

TEST(Urdf, TheLocaleDoesNotMatter) {
  const Model<double> here = load_urdf(robot_file("ur5"));
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new CommaNumbers));
  const UrdfRobot there = read_urdf(robot_file("ur5"));
  std::locale::global(before);
  for (int i = 0; i < here.njoints(); ++i) {
    EXPECT_EQ(here.inertias[i].mass, there.model.inertias[i].mass);
    EXPECT_EQ(here.inertias[i].I_c, there.model.inertias[i].I_c);
    EXPECT_EQ(here.X_PJ[i].p, there.model.X_PJ[i].p);
    EXPECT_EQ(here.joints[i].limits.upper, there.model.joints[i].limits.upper);
  }
  EXPECT_TRUE(has_note(there, "4.897e-12 rad"));
}

TEST(Urdf, ThreadsReadAtTheSameTime) {
  std::vector<std::thread> threads;
  std::vector<int> nv(4, 0), faults(4, 0);
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&, t] {
      for (int i = 0; i < 5; ++i) {
        nv[t] += load_urdf(robot_file(t % 2 ? "solo12" : "talos")).nv;
        try {
          load_urdf_text(kRefusedByUrdfdom, "t.urdf");
        } catch (const FileError&) {
          ++faults[t];
        }
      }
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(nv, (std::vector<int>{160, 60, 160, 60}));
  EXPECT_EQ(faults, (std::vector<int>{5, 5, 5, 5}));
}

}  // namespace
}  // namespace dyntape::dynamics::urdf_test
