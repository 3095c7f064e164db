// SPDX-License-Identifier: BSD-3-Clause
//
// scene.rollout: many motions of a scene at once, from states and commands of one's own, and their Jacobians.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <limits>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/run/threads.h>
#include <dyntape/interface/system/scene_system.h>

#include "scenes.h"

namespace dyntape::python {
namespace {

// What is rolled out: x0 (worlds x nx), u (worlds x steps x n_u), either one for all.
struct Plan {
  std::size_t worlds = 1, steps = 0;
  bool is_batch = true;
  Numbers x0, u;
  std::size_t x_stride = 0, u_stride = 0;  // doubles from world to world
  Eigen::VectorXd times;                   // (steps) where each begins

  const double* start(std::size_t world) const { return x0.data + world * x_stride; }
  const double* command(std::size_t world, std::size_t step, std::size_t n_u) const {
    return n_u == 0 ? nullptr : u.data + world * u_stride + step * n_u;
  }
};

// (steps x n_u) what the scene itself tells its motors; held over each step.
Numbers commands_of(const Scene& scene, std::size_t steps, int n_u) {
  if (scene.commands.followed) {
    throw ArgumentError("rollout: the commands of scene \"" + scene.name +
                        "\" follow a motion and depend on the state; expected u (worlds, steps, " +
                        std::to_string(n_u) + ")");
  }
  double* data = nullptr;
  Numbers u;
  u.shape = {static_cast<std::ptrdiff_t>(steps), n_u};
  u.array = new_array(u.shape, data);
  u.data = data;
  for (std::size_t k = 0; k < steps; ++k) {
    const Eigen::VectorXd at = scene.commands.at((double(k) + 0.5) * scene.step, {});
    std::copy_n(at.data(), n_u, data + k * static_cast<std::size_t>(n_u));
  }
  return u;
}

std::size_t worlds_of(const std::string& what, const Numbers& given, std::size_t axes, std::size_t before) {
  if (given.shape.size() < axes) return before;
  const auto here = static_cast<std::size_t>(given.shape[0]);
  if (before != 1 && here != 1 && before != here) {
    throw ArgumentError("rollout: x0 is of " + std::to_string(before) + " worlds, and " + what + " of " +
                        std::to_string(here) + "; expected the same number, or one");
  }
  return before == 1 ? here : before;
}

void check_axes(const std::string& what, const Numbers& given, const std::string& expected, std::size_t axes,
                int entries) {
  const bool fits =
      (given.shape.size() == axes || given.shape.size() + 1 == axes) && given.shape.back() == entries;
  if (!fits)
    throw ArgumentError("rollout: expected " + what + " of shape " + expected + ", got " +
                        shape_text(given.shape));
}

Plan plan_of(const SceneSteps& steps, nb::handle x0, nb::handle u, std::optional<std::size_t> n_steps) {
  const Scene& scene = steps.scene;
  const int nx = steps.first.nx(), n_u = steps.first.n_u();
  Plan plan;
  plan.x0 = numbers(x0, "rollout: x0");
  const std::string n = std::to_string(nx), m = std::to_string(n_u);
  check_axes("x0", plan.x0, "(worlds, " + n + ") or (" + n + ",)", 2, nx);
  if (u.is_none()) {
    plan.steps = n_steps.value_or(static_cast<std::size_t>(scene.steps()));
    plan.u = commands_of(scene, plan.steps, n_u);
  } else {
    plan.u = numbers(u, "rollout: u");
    check_axes("u", plan.u, "(worlds, steps, " + m + ") or (steps, " + m + ")", 3, n_u);
    plan.steps = static_cast<std::size_t>(plan.u.shape[plan.u.shape.size() - 2]);
    if (n_steps && *n_steps != plan.steps)
      throw ArgumentError("rollout: steps is " + std::to_string(*n_steps) + ", and u is of " +
                          std::to_string(plan.steps));
  }
  plan.is_batch = plan.x0.shape.size() == 2 || plan.u.shape.size() == 3;
  plan.worlds = worlds_of("u", plan.u, 3, worlds_of("x0", plan.x0, 2, 1));
  if (plan.x0.size() > static_cast<std::size_t>(nx)) plan.x_stride = static_cast<std::size_t>(nx);
  const std::size_t of_world = plan.steps * static_cast<std::size_t>(n_u);
  if (plan.u.size() > of_world) plan.u_stride = of_world;
  plan.times = Eigen::VectorXd::LinSpaced(Eigen::Index(plan.steps), 0, double(plan.steps) - 1) * scene.step;
  return plan;
}

Shape shape_of(const Plan& plan, std::initializer_list<std::ptrdiff_t> of_step) {
  Shape shape;
  if (plan.is_batch) shape.push_back(static_cast<std::ptrdiff_t>(plan.worlds));
  shape.push_back(static_cast<std::ptrdiff_t>(plan.steps));
  shape.insert(shape.end(), of_step);
  return shape;
}

// Worlds that a thread takes at a time: a multiple of all lanes.
constexpr std::size_t kWorlds = 16;

void in_parts(const Plan& plan, std::size_t at_a_time,
              const std::function<void(std::size_t, std::size_t)>& part) {
  const nb::gil_scoped_release unlocked;
  codegen::run_tasks((plan.worlds + at_a_time - 1) / at_a_time, [&](std::size_t k) {
    const std::size_t first = k * at_a_time;
    part(first, std::min(at_a_time, plan.worlds - first));
  });
}

nb::object rollout(const PythonScene& self, nb::handle x0, nb::handle u, std::optional<std::size_t> n_steps) {
  SceneSteps& steps = self.steps(false);
  const Plan plan = plan_of(steps, x0, u, n_steps);
  const auto nx = static_cast<std::size_t>(steps.first.nx()),
             n_u = static_cast<std::size_t>(steps.first.n_u());
  double* states = nullptr;
  nb::object result = new_array(shape_of(plan, {steps.first.nx()}), states);
  const std::size_t of_world = plan.steps * nx;
  in_parts(plan, kWorlds, [&](std::size_t first, std::size_t count) {
    const auto stepper = steps.pool.take([&] { return steps.stepper(); });
    for (std::size_t k = 0; k < plan.steps; ++k) {
      StateRows rows;
      rows.count = count;
      rows.t = &plan.times[Eigen::Index(k)], rows.stride_t = 0;
      rows.x = k == 0 ? plan.start(first) : states + first * of_world + (k - 1) * nx;
      rows.stride_x = k == 0 ? plan.x_stride : of_world;
      rows.u = plan.command(first, k, n_u), rows.stride_u = plan.u_stride;
      rows.x_next = states + first * of_world + k * nx, rows.stride_next = of_world;
      stepper->steps(steps.scene.step, rows);  // what fails is NaN from here on, in its own rows
    }
  });
  return result;
}

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// The steps of one world with their Jacobians; NaN from a step that failed on.
void roll_world(SceneSteps& steps, const Plan& plan, std::size_t world, double* states, double* by_x,
                double* by_u) {
  const int nx = steps.first.nx(), nt = steps.first.nt(), n_u = steps.first.n_u();
  const auto stepper = steps.pool.take([&] { return steps.stepper(); });
  Eigen::VectorXd x = Eigen::VectorXd::Map(plan.start(world), nx), next(nx);
  Eigen::MatrixXd A, B, P;
  bool goes_on = true;
  for (std::size_t k = 0; k < plan.steps; ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    goes_on = goes_on && stepper->jacobians(plan.times[row], steps.scene.step, x.data(),
                                            plan.command(world, k, static_cast<std::size_t>(n_u)), nullptr,
                                            next.data(), A, B, P);
    if (!goes_on) {
      const double none = std::numeric_limits<double>::quiet_NaN();
      next.setConstant(none), A.setConstant(nt, nt, none), B.setConstant(nt, n_u, none);
    }
    Eigen::VectorXd::Map(states + row * nx, nx) = next;
    RowMajor::Map(by_x + row * nt * nt, nt, nt) = A;
    RowMajor::Map(by_u + row * nt * n_u, nt, n_u) = B;
    x = next;
  }
}

nb::tuple rollout_jacobians(const PythonScene& self, nb::handle x0, nb::handle u,
                            std::optional<std::size_t> n_steps) {
  SceneSteps& steps = self.steps(true);
  const Plan plan = plan_of(steps, x0, u, n_steps);
  const int nt = steps.first.nt();
  double *states = nullptr, *by_x = nullptr, *by_u = nullptr;
  nb::object x = new_array(shape_of(plan, {steps.first.nx()}), states);
  nb::object A = new_array(shape_of(plan, {nt, nt}), by_x);
  nb::object B = new_array(shape_of(plan, {nt, steps.first.n_u()}), by_u);
  in_parts(plan, 1, [&](std::size_t world, std::size_t) {
    const auto row = static_cast<std::ptrdiff_t>(world * plan.steps);
    roll_world(steps, plan, world, states + row * steps.first.nx(), by_x + row * nt * nt,
               by_u + row * nt * steps.first.n_u());
  });
  return nb::make_tuple(x, A, B);
}

// One world: lambda_k = w_k + A_{k+1}^T lambda_{k+1}, slopes by u are B_k^T lambda_k, by x0 A_0^T lambda_0.
void sweep_back(const RowMajor& A, const RowMajor& B, const RowMajor& weights, Eigen::VectorXd& by_x0,
                RowMajor& by_u) {
  const Eigen::Index steps = weights.rows(), nt = weights.cols();
  Eigen::VectorXd lambda = Eigen::VectorXd::Zero(nt);
  for (Eigen::Index k = steps; k-- > 0;) {
    lambda += weights.row(k).transpose();
    by_u.row(k) = (B.middleRows(k * nt, nt).transpose() * lambda).transpose();
    lambda = (A.middleRows(k * nt, nt).transpose() * lambda).eval();
  }
  by_x0 = lambda;
}

nb::tuple rollout_gradient(const PythonScene& self, nb::handle x0, nb::handle u, nb::handle weights) {
  SceneSteps& steps = self.steps(true);
  const Plan plan = plan_of(steps, x0, u, std::nullopt);
  const int nx = steps.first.nx(), nt = steps.first.nt(), n_u = steps.first.n_u();
  const Numbers w = numbers(weights, "rollout_gradient: weights", shape_of(plan, {nt}));
  double *states = nullptr, *by_x0 = nullptr, *by_u = nullptr;
  nb::object x = new_array(shape_of(plan, {nx}), states);
  Shape of_start = shape_of(plan, {nt});
  of_start.erase(of_start.end() - 2);
  nb::object start = new_array(of_start, by_x0), commands = new_array(shape_of(plan, {n_u}), by_u);
  const auto n = static_cast<Eigen::Index>(plan.steps);
  in_parts(plan, 1, [&](std::size_t world, std::size_t) {
    const auto row = static_cast<Eigen::Index>(world) * n;
    RowMajor A(n * nt, nt), B(n * nt, n_u), slopes(n, n_u);
    roll_world(steps, plan, world, states + row * nx, A.data(), B.data());
    Eigen::VectorXd of_x0;
    sweep_back(A, B, RowMajor::Map(w.data + row * nt, n, nt), of_x0, slopes);
    Eigen::VectorXd::Map(by_x0 + static_cast<Eigen::Index>(world) * nt, nt) = of_x0;
    RowMajor::Map(by_u + row * n_u, n, n_u) = slopes;
  });
  return nb::make_tuple(x, start, commands);
}

// Several states in registers, of explicit schemes.
CodegenOptions options_of(const Scene& scene) {
  CodegenOptions options = scene.evaluation;
  const bool is_explicit =
      scene.integrator == Integrator::kRungeKutta4 || scene.integrator == Integrator::kSemiImplicitEuler;
  if (is_explicit) options.lanes = Lanes::kNative;
  return options;
}

void check_can_roll(const Scene& scene) {
  if (scene.robot.constraints.rigid.empty()) return;
  throw ArgumentError(
      "rollout: scene \"" + scene.name +
      "\" has rigid contacts or hard limits, whose steps depend on each other; expected a scene "
      "without them, or simulate()");
}

}  // namespace

SceneSteps::SceneSteps(const Scene& of, bool jacobians)
    : scene(of),
      options(options_of(of)),
      with_jacobians(jacobians),
      first(system_of(of.robot), of.integrator, options, jacobians, 1, of.tolerances) {}

std::unique_ptr<Stepper> SceneSteps::stepper() const {
  if (!with_jacobians) return std::make_unique<Stepper>(first.twin());
  return std::make_unique<Stepper>(system_of(scene.robot), scene.integrator, options, true, 1,
                                   scene.tolerances);
}

SceneSteps& PythonScene::steps(bool with_jacobians) const {
  check_can_roll(scene);
  const nb::gil_scoped_release unlocked;
  const std::scoped_lock lock(mutex_);
  auto& steps = steps_[with_jacobians];
  if (!steps) steps = std::make_unique<SceneSteps>(scene, with_jacobians);
  return *steps;
}

void bind_rollouts(nb::class_<PythonScene>& scene) {
  scene.def_prop_ro(
      "nx", [](const PythonScene& s) { return s.steps(false).first.nx(); },
      "Entries of a state x = (q, v, motors with a lag).");
  scene.def_prop_ro(
      "nu", [](const PythonScene& s) { return s.steps(false).first.n_u(); }, "Entries of a command u.");
  scene.def(
      "rollout", rollout, nb::arg("x0"), nb::arg("u") = nb::none(), nb::kw_only(),
      nb::arg("steps") = nb::none(),
      nb::sig("def rollout(self, x0: ArrayLike, u: ArrayLike | None = None, *, steps: int | None = None) -> "
              "Array"),
      "Many motions at once: the states after each step, (worlds, steps, nx).\n\n"
      "x0: (worlds, nx), or (nx,) for all.  u: (worlds, steps, nu), or (steps, nu) for all, held over each "
      "step, N m\n"
      "or N; by default what the scene tells its motors, for `steps` steps or the duration.  Without worlds "
      "in either\n"
      "the result is (steps, nx).  Explicit steps run several worlds to a register; worlds are shared out "
      "among the\n"
      "threads of the process, and none depends on another.  A world that diverges is NaN from there on.\n\n"
      "Raises ArgumentError for wrong shapes and for scenes with rigid contacts or hard limits.");
  scene.def("rollout_jacobians", rollout_jacobians, nb::arg("x0"), nb::arg("u") = nb::none(), nb::kw_only(),
            nb::arg("steps") = nb::none(),
            nb::sig("def rollout_jacobians(self, x0: ArrayLike, u: ArrayLike | None = None, *, "
                    "steps: int | None = None) -> tuple[Array, Array, Array]"),
            "The same states, and the exact Jacobians of each step: x (worlds, steps, nx), A = dx'/dx "
            "(worlds, steps, nt, nt),\n"
            "B = dx'/du (worlds, steps, nt, nu); increments of q in the moving frame on both sides, nt = 2 "
            "nv + lagged\n"
            "motors.");
  scene.def(
      "rollout_gradient", rollout_gradient, nb::arg("x0"), nb::arg("u"), nb::arg("weights"),
      nb::sig("def rollout_gradient(self, x0: ArrayLike, u: ArrayLike, weights: ArrayLike) -> tuple[Array, "
              "Array, Array]"),
      "The states, and the slopes of sum weights . x by x0 and u in one sweep back: x (worlds, steps, nx),\n"
      "(worlds, nt), (worlds, steps, nu).  weights: (worlds, steps, nt), slopes of a cost by the states, "
      "along the tangent\n"
      "where q has more entries than v.");
}

}  // namespace dyntape::python
