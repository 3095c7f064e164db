// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/model.h>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace dyntape::dynamics::detail {
namespace {

// Levenshtein distance, one row at a time.
size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t substitute = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({substitute, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

int find_name(const std::string& what, const std::string& model_name, const std::string& wanted,
              const std::vector<std::string>& names) {
  const auto found = std::find(names.begin(), names.end(), wanted);
  if (found != names.end()) return static_cast<int>(found - names.begin());
  const std::string where = "model \"" + model_name + "\" has no " + what + " \"" + wanted + "\"";
  if (names.empty()) throw ArgumentError(where + "; it has none at all");
  const auto nearest =
      std::min_element(names.begin(), names.end(), [&](const std::string& a, const std::string& b) {
        return edit_distance(a, wanted) < edit_distance(b, wanted);
      });
  throw ArgumentError(where + "; the nearest is \"" + *nearest + "\"");
}

void check_new_joint(const std::string& name, JointType type, const Eigen::Vector3d& axis, int parent,
                     int njoints) {
  if (parent < -1 || parent >= njoints) {
    throw ArgumentError("add_joint: joint \"" + name + "\" names parent " + std::to_string(parent) +
                        ", expected -1 (the world) to " + std::to_string(njoints - 1));
  }
  const double length = axis.norm();
  if (type != JointType::kFreeFlyer && !(std::abs(length - 1) <= 1e-12)) {
    throw ArgumentError("add_joint: the axis of joint \"" + name + "\" has length " + std::to_string(length) +
                        ", expected 1");
  }
}

}  // namespace dyntape::dynamics::detail
