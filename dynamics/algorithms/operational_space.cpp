// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/algorithms/detail/operational_space.hxx>

#include <cmath>

namespace dyntape::dynamics::detail {

void check_task_rows(const std::vector<int>& rows, const std::string& model) {
  const std::string where = "operational space of model \"" + model + "\": ";
  if (rows.empty()) throw ArgumentError(where + "no rows, expected some of 0 to 5");
  for (size_t i = 0; i < rows.size(); ++i) {
    if (rows[i] < 0 || rows[i] > 5) {
      throw ArgumentError(where + "row " + std::to_string(rows[i]) + ", expected 0 to 5");
    }
    for (size_t j = 0; j < i; ++j) {
      if (rows[j] == rows[i]) throw ArgumentError(where + "row " + std::to_string(rows[i]) + " twice");
    }
  }
}

void check_damping(double damping) {
  if (damping >= 0 && std::isfinite(damping)) return;
  throw ArgumentError("operational_space: damping is " + std::to_string(damping) +
                      ", expected a finite number that is not negative");
}

}  // namespace dyntape::dynamics::detail
