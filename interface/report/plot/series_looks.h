// SPDX-License-Identifier: BSD-3-Clause
//
// Chooses colour, dashes and points of each series of a plot (private to the pictures).
//
// In a plot each name has its own style.  When colours repeat, dashes and points change, then colours get darker.
// Series of one name in several panels have the same style.
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
