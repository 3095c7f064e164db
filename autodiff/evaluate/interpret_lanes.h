// SPDX-License-Identifier: BSD-3-Clause
//
// Runs a program on N points side by side.  Internal to the interpreter.
//
//   std::vector<LaneRoom<8>> rooms(programs.begin(), programs.end());    one of each program
//   run<8>(functions, programs, which, inputs, outputs, rooms, lanes, status);
//
// Values lie lane beside lane, slot after slot.  What an operation costs beyond its arithmetic (to find out
// what it is and where its arguments are) is shared by the lanes, and the arithmetic is a loop of N turns that
// the compiler turns into vector instructions.  Elementary functions are the C library's, lane by lane, or the
// portable ones: either way a lane has the bits of one point alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <dyntape/autodiff/evaluate/program.h>
#include <dyntape/autodiff/scalars/portable.h>

namespace dyntape::detail {

inline constexpr int kLanes = 8;

// Where the entries of the lanes are: entry i of lane l at data[i * entry + l * lane].
template <class T>
struct LaneView {
  T* data;
  std::size_t entry, lane;
};

// A program, and the number of the program that each of its callees is; kKernel: a kernel written by hand.
struct LinkedProgram {
  static constexpr std::size_t kKernel = SIZE_MAX;
  Program program;
  std::vector<std::size_t> callees;
  std::size_t call_space = 0;  // most arguments and results that a call has
};

// Working memory of one program for N lanes: values, what a call takes and gives, and that of one lane.
template <int N>
struct LaneRoom {
  struct alignas(8 * N) Lanes {
    double lane[N];
  };
  explicit LaneRoom(const LinkedProgram& linked);
  std::vector<Lanes> values, call;
  std::vector<double> one;
};

// `inputs`: x, p, w.  All N lanes are computed; the first `lanes` are stored, and status[l] is 1 + the first
// guard that lane l violates, or 0.
template <int N>
void run(Functions functions, const std::vector<LinkedProgram>& programs, std::size_t which,
         const LaneView<const double>* inputs, const LaneView<double>& outputs,
         std::vector<LaneRoom<N>>& rooms, int lanes, std::uint32_t* status);

}  // namespace dyntape::detail
