// SPDX-License-Identifier: BSD-3-Clause
//
// Questions to a Section (section.h), and the ranges of valid answers.
#pragma once

#include <limits>
#include <string>

namespace dyntape::io {

// The range of valid numbers for a key.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false, high_open = false;  // true: the bound is excluded
  bool infinite = false;                     // true: "inf" and "-inf" are valid
  std::string text = {};                     // "positive": the text for messages

  bool holds(double value) const {
    return (low_open ? value > low : value >= low) && (high_open ? value < high : value <= high);
  }
};
Range positive();
Range not_negative();
Range at_least(double low);
Range between(double low, double high);  // both included
Range or_infinite(Range range);

// A question that was asked, for lists of keys.
struct Question {
  std::string path;      // "solver.tolerance"
  std::string takes;     // "a number, positive", "euler | trapezoid"; "a block"
  std::string fallback;  // value of an absent key
  bool is_required = false;
  std::string meaning;
};

}  // namespace dyntape::io
