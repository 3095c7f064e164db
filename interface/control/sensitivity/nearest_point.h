// SPDX-License-Identifier: BSD-3-Clause
//
// Returns the point of a polyhedron that is nearest to a given one, or proves that the polyhedron is empty.
//
//   minimise  1/2 |z - z0|^2   subject to  B z <= d
//
//   const NearestPoint p = nearest_point(z0, B, d, off);   // off: by how much each d may be rounded
//   p.z, p.multipliers          // z - z0 + B^T multipliers = 0, multipliers >= 0
//   p.held                      // independent rows that hold at equality; every positive multiplier is of one of them
//   if (p.is_empty) p.ray       // >= 0, B^T ray = 0, d.ray < 0: so weighed, the rows add up to 0 < 0 (Farkas' lemma)
//
// A strictly convex program 1/2 w.H w + f.w is of this form: w = L^-T z with H = L L^T and z0 = -L^-1 f.  Small and dense: a step
// takes n^2 operations.  Equal rows and rows that other rows imply are allowed.
//
// Source: D. Goldfarb, A. Idnani, A numerically stable dual method for solving strictly convex quadratic programs,
// Mathematical Programming 27, 1983.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace dyntape {

struct NearestPoint {
  bool is_found = false, is_empty = false;  // neither: the method did not end
  Eigen::VectorXd z, multipliers, ray;
  std::vector<Eigen::Index> held;
};

NearestPoint nearest_point(const Eigen::VectorXd& z0, const Eigen::MatrixXd& B, const Eigen::VectorXd& d,
                           const Eigen::VectorXd& off);

}  // namespace dyntape
