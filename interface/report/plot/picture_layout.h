// SPDX-License-Identifier: BSD-3-Clause
//
// Where the parts of a picture stand and how far its axes reach (private to the pictures).
#pragma once

#include <vector>

#include <dyntape/interface/report/plot/gnuplot_text.h>
#include <dyntape/interface/report/plot/picture.h>

namespace dyntape::io {

inline constexpr double kTextSize = 13, kSmallSize = 11.5, kTitleSize = 17;
inline constexpr double kLeft = 78, kRight = 26, kBottom = 58, kTop = 14;  // around the frame of a panel [px]
inline constexpr double kHeadRow = 24, kTitleRow = 40;
inline constexpr double kSample = 26;  // the line in the legend [px]

// What stands where: one entry a panel.
struct Place {
  Box frame;
  double head;                              // where the title begins [px]; the legend follows
  std::vector<std::vector<size_t>> legend;  // rows of indices into series
};

// Fills `places`, row by row of the grid; returns the height of the picture.
double arrange(const Plot& plot, std::vector<Place>& places);

// Zeros are drawn where the panel wants them.
double drawn_y(const Panel& panel, double y);

// Whether the axes of the panel can show the point.
bool drawable(const Panel& panel, double x, double y);

// The part of the plane to show in the frame; an end that is NaN is left to gnuplot.
void choose_limits(const Panel& panel, const Box& frame, Limits& x, Limits& y);

}  // namespace dyntape::io
