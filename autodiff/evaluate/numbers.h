// SPDX-License-Identifier: BSD-3-Clause
//
// A view of doubles, for arguments.  Takes a std::vector, std::array, std::span or Eigen vector without a copy, or a
// list in braces.
//
//   std::vector<double> y = evaluate(f, q, {0.5, 0, 0.5});      // q: Eigen::VectorXd
//
// The view is valid as long as the numbers; a list in braces is valid until the end of the statement.
//
// ArgumentError: the entries of an Eigen object are not adjacent in memory, as in a row or a block of a matrix;
// copy it with .eval().  A whole matrix is a vector in its own storage order.
#pragma once

#include <concepts>
#include <cstddef>
#include <initializer_list>
#include <iterator>

#include <dyntape/autodiff/error.h>

namespace dyntape {

class Numbers {
 public:
  Numbers() = default;
  Numbers(std::initializer_list<double> list) : data_(std::data(list)), size_(list.size()) {}  // NOLINT
  template <class Values>
  requires requires(const Values& values) {
    { values.data() } -> std::convertible_to<const double*>;
    { values.size() } -> std::convertible_to<std::size_t>;
  }
  Numbers(const Values& values)  // NOLINT: an argument of any of these types
      : data_(values.data()), size_(static_cast<std::size_t>(values.size())) {
    if constexpr (requires { values.innerStride(); }) {
      const bool has_gaps = (values.innerStride() != 1 && size_ > 1) ||
                            (values.outerSize() > 1 && values.outerStride() != values.innerSize());
      if (has_gaps)
        throw ArgumentError("a vector whose entries are not adjacent in memory; expected a copy, .eval()");
    }
  }

  const double* data() const { return data_; }
  std::size_t size() const { return size_; }

 private:
  const double* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace dyntape
