// SPDX-License-Identifier: BSD-3-Clause
//
// Doubles, for arguments.  Takes a std::vector, std::array, std::span or Eigen vector without a copy, a list in braces, or
// any expression of Eigen.
//
//   std::vector<double> y = evaluate(f, q, {0.5, 0, 0.5});      // q: Eigen::VectorXd
//   y = evaluate(f, 2 * q + v, x.head(3));                      // a sum is computed once, a segment is not copied
//
// Without a copy it is a view, valid as long as the numbers; a list in braces is valid until the end of the statement.
// Expressions are evaluated, and entries that are not adjacent in memory, as those of a row of a matrix, are copied.  A
// matrix is a vector in its own storage order.
#pragma once

#include <concepts>
#include <cstddef>
#include <initializer_list>
#include <iterator>
#include <memory>
#include <vector>

namespace dyntape {

namespace detail {

template <class Values>
concept AdjacentNumbers = requires(const Values& values) {
  { values.data() } -> std::convertible_to<const double*>;
  { values.size() } -> std::convertible_to<std::size_t>;
};

// Of Eigen: a product, a sum, a reversed vector.
template <class Values>
concept NumberExpression = !AdjacentNumbers<Values> && requires(const Values& values) {
  { values.eval().data() } -> std::convertible_to<const double*>;
  { values.size() } -> std::convertible_to<std::size_t>;
};

}  // namespace detail

class Numbers {
 public:
  Numbers() = default;
  Numbers(std::initializer_list<double> list) : data_(std::data(list)), size_(list.size()) {}  // NOLINT
  template <detail::AdjacentNumbers Values>
  Numbers(const Values& values)  // NOLINT: an argument of any of these types
      : data_(values.data()), size_(static_cast<std::size_t>(values.size())) {
    if constexpr (requires { values.innerStride(); }) {
      const bool has_gaps = (values.innerStride() != 1 && size_ > 1) ||
                            (values.outerSize() > 1 && values.outerStride() != values.innerSize());
      if (has_gaps) keep(values.eval());
    }
  }
  template <detail::NumberExpression Values>
  Numbers(const Values& values) {  // NOLINT: likewise
    keep(values.eval());
  }

  const double* data() const { return data_; }
  std::size_t size() const { return size_; }

 private:
  template <class Plain>
  void keep(const Plain& plain) {
    const auto size = static_cast<std::size_t>(plain.size());
    owned_ = std::make_shared<const std::vector<double>>(plain.data(), plain.data() + size);
    data_ = owned_->data(), size_ = size;
  }

  const double* data_ = nullptr;
  std::size_t size_ = 0;
  std::shared_ptr<const std::vector<double>> owned_;  // null: a view
};

}  // namespace dyntape
