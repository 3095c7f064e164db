// SPDX-License-Identifier: BSD-3-Clause
//
// Points that lie one after the other, through a kernel of several lanes: block by block into lanes, through
// the kernel, and back.
//
//   AlignedRoom room;
//   room.resize(room_for_lanes(kernel, sizes));
//   run_in_lanes(kernel, sizes, points, strides, count, room.data(), status);
//
// W x W entries at a time are transposed in registers.  The last block repeats the last point in its unused
// lanes, and writes nothing of them.  Inputs of stride 0, shared by all points, are put into lanes once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <dyntape/codegen/store/abi.h>

namespace dyntape::codegen {

// Doubles at an address that any vector may have.
class AlignedRoom {
 public:
  void resize(std::size_t doubles) { lines_.resize((doubles + 7) / 8); }
  std::size_t size() const { return lines_.size() * 8; }
  double* data() { return lines_.empty() ? nullptr : lines_.data()->entries; }

 private:
  struct alignas(64) Line {
    double entries[8];
  };
  std::vector<Line> lines_;
};

// Entries of one point in each array.
struct PointSizes {
  std::size_t x = 0, p = 0, w = 0, y = 0, jacobian = 0, hessian = 0;
};

struct PointArrays {
  const double *x = nullptr, *p = nullptr, *w = nullptr;
  double *y = nullptr, *jacobian = nullptr, *hessian = nullptr;
};

// Doubles that run_in_lanes needs.
std::size_t room_for_lanes(const dyntape_kernel& kernel, const PointSizes& sizes);

// Evaluates `count` points.  status: a word a point, or NULL.
void run_in_lanes(const dyntape_kernel& kernel, const PointSizes& sizes, const PointArrays& points,
                  const dyntape_strides& strides, std::size_t count, double* room, std::uint32_t* status);

}  // namespace dyntape::codegen
