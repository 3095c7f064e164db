// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/contact/constraints.h>

namespace dyntape::dynamics::detail {

void check_constraint(int rows, int body_1, int body_2, int njoints, const std::string& model) {
  if (rows != 3 && rows != 6) {
    throw ArgumentError("constraint: " + std::to_string(rows) + " rows, expected 3 (point) or 6 (frame)");
  }
  for (int body : {body_1, body_2}) {
    if (body < -1 || body >= njoints) {
      throw ArgumentError("constraint: body " + std::to_string(body) + " does not exist, model \"" + model +
                          "\" has " + std::to_string(njoints) + " (-1: the world)");
    }
  }
  if (body_1 == body_2) {
    throw ArgumentError("constraint: both frames are on body " + std::to_string(body_1) +
                        ", expected two bodies, or a body and the world");
  }
}

}  // namespace dyntape::dynamics::detail
