// SPDX-License-Identifier: BSD-3-Clause
//
// The layout of a picture and the ranges of its axes (private to the pictures).
#pragma once

#include <vector>

#include <dyntape/interface/report/plot/gnuplot_text.h>
#include <dyntape/interface/report/plot/picture.h>

namespace dyntape::io {

inline constexpr double kTextSize = 13, kSmallSize = 11.5, kTitleSize = 17;
inline constexpr double kLeft = 91, kRight = 26, kBottom = 58, kTop = 14;  // around the frame of a panel [px]
inline constexpr double kHeadRow = 24, kTitleRow = 40;
inline constexpr double kSample = 26;  // the line in the legend [px]

// A row of a legend: its series, and the start of each [px].
struct LegendEntry {
  size_t panel, series;
  double x;
};
using LegendRow = std::vector<LegendEntry>;

// The layout of a panel.
struct Place {
  Box frame;
  double head;                    // position of the title [px]; the legend follows
  std::vector<LegendRow> legend;  // empty if the picture has one legend for all
};

struct Layout {
  std::vector<Place> places;  // one entry per panel
  double legend_top = 0;      // of the legend of all panels [px]
  std::vector<LegendRow> legend;
  double height = 0;  // of the picture [px]
};

// Row by row of the grid.
Layout arrange(const Plot& plot);

// A text limited to this width [px]; the middle of longer ones is replaced.
std::string shortened(const std::string& text, double size, double width);

// Zeros are drawn where the panel wants them.
double drawn_y(const Panel& panel, double y);

// Whether the axes of the panel can show the point.
bool drawable(const Panel& panel, double x, double y);

// The part of the plane to show in the frame; an end that is NaN is left to gnuplot.
void choose_limits(const Panel& panel, const Box& frame, Limits& x, Limits& y);

// The distance between numbers along the axis, or of a logarithmic one the factor, at which they do not run into each
// other.
double tick_step(const Panel& panel, const Box& frame, const Limits& x);

}  // namespace dyntape::io
