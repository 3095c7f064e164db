// SPDX-License-Identifier: BSD-3-Clause
//
// Configurations of a robot from Python: neutral, random, moved along velocities, and what lies between two.
#include <nanobind/stl/optional.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <random>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/robot/robot_workspace.h>

#include "../robot.h"
#include "limits.h"

namespace dyntape::python {
namespace {

using Eigen::VectorXd;

using Mimic = dynamics::MimicModel<double>;

// Calls f with the robot's model: a MimicModel if joints follow others.
auto with_model(const Robot& robot, const auto& f) {
  return robot.urdf.mimics.empty() ? f(robot.model()) : f(Mimic(robot.model(), robot.urdf.mimics));
}

VectorXd entries_of(const std::vector<int>& places, const VectorXd& full) { return full(places); }

VectorXd neutral(const dynamics::Model<double>& model) { return dynamics::neutral(model); }
VectorXd neutral(const Mimic& model) { return entries_of(model.q_owners, dynamics::neutral(model.full)); }

VectorXd way(const dynamics::Model<double>& model, const VectorXd& from, const VectorXd& to) {
  return dynamics::difference<double>(model, from, to);
}
VectorXd way(const Mimic& model, const VectorXd& from, const VectorXd& to) {
  const VectorXd all = dynamics::difference<double>(model.full, expand_configuration<double>(model, from),
                                                    expand_configuration<double>(model, to));
  return entries_of(model.v_owners, all);
}

nb::object neutral_configuration(const Robot& robot) {
  const VectorXd q = with_model(robot, [](const auto& model) { return neutral(model); });
  return copy_of(q.data(), {q.size()});
}

// Drawn one after the other from a seed: the same numbers on every machine.
nb::object random_configuration(const Robot& robot, std::optional<std::size_t> count, std::uint64_t seed) {
  constexpr std::size_t kMost = std::size_t(1) << 40;  // numbers, 8 TiB
  if (count && *count > kMost / std::size_t(std::max(robot.nq, 1)))
    throw ArgumentError("Robot.random: count is " + std::to_string(*count) +
                        ", which no memory holds; expected at most " +
                        std::to_string(kMost / std::size_t(std::max(robot.nq, 1))));
  std::mt19937_64 random(seed);
  double* data = nullptr;
  const auto rows = static_cast<std::ptrdiff_t>(count.value_or(1));
  nb::object array = new_array(count ? Shape{rows, robot.nq} : Shape{robot.nq}, data);
  const auto draw = [&](const auto& model) {
    for (std::ptrdiff_t i = 0; i < rows; ++i)
      VectorXd::Map(data + i * robot.nq, robot.nq) = dynamics::random_configuration(model, random);
  };
  if (robot.urdf.mimics.empty()) {
    draw(robot.model());
  } else {
    draw(Mimic(with_tied_limits(robot), robot.urdf.mimics));
  }
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
  Rows rows("integrate");
  rows.add(q, "q", static_cast<std::size_t>(robot.nq));
  rows.add(v, "v", static_cast<std::size_t>(robot.nv));
  return with_model(robot, [&](const auto& model) {
    return at_all(rows, "q", robot.nq, robot.nv, robot.nq, [&](const VectorXd& from, const VectorXd& by) {
      return dynamics::integrate<double>(model, from, by);
    });
  });
}

nb::object difference(const Robot& robot, nb::handle q0, nb::handle q1) {
  Rows rows("difference");
  rows.add(q0, "q0", static_cast<std::size_t>(robot.nq));
  rows.add(q1, "q1", static_cast<std::size_t>(robot.nq));
  return with_model(robot, [&](const auto& model) {
    return at_all(rows, "v", robot.nq, robot.nq, robot.nv,
                  [&](const VectorXd& from, const VectorXd& to) { return way(model, from, to); });
  });
}

}  // namespace

void bind_configurations(nb::class_<Robot>& robot) {
  robot.def("neutral", neutral_configuration, nb::sig("def neutral(self) -> Array"),
            "(nq,) all joints at zero.");
  robot.def("random", random_configuration, nb::arg("count") = nb::none(), nb::kw_only(), nb::arg("seed") = 0,
            nb::sig("def random(self, count: int | None = None, *, seed: int = 0) -> Array"),
            "(nq,), or (count, nq): configurations within the joints' limits, the same for the same seed.  "
            "A joint that others follow stays within lower_limits and upper_limits, which keep the "
            "followers' limits too.");
  robot.def(
      "integrate", integrate, nb::arg("q"), nb::arg("v"),
      nb::sig("def integrate(self, q: ArrayLike, v: ArrayLike) -> Array"),
      "q (+) v: q (..., nq) moved by v (..., nv), each joint in its moving frame.  Returns (..., nq).\n\n"
      "Raises ArgumentError for wrong shapes.");
  robot.def("difference", difference, nb::arg("q0"), nb::arg("q1"),
            nb::sig("def difference(self, q0: ArrayLike, q1: ArrayLike) -> Array"),
            "v with q0 (+) v = q1.  q0, q1 (..., nq); returns (..., nv).\n\n"
            "Raises ArgumentError for wrong shapes.");
}

}  // namespace dyntape::python
