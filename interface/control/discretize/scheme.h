// SPDX-License-Identifier: BSD-3-Clause
//
// Transcription schemes (collocation and shooting) as tables of coefficients.
//
// An interval of length h has points at fractions c.  Its first and last point are shared with the neighbours.  With
// x_i, f_i, L_i the state, rate and running cost at point i,
//   defects   sum_i alpha(r, i) x_i + h sum_i beta(r, i) f_i = 0       n_x equations for each r
//   cost      h sum_i gamma_i L_i
//   controls  sum_i held(r, i) u_i = 0                                 n_u equations for each r; usually none
//
//   euler            x1 - x0 - h f0 = 0                                            cost h L0
//   trapezoid        x1 - x0 - h/2 (f0 + f1) = 0                                   cost h/2 (L0 + L1)
//   hermite-simpson  xm - (x0 + x1)/2 - h/8 (f0 - f1) = 0,
//                    x1 - x0 - h/6 (f0 + 4 fm + f1) = 0                            cost h/6 (L0 + 4 Lm + L1)
//   hermite-simpson-linear   the same with um - (u0 + u1)/2 = 0: controls are linear
//   runge-kutta-4            euler with f and L of a step with constant control, x1 - Phi(x0, u0) = 0: multiple
//                            shooting
//   semi-implicit-euler      (multiple_shooting.h); limits and path rows hold at the nodes
//
// Hermite-Simpson is in separated form: midpoint state and control are variables.  So the Jacobian has blocks h beta
// J_f + alpha I, and the Hessian of the Lagrangian is block-diagonal, one block per point.
//
// Families with any number of points, for one long interval or many short ones (P_n: Legendre polynomials):
//
//   lobatto-s         s >= 2 points: both ends and the roots of P'_{s-1}.  s - 1 rows x_i - x_0 - h sum_j a_ij f_j,
//                     with a_ij the integral of point j's Lagrange polynomial up to c_i (Lobatto IIIA): the
//                     polynomial through the states has the rate f at every point.  Order 2 s - 2.  lobatto-2 is the
//                     trapezoid, lobatto-3 Hermite-Simpson
//   radau-s           s >= 1 collocated points after the first: the roots of P_s - P_{s-1}, including the end.  s
//                     rows as before (Radau IIA).  Order 2 s - 1; fast modes decay in long steps too.  radau-1 is
//                     implicit Euler.  A node's control belongs to the interval before, so controls may jump there.
//                     From a node to the first collocated point the polynomial is extrapolated, also beyond limits
//   pseudospectral-s  s >= 3 points of lobatto-s and s rows: the polynomial of degree s - 1 through the states has
//                     the rate f at every point, D x = h f with D its derivative, here times the quadrature weights.
//                     "LGL(N)" of one interval is pseudospectral-(N + 1)
//   runge-kutta-4xN   N steps per interval with constant control
//
// Pseudospectral-s has one more row of n_x equations than lobatto-s.  There the states' polynomial has degree s,
// here s - 1, so the f_i lie on a polynomial of degree s - 2.  Its motions are motions of lobatto-s with fewer
// controls: for q' = v, v' = u, u has degree s - 3 through s points, two conditions on the controls of each
// interval.  It needs n_u >= n_x / (s - 1).  Optima are above those of lobatto-s: on one interval of 16 points the
// swing-up of a cart-pole costs 127.1, with lobatto-16 46.0; the exact value is 58.8.
//
// Pseudospectral schemes are for one interval; more are refused.  D is singular: in one combination of an interval's
// rows all states cancel and only rates times h remain.  So rows on short intervals are nearly dependent: the least
// singular value of the swing-up's Jacobian relative to the largest is 8e-5 on one interval of 16 points, 3e-7 on
// four, 1e-9 on sixteen (lobatto-16: 1e-3 on each).  With few points there are more rows than variables.
//
// Sources: M. Kelly, "An introduction to trajectory optimization", SIAM Review 59(4), 2017; F. Fahroo, I. M. Ross,
// "Costate estimation by a Legendre pseudospectral method", J. Guidance, Control, and Dynamics 24(2), 2001; E.
// Hairer, G. Wanner, Solving Ordinary Differential Equations II, IV.5; D. Garg et al., "A unified framework for the
// numerical solution of optimal control problems using pseudospectral methods", Automatica 46(11), 2010.
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
  // For multiple shooting: f and L are from this number of steps per interval.
  std::optional<ShootingScheme> step = {};
  int steps = 1;
  bool spans_all = false;  // true: for one interval only

  int points() const { return static_cast<int>(c.size()); }
  int rows() const { return static_cast<int>(alpha.rows()); }
  // Returns true if anything depends on rate or cost at the first, or last, point of an interval.
  bool uses_first_point() const { return uses(0); }
  bool uses_last_point() const { return uses(points() - 1); }
  // Weights w (points) with u(c) = sum_i w_i u_i: the polynomial through the used points.
  Eigen::VectorXd control_weights(double fraction) const;
  // Returns why a mesh with this number of intervals is refused; "" if it is not.
  std::string fault_on(int intervals) const;
  // The problem with the rate and costs of the rows; `length` of the intervals.
  Problem taken_by(const Problem& problem, const IntervalLength& length) const;

 private:
  bool uses(int point) const { return !beta.col(point).isZero(0) || gamma[point] != 0; }
};

// The schemes without a family; to add one, add a row.
const std::vector<Scheme>& schemes();

Scheme euler();
Scheme trapezoid();
Scheme hermite_simpson();

// The families.  ArgumentError for too few points or steps, or more than 128.
Scheme lobatto(int points);
Scheme radau(int collocated);
Scheme pseudospectral(int points);
Scheme runge_kutta_4(int steps);

// The scheme of this name, e.g. "lobatto-5"; ArgumentError with the choices.
Scheme scheme_by_name(const std::string& name);
std::vector<std::string> scheme_names();  // the choices: "euler", ..., "lobatto-<points>", ...
std::string listed_schemes();             // separated by commas

// Lagrange weights: w with f(at) = sum_i w_i f(points_i) for every polynomial f of a degree below the number of
// points.
Eigen::VectorXd lagrange_weights(const Eigen::VectorXd& points, double at);

}  // namespace dyntape
