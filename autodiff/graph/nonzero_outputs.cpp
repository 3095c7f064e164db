// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/graph/nonzero_outputs.h>

#include <cmath>
#include <unordered_map>

namespace dyntape {

NonzeroOutputs nonzero_outputs(const Function& function) {
  NonzeroOutputs result;
  std::vector<std::size_t> kept;
  std::unordered_map<NodeId, std::int32_t> met;
  for (std::size_t i = 0; i < function.n_y(); ++i) {
    const NodeId node = function.outputs[i];
    if (function.graph.is_constant(node, 0)) {
      const bool is_negative = std::signbit(function.graph.constant_value(node));
      result.place.push_back(is_negative ? NonzeroOutputs::kNegativeZero : NonzeroOutputs::kZero);
      continue;
    }
    const auto [entry, is_new] = met.emplace(node, std::int32_t(kept.size()));
    if (is_new) kept.push_back(i);
    result.place.push_back(entry->second);
  }
  result.function = select_outputs(function, kept);
  return result;
}

void NonzeroOutputs::expand(const double* nonzeros, double* outputs) const {
  for (std::size_t i = 0; i < place.size(); ++i)
    outputs[i] = place[i] >= 0 ? nonzeros[place[i]] : place[i] == kZero ? 0.0 : -0.0;
}

}  // namespace dyntape
