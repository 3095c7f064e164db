// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/derive/condition.h>

#include <algorithm>
#include <iterator>

namespace dyntape {

ConditionId Conditions::find_or_add(Kind kind, std::uint32_t a, std::uint32_t b) {
  const auto [at, is_new] = found_.try_emplace({kind, a, b}, static_cast<ConditionId>(rows_.size()));
  if (is_new) rows_.push_back({kind, a, b});
  return at->second;
}

ConditionId Conditions::is(NodeId node, bool positive) {
  if (graph_.is_constant(node)) return (graph_.constant_value(node) != 0) == positive ? kAlways : kNever;
  return find_or_add(positive ? Kind::kIs : Kind::kIsNot, node, 0);
}

bool Conditions::opposite(ConditionId a, ConditionId b) const {
  const Row &x = rows_[a], &y = rows_[b];
  return x.a == y.a &&
         ((x.kind == Kind::kIs && y.kind == Kind::kIsNot) || (x.kind == Kind::kIsNot && y.kind == Kind::kIs));
}

// Whether one condition was made of another, in one step.
bool Conditions::is_part(ConditionId whole, ConditionId part, Kind kind) const {
  const Row& row = rows_[whole];
  return row.kind == kind && (row.a == part || row.b == part);
}

ConditionId Conditions::both(ConditionId a, ConditionId b) {
  if (a == b || b == kAlways || a == kNever) return a;
  if (a == kAlways || b == kNever) return b;
  if (opposite(a, b)) return kNever;
  if (is_part(a, b, Kind::kBoth) || is_part(b, a, Kind::kEither)) return a;
  if (is_part(b, a, Kind::kBoth) || is_part(a, b, Kind::kEither)) return b;
  return find_or_add(Kind::kBoth, a, b);
}

ConditionId Conditions::either(ConditionId a, ConditionId b) {
  if (a == b || b == kNever || a == kAlways) return a;
  if (a == kNever || b == kAlways) return b;
  if (opposite(a, b)) return kAlways;
  if (is_part(a, b, Kind::kEither) || is_part(b, a, Kind::kBoth)) return a;
  if (is_part(b, a, Kind::kEither) || is_part(a, b, Kind::kBoth)) return b;
  return either_of_parts(a, b);
}

// Of few parts each set is one condition, in whatever order it came together.
ConditionId Conditions::either_of_parts(ConditionId a, ConditionId b) {
  const auto parts_of = [&](ConditionId c) {
    return rows_[c].kind == Kind::kEither ? rows_[c].parts : Set{c};
  };
  const Set x = parts_of(a), y = parts_of(b);
  Set parts;
  std::set_union(x.begin(), x.end(), y.begin(), y.end(), std::back_inserter(parts));
  const bool are_known = !x.empty() && !y.empty() && parts.size() <= kMostParts;
  if (are_known) {
    if (parts == x) return a;
    if (parts == y) return b;
    if (const auto known = by_parts_.find(parts); known != by_parts_.end()) return known->second;
  }
  const ConditionId either = find_or_add(Kind::kEither, std::min(a, b), std::max(a, b));
  if (are_known) {
    by_parts_.emplace(parts, either);
    rows_[either].parts = std::move(parts);
  }
  return either;
}

// Conditions are made of older ones, which come first; without recursion, for a sum of many weights is deep.
NodeId Conditions::truth(ConditionId c) {
  std::vector<ConditionId> wanted = {c};
  while (!wanted.empty()) {
    Row& row = rows_[wanted.back()];
    const bool is_compound = row.kind == Kind::kBoth || row.kind == Kind::kEither;
    if (is_compound && rows_[row.a].node == kNoNode) {
      wanted.push_back(row.a);
    } else if (is_compound && rows_[row.b].node == kNoNode) {
      wanted.push_back(row.b);
    } else {
      if (row.node == kNoNode) row.node = made(row);
      wanted.pop_back();
    }
  }
  return rows_[c].node;
}

NodeId Conditions::made(const Row& row) {
  const NodeId one = graph_.constant(1), zero = graph_.constant(0);
  switch (row.kind) {
    case Kind::kAlways:
      return one;
    case Kind::kNever:
      return zero;
    case Kind::kIs:
      return row.a;
    case Kind::kIsNot:
      return graph_.make(Op::Select, row.a, zero, one);
    case Kind::kBoth:
      return graph_.make(Op::Select, rows_[row.a].node, rows_[row.b].node, zero);
    case Kind::kEither:
      return graph_.make(Op::Select, rows_[row.a].node, one, rows_[row.b].node);
  }
  return kNoNode;
}

NodeId Conditions::select(ConditionId c, NodeId value, NodeId otherwise) {
  const Row& row = rows_[c];
  return row.kind == Kind::kIsNot ? graph_.make(Op::Select, row.a, otherwise, value)
                                  : graph_.make(Op::Select, truth(c), value, otherwise);
}

}  // namespace dyntape
