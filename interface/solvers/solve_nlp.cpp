// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/solvers/interior_point.h>
#include <dyntape/interface/solvers/ipopt.h>

namespace dyntape {

NlpSolution solve_nlp(Nlp& problem, const std::vector<double>& start, const SolverOptions& options) {
  const auto solve = options.method == NlpMethod::kIpopt ? solve_with_ipopt : solve_by_stages;
  return solve(problem, start, options);
}

}  // namespace dyntape
