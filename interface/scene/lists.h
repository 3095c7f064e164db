// SPDX-License-Identifier: BSD-3-Clause
//
// Lists of numbers and of names in .info files.
//
//   const Eigen::Vector3d wind = read_vector3(block, "velocity", Eigen::Vector3d::Zero());    // "1 0 0" or { x 1  y 0  z 0 }
//
// What is no number, out of range, or too many is noted in the section (Section::finish reports it).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <dyntape/interface/io/section.h>

namespace dyntape {

// "0 3.14", or one number for all n where `spreads`.  `has` ends the sentence of a wrong count: "the robot has 2 joints".
Eigen::VectorXd numbers_in(io::Section& section, const std::string& key, const std::string& text,
                           Eigen::Index n, const io::Range& range, const std::string& has, bool spreads);

// Missing without fallback is a problem.
Eigen::Vector3d read_vector3(io::Section& section, const std::string& key,
                             const std::optional<Eigen::Vector3d>& fallback, const io::Range& range = {});

// A list in which no name stands twice.
std::vector<std::string> distinct_names(io::Section& section, const std::string& key,
                                        const std::vector<std::string>& valid = {});

}  // namespace dyntape
