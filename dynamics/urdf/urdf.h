// SPDX-License-Identifier: BSD-3-Clause
//
// Robots from URDF files.
//
//   Model<double> arm = load_urdf("panda.urdf", {.lock = {"panda_finger_joint1", "panda_finger_joint2"}});
//   UrdfRobot dog = read_urdf("solo12.urdf", {.base = Base::kFloating});
//   for (const std::string& note : dog.notes) std::cout << note << "\n";   // what a careful reader would say
//
// urdfdom reads the file; joints are numbered as Pinocchio numbers them (model.h), so that q, v, a and tau
// are interchangeable.  Fixed joints vanish: their bodies are merged and every link stays as a frame.
//   fixed base     the root link is the world; its inertia has no effect and is dropped.
//   floating base  joint 0 is a free-flyer "root_joint" that carries the root link.
//   continuous     (cos, sin), as Pinocchio, or a plain angle on request; without position limits.
//   planar         in the plane normal to <axis>; if that is not z, the body frame is turned so that its z
//                  is the axis, and a note says so (Pinocchio takes z whatever the file says).
//   mimic joints   independent joints, as Pinocchio reads them by default; on request their rules are kept
//                  beside the model (mimic.h).
//
// Right angles written with few digits are made exact (urdf/rotation_snap.h).
//
// Errors: FileError, `file:line: sentence`, for everything that urdf/check.h lists, for what urdfdom
// complains about and for a file that cannot be opened; ArgumentError, with the nearest name, for an option
// that does not fit the file.  Nothing is printed.  Independent of the locale.  Threads may read at the same
// time.
//
// Units: kg, m, rad, s.
#pragma once

#include <string>
#include <vector>

#include <dyntape/dynamics/model/mimic_rules.h>
#include <dyntape/dynamics/model/model.h>

namespace dyntape::dynamics {

enum class ContinuousJoint { kCosSin, kAngle };

struct UrdfOptions {
  Base base = Base::kFixed;
  // Joints held at zero (continuous: the angle 0); their bodies are merged into the body before them.
  std::vector<std::string> lock = {};
  // Rotations and axes within this angle (rad) of a right angle become exact; 0 reads literally, at most
  // 0.01.
  double snap = 1e-8;
  ContinuousJoint continuous = ContinuousJoint::kCosSin;
  // The link that is fixed to the world, or floats; empty for the root link of the file (change_base).
  std::string root = {};
  // Reads an inertia that no body has (a principal moment below zero) with a note, not an error.
  bool accept_nonphysical_inertia = false;
  // Keeps what <mimic> says in UrdfRobot::mimics; without, such joints are independent.
  bool mimic = false;
};

// A robot, and what is odd or was corrected in its file: `file:line: sentence`, in no order that matters.
struct UrdfRobot {
  Model<double> model;            // every joint, followers too
  std::vector<MimicRule> mimics;  // for MimicModel; empty unless asked for
  std::vector<std::string> notes;
  std::vector<std::string> left_out = {};  // elements that nothing reads, by kind: `<collision> of 8 links`
};

UrdfRobot read_urdf(const std::string& path, const UrdfOptions& options = {});

// The same from text in memory; `file` stands for the name in messages.
UrdfRobot read_urdf_text(const std::string& text, const std::string& file, const UrdfOptions& options = {});

// For those who do not care for notes.
Model<double> load_urdf(const std::string& path, const UrdfOptions& options = {});
Model<double> load_urdf_text(const std::string& text, const std::string& file,
                             const UrdfOptions& options = {});

}  // namespace dyntape::dynamics
