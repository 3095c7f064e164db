// SPDX-License-Identifier: BSD-3-Clause
//
// Runs a program on N points in SIMD lanes.  Internal to the interpreter.
//
//   std::vector<LaneRoom<8>> rooms(programs.begin(), programs.end());    one per program
//   run<8>(functions, programs, which, inputs, outputs, rooms, lanes, status);
//
// Values of the lanes are contiguous in each slot.  The lanes share the overhead of an operation (dispatch,
// addresses).  The arithmetic is a loop of N iterations, which the compiler vectorises.  Elementary functions are
// the C library's, lane by lane, or the portable ones; in both cases a lane has the bits of a single point.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <dyntape/autodiff/evaluate/program.h>
#include <dyntape/autodiff/scalars/portable.h>

namespace dyntape::detail {

inline constexpr int kLanes = 8;

// Addresses of the lanes' entries: entry i of lane l is at data[i * entry + l * lane].
template <class T>
struct LaneView {
  T* data;
  std::size_t entry, lane;
};

// A program, and the program numbers of its callees; kKernel: a hand-written kernel.
struct LinkedProgram {
  static constexpr std::size_t kKernel = SIZE_MAX;
  Program program;
  std::vector<std::size_t> callees;
  std::size_t call_space = 0;  // largest number of arguments and results of a call
};

// Working memory of one program for N lanes: values, arguments and results of calls, and memory for a single lane.
template <int N>
struct LaneRoom {
  struct alignas(8 * N) Lanes {
    double lane[N];
  };
  explicit LaneRoom(const LinkedProgram& linked);
  std::vector<Lanes> values, call;
  std::vector<double> one;
};

// `inputs`: x, p, w.  All N lanes are computed; the first `lanes` are stored.  status[l] is 1 + the first guard that
// lane l violates, or 0.
template <int N>
void run(Functions functions, const std::vector<LinkedProgram>& programs, std::size_t which,
         const LaneView<const double>* inputs, const LaneView<double>& outputs,
         std::vector<LaneRoom<N>>& rooms, int lanes, std::uint32_t* status);

}  // namespace dyntape::detail
