// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/call_places.h>

#include <algorithm>

#include <dyntape/autodiff/callee.h>

namespace dyntape::codegen {
namespace {

constexpr std::size_t kLong = 64;

// What becomes of each result.
class Results {
 public:
  explicit Results(const Function& function)
      : used_(function.graph.size(), false),
        output_(function.graph.size(), CallPlace::kInWork),
        of_call_(function.graph.size()) {
    const Graph& graph = function.graph;
    for (NodeId id = 0; id < graph.size(); ++id) {
      if (graph[id].op == Op::Result) {
        auto& results = of_call_[graph[id].a];
        results.resize(std::max<std::size_t>(results.size(), graph[id].b + 1), id);
        results[graph[id].b] = id;
      } else {
        graph.for_each_argument(id, [&](NodeId a) { used_[a] = true; });
      }
    }
    for (const Guard& guard : function.guards) used_[guard.condition] = true;
    for (std::size_t k = 0; k < function.outputs.size(); ++k) {
      std::size_t& output = output_[function.outputs[k]];
      if (output != CallPlace::kInWork) used_[function.outputs[k]] = true;  // it is two outputs
      output = k;
    }
  }

  // The first output if the results of the call are outputs of one group, in their order, and nothing else.
  std::size_t outputs_of(NodeId call, std::size_t n_out, const std::vector<OutputRange>& groups) const {
    const std::vector<NodeId>& results = of_call_[call];
    if (results.empty() || results.size() < n_out) return CallPlace::kInWork;
    const std::size_t begin = output_[results[0]];
    for (std::size_t b = 0; b < results.size(); ++b) {
      if (used_[results[b]] || output_[results[b]] != begin + b) return CallPlace::kInWork;
    }
    const bool one_group = std::any_of(groups.begin(), groups.end(), [&](const OutputRange& group) {
      return begin >= group.begin && begin + results.size() <= group.end;
    });
    return one_group ? begin : CallPlace::kInWork;
  }

 private:
  std::vector<bool> used_;  // by something else than an output
  std::vector<std::size_t> output_;
  std::vector<std::vector<NodeId>> of_call_;  // by number
};

}  // namespace

std::vector<CallPlace> place_calls(const Function& function, const std::vector<OutputRange>& groups,
                                   std::size_t& work) {
  const Graph& graph = function.graph;
  const auto n_out = [&](NodeId call) { return graph.callees()[graph[call].a]->n_out; };
  std::vector<CallPlace> places;
  for (NodeId id = 0; id < graph.size(); ++id) {
    if (graph[id].op == Op::Call && call_arity(graph, id) + n_out(id) > kLong) places.push_back({id});
  }
  if (places.empty()) return places;
  const Results results(function);
  const auto reserve = [&](std::size_t slots) {
    work += slots;
    return static_cast<std::uint32_t>(work - slots);
  };
  for (CallPlace& place : places) {
    place.in = reserve(call_arity(graph, place.call));
    place.outputs = results.outputs_of(place.call, n_out(place.call), groups);
    if (place.outputs == CallPlace::kInWork) place.out = reserve(n_out(place.call));
  }
  return places;
}

}  // namespace dyntape::codegen
