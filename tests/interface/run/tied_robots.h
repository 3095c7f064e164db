// SPDX-License-Identifier: BSD-3-Clause
//
// Small robots with mimic joints whose motion is known in closed form, for tests.
#pragma once

#include <cmath>
#include <string>

#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/files/scene/scene_of_robot.h>

namespace dyntape::test {

// A slider "a" along z of 0.3 kg, and "b" of 0.2 kg, with b = ratio a + offset.
struct Sliders {
  double ratio = -2, offset = 0.01, m_a = 0.3, m_b = 0.2;
  std::string limit_a = "", limit_b = "";

  double mass() const { return m_a + ratio * ratio * m_b; }  // G^T M G
  std::string urdf() const {
    const auto slider = [](const std::string& name, double mass, const std::string& inside) {
      return "<joint name='" + name + "' type='prismatic'><parent link='base'/><child link='" + name +
             "_link'/><origin xyz='0.2 0 0'/><axis xyz='0 0 1'/>" + inside + "</joint><link name='" + name +
             "_link'><inertial><mass value='" + std::to_string(mass) +
             "'/><inertia ixx='0.001' iyy='0.001' izz='0.001' ixy='0' ixz='0' iyz='0'/></inertial></link>";
    };
    const auto limit = [](const std::string& range) {
      return "<limit effort='20' velocity='50' " + (range.empty() ? "lower='-100' upper='100'" : range) +
             "/>";
    };
    return "<robot name='sliders'><link name='base'/>" + slider("a", m_a, limit(limit_a)) +
           slider("b", m_b,
                  limit(limit_b) + "<mimic joint='a' multiplier='" + std::to_string(ratio) + "' offset='" +
                      std::to_string(offset) + "'/>") +
           "</robot>";
  }
};

// Two pendulums of the same world axis y: rods without mass to points; the second at ratio a + offset.
struct Pendulums {
  double ratio = 1.5, offset = 0.4, m_a = 0.7, m_b = 0.4, l_a = 0.5, l_b = 0.3;

  double inertia() const { return m_a * l_a * l_a + ratio * ratio * m_b * l_b * l_b; }
  double torque(double a) const {  // of gravity, at the leader
    return -9.81 * (m_a * l_a * std::sin(a) + ratio * m_b * l_b * std::sin(ratio * a + offset));
  }
  double energy(double a, double w) const {
    return inertia() * w * w / 2 -
           9.81 * (m_a * l_a * std::cos(a) + m_b * l_b * std::cos(ratio * a + offset));
  }
  std::string urdf() const {
    const auto rod = [](const std::string& name, double mass, double length, const std::string& inside) {
      return "<joint name='" + name + "' type='revolute'><parent link='base'/><child link='" + name +
             "_link'/><axis xyz='0 1 0'/><limit effort='20' velocity='90' lower='-50' upper='50'/>" + inside +
             "</joint><link name='" + name + "_link'><inertial><origin xyz='0 0 " + std::to_string(-length) +
             "'/><mass value='" + std::to_string(mass) +
             "'/><inertia ixx='0' iyy='0' izz='0' ixy='0' ixz='0' iyz='0'/></inertial></link>";
    };
    return "<robot name='pendulums'><link name='base'/>" + rod("a", m_a, l_a, "") +
           rod("b", m_b, l_b,
               "<mimic joint='a' multiplier='" + std::to_string(ratio) + "' offset='" +
                   std::to_string(offset) + "'/>") +
           "</robot>";
  }
};

// A crank "a", whose rod "c" is held by the slider "d" along x with a loop of "rod_end" and "d_link"; "b", a pendulum beside
// the crank, turns at -2 a.
inline std::string crank_with_follower() {
  const auto body = [](const std::string& name, double mass, const std::string& at) {
    return "<link name='" + name + "'><inertial><origin xyz='" + at + "'/><mass value='" +
           std::to_string(mass) +
           "'/><inertia ixx='0.001' iyy='0.002' izz='0.001' ixy='0' ixz='0' iyz='0'/></inertial></link>";
  };
  const auto turns = [](const std::string& name, const std::string& parent, const std::string& at,
                        const std::string& inside) {
    return "<joint name='" + name + "' type='revolute'><parent link='" + parent + "'/><child link='" + name +
           "_link'/><origin xyz='" + at +
           "'/><axis xyz='0 1 0'/><limit effort='20' velocity='90' lower='-50' upper='50'/>" + inside +
           "</joint>";
  };
  return "<robot name='crank'><link name='base'/>" + turns("a", "base", "0 0 0", "") +
         body("a_link", 0.5, "0.1 0 0") + turns("c", "a_link", "0.2 0 0", "") +
         body("c_link", 0.3, "0.25 0 0") +
         "<joint name='end' type='fixed'><parent link='c_link'/><child link='rod_end'/><origin xyz='0.5 0 "
         "0'/>"
         "</joint><link name='rod_end'/><joint name='d' type='prismatic'><parent link='base'/><child "
         "link='d_link'/><axis xyz='1 0 0'/><limit effort='20' velocity='90' lower='-5' upper='5'/></joint>" +
         body("d_link", 0.4, "0 0 0") +
         turns("b", "base", "0 0.3 0", "<mimic joint='a' multiplier='-2' offset='0.3'/>") +
         body("b_link", 0.2, "0.15 0 0") + "</robot>";
}

inline GivenRobot tied_robot(const std::string& urdf) {
  dynamics::UrdfOptions options;
  options.mimic = true, options.continuous = dynamics::ContinuousJoint::kAngle;
  return {dynamics::read_urdf_text(urdf, "tied", options), {}};
}

// Nothing is compiled.
inline Scene tied_scene(const std::string& urdf, const std::string& text) {
  return read_scene_text(tied_robot(urdf), text + "\nevaluation { route interpreter }", "tied.info");
}

}  // namespace dyntape::test
