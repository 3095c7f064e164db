// SPDX-License-Identifier: BSD-3-Clause
//
// What bench_tape_peer and the peer's side of it (tape_cppad.cpp), a library with other flags, have in common: plain
// numbers only.
#pragma once

#include <algorithm>
#include <chrono>

#include "pinocchio_peer.h"

namespace dyntape::bench {

template <class F>
double least_us(F&& f) {
  const auto begin = std::chrono::steady_clock::now();
  double least = 1e9, total = 0;
  for (int i = 0; i < 2000 && (i < 5 || total < 0.3); ++i) {
    const auto start = std::chrono::steady_clock::now();
    f();
    const auto end = std::chrono::steady_clock::now();
    least = std::min(least, std::chrono::duration<double>(end - start).count());
    total = std::chrono::duration<double>(end - begin).count();
  }
  return least * 1e6;
}

// What is measured of a side, in microseconds.
struct Times {
  double record = 0, prepare = 0, value = 0, jacobian = 0;
};

}  // namespace dyntape::bench

// Inverse dynamics of the robot at x = (q, v, a), n entries: y and, of its derivatives by x, all nv x n entries row by
// row.  `optimised` is the same after ADFun::optimize().  False where Pinocchio does not have a joint.
extern "C" __attribute__((visibility("default"))) bool measure_cppad(const dyntape_peer_joint* joints,
                                                                     int count, const double* gravity,
                                                                     const double* x, int n, double* y,
                                                                     double* J, dyntape::bench::Times* times,
                                                                     dyntape::bench::Times* optimised);
