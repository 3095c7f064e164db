// SPDX-License-Identifier: BSD-3-Clause
//
// scene.rollout: many motions of a scene at once, from states and commands or a policy of one's own, and their Jacobians.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <vector>

#include <dyntape/autodiff/error.h>
#include "../scenes.h"
#include "../watch.h"
#include "policy.h"

namespace dyntape::python {
namespace {

// What a caller says.
struct Request {
  std::string call;  // the method
  nb::handle x0, u;
  std::optional<std::size_t> steps;
  std::shared_ptr<const RecordedFunction> policy;
  nb::handle parameters;
};

// What is rolled out: x0 (worlds x nx), u (worlds x steps x n_u), either one for all; or a policy in place of u.
struct Plan {
  std::size_t worlds = 1, steps = 0, nx = 0;
  bool is_batch = true;
  Numbers x0, u;
  std::optional<Policy> policy = {};
  std::size_t x_stride = 0, u_stride = 0;  // doubles from world to world

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

std::size_t worlds_of(const std::string& what, std::size_t here, std::size_t before) {
  if (before != 1 && here != 1 && before != here) {
    throw ArgumentError("rollout: x0 is of " + std::to_string(before) + " worlds, and " + what + " of " +
                        std::to_string(here) + "; expected the same number, or one");
  }
  return before == 1 ? here : before;
}
std::size_t worlds_of(const std::string& what, const Numbers& given, std::size_t axes, std::size_t before) {
  if (given.shape.size() < axes) return before;
  return worlds_of(what, static_cast<std::size_t>(given.shape[0]), before);
}

void check_axes(const std::string& what, const Numbers& given, const std::string& expected, std::size_t axes,
                int entries) {
  const bool fits =
      (given.shape.size() == axes || given.shape.size() + 1 == axes) && given.shape.back() == entries;
  if (!fits)
    throw ArgumentError("rollout: expected " + what + " of shape " + expected + ", got " +
                        shape_text(given.shape));
}

// What the commands are: given, those of the scene, or of a policy.
void plan_commands(Plan& plan, const Request& request, const SceneRollout& steps) {
  const Scene& scene = steps.scene();
  const int n_u = steps.n_u();
  const std::string m = std::to_string(n_u);
  if (request.policy && !request.u.is_none())
    throw ArgumentError(request.call + ": u and policy both say what the motors do; expected one of them");
  if (!request.policy && !request.parameters.is_none())
    throw ArgumentError(request.call +
                        ": parameters are those of a policy; expected policy, a dyntape.Function");
  if (request.u.is_none()) {
    plan.steps = request.steps.value_or(static_cast<std::size_t>(scene.steps()));
    constexpr std::size_t kMost = 1'000'000'000;
    if (plan.steps > kMost)
      throw ArgumentError(std::string(request.call) + ": steps is " + std::to_string(plan.steps) +
                          "; expected at most 1e9");
    if (request.policy)
      plan.policy.emplace(request.policy, request.parameters, request.call, steps.n_x(), n_u);
    else
      plan.u = commands_of(scene, plan.steps, n_u);
    return;
  }
  plan.u = numbers(request.u, "rollout: u");
  check_axes("u", plan.u, "(worlds, steps, " + m + ") or (steps, " + m + ")", 3, n_u);
  plan.steps = static_cast<std::size_t>(plan.u.shape[plan.u.shape.size() - 2]);
  if (request.steps && *request.steps != plan.steps)
    throw ArgumentError("rollout: steps is " + std::to_string(*request.steps) + ", and u is of " +
                        std::to_string(plan.steps));
}

Plan plan_of(const SceneRollout& steps, const Request& request) {
  const int nx = steps.n_x(), n_u = steps.n_u();
  Plan plan;
  plan.nx = static_cast<std::size_t>(nx);
  plan.x0 = numbers(request.x0, "rollout: x0");
  const std::string n = std::to_string(nx);
  check_axes("x0", plan.x0, "(worlds, " + n + ") or (" + n + ",)", 2, nx);
  plan_commands(plan, request, steps);
  const bool has_rows = plan.policy && plan.policy->worlds().has_value();
  plan.is_batch = plan.x0.shape.size() == 2 || plan.u.shape.size() == 3 || has_rows;
  plan.worlds = worlds_of("u", plan.u, 3, worlds_of("x0", plan.x0, 2, 1));
  if (has_rows) plan.worlds = worlds_of("parameters", *plan.policy->worlds(), plan.worlds);
  if (plan.x0.size() > static_cast<std::size_t>(nx)) plan.x_stride = static_cast<std::size_t>(nx);
  const std::size_t of_world = plan.steps * static_cast<std::size_t>(n_u);
  if (plan.u.size() > of_world) plan.u_stride = of_world;
  return plan;
}

Shape shape_of(const Plan& plan, std::initializer_list<std::ptrdiff_t> of_step) {
  Shape shape;
  if (plan.is_batch) shape.push_back(static_cast<std::ptrdiff_t>(plan.worlds));
  shape.push_back(static_cast<std::ptrdiff_t>(plan.steps));
  shape.insert(shape.end(), of_step);
  return shape;
}

// Numbers of all states that are computed before anybody could press a key.
constexpr std::size_t kBriefNumbers = 8192;

using RolloutPart = std::function<void(std::size_t first, std::size_t count, const std::stop_token& stop)>;

void in_parts(const SceneRollout& steps, const Plan& plan, const RolloutPart& part) {
  interruptible(plan.worlds * plan.steps * plan.nx > kBriefNumbers, [&](const std::stop_token& stop) {
    steps.in_parts(plan.worlds, [&](std::size_t first, std::size_t count) {
      if (!stop.stop_requested()) part(first, count, stop);
    });
  });
}

// A launch can take a second, which is left alone: it reads the plan and writes to `states`, memory of `result`.
void roll_on_device(const PythonScene& self, const Plan& plan, const std::string& device, bool single,
                    std::size_t every, const nb::object& result, double* states) {
  const std::shared_ptr<const DeviceRollout> rollout =
      self.steps_on(device, single, plan.policy ? plan.policy->function() : nullptr);
  const bool has_rows = plan.policy && plan.policy->worlds() && plan.policy->n_p() > 0;
  const DeviceRollout::Worlds worlds{.worlds = plan.worlds,
                                     .steps = plan.steps,
                                     .every = every,
                                     .x0 = plan.x0.data,
                                     .u = plan.u.data,
                                     .p = plan.policy ? plan.policy->parameters(0) : nullptr,
                                     .states = states,
                                     .x_stride = plan.x_stride,
                                     .u_stride = plan.u_stride,
                                     .p_stride = has_rows ? plan.policy->n_p() : 0};
  nb::list owner;
  owner.append(result), owner.append(plan.x0.array);
  for (const nb::object& given : {plan.u.array, plan.policy ? plan.policy->given() : nb::object()})
    if (given.is_valid()) owner.append(given);
  left_alone(std::move(owner),
             [rollout, worlds](const std::stop_token& stop) { rollout->run(worlds, stop); });
}

nb::object rollout(const PythonScene& self, nb::handle x0, nb::handle u, std::optional<std::size_t> n_steps,
                   std::shared_ptr<const RecordedFunction> policy, nb::handle parameters, std::size_t every,
                   const std::optional<std::string>& device, bool single) {
  if (every == 0) throw ArgumentError("rollout: every is 0, expected 1 or more");
  if (single && !device) throw ArgumentError("rollout: single: expected a device, got none");
  SceneRollout& steps = self.steps(false);
  const Plan plan = plan_of(steps, {"rollout", x0, u, n_steps, std::move(policy), parameters});
  const auto n_u = static_cast<std::size_t>(steps.n_u());
  const std::size_t kept = plan.steps / every;
  Shape shape = shape_of(plan, {steps.n_x()});
  shape[shape.size() - 2] = static_cast<std::ptrdiff_t>(kept);
  double* states = nullptr;
  nb::object result = new_array(shape, states);
  if (device) {
    roll_on_device(self, plan, *device, single, every, result, states);
    return result;
  }
  in_parts(steps, plan, [&](std::size_t first, std::size_t count, const std::stop_token& stop) {
    std::vector<double> of_policy(plan.policy ? count * n_u : 0);
    const auto law = [&](long k, const WorldRows& at) {
      if (!plan.policy)
        return CommandRows{plan.command(at.first, static_cast<std::size_t>(k), n_u), plan.u_stride};
      plan.policy->commands(at, of_policy.data());
      return CommandRows{of_policy.data(), n_u};
    };
    std::vector<double> all(every > 1 ? count * plan.steps * plan.nx : 0);
    double* const here = states + first * kept * plan.nx;
    steps.run({first, count, plan.start(first), plan.x_stride}, static_cast<long>(plan.steps), law,
              every > 1 ? all.data() : here, stop);
    if (every == 1) return;
    for (std::size_t k = 0; k < count * kept; ++k) {
      const std::size_t row = k / kept * plan.steps + (k % kept + 1) * every - 1;
      std::copy_n(&all[row * plan.nx], plan.nx, here + k * plan.nx);
    }
  });
  return result;
}

WorldSlopes roll_world(SceneRollout& steps, const Plan& plan, std::size_t world, double* states,
                       const std::stop_token& stop) {
  const int n_u = steps.n_u();
  const auto n = static_cast<Eigen::Index>(plan.steps);
  WorldSlopes slopes(n, steps.n_t(), n_u, plan.policy ? static_cast<Eigen::Index>(plan.policy->n_p()) : 0);
  LawSlopes of_law;
  const auto law = [&](long k, const double* x) -> const double* {
    if (!plan.policy) return plan.command(world, static_cast<std::size_t>(k), static_cast<std::size_t>(n_u));
    plan.policy->derivatives(steps.state_model(), x, world, of_law);
    slopes.by_x.middleRows(k * n_u, n_u) = of_law.by_x;
    slopes.by_p.middleRows(k * n_u, n_u) = of_law.by_p;
    return of_law.u.data();
  };
  steps.run(plan.start(world), n, law, states, slopes, stop);
  return slopes;
}

// Parameters of the policy, or none.
Eigen::Index parameters_of(const Plan& plan) {
  return plan.policy ? static_cast<Eigen::Index>(plan.policy->n_p()) : 0;
}

void prepare(Plan& plan) {
  if (plan.policy) watched(nb::none(), [&](const Watch&) { plan.policy->prepare_derivatives(); });
}

nb::tuple rollout_jacobians(const PythonScene& self, nb::handle x0, nb::handle u,
                            std::optional<std::size_t> n_steps,
                            std::shared_ptr<const RecordedFunction> policy, nb::handle parameters) {
  SceneRollout& steps = self.steps(true);
  Plan plan = plan_of(steps, {"rollout_jacobians", x0, u, n_steps, std::move(policy), parameters});
  prepare(plan);
  const int nt = steps.n_t(), n_u = steps.n_u();
  const Eigen::Index n_p = parameters_of(plan), columns = plan.policy ? n_p : n_u;
  double *states = nullptr, *by_x = nullptr, *by_u = nullptr;
  nb::object x = new_array(shape_of(plan, {steps.n_x()}), states);
  nb::object A = new_array(shape_of(plan, {nt, nt}), by_x);
  nb::object B = new_array(shape_of(plan, {nt, columns}), by_u);
  const auto n = static_cast<Eigen::Index>(plan.steps);
  in_parts(steps, plan, [&](std::size_t world, std::size_t, const std::stop_token& stop) {
    const auto row = static_cast<Eigen::Index>(world) * n;
    const WorldSlopes slopes = roll_world(steps, plan, world, states + row * steps.n_x(), stop);
    if (stop.stop_requested()) return;
    auto whole_A = WorldSlopes::Rows::Map(by_x + row * nt * nt, n * nt, nt);
    auto whole_B = WorldSlopes::Rows::Map(by_u + row * nt * columns, n * nt, columns);
    whole_A = slopes.A;
    if (!plan.policy) whole_B = slopes.B;
    for (Eigen::Index k = 0; plan.policy && k < n; ++k) {
      const auto open = slopes.B.middleRows(k * nt, nt);
      whole_A.middleRows(k * nt, nt) += open * slopes.by_x.middleRows(k * n_u, n_u);
      whole_B.middleRows(k * nt, nt) = open * slopes.by_p.middleRows(k * n_u, n_u);
    }
  });
  return nb::make_tuple(x, A, B);
}

Shape without_steps(Shape shape) {
  shape.erase(shape.end() - 2);
  return shape;
}

nb::tuple rollout_gradient(const PythonScene& self, nb::handle x0, nb::handle u, nb::handle weights,
                           std::optional<std::size_t> n_steps, std::shared_ptr<const RecordedFunction> policy,
                           nb::handle parameters, nb::handle command_weights) {
  if (weights.is_none() && command_weights.is_none())
    throw ArgumentError(
        "rollout_gradient: weights and command_weights are None; expected an array of numbers in one of "
        "them");
  SceneRollout& steps = self.steps(true);
  Plan plan = plan_of(steps, {"rollout_gradient", x0, u, n_steps, std::move(policy), parameters});
  prepare(plan);
  const int nx = steps.n_x(), nt = steps.n_t(), n_u = steps.n_u();
  const Eigen::Index n_p = parameters_of(plan);
  Numbers w, c;
  if (!weights.is_none()) w = numbers(weights, "rollout_gradient: weights", shape_of(plan, {nt}));
  if (!command_weights.is_none())
    c = numbers(command_weights, "rollout_gradient: command_weights", shape_of(plan, {n_u}));
  double *states = nullptr, *by_x0 = nullptr, *by_command = nullptr;
  nb::object x = new_array(shape_of(plan, {nx}), states);
  nb::object start = new_array(without_steps(shape_of(plan, {nt})), by_x0);
  const Shape of_commands = plan.policy ? without_steps(shape_of(plan, {n_p})) : shape_of(plan, {n_u});
  nb::object commands = new_array(of_commands, by_command);
  const auto n = static_cast<Eigen::Index>(plan.steps);
  in_parts(steps, plan, [&](std::size_t world, std::size_t, const std::stop_token& stop) {
    const auto at = static_cast<Eigen::Index>(world), row = at * n;
    const WorldSlopes slopes = roll_world(steps, plan, world, states + row * nx, stop);
    if (stop.stop_requested()) return;
    const auto rows_of = [&](const Numbers& given, Eigen::Index entries) {
      return Eigen::MatrixXd::Map(given.data ? given.data + row * entries : nullptr, entries,
                                  given.data ? n : 0);
    };
    const WorldGradient g = gradient_of(slopes, rows_of(w, nt), rows_of(c, n_u), plan.policy.has_value());
    Eigen::VectorXd::Map(by_x0 + at * nt, nt) = g.start;
    if (plan.policy)
      Eigen::VectorXd::Map(by_command + at * n_p, n_p) = g.parameters;
    else
      Eigen::MatrixXd::Map(by_command + row * n_u, n_u, n) = g.commands;
  });
  return nb::make_tuple(x, start, commands);
}

}  // namespace

SceneRollout& PythonScene::steps(bool with_jacobians) const {
  auto& steps = steps_[with_jacobians];
  bool is_made = false;
  {
    const nb::gil_scoped_release unlocked;
    const std::scoped_lock lock(mutex_);
    is_made = steps != nullptr;
  }
  if (!is_made) {
    watched(nb::none(), [&](const Watch& watch) {
      const std::scoped_lock lock(mutex_);
      if (!steps) steps = std::make_unique<SceneRollout>(scene, with_jacobians, watch.stop);
    });
  }
  return *steps;
}

std::shared_ptr<const DeviceRollout> PythonScene::steps_on(const std::string& device, bool single,
                                                           std::shared_ptr<const Function> policy) const {
  const OnDevice key(device, single, policy ? content_hash(*policy) : "");
  {
    const std::scoped_lock lock(mutex_);
    const auto found = on_devices_.find(key);
    if (found != on_devices_.end()) return found->second;
  }
  auto made = left_alone(nb::find(*this), [=, this](const std::stop_token&) {
    return std::make_shared<const DeviceRollout>(scene, DeviceRunOptions{.device = device, .single = single},
                                                 policy.get());
  });
  const std::scoped_lock lock(mutex_);
  return on_devices_.emplace(key, std::move(made)).first->second;
}

void bind_rollouts(nb::class_<PythonScene>& scene) {
  scene.def_prop_ro(
      "nx", [](const PythonScene& s) { return s.steps(false).n_x(); },
      "Entries of a state x = (q, v, motors with a lag).");
  scene.def_prop_ro(
      "nu", [](const PythonScene& s) { return s.steps(false).n_u(); }, "Entries of a command u.");
  scene.def(
      "rollout", rollout, nb::arg("x0"), nb::arg("u") = nb::none(), nb::kw_only(),
      nb::arg("steps") = nb::none(), nb::arg("policy") = nb::none(), nb::arg("parameters") = nb::none(),
      nb::arg("every") = 1, nb::arg("device") = nb::none(), nb::arg("single") = false,
      nb::sig("def rollout(self, x0: ArrayLike, u: ArrayLike | None = None, *, steps: int | None = None, "
              "policy: Function | None = None, parameters: ArrayLike | None = None, every: int = 1, "
              "device: str | None = None, single: bool = False) -> Array"),
      "Many motions at once: the states after each step, (worlds, steps, nx).\n\n"
      "x0: (worlds, nx), or (nx,) for all.  u: (worlds, steps, nu), or (steps, nu) for all, held over each "
      "step, N m\n"
      "or N; by default what the scene tells its motors, for `steps` steps or the duration.\n"
      "policy: in place of u, a recorded function of the state (nx,), and of parameters (n_p,), that returns "
      "the\n"
      "   commands (nu,) at the beginning of each step.  parameters: (worlds, n_p), or (n_p,) for all.\n"
      "every: 1 returns all states, `steps` the last one: (worlds, steps // every, nx).\n"
      "device: \"opencl:0\", the first of `dyntape.devices()`, on which one kernel takes many steps; "
      "explicit "
      "schemes and\n"
      "   compliant contacts; a policy must not branch on values.  The bits are the same, but for friction "
      "(tanh) and "
      "exponents of "
      "contacts\n"
      "   (pow), which are the device's.\n"
      "single: the device computes in float.\n"
      "Without worlds in any of these the result is (steps, nx).  Explicit steps run several worlds to a "
      "register; worlds\n"
      "are shared out among the threads of the process, and none depends on another.  A world that diverges "
      "is NaN from\n"
      "there on.  Ctrl-C stops it.\n\n"
      "Worlds with rigid contacts or hard limits run one by one.\n\n"
      "Raises ArgumentError for wrong shapes, for a world that starts below its ground and for scenes that "
      "no "
      "device takes,\n"
      "ToolError for a device that is not there, GuardViolation where a policy leaves the branch that was "
      "recorded.\n\n"
      ">>> scene = dyntape.Scene(\"config/scenes/pendulum.info\")\n"
      ">>> f = dyntape.record(lambda x, p: [-p[0] * x[0] - p[1] * x[1]], 2, 2)\n"
      ">>> scene.rollout([[0.1, 0], [0.2, 0]], steps=50, policy=f, parameters=[20, 5]).shape\n"
      "(2, 50, 2)");
  scene.def("rollout_jacobians", rollout_jacobians, nb::arg("x0"), nb::arg("u") = nb::none(), nb::kw_only(),
            nb::arg("steps") = nb::none(), nb::arg("policy") = nb::none(), nb::arg("parameters") = nb::none(),
            nb::sig("def rollout_jacobians(self, x0: ArrayLike, u: ArrayLike | None = None, *, "
                    "steps: int | None = None, policy: Function | None = None, parameters: ArrayLike | None "
                    "= None) -> tuple[Array, Array, Array]"),
            "The same states, and the exact Jacobians of each step: x (worlds, steps, nx), A = dx'/dx "
            "(worlds, steps, nt, nt),\n"
            "B = dx'/du (worlds, steps, nt, nu); increments of q in the moving frame on both sides, nt = 2 "
            "nv + lagged\n"
            "motors.  With a policy A is that of the closed loop, and B = dx'/dparameters (worlds, steps, "
            "nt, n_p).\n"
            "Raises ArgumentError for scenes with rigid contacts or hard limits: derivatives of impacts are "
            "not computed.");
  scene.def(
      "rollout_gradient", rollout_gradient, nb::arg("x0"), nb::arg("u") = nb::none(),
      nb::arg("weights") = nb::none(), nb::kw_only(), nb::arg("steps") = nb::none(),
      nb::arg("policy") = nb::none(), nb::arg("parameters") = nb::none(),
      nb::arg("command_weights") = nb::none(),
      nb::sig("def rollout_gradient(self, x0: ArrayLike, u: ArrayLike | None = None, weights: ArrayLike | "
              "None = None, *, steps: int | None = None, policy: Function | None = None, parameters: "
              "ArrayLike | None = None, command_weights: ArrayLike | None = None) -> tuple[Array, Array, "
              "Array]"),
      "The states, and the slopes of sum weights . x + sum command_weights . u by x0 and u in one sweep "
      "back:\n"
      "x (worlds, steps, nx), (worlds, nt), (worlds, steps, nu).  With a policy the last is by its "
      "parameters,\n"
      "(worlds, n_p); the slope of a shared parameter is the sum over the worlds.\n\n"
      "weights: (worlds, steps, nt), by default zero, slopes of a cost by the states, along the tangent "
      "where q has more "
      "entries than v.\n"
      "command_weights: (worlds, steps, nu), slopes of a cost by the commands; by default zero.\n\n"
      ">>> scene = dyntape.Scene(\"config/scenes/pendulum.info\")\n"
      ">>> f = dyntape.record(lambda x, p: [-p[0] * x[0] - p[1] * x[1]], 2, 2)\n"
      ">>> w = np.ones((2, 50, 2))\n"
      ">>> x, by_x0, by_p = scene.rollout_gradient([[0.1, 0], [0.2, 0]], weights=w, steps=50, policy=f, "
      "parameters=[20, 5])\n"
      ">>> by_p.shape\n"
      "(2, 2)");
}

}  // namespace dyntape::python
