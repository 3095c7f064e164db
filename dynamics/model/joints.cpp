// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/model/model.h>

namespace dyntape::dynamics {
namespace {

struct Row {
  const char* name;
  int nq, nv;
};

// In the order of JointType.
constexpr Row kRows[] = {{"revolute", 1, 1},  {"continuous", 2, 1}, {"prismatic", 1, 1}, {"helical", 1, 1},
                         {"spherical", 4, 3}, {"planar", 4, 3},     {"free-flyer", 7, 6}};

}  // namespace

const char* to_string(JointType type) { return kRows[static_cast<int>(type)].name; }
int nq(JointType type) { return kRows[static_cast<int>(type)].nq; }
int nv(JointType type) { return kRows[static_cast<int>(type)].nv; }

}  // namespace dyntape::dynamics
