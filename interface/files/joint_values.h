// SPDX-License-Identifier: BSD-3-Clause
//
// Reads vectors over the joints of a robot in .info files.
//
//   q { slider 0  pivot 3.14 }      by name, every joint
//   q { [0] 0  [1] 3.14 }           by index, as OCS2 writes vectors
//   q "0 3.14"                      in order
//   q 0                             one number for all
//
//   const Eigen::VectorXd d = read_joint_values(section, "damping", &model, {.fallback = 0.0});
//
// Without a fallback every joint needs a value, except those in `open`.  Followers have no value of their own
// (robot_scene.h); the others are in the order without them.
//
// Notes in the section: missing values, values that are no numbers, out of range or too many (Section::finish
// reports them).  Joints of one degree of freedom have one value each, in the order of the model; a floating base
// has none.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <dyntape/dynamics/model/mimic_rules.h>
#include <dyntape/interface/files/info/section.h>

namespace dyntape {

struct JointValues {
  std::optional<double> fallback = {};  // of all joints, if the key is absent; none: it is required
  io::Range range = {};
  std::vector<std::string> open = {};  // joints that may have no value
  std::vector<dynamics::MimicRule> followers = {};
};

// (nv).  Zero for joints with several entries, and for joints in `open` without a value.  Without a robot the key is
// deferred.
Eigen::VectorXd read_joint_values(io::Section& section, const std::string& key,
                                  const dynamics::Model<double>* model, const JointValues& of = {});

// The same entries of a configuration (nq); the other entries are neutral.
Eigen::VectorXd configuration_of(const dynamics::Model<double>& model, const Eigen::VectorXd& joint_values);

// "; in degrees? -46 degrees are -0.802851 rad" for a position outside [lower, upper] that another unit puts within.  Empty
// for others, also for what the unit itself makes sense of: an angle of less than a turn, a way of less than 10 m.
std::string other_unit(const dynamics::Joint<double>& joint, double value, double lower, double upper);

// All joints, or those of one degree of freedom.
std::vector<std::string> joint_names(const dynamics::Model<double>& model);
std::vector<std::string> single_joint_names(const dynamics::Model<double>& model);
std::vector<int> single_dofs(const dynamics::Model<double>& model);  // their indices in v

}  // namespace dyntape
