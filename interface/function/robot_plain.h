// SPDX-License-Identifier: BSD-3-Clause
//
// One function of dynamics/ in any scalar, with its result in the order of robot_functions.h.  Internal.
#pragma once

#include <dyntape/dynamics/algorithms.h>
#include <dyntape/interface/function/robot_functions.h>

namespace dyntape::detail {

// Number of entries of a state behind q: (v, a | tau).
inline Eigen::Index rest_of_state(int nv, RobotFunction function) {
  return function == RobotFunction::kCrba ? 0 : 2 * nv;
}

template <class T>
T* append(const dynamics::MatrixX<T>& block, T* y) {
  for (Eigen::Index i = 0; i < block.rows(); ++i) {
    for (Eigen::Index j = 0; j < block.cols(); ++j) *y++ = block(i, j);
  }
  return y;
}

// Writes the result at y.  Allocates nothing.
template <class T>
void run(const dynamics::Model<T>& model, dynamics::Data<T>& data, RobotFunction function,
         const dynamics::VectorRef<T>& q, const dynamics::VectorRef<T>& v, const dynamics::VectorRef<T>& w,
         T* y) {
  switch (function) {
    case RobotFunction::kRnea:
      dynamics::rnea<T>(model, data, q, v, w);
      std::copy(data.tau.data(), data.tau.data() + model.nv, y);
      return;
    case RobotFunction::kAba:
      dynamics::aba<T>(model, data, q, v, w);
      std::copy(data.ddq.data(), data.ddq.data() + model.nv, y);
      return;
    case RobotFunction::kCrba:
      append(dynamics::crba<T>(model, data, q), y);
      return;
    case RobotFunction::kIdDerivatives:
      dynamics::id_derivatives<T>(model, data, q, v, w);
      append(data.M, append(data.dtau_dv, append(data.dtau_dq, y)));
      return;
    case RobotFunction::kFdDerivatives:
      dynamics::fd_derivatives<T>(model, data, q, v, w);
      append(data.Minv, append(data.ddq_dv, append(data.ddq_dq, y)));
      return;
  }
}

inline std::size_t size_of_result(int nv, RobotFunction function) {
  const auto n = static_cast<std::size_t>(nv);
  if (is_derivative(function)) return 3 * n * n;
  return function == RobotFunction::kCrba ? n * n : n;
}

}  // namespace dyntape::detail
