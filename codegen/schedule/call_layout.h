// SPDX-License-Identifier: BSD-3-Clause
//
// The memory layout of arguments and results of long calls, such as loops over matrices.  Arguments are contiguous
// in the work array, where they are stored as they are computed.  Results are there too, or directly in the output
// array if they are outputs in this order.  A call copies nothing.
//
//   std::vector<CallPlace> places = place_calls(function, {{0, n_y}}, work);       // work grows by their size
//
// A repeated part (outline.h) writes its outputs itself: outputs with equal distances in all calls use one pointer.
#pragma once

#include <cstdint>
#include <vector>

#include <dyntape/autodiff/graph/function.h>

namespace dyntape::codegen {

// A range of outputs: the value, the Jacobian, the Hessian.
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
  std::uint32_t in = 0, out = 0;     // the first slots; no `out` if the results are outputs
  std::size_t outputs = kInWork;     // or the first of these outputs
  std::vector<OutputRun> runs = {};  // of a part, by result

  // Returns true if the callee writes the output of this result.
  bool writes(std::size_t result) const;
};

// Arguments of a call in the work array: all except the constants of a part (outline.h), which are the parameters of
// its function.
std::size_t stored_arguments(const Graph& graph, NodeId call);

// The layouts by node, for every part, every call with more than 64 arguments and results, and every shorter call
// after the previous short calls have 512 arguments and results in total.
std::vector<CallPlace> place_calls(const Function& function, const std::vector<OutputRange>& groups,
                                   std::size_t& work);

}  // namespace dyntape::codegen
