// SPDX-License-Identifier: BSD-3-Clause
//
// A float of 113 bits for reference values: the same algorithms, 18 digits below the rounding of double.
//
//   Model<Float128> exact = model.cast<Float128>();
//   Data<Float128> data(exact);
//   VectorX<double> tau = rnea(exact, data, q.cast<Float128>().eval(), ...).cast<double>();
//
// Implemented in software, so slow: use it in tests and references only.
#pragma once

#if defined(__aarch64__)
#include <dyntape/dynamics/algebra/scalar.h>
#else
#include <boost/multiprecision/eigen.hpp>
#include <boost/multiprecision/float128.hpp>
#endif

namespace dyntape::dynamics {

#if defined(__aarch64__)
using Float128 = long double;  // of the same 113 bits; gcc has no __float128 there
#else
using Float128 = boost::multiprecision::float128;
#endif

}  // namespace dyntape::dynamics
