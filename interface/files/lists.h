// SPDX-License-Identifier: BSD-3-Clause
//
// Lists of numbers and of names in .info files.
//
//   const Eigen::Vector3d wind = read_vector3(block, "velocity", Eigen::Vector3d::Zero());    // "1 0 0" or { x 1  y 0  z 0 }
//
// What is no number, out of range, or too many is noted in the section (Section::finish reports it).
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <dyntape/interface/files/info/section.h>

namespace dyntape {

// What is larger in a file is a slip of the pen, on which solvers would fail late and say something else.
io::Range seconds();        // above 0 and up to 1e7, 16 weeks
io::Range some_seconds();   // 0 as well
io::Range metres();         // up to 1e6 either way
io::Range some_metres();    // up to 1e6, 0 or more
io::Range coefficients();   // of friction, above 0 and up to 1e3
io::Range plain_numbers();  // up to 1e12 either way

// "0 3.14", or one number for all n where `spreads`.  `has` ends the sentence of a wrong count: "the robot has 2 joints".
Eigen::VectorXd numbers_in(io::Section& section, const std::string& key, const std::string& text,
                           Eigen::Index n, const io::Range& range, const std::string& has, bool spreads);

// Missing without fallback is a problem.
Eigen::Vector3d read_vector3(io::Section& section, const std::string& key,
                             const std::optional<Eigen::Vector3d>& fallback,
                             const io::Range& range = plain_numbers());

// A list in which no name stands twice.
std::vector<std::string> distinct_names(io::Section& section, const std::string& key,
                                        const std::vector<std::string>& valid = {});

template <class List, class Value>
bool contains(const List& list, const Value& value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

}  // namespace dyntape
