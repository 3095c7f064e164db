// SPDX-License-Identifier: BSD-3-Clause
//
// Configurations of a robot from Python: neutral, random, moved along velocities, and what lies between two.
#include <nanobind/stl/optional.h>

#include <cstdint>
#include <optional>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/robot/robot_workspace.h>

#include "../robot.h"

namespace dyntape::python {
namespace {

using Eigen::VectorXd;

// A robot whose joints all have entries of their own; of others q is not what configuration.h takes.
void check_is_free(const Robot& robot, const char* what) {
  if (robot.urdf.mimics.empty()) return;
  throw ArgumentError(std::string(what) +
                      ": not for robots whose joints follow others; load it without mimic=True");
}

VectorXd neutral(const Robot& robot) { return dynamics::neutral(robot.model()); }

nb::object neutral_configuration(const Robot& robot) {
  check_is_free(robot, "neutral");
  const VectorXd q = neutral(robot);
  return copy_of(q.data(), {q.size()});
}

// Drawn one after the other from a seed: the same numbers on every machine.
nb::object random_configuration(const Robot& robot, std::optional<std::size_t> count, std::uint64_t seed) {
  check_is_free(robot, "random");
  std::mt19937_64 random(seed);
  double* data = nullptr;
  const auto rows = static_cast<std::ptrdiff_t>(count.value_or(1));
  nb::object array = new_array(count ? Shape{rows, robot.nq} : Shape{robot.nq}, data);
  for (std::ptrdiff_t i = 0; i < rows; ++i)
    VectorXd::Map(data + i * robot.nq, robot.nq) = dynamics::random_configuration(robot.model(), random);
  return array;
}

// result = f(first, second) at every state.
nb::object at_all(const Rows& rows, const char* name, int n_first, int n_second, int n_result,
                  const auto& f) {
  const std::vector<Block> blocks = {{name, {n_result}}};
  const Result result(rows, blocks);
  VectorXd state(n_first + n_second);
  for (std::size_t i = 0; i < rows.count(); ++i) {
    rows.gather(i, 1, state.data());
    VectorXd::Map(result.data() + i * static_cast<std::size_t>(n_result), n_result) =
        f(VectorXd(state.head(n_first)), VectorXd(state.tail(n_second)));
  }
  return result.block(0);
}

nb::object integrate(const Robot& robot, nb::handle q, nb::handle v) {
  check_is_free(robot, "integrate");
  Rows rows("integrate");
  rows.add(q, "q", static_cast<std::size_t>(robot.nq));
  rows.add(v, "v", static_cast<std::size_t>(robot.nv));
  return at_all(rows, "q", robot.nq, robot.nv, robot.nq, [&](const VectorXd& from, const VectorXd& by) {
    return dynamics::integrate<double>(robot.model(), from, by);
  });
}

nb::object difference(const Robot& robot, nb::handle q0, nb::handle q1) {
  check_is_free(robot, "difference");
  Rows rows("difference");
  rows.add(q0, "q0", static_cast<std::size_t>(robot.nq));
  rows.add(q1, "q1", static_cast<std::size_t>(robot.nq));
  return at_all(rows, "v", robot.nq, robot.nq, robot.nv, [&](const VectorXd& from, const VectorXd& to) {
    return dynamics::difference<double>(robot.model(), from, to);
  });
}

}  // namespace

void bind_configurations(nb::class_<Robot>& robot) {
  robot.def("neutral", neutral_configuration, nb::sig("def neutral(self) -> Array"),
            "(nq,) all joints at zero.\n\nRaises ArgumentError for robots whose joints follow others.");
  robot.def("random", random_configuration, nb::arg("count") = nb::none(), nb::kw_only(), nb::arg("seed") = 0,
            nb::sig("def random(self, count: int | None = None, *, seed: int = 0) -> Array"),
            "(nq,), or (count, nq): configurations within the limits, the same for the same seed.\n\n"
            "Raises ArgumentError for robots whose joints follow others.");
  robot.def(
      "integrate", integrate, nb::arg("q"), nb::arg("v"),
      nb::sig("def integrate(self, q: ArrayLike, v: ArrayLike) -> Array"),
      "q (+) v: q (..., nq) moved by v (..., nv), each joint in its moving frame.  Returns (..., nq).\n\n"
      "Raises ArgumentError for wrong shapes and for robots whose joints follow others.");
  robot.def("difference", difference, nb::arg("q0"), nb::arg("q1"),
            nb::sig("def difference(self, q0: ArrayLike, q1: ArrayLike) -> Array"),
            "v with q0 (+) v = q1.  q0, q1 (..., nq); returns (..., nv).\n\n"
            "Raises ArgumentError for wrong shapes and for robots whose joints follow others.");
}

}  // namespace dyntape::python
