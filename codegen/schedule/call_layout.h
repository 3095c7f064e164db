// SPDX-License-Identifier: BSD-3-Clause
//
// Where the arguments and the results of long calls lie, such as loops over matrices: the arguments side by side
// in the work array, into which they are stored as they are computed; the results there as well or, where they
// are outputs in their order and nothing else, in the output array.  Nothing is copied for the call.
//
//   std::vector<CallPlace> places = place_calls(function, {{0, n_y}}, work);       // work grows by what they take
//
// A part that is there several times (outline.h) writes its outputs itself: those that lie equally far apart in
// all of its calls go through one pointer.
#pragma once

#include <cstdint>
#include <vector>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape::codegen {

// A range of outputs that belong together: the value, the Jacobian, the Hessian.
struct OutputRange {
  std::size_t begin, end;
};

// Results [begin, end) of a part are the outputs first + offsets[0], first + offsets[1], ... of one group.
struct OutputRun {
  std::size_t begin, end, first;
  std::vector<std::size_t> offsets;  // the same in every call of the part
};

struct CallPlace {
  static constexpr std::size_t kInWork = static_cast<std::size_t>(-1);
  NodeId call;
  std::uint32_t in = 0, out = 0;     // the first slots; no `out` where the results are outputs
  std::size_t outputs = kInWork;     // or the first of these
  std::vector<OutputRun> runs = {};  // of a part, by result

  // Whether the callee writes the output that the result is.
  bool writes(std::size_t result) const;
};

// Arguments of a call that lie in the work array: all but the constants of a part (outline.h), which are the parameters
// of its function.
std::size_t stored_arguments(const Graph& graph, NodeId call);

// Of every call with more than 64 arguments and results, of every part, and of those behind the first short calls
// with 512 together, by node.
std::vector<CallPlace> place_calls(const Function& function, const std::vector<OutputRange>& groups,
                                   std::size_t& work);

}  // namespace dyntape::codegen
