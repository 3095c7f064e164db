// SPDX-License-Identifier: BSD-3-Clause
//
// A float of 113 bits for references: the same algorithms, 18 digits below the rounding of double.
//
//   Model<Float128> exact = model.cast<Float128>();
//   Data<Float128> data(exact);
//   VectorX<double> tau = rnea(exact, data, q.cast<Float128>().eval(), ...).cast<double>();
//
// Slow (software); never in a program that must be fast.
#pragma once

#include <boost/multiprecision/eigen.hpp>
#include <boost/multiprecision/float128.hpp>

namespace dyntape::dynamics {

using Float128 = boost::multiprecision::float128;

}  // namespace dyntape::dynamics
