// SPDX-License-Identifier: BSD-3-Clause
//
// A tangent or an adjoint that a sweep passes from node to node, with the conditions under which it is not zero.
//
//   Flows flows(graph);
//   flows.add(sum, {value, flows.conditions().is(branch)});
//   NodeId derivative = flows.value_of(sum);
//
// Slopes multiply as numbers do: 0 * inf is NaN.  Exception: a term that does not contribute at all (a branch that
// is not taken, a weight of zero) is zero.  A flow that has met a possibly infinite slope stores the conditions; it
// is masked at its end or where it is added to another flow.  Internal to the derivation.
#pragma once

#include <dyntape/autodiff/derive/condition.h>

namespace dyntape {

struct Flow {
  NodeId value = kNoNode;
  ConditionId live = kAlways;      // the branches on its way are taken
  ConditionId weighted = kAlways;  // at least one weight of its sources is not zero
  bool cut = false;                // the value may be non-zero although the flow is not live
  bool wild = false;               // the value may be anything if either condition is false

  bool exists() const { return value != kNoNode; }
};

class Flows {
 public:
  explicit Flows(Graph& graph) : graph_(graph), conditions_(graph) {}

  Conditions& conditions() { return conditions_; }

  // sum += more; drops a constant zero.
  void add(Flow& sum, Flow more);
  // The flow with value zero where it does not contribute; keeps its conditions.
  Flow masked(Flow flow);
  NodeId value_of(const Flow& flow) { return masked(flow).value; }
  // The flow through one side of a selection, to be cut later.
  Flow through_branch(Flow flow, NodeId condition, bool positive);
  // The flow after a gate with this condition.
  Flow through_gate(Flow flow, NodeId condition);
  // A node that is not zero where the flow contributes: 1, or a gate if weights decide.
  NodeId alive(const Flow& flow);
  // Sets the conditions of sum to those under which one of the two contributes.
  void unite(Flow& sum, const Flow& more);

 private:
  Flow gated(Flow flow);
  void join(Flow& sum, Flow more);

  Graph& graph_;
  Conditions conditions_;
};

}  // namespace dyntape
