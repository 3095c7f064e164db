// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluates consecutive points by a kernel of several lanes: transposes a block into lanes, runs the kernel,
// transposes the results back.
//
//   AlignedRoom room;
//   room.resize(room_for_lanes(kernel, sizes));
//   run_in_lanes(kernel, sizes, points, room.data());
//
// W x W entries at a time are transposed in registers.  In the last block, unused lanes repeat the last point; their
// results are not written.  Inputs of stride 0, which all points share, are put into lanes once.
#pragma once

#include <cstddef>
#include <vector>

#include <dyntape/codegen/run/points.h>

namespace dyntape::codegen {

// Doubles at an address with the alignment of every vector.
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

// The number of doubles that run_in_lanes needs; sizes: those of one point in each array.
std::size_t room_for_lanes(const dyntape_kernel& kernel, const Strides& sizes);

// The points have strides.
void run_in_lanes(const dyntape_kernel& kernel, const Strides& sizes, const Points& points, double* room);

}  // namespace dyntape::codegen
