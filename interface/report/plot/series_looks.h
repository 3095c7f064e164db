// SPDX-License-Identifier: BSD-3-Clause
//
// Chooses colour, dashes and points of each series of a plot (private to the pictures).
//
// Series in one panel differ, as do all series of a plot with one legend.  A name has the same style in all panels.
// When colours repeat, dashes and points change, then colours get darker.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/report/plot/picture.h>

namespace dyntape::io {

struct Look {
  std::string color, dash;  // "#0072b2", of gnuplot's dt
  int point;                // of gnuplot's pt
};

// One entry per panel, with one entry per series.
std::vector<std::vector<Look>> looks_of(const Plot& plot);

}  // namespace dyntape::io
