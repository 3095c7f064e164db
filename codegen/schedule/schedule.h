// SPDX-License-Identifier: BSD-3-Clause
//
// The order in which a kernel computes, and where a long body is cut into pieces.
//
//   Schedule s = schedule(function, {{0, n_y}, {n_y, n_y + nnz}}, 400);
//   for (const Piece& piece : s.pieces) for (i in piece.begin .. piece.end) print(s.steps[i]);
//
// Values that several sections need come first, then those of the value alone, of the Jacobian alone, of the
// Hessian alone.  A result is stored, and a guard checked, as soon as its value is there.  Within a section
// the order is the recorded one: it keeps fewer values alive than a depth-first order from the outputs (arm
// 330 against 538, humanoid 868 against 1351) and runs up to a tenth faster.
//
// gcc's time and memory grow faster than a function's length, so a long body is cut into functions of some
// hundred statements, at places where few values cross.  What crosses lies in the caller's work array; its
// slots are used again once their value is not needed any more (a linear scan).  Cutting changes no result.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/autodiff/scalars/portable.h>
#include <dyntape/codegen/schedule/call_layout.h>

namespace dyntape::codegen {

struct Step {
  enum class Kind : std::uint8_t { kCompute, kStore, kCheck } kind;
  std::uint32_t index;  // the node, the output or the guard
};

// Steps [begin, end) under one heading.  `shared` is the number of the group, or kShared.
struct Section {
  static constexpr int kShared = -1;
  int group;
  std::size_t begin, end;
};

struct Crossing {
  NodeId node;
  std::uint32_t slot;  // in the work array
};

struct Piece {
  std::size_t begin, end;        // of steps
  std::vector<Crossing> loads;   // values of earlier pieces that this one uses
  std::vector<Crossing> stores;  // values that later pieces or long calls read, by node
  std::array<std::vector<std::uint32_t>, kBlocks> inputs;  // entries of x, p, w that it reads, sorted
};

struct Schedule {
  std::vector<Step> steps;
  std::vector<Section> sections;
  std::vector<Piece> pieces;     // at least one
  std::vector<CallPlace> calls;  // the long ones, by node
  std::size_t work = 0;          // slots
  std::size_t live = 0;          // most values that are live at once

  // The place of a long call; null for any other node.
  const CallPlace* long_call(NodeId id) const;
};

// Calls of portable functions are brought together (gather.h).
Schedule schedule(const Function& function, const std::vector<OutputRange>& groups,
                  std::size_t piece_statements, Functions functions = kDefaultFunctions);

}  // namespace dyntape::codegen
