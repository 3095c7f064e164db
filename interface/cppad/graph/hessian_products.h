// SPDX-License-Identifier: BSD-3-Clause
//
// Builds the graph of Hessians times directions, several directions at a time, for detail/fun_derivatives.hxx.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace dyntape {
struct Function;
}

namespace CppAD::inline dyntape_names::detail {

// (w . f)'' d of the first `range` results, by the derived graph, which is made here and evaluated in lanes: for functions of numbers
// without kernels of the user.
class HessianProducts {
 public:
  HessianProducts(const dyntape::Function& f, std::size_t range);
  ~HessianProducts();
  // n_x a direction and a product. False: one is not finite, and sweeps may know better what does not move.
  bool operator()(const std::vector<double>& x, const std::vector<double>& p, const std::vector<double>& w,
                  const std::vector<double>& directions, std::vector<double>& products);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace CppAD::inline dyntape_names::detail
