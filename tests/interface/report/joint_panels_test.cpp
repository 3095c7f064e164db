// SPDX-License-Identifier: BSD-3-Clause
//
// Pictures of motions: every axis has one unit, which is that of all its curves.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include <dyntape/interface/report/joints/joint_panels.h>
#include <dyntape/interface/report/simulation_results.h>
#include <dyntape/interface/report/sweep_results.h>

#include "interface/run/sweep/swept.h"
#include "interface/run/tied_robots.h"
#include "source_folder.h"

namespace dyntape::joint_panels_test {
namespace {

// "a c" by the label of their axis.
std::map<std::string, std::string> curves_of(const io::Plot& plot) {
  std::map<std::string, std::string> curves;
  for (const io::Panel& panel : plot.panels)
    for (const io::Series& series : panel.series)
      curves[panel.y_label] += (curves[panel.y_label].empty() ? "" : " ") + series.name;
  return curves;
}

io::Plot plot_of(const std::string& urdf, const std::string& torque) {
  const Scene scene = test::tied_scene(
      urdf, "commands { torque { " + torque + " } }\nsimulation { duration 0.02  step 1e-3 }\n");
  return state_plot(scene, simulate(scene));
}

using Curves = std::map<std::string, std::string>;

TEST(JointPanels, TurningAndSlidingJointsHaveTheirOwn) {
  EXPECT_EQ(curves_of(plot_of(test::crank_with_follower(), "a 1  c 0  d 2")), (Curves{{"q [rad]", "a c b"},
                                                                                      {"q [m]", "d"},
                                                                                      {"v [rad/s]", "a c b"},
                                                                                      {"v [m/s]", "d"},
                                                                                      {"tau [N m]", "a c"},
                                                                                      {"tau [N]", "d"}}));
  EXPECT_EQ(curves_of(plot_of(test::Sliders().urdf(), "a 1")),
            (Curves{{"q [m]", "a b"}, {"v [m/s]", "a b"}, {"tau [N]", "a"}}));
  EXPECT_EQ(curves_of(plot_of(test::Pendulums().urdf(), "a 1")),
            (Curves{{"q [rad]", "a b"}, {"v [rad/s]", "a b"}, {"tau [N m]", "a"}}));
  const io::Plot at_rest = plot_of(test::Pendulums().urdf(), "a 0");
  EXPECT_EQ(at_rest.panels.size(), 2u);  // drives that do nothing have no panel
}

TEST(JointPanels, PairsAreAnglesWithoutJumps) {
  const auto robot = dynamics::read_urdf_text(
      "<robot name='r'><link name='base'/><joint name='wheel' type='continuous'><parent link='base'/>"
      "<child link='rim'/></joint><link name='rim'><inertial><mass value='1'/><inertia ixx='1' iyy='1' "
      "izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>",
      "wheel", {});
  ASSERT_EQ(robot.model.nq, 2);
  const Eigen::VectorXd angle = Eigen::VectorXd::LinSpaced(50, 3, 20);
  Eigen::MatrixXd q(2, 50), targets(2, 50);
  q << angle.array().cos().transpose(), angle.array().sin().transpose();
  targets << (angle.array() + 0.2).cos().transpose(), (angle.array() + 0.2).sin().transpose();
  io::Plot plot;
  add_positions(plot, robot.model, angle, {q, {}, {}, targets});
  ASSERT_EQ(curves_of(plot), (Curves{{"q [rad]", "wheel "}}));
  for (std::size_t k = 0; k < 50; ++k) {
    EXPECT_NEAR(plot.panels[0].series[0].y[k], angle[Eigen::Index(k)], 1e-12);
    EXPECT_NEAR(plot.panels[0].series[1].y[k], angle[Eigen::Index(k)] + 0.2, 1e-12);
  }
}

// Roll and yaw of a rolling ball jumped by half turns.
TEST(JointPanels, OrientationsHaveNoJumps) {
  dynamics::UrdfOptions floating;
  floating.base = dynamics::Base::kFloating;
  const auto robot = dynamics::read_urdf_text(
      "<robot name='r'><link name='ball'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' "
      "ixz='0' iyz='0'/></inertial></link></robot>",
      "ball", floating);
  ASSERT_EQ(robot.model.nq, 7);
  constexpr int kSamples = 401;  // some at a pitch of a quarter turn
  const Eigen::VectorXd turned = Eigen::VectorXd::LinSpaced(kSamples, 0, 10 * M_PI);
  for (const double heading : {0.0, 0.7, -2.5}) {
    for (const double spin : {1.0, -1.0}) {
      Eigen::MatrixXd q = Eigen::MatrixXd::Zero(7, kSamples);
      for (int k = 0; k < kSamples; ++k)
        q.col(k).tail<4>() = (Eigen::AngleAxisd(heading, Eigen::Vector3d::UnitZ()) *
                              Eigen::AngleAxisd(spin * turned[k], Eigen::Vector3d::UnitY()))
                                 .coeffs();
      io::Plot plot;
      add_positions(plot, robot.model, turned, {q});
      ASSERT_EQ(plot.panels.size(), 2u);
      const auto& angles = plot.panels[1].series;
      ASSERT_EQ(angles.size(), 3u);
      for (std::size_t k = 0; k < kSamples; ++k) {
        EXPECT_NEAR(angles[0].y[k], 0, 1e-7) << k;
        EXPECT_NEAR(angles[1].y[k], spin * turned[Eigen::Index(k)], 1e-7) << k;
        EXPECT_NEAR(angles[2].y[k], heading, 1e-7) << k;
      }
    }
  }
}

// An impact between two samples is in no curve: the title says how far they are apart.
TEST(ForcePlot, SaysItsSamples) {
  const auto title = [](const char* sample) {
    const Scene scene = read_scene(
        test::source_folder() + "/config/scenes/bouncing_ball.info",
        io::settings_of({"simulation.duration=0.02", "simulation.step=1e-3",
                         std::string("simulation.sample=") + sample, "evaluation.route=interpreter"}));
    return force_plot(scene, simulate(scene)).panels.at(0).title;
  };
  EXPECT_EQ(title("0.01"), "forces at points, upwards, at samples 10.0 ms apart");
  EXPECT_EQ(title("1e-3"), "forces at points, upwards");
}

// Rounding of a box that only slides filled the panels of its orientation.
TEST(JointPanels, RoundingIsFlat) {
  const auto robot = dynamics::read_urdf_text(
      "<robot name='r'><link name='base'/><joint name='hinge' type='revolute'><parent link='base'/>"
      "<child link='door'/><limit lower='-1' upper='1' effort='1' velocity='1'/></joint><link name='door'>"
      "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' "
      "iyz='0'/></inertial></link>"
      "</robot>",
      "hinge", {});
  for (const double size : {1e-13, 1e-6}) {
    const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(20, 0, 1);
    io::Plot plot;
    add_positions(plot, robot.model, t, {size * (5 * t.transpose().array()).sin().matrix(), {}, {}, {}});
    double largest = 0;
    for (const double y : plot.panels.at(0).series.at(0).y) largest = std::max(largest, std::abs(y));
    EXPECT_NEAR(largest, size > 1e-9 ? size : 0, 0.1 * size);
  }
}

// Labels of a sweep of one value.
std::pair<std::string, std::string> axes_of(const MadeScene& made, const std::string& varied,
                                            const std::string& shown) {
  const SceneSweep sweep = made.sweep("samples 2\n" + block("vary", value(varied + "\nfrom 0.1\nto 1")) +
                                      "plot \"" + shown + "\"\nevaluation\n{\nroute interpreter\n}\n");
  const io::Plot plot = sweep_plot(sweep, table_of(sweep, computed(sweep, 0, 2)));
  return {plot.panels.at(0).x_label, plot.panels.at(0).y_label};
}

TEST(SweepAxes, SayTheirUnits) {
  const MadeScene cart("robot\n{\nurdf \"" + kSource +
                       "/config/robots/cart_pole.urdf\"\n}\neffects\n{\njoint_damping 0.1\n}\nactuated "
                       "\"slider pivot\"\nsimulation\n{\nduration 0.01\n}\n");
  using Axes = std::pair<std::string, std::string>;
  EXPECT_EQ(axes_of(cart, "parameter start.q\njoint slider", "v.pivot"),
            Axes("start.q.slider [m]", "v.pivot [rad/s]"));
  EXPECT_EQ(axes_of(cart, "parameter start.v", "most.v").first, "start.v [rad/s or m/s]");
  EXPECT_NE(axes_of(cart, "parameter start.v", "most.v").second.find("rad/s or m/s]"), std::string::npos);
  EXPECT_EQ(axes_of(cart, "parameter commands.torque\njoint slider", "q.slider").first,
            "commands.torque.slider [N]");
  EXPECT_EQ(axes_of(cart, "parameter commands.torque\njoint pivot", "q.slider").first,
            "commands.torque.pivot [N m]");
  EXPECT_EQ(axes_of(cart, "parameter effects.joint_damping\njoint slider", "q.slider").first,
            "effects.joint_damping.coefficient.slider [N s/m]");
  EXPECT_EQ(
      axes_of(cart, "parameter effects.joint_damping\njoint pivot\ndistribution log-uniform", "q.slider")
          .first,
      "effects.joint_damping.coefficient.pivot [N m s/rad]");
  EXPECT_EQ(axes_of(cart, "parameter effects.joint_damping", "q.slider").first,
            "effects.joint_damping.coefficient [N s/m or N m s/rad]");
  EXPECT_EQ(axes_of(cart, "parameter robot.mass:pole\nname mass", "q.slider").first, "mass [kg]");
  EXPECT_EQ(axes_of(cart, "parameter robot.comx:pole", "q.slider").first, "robot.comx:pole [m]");
}

}  // namespace
}  // namespace dyntape::joint_panels_test
