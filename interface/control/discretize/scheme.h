// SPDX-License-Identifier: BSD-3-Clause
//
// Transcription schemes as small tables.
//
// An interval of length h carries points at the fractions c of it; its first and last point are shared with
// its neighbours.  With x_i, f_i, L_i the state, its rate and the running cost at point i,
//   defects   sum_i alpha(r, i) x_i + h sum_i beta(r, i) f_i = 0       one row of n_x equations for each r
//   cost      h sum_i gamma_i L_i
//   controls  sum_i held(r, i) u_i = 0                                 one row of n_u equations for each r, mostly none
//
//   euler            x1 - x0 - h f0 = 0                                            cost h L0
//   trapezoid        x1 - x0 - h/2 (f0 + f1) = 0                                   cost h/2 (L0 + L1)
//   hermite-simpson  xm - (x0 + x1)/2 - h/8 (f0 - f1) = 0,
//                    x1 - x0 - h/6 (f0 + 4 fm + f1) = 0                            cost h/6 (L0 + 4 Lm + L1)
//   hermite-simpson-linear   the same, and um - (u0 + u1)/2 = 0: controls are straight lines
//   runge-kutta-4            euler with f and L of a step with the control held, x1 - Phi(x0, u0) = 0: multiple shooting
//   semi-implicit-euler      (multiple_shooting.h); limits and path rows hold at the nodes
//
// Hermite-Simpson is written in its separated form, midpoint state and control being variables: the Jacobian
// of the program is then made of blocks h beta J_f + alpha I and the Hessian of its Lagrangian is
// block-diagonal, one block a point.  M. Kelly, "An introduction to trajectory optimization", SIAM Review
// 59(4), 2017.
//
// Families of any number of points, alike from one long interval to many short ones (P_n: Legendre's polynomials):
//
//   lobatto-s         s >= 2 points, both ends and the roots of P'_{s-1}; s - 1 rows x_i - x_0 - h sum_j a_ij f_j, a_ij the
//                     integral of point j's Lagrange polynomial up to c_i (Lobatto IIIA): the polynomial through the states
//                     has the rate f at every point.  Order 2 s - 2.  lobatto-2 is the trapezoid, lobatto-3 Hermite-Simpson
//   radau-s           s >= 1 collocated points behind the first, the roots of P_s - P_{s-1}, the end among them; s rows as
//                     before (Radau IIA).  Order 2 s - 1, and what decays fast decays in long steps too.  radau-1 is the
//                     implicit Euler scheme.  A node's control is that of the interval before it, so controls may jump there;
//                     from a node to the first collocated point the polynomial is extrapolated, beyond limits too
//   pseudospectral-s  s >= 3 points of lobatto-s and s rows: the polynomial of degree s - 1 through the states has the rate f
//                     at every point, D x = h f with D its derivative, here times the weights of the quadrature.  "LGL(N)" of
//                     one interval is pseudospectral-(N + 1)
//   runge-kutta-4xN   N such steps an interval, the control held over all of them
//
// Of the same points pseudospectral-s has one row of n_x equations more than lobatto-s: there the states' polynomial is of
// degree s, here of s - 1, so that the f_i have to lie on a polynomial of degree s - 2.  Its motions are motions of lobatto-s
// with fewer controls: of q' = v, v' = u with u of degree s - 3 through s points, which is two conditions on the controls of
// each interval; of n_u controls there have to be at least n_x / (s - 1).  Optima lie above those of lobatto-s: on one interval
// of 16 points the swing-up of a cart-pole costs 127.1, by lobatto-16 46.0, in truth 58.8.
//
// It is for one interval, and more are refused.  D is singular: in one combination of an interval's rows all states cancel, and
// what is left of them are rates, times h.  So on short intervals rows all but depend on each other: the least singular value of
// the swing-up's Jacobian is 8e-5 of the largest on one interval of 16 points, 3e-7 on four, 1e-9 on sixteen (of lobatto-16 1e-3
// on each), and with few points there are more rows than variables.
// F. Fahroo, I. M. Ross, "Costate estimation by a Legendre pseudospectral method", J. Guidance, Control, and Dynamics 24(2), 2001;
// E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.5; D. Garg et al., "A unified framework for the numerical
// solution of optimal control problems using pseudospectral methods", Automatica 46(11), 2010.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/autodiff/eigen_layout.h>
#include <dyntape/interface/control/problem/multiple_shooting.h>

namespace dyntape {

struct Scheme {
  std::string name;
  Eigen::VectorXd c;            // (points)
  Eigen::MatrixXd alpha, beta;  // (rows x points)
  Eigen::VectorXd gamma;        // (points)
  int order;                    // of the error of the state at the nodes
  Eigen::MatrixXd held = {};    // (rows x points), or empty
  // Multiple shooting: f and L are those of so many steps an interval.
  std::optional<ShootingScheme> step = {};
  int steps = 1;
  bool spans_all = false;  // its rows are of one interval alone

  int points() const { return static_cast<int>(c.size()); }
  int rows() const { return static_cast<int>(alpha.rows()); }
  // Whether anything depends on the rate or the cost at the first, or at the last, point of an interval.
  bool uses_first_point() const { return uses(0); }
  bool uses_last_point() const { return uses(points() - 1); }
  // Weights w (points) with u(c) = sum_i w_i u_i: the polynomial through the points that are used.
  Eigen::VectorXd control_weights(double fraction) const;
  // Why a mesh of so many intervals is refused, in one sentence; empty: it is not.
  std::string fault_on(int intervals) const;
  // The problem whose rate and costs the rows are of; `length` of the intervals.
  Problem taken_by(const Problem& problem, const IntervalLength& length) const;

 private:
  bool uses(int point) const { return !beta.col(point).isZero(0) || gamma[point] != 0; }
};

// Those that are no family's: a new one is a row there.
const std::vector<Scheme>& schemes();

Scheme euler();
Scheme trapezoid();
Scheme hermite_simpson();

// The families.  ArgumentError for fewer points, or steps, than there have to be, and for more than 128.
Scheme lobatto(int points);
Scheme radau(int collocated);
Scheme pseudospectral(int points);
Scheme runge_kutta_4(int steps);

// By the name above, "lobatto-5"; ArgumentError naming the choices.
Scheme scheme_by_name(const std::string& name);
std::vector<std::string> scheme_names();  // those choices: "euler", ..., "lobatto-<points>", ...
std::string listed_schemes();             // with commas between them

// What the Lagrange polynomials of some points are at a place: weights w with f(at) = sum_i w_i f(points_i) for every
// polynomial f of lower degree than there are points.
Eigen::VectorXd lagrange_weights(const Eigen::VectorXd& points, double at);

}  // namespace dyntape
