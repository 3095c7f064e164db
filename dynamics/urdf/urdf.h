// SPDX-License-Identifier: BSD-3-Clause
//
// Reads robots from URDF files.
//
//   Model<double> arm = load_urdf("panda.urdf", {.lock = {"panda_finger_joint1", "panda_finger_joint2"}});
//   UrdfRobot dog = read_urdf("solo12.urdf", {.base = Base::kFloating});
//   for (const std::string& note : dog.notes) std::cout << note << "\n";   // remarks and corrections
//
// urdfdom parses the file.  Joints are numbered as in Pinocchio (model.h), so that q, v, a and tau are
// interchangeable.  Fixed joints vanish: their bodies are merged, and every link stays as a frame.
//   fixed base     the root link is the world; its inertia has no effect and is dropped.
//   floating base  joint 0 is a free-flyer "root_joint" that carries the root link.
//   continuous     (cos, sin), as in Pinocchio, or a plain angle on request; without position limits.
//   planar         in the plane normal to <axis>.  If the axis is not z, the body frame is turned so that its z is
//                  the axis, and a note says so (Pinocchio always takes z).
//   mimic joints   independent joints, as in Pinocchio's default; on request UrdfRobot::mimics has their rules
//                  (mimic.h).
//
// Right angles written with few digits are made exact (urdf/rotation_snap.h).  Units: kg, m, rad, s.
//
// Errors:
//
// - FileError, `file:line: sentence`: all problems listed in urdf/check.h, errors of urdfdom, a file that cannot be
// opened.
// - ArgumentError, with the nearest name: an option that does not fit the file.
//
// Nothing is printed.  The result does not depend on the locale.  Several threads may read at the same time.
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/model/mimic_rules.h>
#include <dyntape/dynamics/model/model.h>

namespace dyntape::dynamics {

enum class ContinuousJoint { kCosSin, kAngle };

struct UrdfOptions {
  Base base = Base::kFixed;
  // Joints fixed at zero (continuous: the angle 0).  Their bodies are merged into the body before them.
  std::vector<std::string> lock = {};
  // Rotations and axes within this angle (rad, at most 0.01) of a right angle become exact; 0 disables this.
  double snap = 1e-8;
  ContinuousJoint continuous = ContinuousJoint::kCosSin;
  // The link that is the fixed or floating base (change_base).  Empty: the root link of the file.
  std::string root = {};
  // If true, an inertia that no body can have (a principal moment below zero) gives a note instead of an error.
  bool accept_nonphysical_inertia = false;
  // If true, UrdfRobot::mimics has the rules of <mimic> elements.  If false, such joints are independent.
  bool mimic = false;
};

// A robot, and notes on oddities and corrections: `file:line: sentence`, in any order.
struct UrdfRobot {
  Model<double> model;            // all joints, including mimic joints
  std::vector<MimicRule> mimics;  // for MimicModel; empty unless UrdfOptions::mimic
  std::vector<std::string> notes;
  std::vector<std::string> left_out = {};  // ignored elements by kind: `<collision> of 8 links`
};

UrdfRobot read_urdf(const std::string& path, const UrdfOptions& options = {});

// Reads from text in memory; messages use `file` as the name.
UrdfRobot read_urdf_text(const std::string& text, const std::string& file, const UrdfOptions& options = {});

// Returns the model only, without notes.
Model<double> load_urdf(const std::string& path, const UrdfOptions& options = {});
Model<double> load_urdf_text(const std::string& text, const std::string& file,
                             const UrdfOptions& options = {});

}  // namespace dyntape::dynamics
