// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluates a compiled function for W problems in lanes, for any number of lanes of its kernels.
//
//   LaneFunction<8> f(compiled);
//   f.run(Order::kFirst, 100, {.x = x, .p = p, .y = y, .jacobian = J}, status);     // 100 blocks of W points in lanes
//
// Layout: entry i of lane l of block b, of an array with n entries per point, is at [(b n + i) W + l].  `status`: a
// word for each lane; not 0 if one of the lane's points leaves a recorded branch.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include <dyntape/autodiff/processor.h>
#include <dyntape/codegen/compiled_function.h>

namespace dyntape {
inline namespace DYNTAPE_VECTORS {

template <int W>
class LaneFunction {
 public:
  explicit LaneFunction(const CompiledFunction& f)
      : f_(f), workspace_(f_), sizes_{f_.n_x(), f_.n_p(), f_.n_w() + f_.n_y(), f_.n_y(), 0, 0} {
    if (f_.order() >= Order::kFirst) sizes_.jacobian = f_.jacobian_pattern().nnz();
    if (f_.order() >= Order::kSecond) sizes_.hessian = f_.hessian_pattern().nnz();
    if (f_.lane_width() == W) return;
    for (const std::size_t n : {sizes_.x, sizes_.p, sizes_.w, sizes_.y, sizes_.jacobian, sizes_.hessian})
      rooms_.emplace_back(n * W + 1);
  }

  const CompiledFunction& function() const { return f_; }

  void run(Order order, std::size_t blocks, Points points, std::uint32_t* left) {
    std::fill(left, left + W, 0u);
    if (f_.lane_width() == W) {
      points.count = blocks * W, points.side_by_side = W;
      if (!f_.function().guards.empty()) words_.resize(points.count), points.status = words_.data();
      if (!f_.run(order, points, workspace_)) return;
      for (std::size_t i = 0; i < words_.size(); ++i) left[i % W] |= words_[i];
      return;
    }
    for (std::size_t b = 0; b < blocks; ++b) run_block(order, b, points, left);
  }

 private:
  // Copies point by point; the function may put the points in lanes again.
  void run_block(Order order, std::size_t b, const Points& all, std::uint32_t* left) {
    const auto in = [&](const double* from, std::size_t n, int room) -> const double* {
      if (!from) return nullptr;
      double* const to = rooms_[std::size_t(room)].data();
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t l = 0; l < W; ++l) to[l * n + i] = from[(b * n + i) * W + l];
      return to;
    };
    const auto room = [&](double* to, int which) { return to ? rooms_[std::size_t(which)].data() : nullptr; };
    std::uint32_t words[W] = {};
    const Points points{.count = W,
                        .x = in(all.x, sizes_.x, 0),
                        .p = in(all.p, sizes_.p, 1),
                        .w = in(all.w, sizes_.w, 2),
                        .y = room(all.y, 3),
                        .jacobian = room(all.jacobian, 4),
                        .hessian = room(all.hessian, 5),
                        .status = words};
    static_cast<void>(f_.run(order, points, workspace_));
    const auto out = [&](double* to, std::size_t n, int which) {
      if (!to) return;
      const double* const from = rooms_[std::size_t(which)].data();
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t l = 0; l < W; ++l) to[(b * n + i) * W + l] = from[l * n + i];
    };
    out(all.y, sizes_.y, 3), out(all.jacobian, sizes_.jacobian, 4), out(all.hessian, sizes_.hessian, 5);
    for (std::size_t l = 0; l < W; ++l) left[l] |= words[l];
  }

  CompiledFunction f_;
  CompiledFunction::Workspace workspace_;
  Strides sizes_;
  std::vector<std::vector<double>> rooms_;
  std::vector<std::uint32_t> words_;
};

}  // namespace DYNTAPE_VECTORS
}  // namespace dyntape
