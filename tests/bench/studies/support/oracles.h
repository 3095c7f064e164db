// SPDX-License-Identifier: BSD-3-Clause
//
// Where free motions end, to more digits than double has.
//
//   const Eigen::VectorXd x = exact_end(model, x0, 2.0);      // x = (q, v) after 2 s
//
// Forward dynamics in 113 bits (dynamics/algebra/float128.h), velocities as rates of coordinates, integrated twice by methods that
// dyntape does not have: Runge-Kutta-Fehlberg 7(8) and Bulirsch-Stoer (Boost.Numeric.Odeint).  Joints of one velocity and a free base.
//
// Errors.  ArgumentError where the two agree to less than 1e-18, or a joint is of another kind.
#pragma once

#include <dyntape/dynamics/model/model.h>

namespace dyntape::tools {

Eigen::VectorXd exact_end(const dynamics::Model<double>& model, const Eigen::VectorXd& x0, double seconds);

}  // namespace dyntape::tools
