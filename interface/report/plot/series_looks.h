// SPDX-License-Identifier: BSD-3-Clause
//
// Which colour, dashes and points each series of a plot has (private to the pictures).
//
// In one plot a look belongs to one name, however many there are: where colours come round again, dashes and shapes change, then
// colours get darker.  Series of one name in several panels look alike.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/report/plot/picture.h>

namespace dyntape::io {

struct Look {
  std::string color, dash;  // "#0072b2", of gnuplot's dt
  int point;                // of gnuplot's pt
};

// One entry a panel, of one entry a series.
std::vector<std::vector<Look>> looks_of(const Plot& plot);

}  // namespace dyntape::io
