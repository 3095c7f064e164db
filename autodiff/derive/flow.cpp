// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/derive/flow.h>

namespace dyntape {

void Flows::add(Flow& sum, Flow more) {
  if (more.live == kNever || more.weighted == kNever || graph_.is_constant(more.value, 0)) return;
  if (!sum.exists()) {
    sum = more;
  } else {
    join(sum, more);
  }
}

Flow Flows::through_branch(Flow flow, NodeId condition, bool positive) {
  flow.live = conditions_.both(flow.live, conditions_.is(condition, positive));
  flow.cut = flow.live != kAlways;
  return flow;
}

void Flows::join(Flow& sum, Flow more) {
  if (sum.live == more.live && sum.weighted == more.weighted) {  // as nearly always
    sum.value = graph_.make(Op::Add, sum.value, more.value);
    sum.cut = sum.cut || more.cut;
    sum.wild = sum.wild || more.wild;
    return;
  }
  if (sum.weighted != more.weighted) {
    // What is without a number only where the sum is without weights waits for the sum's gate.
    const ConditionId either = conditions_.either(sum.weighted, more.weighted);
    if (sum.weighted != either || sum.live != more.live) sum = gated(sum);
    if (more.weighted != either || sum.live != more.live) more = gated(more);
  }
  Flow joined;
  if (sum.live == more.live || conditions_.opposite(sum.live, more.live)) {
    joined.cut = sum.live == more.live && (sum.cut || more.cut);
    joined.wild = sum.wild || more.wild;
    joined.value = sum.live == more.live
                       ? graph_.make(Op::Add, sum.value, more.value)
                       : conditions_.select(sum.live, sum.value, more.value);  // one each way
  } else {
    sum = masked(sum), more = masked(more);
    joined.value = graph_.make(Op::Add, sum.value, more.value);
  }
  unite(sum, more);
  joined.live = sum.live, joined.weighted = sum.weighted;
  sum = joined;
}

void Flows::unite(Flow& sum, const Flow& more) {
  if (sum.weighted == more.weighted) {
    sum.live = conditions_.either(sum.live, more.live);
  } else if (sum.live == more.live) {
    sum.weighted = conditions_.either(sum.weighted, more.weighted);
  } else {
    sum.weighted = conditions_.either(conditions_.both(sum.live, sum.weighted),
                                      conditions_.both(more.live, more.weighted));
    sum.live = kAlways;
  }
}

// Without a value where its weights are zero.  Where it is not live it may still have one.
Flow Flows::gated(Flow flow) {
  if (!flow.wild) return flow;
  if (flow.weighted != kAlways) {
    flow.value = graph_.make(Op::Gate, conditions_.truth(flow.weighted), flow.value);
  }
  flow.cut = flow.live != kAlways;
  flow.wild = false;
  return flow;
}

Flow Flows::masked(Flow flow) {
  flow = gated(flow);
  if (flow.cut) flow.value = conditions_.select(flow.live, flow.value, graph_.constant(0));
  flow.cut = false;
  return flow;
}

// Its value is behind the gate already.
Flow Flows::through_gate(Flow flow, NodeId condition) {
  const ConditionId open = conditions_.is(condition);
  if (flow.wild && (flow.weighted == kAlways || flow.weighted == open)) {
    flow.wild = false;
    flow.cut = flow.live != kAlways;
  }
  flow.weighted = conditions_.both(flow.weighted, open);
  return flow;
}

NodeId Flows::alive(const Flow& flow) {
  const NodeId live = conditions_.truth(flow.live);
  return flow.weighted == kAlways ? live : graph_.make(Op::Gate, conditions_.truth(flow.weighted), live);
}

}  // namespace dyntape
