// SPDX-License-Identifier: BSD-3-Clause
//
// Where the nodes of a mesh stand, and which of them is an instant at which terms stand.
#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/staged_program.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

constexpr double kNodeRounding = 1e-12;    // of the duration
constexpr double kInstantRounding = 1e-9;  // likewise: what a file's digits leave of a third

// The first term that stands at a share, as messages name it.
std::string instant_term(const Problem& problem, double share) {
  const auto stands = [share](const Term& term) { return stands_at(term, share); };
  const auto term = std::find_if(problem.terms.begin(), problem.terms.end(), stands);
  return "problem \"" + problem.name + "\": the term \"" + term->name + "\" is at " + name_of_instant(share);
}

// Instants between start and end, those within rounding of each other once.
std::vector<double> inner_instants(const Problem& problem) {
  std::vector<double> inner;
  for (double share : instants_of(problem)) {
    const double last = inner.empty() ? 0 : inner.back();
    if (share - last > kInstantRounding && 1 - share > kInstantRounding) inner.push_back(share);
  }
  return inner;
}

// Evenly spaced; a node that is nearest to an instant moves there, the others stay evenly spaced between.
std::vector<double> even_nodes(const Problem& problem, int intervals) {
  const double duration = problem.duration;
  std::vector<double> nodes;
  for (int k = 0; k < intervals; ++k) nodes.push_back(duration * k / intervals);
  if (nodes.empty()) return nodes;
  nodes.push_back(duration);
  std::vector<double> to = inner_instants(problem);
  if (int(to.size()) >= intervals)
    refuse(problem, "terms are at " + std::to_string(to.size()) +
                        " instants between start and end, and the mesh has " + std::to_string(intervals) +
                        " intervals; expected " + std::to_string(to.size() + 1) + " at least");
  to.push_back(1);
  int before = 0;
  double from = 0;
  for (std::size_t i = 0; i < to.size(); ++i) {
    const int left = int(to.size() - 1 - i);
    const int node = i + 1 == to.size()
                         ? intervals
                         : std::clamp(int(std::lround(to[i] * intervals)), before + 1, intervals - left);
    const bool is_even = std::abs(from * intervals - before) < kInstantRounding * intervals &&
                         std::abs(to[i] * intervals - node) < kInstantRounding * intervals;
    for (int k = before + 1; k <= node && !is_even; ++k)
      nodes[std::size_t(k)] = duration * (from + (to[i] - from) * (k - before) / (node - before));
    before = node, from = to[i];
  }
  nodes.back() = duration;
  return nodes;
}

}  // namespace

// The last node is the duration itself: duration * k / k, or a sum of steps, may miss it by rounding.
std::vector<double> node_times(const Problem& problem, const MeshOptions& options) {
  const double end = problem.duration;
  std::vector<double> nodes = options.nodes.empty() ? even_nodes(problem, options.intervals) : options.nodes;
  if (!nodes.empty() && std::abs(nodes.back() - end) <= kNodeRounding * end) nodes.back() = end;
  const auto not_later = [](double a, double b) { return !(a < b); };  // NaN included
  const bool increasing = std::adjacent_find(nodes.begin(), nodes.end(), not_later) == nodes.end();
  if (nodes.size() >= 2 && increasing && nodes.front() == 0 && nodes.back() == end) return nodes;
  throw ArgumentError(
      "problem \"" + problem.name +
      "\": a mesh needs at least one interval and increasing node times from 0 to the duration");
}

std::size_t node_at_share(const Problem& problem, double share, const std::vector<double>& nodes) {
  const double t = share * nodes.back();
  const auto nearer = [t](double a, double b) { return std::abs(a - t) < std::abs(b - t); };
  const auto nearest = std::min_element(nodes.begin(), nodes.end(), nearer);
  if (std::abs(*nearest - t) <= kInstantRounding * std::abs(nodes.back()))
    return std::size_t(nearest - nodes.begin());
  throw ArgumentError(instant_term(problem, share) +
                      ", where the mesh has no node; expected one, and the nearest is at " +
                      io::shortest(*nearest / nodes.back()) + " of the duration");
}

}  // namespace dyntape
