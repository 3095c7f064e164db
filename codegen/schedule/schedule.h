// SPDX-License-Identifier: BSD-3-Clause
//
// The order of computation of a kernel, and the cuts of a long body into pieces.
//
//   Schedule s = schedule(function, {{0, n_y}, {n_y, n_y + nnz}}, 400);
//   for (const Piece& piece : s.pieces) for (i in piece.begin .. piece.end) print(s.steps[i]);
//
// Values for several sections come first, then those of the value alone, of the Jacobian alone, of the Hessian
// alone.  A result is stored, and a guard checked, as soon as its value is available.  Within a section the recorded
// order is kept: it has fewer live values than a depth-first order from the outputs (arm 330 against 538, humanoid
// 868 against 1351) and is up to a tenth faster.  For cards all is one section, in the order of few_live.h.
//
// gcc's time and memory grow faster than the length of a function.  So a long body is cut into functions of some
// hundred statements, at positions where few values cross.  Crossing values are in the caller's work array, whose
// slots are reused (linear scan).  Cuts change no result.
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

// Steps [begin, end) with one heading.  `shared` is the number of the group, or kShared.
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
  std::vector<Crossing> stores;  // values used by later pieces or long calls, by node
  std::array<std::vector<std::uint32_t>, kBlocks> inputs;  // entries of x, p, w that it uses, sorted
};

struct Schedule {
  std::vector<Step> steps;
  std::vector<Section> sections;
  std::vector<Piece> pieces;     // at least one
  std::vector<CallPlace> calls;  // the long ones, by node
  std::size_t work = 0;          // slots
  std::size_t live = 0;          // largest number of live values

  // The layout of a long call; null for any other node.
  const CallPlace* long_call(NodeId id) const;
};

enum class StatementOrder { kRecorded, kFewLive };

// Groups calls of portable functions (gather.h).
Schedule schedule(const Function& function, const std::vector<OutputRange>& groups,
                  std::size_t piece_statements, Functions functions = kDefaultFunctions,
                  StatementOrder order = StatementOrder::kRecorded);

}  // namespace dyntape::codegen
