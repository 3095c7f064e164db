// SPDX-License-Identifier: BSD-3-Clause
//
// Vectors over the joints of a robot in .info files.
//
//   q { slider 0  pivot 3.14 }      by name, every joint
//   q { [0] 0  [1] 3.14 }           by index, as OCS2 writes vectors
//   q "0 3.14"                      in order
//   q 0                             one number for all
//
//   const Eigen::VectorXd q = read_joint_values(section, "q", model, 0.0);    // fallback: where q is absent
//
// What is missing, no number, out of range or too many is noted in the section (Section::finish reports it).
// For robots whose joints have one degree of freedom each.
#pragma once

#include <optional>

#include <dyntape/dynamics/model/model.h>
#include <dyntape/interface/io/section.h>

namespace dyntape {

Eigen::VectorXd read_joint_values(io::Section& section, const std::string& key,
                                  const dynamics::Model<double>& model, std::optional<double> fallback,
                                  const io::Range& range = {});

std::vector<std::string> joint_names(const dynamics::Model<double>& model);

}  // namespace dyntape
