// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluates a recorded function in truncated power series, forward and in reverse, to any order.
//
//   Taylor<double> run(f);
//   run.forward({Series<double>::of({x, dx, 0})});             // x(t) = x + dx t: y(t) up to order 2
//   run.output(0)[2]                                            // half of the second derivative of y along dx
//   const auto X = run.reverse({Series<double>::of({1})});      // slopes of y's highest coefficient: X[j].at(q - k) by x_j^(k)
//   run.forward_at({x});  run.output(0)[0]                      // the value at a point alone
//
// reverse() takes an adjoint series for each output: coefficient j is the weight of the output's coefficient q - j,
// with q the highest order.  Its results have the same form.  In this order, the adjoint of an argument is the slope
// of the table times the adjoint of the result, as series; the same cells of the table serve both directions.
//
// Follows calls of recorded functions.  Calls of kernels need `kernels`; ArgumentError without.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include <dyntape/autodiff/evaluate/series.h>
#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/autodiff/graph/function.h>

namespace dyntape {

// A call of a kernel, in series.
template <class T>
class SeriesKernel {
 public:
  using Many = std::vector<Series<T>>;
  virtual ~SeriesKernel() = default;
  virtual Many forward(const Many& in) const = 0;
  // Adjoints of `in` from the adjoints of `out`, both from the highest order down.
  virtual Many reverse(const Many& in, const Many& out, const Many& adjoints) const = 0;
};

template <class T>
using SeriesKernels = std::function<std::shared_ptr<const SeriesKernel<T>>(const Callee& callee)>;

template <class T>
class Taylor {
 public:
  using Many = std::vector<Series<T>>;

  explicit Taylor(std::shared_ptr<const Function> function, SeriesKernels<T> kernels = {});

  // Variables, parameters and weights; a series of one coefficient is a constant.
  void forward(const Many& x, const Many& p = {}, const Many& w = {});
  void forward_at(const std::vector<T>& x, const std::vector<T>& p = {}, const std::vector<T>& w = {});
  Series<T> operator[](NodeId id) const {
    return is_at_point_ ? Series<T>::constant(point_[id]) : values_[id];
  }
  Series<T> output(std::size_t i) const { return (*this)[function_->outputs[i]]; }
  // The index of the first recorded branch from `first` on that the values leave, or SIZE_MAX.
  std::size_t violated_guard(std::size_t first) const;

  // Adjoints of the variables at the point of the last forward(); a variable that no output depends on gets
  // "nothing".  Kernels compute only the lowest `orders` coefficients.
  Many reverse(const Many& adjoints, std::size_t orders = SIZE_MAX) const;

 private:
  static constexpr bool kKnown = SeriesNumber<T>::kKnown;
  void evaluate_at_point(const T* const* blocks);
  T value(NodeId id) const { return is_at_point_ ? point_[id] : values_[id][0]; }
  void forward_call(NodeId id);
  static bool arithmetic(Op op, const Series<T>& x, const Series<T>& y, Series<T>& r);
  static void add_to(Series<T>& sum, const Series<T>& more, bool minus);
  void reverse_numbers(const Many& of_outputs, Many& of_variables) const;
  void reverse_node(NodeId id, Many& adjoints) const;
  void reverse_call(NodeId call, const Many& of_results, std::size_t orders, Many& adjoints) const;
  std::shared_ptr<const SeriesKernel<T>> kernel_of(NodeId call) const;
  Many arguments_of(NodeId call) const;

  std::shared_ptr<const Function> function_;
  SeriesKernels<T> kernels_;
  // If all inputs are numbers and nothing is called: the values are point_, and values_ is not used.
  bool is_at_point_ = false;
  std::vector<T> point_;
  mutable Many values_;
  bool moves_ = false;         // whether some input is not constant
  std::vector<Many> results_;  // of call number i
  mutable Many adjoints_;      // memory of reverse(), reused
  mutable std::vector<T> numbers_;
  mutable std::vector<std::uint8_t> is_met_;
};

}  // namespace dyntape

#include <dyntape/autodiff/evaluate/taylor.hxx>
