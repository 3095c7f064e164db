// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function evaluated at all points of a mesh in one call, values and derivatives side by side.
//
//   PointFunction f(function, 81, {.order = Order::kSecond, .lanes = Lanes::kNative});
//   f.values(z, t, y);                 // z (points x n_x), t (points x n_p) -> y (points x n_y)
//   f.second(z, t, w, y, J, H);        // w (points x n_y) -> J, H: non-zeros, point after point
//
// Nothing is allocated after construction.  The calls return false where a recorded branch is left; whether
// results are finite is for the caller to see.  Points are shared out among threads, which changes no bit; one call at a
// time.
#pragma once

#include <memory>
#include <string>

#include <dyntape/codegen/options.h>

namespace dyntape {

// What it took to make functions ready, summed over them.
struct BuildReport {
  double derive = 0, print = 0, compile = 0, load = 0;  // s
  int compiled = 0, from_cache = 0, interpreted = 0;    // functions
  std::vector<std::string> sources = {};                // C files, where there are any
  void add(const BuildReport& other);
};

class PointFunction {
 public:
  // options.order is the highest that will be asked for; threads: 0 for as many as there are (threads.h).
  PointFunction(const Function& function, std::size_t points, const CodegenOptions& options,
                unsigned threads = 1);
  // The same functions, made ready already, at another number of points.
  PointFunction(const PointFunction& ready, std::size_t points, unsigned threads = 1);
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

  const BuildReport& build() const;
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
