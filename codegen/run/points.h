// SPDX-License-Identifier: BSD-3-Clause
//
// Many points in memory: inputs of an evaluation and the destination of its results.
//
//   Points points{.count = 100, .x = x, .y = y};      x (100 x n_x), y (100 x n_y), contiguous
//   const Strides strides{.x = n_x, .y = n_y + 3};    gaps between results, one p for all points
//   points.strides = &strides;
#pragma once

#include <cstddef>
#include <cstdint>

#include <dyntape/codegen/store/abi.h>

namespace dyntape {

// The distance from one point to the next in doubles, for each array.
using Strides = dyntape_strides;

struct Points {
  std::size_t count = 1;
  const double *x = nullptr, *p = nullptr, *w = nullptr;
  double *y = nullptr, *jacobian = nullptr, *hessian = nullptr;
  const Strides* strides = nullptr;  // null: contiguous; a stride of 0: one block for all points
  std::uint32_t* status = nullptr;   // one word per point: 0, or 1 + index of the first violated guard

  // For points in SIMD layout: blocks of W = this number of points; entry i of lane l of block b of an array with n
  // entries per point is at [(b n + i) W + l].  The count is a multiple of W; strides are those of blocks.
  std::size_t side_by_side = 1;
};

// The first point that left a recorded branch; converts to false if there is none.
struct Violation {
  std::uint32_t guard = 0;  // 1 + index
  std::size_t point = 0;
  explicit operator bool() const { return guard != 0; }
};

namespace codegen {

// Returns the `count` points that start at `first`; both are multiples of a block.
inline Points part_of(const Points& all, const Strides& strides, std::size_t first, std::size_t count) {
  const std::size_t block = first / all.side_by_side;
  const auto from = [](auto* start, std::size_t by) { return start ? start + by : nullptr; };
  Points part = all;
  part.count = count;
  part.x = from(all.x, block * strides.x);
  part.p = from(all.p, block * strides.p);
  part.w = from(all.w, block * strides.w);
  part.y = from(all.y, block * strides.y);
  part.jacobian = from(all.jacobian, block * strides.jacobian);
  part.hessian = from(all.hessian, block * strides.hessian);
  part.strides = &strides;
  part.status = from(all.status, first);
  return part;
}

}  // namespace codegen

}  // namespace dyntape
