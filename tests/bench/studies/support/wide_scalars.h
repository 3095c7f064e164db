// SPDX-License-Identifier: BSD-3-Clause
//
// Forward dynamics and its derivatives in scalars that no library of dyntape is built for: 64 bits and 50 digits.
//
//   InScalar<Exact> exact(model, Wanted::kAccelerations);
//   InScalar<float> narrow(model, Wanted::kAccelerations);
//   exact.run(state), narrow.run(state);                      // state: (q, v, tau)
//   error_of(exact.result(), narrow.result());                // largest difference over largest entry
//
// Accelerations by articulated inertias, or their derivatives by q, v and tau.
#pragma once

#include <vector>

#include <boost/multiprecision/cpp_bin_float.hpp>
#include <boost/multiprecision/eigen.hpp>

#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/algorithms.h>

namespace dyntape::tools {

using Exact =
    boost::multiprecision::number<boost::multiprecision::cpp_bin_float<50>, boost::multiprecision::et_off>;

enum class Wanted { kAccelerations, kDerivatives };

// One robot, one function, many states.
template <class T>
class InScalar {
 public:
  InScalar(const dynamics::Model<double>& model, Wanted wanted);
  void run(const Eigen::VectorXd& state);
  std::vector<Exact> result() const;

 private:
  Wanted wanted_;
  dynamics::Model<T> model_;
  dynamics::Data<T> data_;
  dynamics::VectorX<T> q_, v_, tau_;
};

extern template class InScalar<float>;
extern template class InScalar<double>;
#if !defined(__aarch64__)  // where Float128 is long double
extern template class InScalar<long double>;
#endif
extern template class InScalar<dynamics::Float128>;
extern template class InScalar<Exact>;

// Largest difference over largest entry.
double error_of(const std::vector<Exact>& expected, const std::vector<Exact>& got);

}  // namespace dyntape::tools
