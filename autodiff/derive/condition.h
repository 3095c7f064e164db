// SPDX-License-Identifier: BSD-3-Clause
//
// Conditions under which something contributes to a derivative, made of nodes that are or are not zero.
//
//   Conditions all(graph);
//   ConditionId c = all.either(all.is(a), all.is(b, false));      // a is not zero, or b is
//   NodeId masked = all.select(c, value, zero);                 // the value where c holds, zero elsewhere
//
// They become nodes of the graph when they are asked for as such, once each.  Internal to the derivation.
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

  // Where the node is not zero; not positive: where it is.
  ConditionId is(NodeId node, bool positive = true);
  ConditionId both(ConditionId a, ConditionId b);
  ConditionId either(ConditionId a, ConditionId b);
  bool opposite(ConditionId a, ConditionId b) const;

  // A node that is not zero where the condition holds.
  NodeId truth(ConditionId c);
  // One value where it holds, another where it does not.
  NodeId select(ConditionId c, NodeId value, NodeId otherwise);

 private:
  // Sorted.  Larger sets are not compared: one for each of a hundred thousand sums would be quadratic.
  using Set = std::vector<ConditionId>;
  static constexpr std::size_t kMostParts = 64;

  enum class Kind : std::uint8_t { kAlways, kNever, kIs, kIsNot, kBoth, kEither };
  struct Row {
    Kind kind;
    std::uint32_t a = 0, b = 0;  // a node; or two conditions
    NodeId node = kNoNode;       // once it is made
    Set parts = {};  // of kEither: conditions of other kinds one of which holds; empty if they are many
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
