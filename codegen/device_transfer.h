// SPDX-License-Identifier: BSD-3-Clause
//
// What goes to a device and comes back: arrays state after state, transposed.  Internal.
//
//   const OpenClDevice device = device_of_name("opencl:0", false);
//   send(x, stride, n, count, to);          entry i of state s to to[i * count + s]
//   fetch(from, stride, n, count, y);       and back
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <dyntape/codegen/device/opencl.h>
#include <dyntape/codegen/run/threads.h>

namespace dyntape::codegen {

inline constexpr std::size_t kPartBytes = std::size_t{256}
                                          << 20;  // sent at a time, where the device has more room
inline constexpr std::size_t kTransposed = 64;    // states together: they stay in the cache

// "opencl:0".  ArgumentError: another word, or a device without the precision that is asked for.
OpenClDevice device_of_name(const std::string& name, bool single);

// Options of the device's compiler.
std::string options_for(const OpenClDevice& device, bool single);

template <class Real>
void send(const double* from, std::size_t stride, std::size_t n, std::size_t count, Real* to) {
  run_tasks((count + kTransposed - 1) / kTransposed, [&](std::size_t tile) {
    const std::size_t begin = tile * kTransposed, end = std::min(count, begin + kTransposed);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t s = begin; s < end; ++s) to[i * count + s] = static_cast<Real>(from[s * stride + i]);
    }
  });
}

template <class Real>
void fetch(const Real* from, std::size_t stride, std::size_t n, std::size_t count, double* to) {
  run_tasks((count + kTransposed - 1) / kTransposed, [&](std::size_t tile) {
    const std::size_t begin = tile * kTransposed, end = std::min(count, begin + kTransposed);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t s = begin; s < end; ++s) to[s * stride + i] = static_cast<double>(from[i * count + s]);
    }
  });
}

}  // namespace dyntape::codegen
