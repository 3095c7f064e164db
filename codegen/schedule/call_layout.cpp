// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/schedule/call_layout.h>

#include <algorithm>
#include <map>

#include <dyntape/autodiff/graph/callee.h>

namespace dyntape::codegen {
namespace {

constexpr std::size_t kLong = 64;
// The arguments and results of all short calls of a function lie on the stack: 32 kB in eight lanes.
constexpr std::size_t kShortTogether = 512;

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
    find_outputs(function);
  }

  void find_outputs(const Function& function) {
    for (std::size_t k = 0; k < function.outputs.size(); ++k) {
      std::size_t& output = output_[function.outputs[k]];
      if (output != CallPlace::kInWork) used_[function.outputs[k]] = true;  // it is two outputs
      output = k;
    }
  }

  // The output that a result is and nothing else is made of; kInWork: there is none.
  std::size_t output_of(NodeId call, std::size_t b) const {
    const std::vector<NodeId>& results = of_call_[call];
    return b < results.size() && !used_[results[b]] ? output_[results[b]] : CallPlace::kInWork;
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

// Results that are outputs in all calls of a part, equally far apart.
std::vector<OutputRun> find_runs(const std::vector<NodeId>& calls, std::size_t call, std::size_t n_out,
                                 const Results& results, const std::vector<OutputRange>& groups) {
  constexpr std::size_t kShortest = 4;
  const auto output = [&](std::size_t c, std::size_t b) { return results.output_of(calls[c], b); };
  const auto group_of = [&](std::size_t k) {
    return std::find_if(groups.begin(), groups.end(),
                        [&](const OutputRange& g) { return k >= g.begin && k < g.end; });
  };
  const auto continues = [&](std::size_t begin, std::size_t b) {
    for (std::size_t c = 0; c < calls.size(); ++c) {
      if (output(c, b) == CallPlace::kInWork ||
          output(c, b) - output(c, begin) != output(0, b) - output(0, begin) ||
          group_of(output(c, b)) != group_of(output(0, begin)))
        return false;
    }
    return true;
  };
  std::vector<OutputRun> runs;
  for (std::size_t begin = 0, end = 0; begin < n_out; begin = std::max(end, begin + 1)) {
    for (end = begin; end < n_out && continues(begin, end);) ++end;
    if (end - begin < kShortest) continue;
    OutputRun run{begin, end, output(call, begin), {}};
    for (std::size_t b = begin; b < end; ++b) run.first = std::min(run.first, output(call, b));
    for (std::size_t b = begin; b < end; ++b) run.offsets.push_back(output(call, b) - run.first);
    runs.push_back(std::move(run));
  }
  return runs;
}

}  // namespace

bool CallPlace::writes(std::size_t result) const {
  if (outputs != kInWork) return true;
  const auto run =
      std::partition_point(runs.begin(), runs.end(), [&](const OutputRun& r) { return r.end <= result; });
  return run != runs.end() && result >= run->begin;
}

std::size_t stored_arguments(const Graph& graph, NodeId call) {
  const Callee& callee = *graph.callees()[graph[call].a];
  return callee.is_part() ? callee.recorded()->function->n_x() : call_arity(graph, call);
}

std::vector<CallPlace> place_calls(const Function& function, const std::vector<OutputRange>& groups,
                                   std::size_t& work) {
  const Graph& graph = function.graph;
  const auto n_out = [&](NodeId call) { return graph.callees()[graph[call].a]->n_out; };
  std::vector<CallPlace> places;
  std::size_t short_together = 0;
  for (NodeId id = 0; id < graph.size(); ++id) {
    if (graph[id].op != Op::Call) continue;
    const std::size_t numbers = call_arity(graph, id) + n_out(id);
    const bool is_long = numbers > kLong || short_together + numbers > kShortTogether ||
                         graph.callees()[graph[id].a]->is_part();
    if (is_long) {
      places.push_back({id});
    } else {
      short_together += numbers;
    }
  }
  if (places.empty()) return places;
  const Results results(function);
  std::map<NodeId, std::vector<NodeId>> calls_of;  // by callee, those of parts
  for (const CallPlace& place : places) {
    const NodeId callee = graph[place.call].a;
    if (graph.callees()[callee]->is_part()) calls_of[callee].push_back(place.call);
  }
  const auto reserve = [&](std::size_t slots) {
    work += slots;
    return static_cast<std::uint32_t>(work - slots);
  };
  for (CallPlace& place : places) {
    place.in = reserve(stored_arguments(graph, place.call));
    if (graph.callees()[graph[place.call].a]->is_part()) {
      const std::vector<NodeId>& calls = calls_of[graph[place.call].a];
      const auto number = std::find(calls.begin(), calls.end(), place.call) - calls.begin();
      place.runs = find_runs(calls, static_cast<std::size_t>(number), n_out(place.call), results, groups);
      place.out = reserve(n_out(place.call));
      continue;
    }
    place.outputs = results.outputs_of(place.call, n_out(place.call), groups);
    if (place.outputs == CallPlace::kInWork) place.out = reserve(n_out(place.call));
  }
  return places;
}

}  // namespace dyntape::codegen
