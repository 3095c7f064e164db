// SPDX-License-Identifier: BSD-3-Clause
//
// What a sweep carries from node to node: a tangent or an adjoint, and the conditions under which it is not zero.
//
//   Flows flows(graph);
//   flows.add(sum, {value, flows.conditions().is(branch)});
//   NodeId derivative = flows.value_of(sum);
//
// Slopes multiply as numbers do, so that 0 * inf is NaN, except where something does not contribute at all: a
// branch that is not taken, a weight that is zero.  A flow that has met a slope which may be infinite remembers
// the conditions, and is masked where it joins another or ends.  Internal to the derivation.
#pragma once

#include <dyntape/autodiff/derive/condition.h>

namespace dyntape {

struct Flow {
  NodeId value = kNoNode;
  ConditionId live = kAlways;      // the branches that it has come through are taken
  ConditionId weighted = kAlways;  // some weight that it comes from is not zero
  bool cut = false;                // the value may be other than zero where the flow is not live
  bool wild = false;               // nor need it be zero, or a number, where either condition fails

  bool exists() const { return value != kNoNode; }
};

class Flows {
 public:
  explicit Flows(Graph& graph) : graph_(graph), conditions_(graph) {}

  Conditions& conditions() { return conditions_; }

  // sum += more, which is dropped where it is a constant zero.
  void add(Flow& sum, Flow more);
  // The flow with zero as value where it is dead, its conditions kept.
  Flow masked(Flow flow);
  NodeId value_of(const Flow& flow) { return masked(flow).value; }
  // The flow that comes through one side of a selection: cut off later.
  Flow through_branch(Flow flow, NodeId condition, bool positive);
  // What is left of it behind a gate with this condition.
  Flow through_gate(Flow flow, NodeId condition);
  // A node that is not zero where the flow is not dead: 1, or a gate where weights decide.
  NodeId alive(const Flow& flow);
  // The conditions of sum become those under which one of the two contributes.
  void unite(Flow& sum, const Flow& more);

 private:
  Flow gated(Flow flow);
  void join(Flow& sum, Flow more);

  Graph& graph_;
  Conditions conditions_;
};

}  // namespace dyntape
