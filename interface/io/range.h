// SPDX-License-Identifier: BSD-3-Clause
//
// Ranges of valid numbers, for readers and their messages.
//
//   positive().fault(-1)           // "must be positive"
//   between(0, 12).fault(3)        // ""
#pragma once

#include <limits>
#include <string>

namespace dyntape::io {

struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false, high_open = false;  // true: the bound is excluded
  bool infinite = false;                     // true: "inf" and "-inf" are valid
  std::string text = {};                     // "positive": the text for messages

  bool holds(double value) const {
    return (low_open ? value > low : value >= low) && (high_open ? value < high : value <= high);
  }
  std::string fault(double value) const;  // why a value is refused; "": it is valid.  NaN is not
};
Range positive();
Range not_negative();
Range at_least(double low);
Range between(double low, double high);  // both included
Range or_infinite(Range range);

}  // namespace dyntape::io
