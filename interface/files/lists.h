// SPDX-License-Identifier: BSD-3-Clause
//
// Reads lists of numbers and of names in .info files.
//
//   const Eigen::Vector3d wind = read_vector3(block, "velocity", Eigen::Vector3d::Zero());    // "1 0 0" or { x 1  y 0  z 0 }
//
// Notes in the section: values that are no numbers, out of range, or too many (Section::finish reports them).
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <dyntape/interface/files/info/section.h>

namespace dyntape {

// Ranges of values in files.  A larger value is a typing error, on which a solver would fail later with another
// message.
io::Range seconds();        // above 0, up to 1e7 (16 weeks)
io::Range some_seconds();   // the same with 0
io::Range metres();         // -1e6 to 1e6
io::Range some_metres();    // 0 to 1e6
io::Range coefficients();   // of friction: above 0, up to 1e3
io::Range plain_numbers();  // -1e12 to 1e12

// "0 3.14", or with `spreads` one number for all n.  `has` ends the message of a wrong count: "the robot has 2
// joints".
Eigen::VectorXd numbers_in(io::Section& section, const std::string& key, const std::string& text,
                           Eigen::Index n, const io::Range& range, const std::string& has, bool spreads);

// A missing list without fallback is a problem of the file.
Eigen::Vector3d read_vector3(io::Section& section, const std::string& key,
                             const std::optional<Eigen::Vector3d>& fallback,
                             const io::Range& range = plain_numbers());

// A list of different names.
std::vector<std::string> distinct_names(io::Section& section, const std::string& key,
                                        const std::vector<std::string>& valid = {});

template <class List, class Value>
bool contains(const List& list, const Value& value) {
  return std::find(list.begin(), list.end(), value) != list.end();
}

}  // namespace dyntape
