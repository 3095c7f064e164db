// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/riccati/stage_checks.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

void refuse_stages(const std::string& what) { throw ArgumentError("solve_with_riccati: " + what); }

void check_stage_options(const NlpShape& shape, const std::vector<double>& start,
                         const SolverOptions& options) {
  if (start.size() != shape.n())
    refuse_stages("the start has " + std::to_string(start.size()) + " entries, the problem has " +
                  std::to_string(shape.n()) + " variables");
  const std::pair<const char*, double> positive[] = {{"tolerance", options.tolerance},
                                                     {"dual tolerance", options.dual_tolerance},
                                                     {"limit of time", options.max_seconds}};
  for (const auto& [name, value] : positive) {
    if (!(value > 0))
      refuse_stages("the " + std::string(name) + " is " + io::shortest(value) +
                    ", expected a number above 0");
  }
  if (!(options.bound_relaxation >= 0))
    refuse_stages("the bound relaxation is " + io::shortest(options.bound_relaxation) +
                  ", expected a number from 0");
  if (options.max_iterations < 0)
    refuse_stages("at most " + std::to_string(options.max_iterations) + " iterations, expected 0 or more");
  if (!options.extra.empty())
    refuse_stages("\"" + options.extra.front().first +
                  "\" is an option of Ipopt's, which this solver does not have");
  if (options.limited_memory)
    refuse_stages("limited memory is an option of Ipopt's, which this solver does not have");
}

bool has_crossed_bounds(const NlpShape& shape) {
  const auto crossed = [](const std::vector<double>& lower, const std::vector<double>& upper) {
    for (std::size_t i = 0; i < lower.size(); ++i) {
      if (!(lower[i] <= upper[i])) return true;
    }
    return false;
  };
  return crossed(shape.x_lower, shape.x_upper) || crossed(shape.g_lower, shape.g_upper);
}

}  // namespace dyntape
