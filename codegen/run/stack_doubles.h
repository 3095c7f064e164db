// SPDX-License-Identifier: BSD-3-Clause
//
// Memory for doubles during a call, such as the non-zeros of a Jacobian: on the stack if they are few.
//
//   StackDoubles values(f.jacobian_pattern().nnz());
//   shared.evaluate(Order::kFirst, {.x = x, .p = p, .jacobian = values.data()});
#pragma once

#include <cstddef>
#include <memory>

namespace dyntape::codegen {

class StackDoubles {
 public:
  explicit StackDoubles(std::size_t size)
      : size_(size), many_(size > kFew ? std::make_unique_for_overwrite<double[]>(size) : nullptr) {}
  std::size_t size() const { return size_; }
  double* data() { return many_ ? many_.get() : few_; }  // never null
  const double* data() const { return many_ ? many_.get() : few_; }

 private:
  static constexpr std::size_t kFew = 128;
  std::size_t size_;
  double few_[kFew];  // NOLINT: written by the evaluation
  std::unique_ptr<double[]> many_;
};

}  // namespace dyntape::codegen
