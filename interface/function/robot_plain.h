// SPDX-License-Identifier: BSD-3-Clause
//
// The core functions by arguments one by one; robot_rows.h is the way to all of them.  Internal.
#pragma once

#include <dyntape/interface/function/robot_rows.h>

namespace dyntape::detail {

inline Eigen::Index rest_of_state(int nv, const RobotFunction& function) {
  return function == RobotFunction::kCrba ? 0 : 2 * nv;
}

inline std::size_t size_of_result(int nv, const RobotFunction& function) {
  const auto n = static_cast<std::size_t>(nv);
  if (is_derivative(function)) return 3 * n * n;
  return function == RobotFunction::kCrba ? n * n : n;
}

template <class T>
void run(const dynamics::Model<T>& model, dynamics::Data<T>&, const RobotFunction& function,
         const dynamics::VectorRef<T>& q, const dynamics::VectorRef<T>& v, const dynamics::VectorRef<T>& w,
         T* y) {
  RobotWork<T> work(model, function);
  work.run({q, v, w, {}});
  work.write(y);
}

}  // namespace dyntape::detail
