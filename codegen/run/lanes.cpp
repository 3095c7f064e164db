// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/run/lanes.h>

#include <algorithm>

#include <dyntape/autodiff/scalars/pack_lanes.h>

namespace dyntape::codegen {
namespace {

template <int W>
class LaneRun {
 public:
  LaneRun(const dyntape_kernel& kernel, const Strides& sizes, const Points& points, double* room)
      : kernel_(kernel), sizes_(sizes), points_(points), strides_(*points.strides) {
    const auto take = [&](std::size_t entries, bool is_wanted) {
      double* const start = is_wanted ? room : nullptr;
      room += entries * W;
      return start;
    };
    x_ = take(sizes.x, points.x), p_ = take(sizes.p, points.p), w_ = take(sizes.w, points.w);
    y_ = take(sizes.y, points.y), jacobian_ = take(sizes.jacobian, points.jacobian);
    hessian_ = take(sizes.hessian, points.hessian);
    work_ = room;
  }

  // `count` points from `first` on, at most W.
  void block(std::size_t first, std::size_t count) {
    std::uint32_t* const status = points_.status;
    const auto lanes = static_cast<int>(count);
    const auto in = [&](const double* from, std::size_t stride, double* to, std::size_t entries) {
      if (from && (stride > 0 || first == 0))
        gather_lanes<W>(from + first * stride, stride, lanes, to, entries);
    };
    in(points_.x, strides_.x, x_, sizes_.x);
    in(points_.p, strides_.p, p_, sizes_.p);
    in(points_.w, strides_.w, w_, sizes_.w);
    std::uint32_t words[W];
    kernel_.run(x_, p_, w_, y_, jacobian_, hessian_, work_, W, nullptr, status ? words : nullptr);
    const auto out = [&](const double* from, std::size_t entries, double* to, std::size_t stride) {
      if (to) scatter_lanes<W>(from, entries, to + first * stride, stride, lanes);
    };
    out(y_, sizes_.y, points_.y, strides_.y);
    out(jacobian_, sizes_.jacobian, points_.jacobian, strides_.jacobian);
    out(hessian_, sizes_.hessian, points_.hessian, strides_.hessian);
    if (status) std::copy(words, words + count, status + first);
  }

 private:
  const dyntape_kernel& kernel_;
  const Strides& sizes_;
  const Points& points_;
  const Strides& strides_;
  double *x_, *p_, *w_, *y_, *jacobian_, *hessian_, *work_;
};

template <int W>
void run_blocks(const dyntape_kernel& kernel, const Strides& sizes, const Points& points, double* room) {
  LaneRun<W> run(kernel, sizes, points, room);
  for (std::size_t first = 0; first < points.count; first += W)
    run.block(first, std::min<std::size_t>(W, points.count - first));
}

}  // namespace

std::size_t room_for_lanes(const dyntape_kernel& kernel, const Strides& sizes) {
  const std::size_t entries = sizes.x + sizes.p + sizes.w + sizes.y + sizes.jacobian + sizes.hessian;
  return entries * kernel.lane_width + kernel.work;
}

void run_in_lanes(const dyntape_kernel& kernel, const Strides& sizes, const Points& points, double* room) {
  const auto run = kernel.lane_width == 8   ? run_blocks<8>
                   : kernel.lane_width == 4 ? run_blocks<4>
                                            : run_blocks<2>;
  run(kernel, sizes, points, room);
}

}  // namespace dyntape::codegen
