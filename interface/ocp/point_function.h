// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function evaluated at all points of a mesh in one call, values and derivatives side by side.
//
//   PointFunction f(function, 81, Order::kSecond);
//   f.values(z, t, y);                 // z (points x n_x), t (points x n_p) -> y (points x n_y)
//   f.second(z, t, w, y, J, H);        // w (points x n_y) -> J, H: non-zeros of each point, one after
//   another
//
// Nothing is allocated after construction.  The calls return false where a recorded branch is left; whether
// results are finite is for the caller to see.  One thread at a time.
#pragma once

#include <memory>

#include <dyntape/autodiff/derive.h>

namespace dyntape {

class PointFunction {
 public:
  PointFunction(const Function& function, std::size_t points, Order order);
  ~PointFunction();
  PointFunction(PointFunction&&) noexcept;

  std::size_t points() const { return points_; }
  std::size_t n_y() const { return n_y_; }
  const Pattern& jacobian() const;
  const Pattern& hessian() const;

  bool values(const double* z, const double* p, double* y);
  bool first(const double* z, const double* p, double* y, double* jacobian);
  bool second(const double* z, const double* p, const double* w, double* y, double* jacobian,
              double* hessian);

  // Why the last call returned false; empty otherwise.
  std::string complaint() const;
  // The first operation of point `i` that makes something not finite of finite arguments, or "".
  std::string first_not_finite(std::size_t i, const double* z, const double* p) const;

 private:
  struct Routes;
  std::unique_ptr<Routes> routes_;
  std::size_t points_, n_y_;
};

}  // namespace dyntape
