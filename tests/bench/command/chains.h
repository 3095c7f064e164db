// SPDX-License-Identifier: BSD-3-Clause
//
// Robots of any size, for studies of how cost grows, and the exponent with which it does.
//
//   fitted_slope({8, 16, 32}, {1, 2, 4}, 8) == 1
#pragma once

#include <vector>

#include <dyntape/dynamics/model/model.h>

namespace dyntape::tools {

// Bodies of 1 kg, each 0.3 m beyond its parent, on revolute joints about x, y and z in turn: one after the other,
// or as a binary tree with each branch in one piece.
dynamics::Model<double> chain(int bodies);
dynamics::Model<double> binary_tree(int bodies);

// Slope of log y over log x by least squares, over the points with x >= first.
double fitted_slope(const std::vector<double>& x, const std::vector<double>& y, double first);

}  // namespace dyntape::tools
