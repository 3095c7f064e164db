// SPDX-License-Identifier: BSD-3-Clause
//
// Transcription schemes as small tables.
//
// An interval of length h carries points at the fractions c of it; its first and last point are shared with
// its neighbours.  With x_i, f_i, L_i the state, its rate and the running cost at point i,
//   defects   sum_i alpha(r, i) x_i + h sum_i beta(r, i) f_i = 0       one row of n_x equations for each r
//   cost      h sum_i gamma_i L_i
//
//   euler            x1 - x0 - h f0 = 0                                            cost h L0
//   trapezoid        x1 - x0 - h/2 (f0 + f1) = 0                                   cost h/2 (L0 + L1)
//   hermite-simpson  xm - (x0 + x1)/2 - h/8 (f0 - f1) = 0,
//                    x1 - x0 - h/6 (f0 + 4 fm + f1) = 0                            cost h/6 (L0 + 4 Lm + L1)
//
// Hermite-Simpson is written in its separated form, midpoint state and control being variables: the Jacobian
// of the program is then made of blocks h beta J_f + alpha I and the Hessian of its Lagrangian is
// block-diagonal, one block a point.  M. Kelly, "An introduction to trajectory optimization", SIAM Review
// 59(4), 2017.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include <dyntape/autodiff/eigen_layout.h>

namespace dyntape {

struct Scheme {
  std::string name;
  Eigen::VectorXd c;            // (points)
  Eigen::MatrixXd alpha, beta;  // (rows x points)
  Eigen::VectorXd gamma;        // (points)
  int order;                    // of the error of the state at the nodes

  int points() const { return static_cast<int>(c.size()); }
  int rows() const { return static_cast<int>(alpha.rows()); }
  // Whether anything depends on the rate or the cost at the last point of an interval.
  bool uses_last_point() const;
  // Weights w (points) with u(c) = sum_i w_i u_i: the polynomial through the points that are used.
  Eigen::VectorXd control_weights(double fraction) const;
};

// All there are: a new one is a row there.
const std::vector<Scheme>& schemes();

Scheme euler();
Scheme trapezoid();
Scheme hermite_simpson();

// By the name above; ArgumentError naming the choices.
Scheme scheme_by_name(const std::string& name);

}  // namespace dyntape
