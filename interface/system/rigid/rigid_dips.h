// SPDX-License-Identifier: BSD-3-Clause
//
// The minimum of a gap within a step, by the cubic through gaps and rates at both ends.
//
//   const GapCurve curve(gap, rate, later_gap, later_rate, h);
//   if (const auto low = curve.lowest()) ... low->at, low->gap      // the minimum inside the step, if any
//   curve.middle()                                                  // at h / 2
//
// The difference of the cubic and the motion's own middle is the accuracy of the gap within a step: h^4 for smooth
// motions.
#pragma once

#include <optional>

namespace dyntape {

class GapCurve {
 public:
  GapCurve(double gap, double rate, double later_gap, double later_rate, double h);

  struct Low {
    double at;  // s after the beginning, within (0, h)
    double gap;
  };
  std::optional<Low> lowest() const;
  double middle() const { return at(0.5); }

 private:
  double at(double s) const { return gap_ + s * (slope_ + s * (b_ + s * c_)); }

  double gap_, slope_, b_, c_, h_;  // gap + slope s + b s^2 + c s^3, s from 0 to 1
};

}  // namespace dyntape
