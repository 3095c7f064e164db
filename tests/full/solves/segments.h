// SPDX-License-Identifier: BSD-3-Clause
//
// The least distance of two segments (m), which shares nothing with the project's own.
//
//   least_distance({from, to}, {other_from, other_to})
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>

namespace dyntape {

using SegmentEnds = std::array<Eigen::Vector3d, 2>;

// By going from the nearest point of one to that of the other and back.
inline double least_distance(const SegmentEnds& a, const SegmentEnds& b) {
  const SegmentEnds* ends[2] = {&a, &b};
  Eigen::Vector3d at[2] = {(a[0] + a[1]) / 2, (b[0] + b[1]) / 2};
  for (int i = 0; i < 400; ++i) {
    const auto& [from, to] = *ends[i % 2];
    const Eigen::Vector3d along = to - from;
    const double length = along.squaredNorm();
    const double r = length > 0 ? std::clamp((at[1 - i % 2] - from).dot(along) / length, 0., 1.) : 0.;
    const Eigen::Vector3d nearest = from + r * along;
    const bool is_done = i > 1 && (nearest - at[i % 2]).norm() < 1e-13;
    at[i % 2] = nearest;
    if (is_done) break;
  }
  return (at[0] - at[1]).norm();
}

}  // namespace dyntape
