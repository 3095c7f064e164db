// SPDX-License-Identifier: BSD-3-Clause
//
// One instant of a motion (a stage), and functions of a stage.  A function is recorded for the solver, and runs in
// plain double for the verification.
//
//   StageFunction effort = [](const auto& s) { return s.u.squaredNorm(); };          // a scalar, or
//   StageFunction gap    = [](const auto& s) { return s.x.head(2).eval(); };         // a vector
//
// The callable must be generic in the scalar: AD for recording, double for verification without generated code.  Do
// not use `if` on values of the stage; use select() (autodiff/record/scalar.h).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <utility>

#include <dyntape/autodiff/record/eigen.h>

namespace dyntape {

template <class T>
struct Stage {
  using Vector = Eigen::Matrix<T, Eigen::Dynamic, 1>;
  T t = T(0);     // s
  Vector x;       // state
  Vector a;       // accelerations, if they are variables (inverse dynamics); else empty
  Vector u;       // controls
  Vector p = {};  // parameters of the problem (parameters.h), read by their handles
};

namespace detail {
template <class T>
Eigen::Matrix<T, Eigen::Dynamic, 1> as_vector(const T& scalar) {
  return Eigen::Matrix<T, Eigen::Dynamic, 1>::Constant(1, scalar);
}
template <class T, class Derived>
Eigen::Matrix<T, Eigen::Dynamic, 1> as_vector(const Eigen::MatrixBase<Derived>& vector) {
  return vector;
}
}  // namespace detail

class StageFunction {
 public:
  StageFunction() = default;

  template <class F>
  requires(!std::is_same_v<std::decay_t<F>, StageFunction>)
      StageFunction(F f)  // NOLINT: a callable is a stage function
      : recorded_([f](const Stage<AD>& s) { return detail::as_vector<AD>(f(s)); }),
        plain_([f](const Stage<double>& s) { return detail::as_vector<double>(f(s)); }) {}

  // For callables with separate code for the two scalars.
  StageFunction(std::function<VectorXad(const Stage<AD>&)> recorded,
                std::function<Eigen::VectorXd(const Stage<double>&)> plain)
      : recorded_(std::move(recorded)), plain_(std::move(plain)) {}

  bool empty() const { return !plain_; }
  VectorXad operator()(const Stage<AD>& stage) const { return recorded_(stage); }
  Eigen::VectorXd operator()(const Stage<double>& stage) const { return plain_(stage); }

 private:
  std::function<VectorXad(const Stage<AD>&)> recorded_;
  std::function<Eigen::VectorXd(const Stage<double>&)> plain_;
};

}  // namespace dyntape
