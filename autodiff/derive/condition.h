// SPDX-License-Identifier: BSD-3-Clause
//
// Conditions under which a term contributes to a derivative: nodes that are zero or not.  Internal to the
// derivation.
//
//   Conditions all(graph);
//   ConditionId c = all.either(all.is(a), all.is(b, false));      // a is not zero, or b is zero
//   NodeId masked = all.select(c, value, zero);                 // value if c is true, zero otherwise
//
// Each condition becomes a node of the graph once, at its first use as a node.
#pragma once

#include <cstdint>
#include <map>
#include <tuple>
#include <vector>

#include <dyntape/autodiff/graph/graph.h>

namespace dyntape {

using ConditionId = std::uint32_t;
inline constexpr ConditionId kAlways = 0, kNever = 1;

class Conditions {
 public:
  explicit Conditions(Graph& graph) : graph_(graph) {}

  // True if the node is not zero; with positive = false, true if the node is zero.
  ConditionId is(NodeId node, bool positive = true);
  ConditionId both(ConditionId a, ConditionId b);
  ConditionId either(ConditionId a, ConditionId b);
  bool opposite(ConditionId a, ConditionId b) const;

  // A node that is not zero if the condition is true.
  NodeId truth(ConditionId c);
  // The first value if the condition is true, the second otherwise.
  NodeId select(ConditionId c, NodeId value, NodeId otherwise);

 private:
  // Sorted.  Larger sets are not compared: a set for each of a hundred thousand sums would take quadratic time.
  using Set = std::vector<ConditionId>;
  static constexpr std::size_t kMostParts = 64;

  enum class Kind : std::uint8_t { kAlways, kNever, kIs, kIsNot, kBoth, kEither };
  struct Row {
    Kind kind;
    std::uint32_t a = 0, b = 0;  // a node; or two conditions
    NodeId node = kNoNode;       // kNoNode until the node is made
    Set parts = {};  // of kEither: conditions of other kinds, of which one is true; empty if there are many
  };
  ConditionId find_or_add(Kind kind, std::uint32_t a, std::uint32_t b);
  ConditionId either_of_parts(ConditionId a, ConditionId b);
  NodeId made(const Row& row);
  bool is_part(ConditionId whole, ConditionId part, Kind kind) const;

  Graph& graph_;
  std::vector<Row> rows_ = {{Kind::kAlways}, {Kind::kNever}};
  std::map<std::tuple<Kind, std::uint32_t, std::uint32_t>, ConditionId> found_;
  std::map<Set, ConditionId> by_parts_;
};

}  // namespace dyntape
