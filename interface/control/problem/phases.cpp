// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/problem/phases.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>

namespace dyntape {

std::vector<PhaseLink> links_of(const Phases& phases) {
  std::vector<PhaseLink> links;
  for (std::size_t k = 1; k < phases.phases.size(); ++k) links.push_back({k - 1, k, &phases.phases[k].link});
  if (phases.closing) links.push_back({phases.phases.size() - 1, 0, &*phases.closing});
  return links;
}

void check(const Phases& phases) {
  const std::string where = "phases \"" + phases.name + "\": ";
  if (phases.phases.empty()) throw ArgumentError(where + "there are none");
  if (!phases.phases.front().link.empty())
    throw ArgumentError(where + "the first, \"" + phases.phases.front().name +
                        "\", has a link, but nothing is before it; close() ties it to the last");
  for (const Phases::Phase& phase : phases.phases) {
    if (phase.name.empty()) throw ArgumentError(where + "one has no name");
    const auto is_same = [&](const Phases::Phase& other) { return other.name == phase.name; };
    if (std::count_if(phases.phases.begin(), phases.phases.end(), is_same) > 1)
      throw ArgumentError(where + "two are called \"" + phase.name + "\"");
    check(phase.problem);
  }
  for (const PhaseLink& link : links_of(phases)) {
    const Phases::Phase &from = phases.phases[link.from], &to = phases.phases[link.to];
    const Problem& p = from.problem;
    if (link.change->empty()) {
      if (p.n_x() == to.problem.n_x()) continue;
      throw ArgumentError(where + "\"" + from.name + "\" has " + std::to_string(p.n_x()) + " states, \"" +
                          to.name + "\" has " + std::to_string(to.problem.n_x()) +
                          ", and no link says what becomes of them");
    }
    const Eigen::VectorXd next = (*link.change)(p.stage(p.duration, p.first_guess(p.duration).x, {}, {}));
    if (next.size() == to.problem.n_x()) continue;
    throw ArgumentError(where + "the link from \"" + from.name + "\" to \"" + to.name + "\" gives " +
                        std::to_string(next.size()) + " states, expected " +
                        std::to_string(to.problem.n_x()));
  }
}

// Phases that the state passes through unchanged.
std::vector<Problem> told_of_each_other(const Phases& phases) {
  std::vector<Problem> told;
  for (const Phases::Phase& phase : phases.phases) told.push_back(phase.problem);
  const std::size_t n = told.size();
  for (std::size_t first = 0, last; first < n; first = last) {
    for (last = first + 1; last < n && phases.phases[last].link.empty();) ++last;
    Eigen::VectorXd low = told[first].first_guess(0).x, high = low;
    for (std::size_t k = first; k < last; ++k) {
      for (const double t : {0.0, told[k].duration}) {
        const Eigen::VectorXd x = told[k].first_guess(t).x, ends = t == 0 ? told[k].start : told[k].goal;
        const Eigen::VectorXd given = ends.array().isNaN().select(x, ends);
        low = low.cwiseMin(given), high = high.cwiseMax(given);
      }
    }
    for (std::size_t k = first; k < last && last > first + 1; ++k) {
      Eigen::VectorXd& typical = told[k].typical;
      if (typical.size() == 0) typical = Eigen::VectorXd::Zero(low.size());
      typical = (typical.array() > 0).select(typical, high - low);
    }
  }
  return told;
}

}  // namespace dyntape
