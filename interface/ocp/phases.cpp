// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocp/phases.h>

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

}  // namespace dyntape
