// SPDX-License-Identifier: BSD-3-Clause
//
// What a Section (section.h) is asked, and which answers make sense.
#pragma once

#include <limits>
#include <string>

namespace dyntape::io {

// The numbers that make sense for a key.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false, high_open = false;  // whether the bound itself is excluded
  bool infinite = false;                     // whether "inf" and "-inf" may be written
  std::string text = {};                     // "positive": how messages put it

  bool holds(double value) const {
    return (low_open ? value > low : value >= low) && (high_open ? value < high : value <= high);
  }
};
Range positive();
Range not_negative();
Range at_least(double low);
Range between(double low, double high);  // both included
Range or_infinite(Range range);

// A question that was asked, for those who write files.
struct Question {
  std::string path;      // "solver.tolerance"
  std::string takes;     // "a number, positive", "euler | trapezoid"; "a block"
  std::string fallback;  // what an absent key stands for
  bool is_required = false;
  std::string meaning;
};

}  // namespace dyntape::io
