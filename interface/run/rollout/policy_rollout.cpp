// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/rollout/policy_rollout.h>

#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/run/rollout/policy_law.h>
#include <dyntape/interface/run/rollout/scene_rollout.h>

namespace dyntape {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct PolicyRollout::Made {
  using Workspace = CompiledFunction::Workspace;

  Made(const Scene& scene, const Function& policy)
      : rollout(scene, false),
        n_p(Index(policy.n_p())),
        law(policy),
        values(CompiledFunction::make(policy, tiered(Order::kValue))) {
    if (policy.n_x() != std::size_t(rollout.n_x()) || policy.n_y() != std::size_t(rollout.n_u()))
      throw ArgumentError("policy \"" + policy.name + "\" takes " + std::to_string(policy.n_x()) +
                          " values and returns " + std::to_string(policy.n_y()) +
                          "; expected a function of the state, " + std::to_string(rollout.n_x()) +
                          " values, that returns the " + std::to_string(rollout.n_u()) +
                          " commands of scene \"" + scene.name + "\"");
  }

  CodegenOptions tiered(Order order) const {
    CodegenOptions options = rollout.scene().evaluation;
    options.order = order;
    if (options.route != Route::kInterpreter) options.route = Route::kTiered;
    return options;
  }

  void check_shapes(const MatrixXd& x0, const MatrixXd& p, int steps) const {
    const auto shape = [](const MatrixXd& m) {
      return std::to_string(m.rows()) + " x " + std::to_string(m.cols());
    };
    if (x0.rows() != rollout.n_x())
      throw ArgumentError("roll-out: expected starts of " + std::to_string(rollout.n_x()) +
                          " x worlds, got " + shape(x0));
    const bool fits = p.rows() == n_p && (p.cols() == 1 || p.cols() == x0.cols());
    if (!fits && !(n_p == 0 && p.size() == 0))
      throw ArgumentError("roll-out: expected parameters of " + std::to_string(n_p) + " x 1 or " +
                          std::to_string(n_p) + " x " + std::to_string(x0.cols()) + ", got " + shape(p));
    if (steps < 0)
      throw ArgumentError("roll-out: got " + std::to_string(steps) + " steps, expected 0 or more");
  }

  const double* parameters(const MatrixXd& p, std::size_t world) const {
    return n_p == 0 ? nullptr : p.col(p.cols() == 1 ? 0 : Index(world)).data();
  }

  void commands(const WorldRows& at, const MatrixXd& p, double* u) {
    Points points;
    points.count = at.count, points.x = at.x, points.p = parameters(p, at.first), points.y = u;
    const Strides strides{.x = at.stride,
                          .p = p.cols() == 1 ? 0 : std::size_t(n_p),
                          .w = 0,
                          .y = std::size_t(rollout.n_u()),
                          .jacobian = 0,
                          .hessian = 0};
    const auto workspace = of_values.take([&] { return std::make_unique<Workspace>(values); });
    evaluate_law(values, *workspace, Order::kValue, points, strides, std::size_t(rollout.n_x()));
  }

  // What gradients need; made for the first of them.
  void make_derivatives() {
    const std::scoped_lock lock(mutex);
    if (linear) return;
    derivatives = CompiledFunction::make(all_as_variables(law), tiered(Order::kFirst));
    linear.emplace(rollout.scene(), true);
  }

  SceneRollout rollout;
  const Index n_p;
  const Function law;
  const CompiledFunction values;
  std::optional<CompiledFunction> derivatives;
  std::optional<SceneRollout> linear;
  std::mutex mutex;
  detail::WorkspacePool<Workspace> of_values, of_slopes;
};

PolicyRollout::PolicyRollout(const Scene& scene, const Function& policy)
    : made_(std::make_unique<Made>(scene, policy)) {}
PolicyRollout::~PolicyRollout() = default;
PolicyRollout::PolicyRollout(PolicyRollout&&) noexcept = default;
PolicyRollout& PolicyRollout::operator=(PolicyRollout&&) noexcept = default;

int PolicyRollout::n_x() const { return made_->rollout.n_x(); }
int PolicyRollout::n_t() const { return made_->rollout.n_t(); }

PolicyMotions PolicyRollout::run(const MatrixXd& x0, const MatrixXd& p, int steps) {
  Made& made = *made_;
  made.check_shapes(x0, p, steps);
  const Index worlds = x0.cols(), n_x = x0.rows();
  const auto n_u = std::size_t(made.rollout.n_u());
  PolicyMotions motions{steps, MatrixXd(n_x, worlds * steps)};
  made.rollout.in_parts(std::size_t(worlds), [&](std::size_t first, std::size_t count) {
    std::vector<double> u(n_u * count);
    const auto law = [&](long, const WorldRows& at) {
      made.commands(at, p, u.data());
      return CommandRows{u.data(), n_u};
    };
    made.rollout.run({first, count, x0.col(Index(first)).data(), std::size_t(n_x)}, steps, law,
                     motions.x.data() + Index(first) * steps * n_x);
  });
  return motions;
}

PolicyGradient PolicyRollout::gradient(const MatrixXd& x0, const MatrixXd& p, int steps,
                                       const CostGradient& by_states) {
  Made& made = *made_;
  made.check_shapes(x0, p, steps);
  made.make_derivatives();
  const Index worlds = x0.cols(), n_t = made.rollout.n_t(), n_u = made.rollout.n_u();
  PolicyGradient result{{steps, MatrixXd(x0.rows(), worlds * steps)},
                        MatrixXd::Zero(n_t, worlds),
                        MatrixXd::Zero(made.n_p, worlds)};
  made.linear->in_parts(std::size_t(worlds), [&](std::size_t task, std::size_t) {
    const auto world = Index(task);
    const auto workspace =
        made.of_slopes.take([&] { return std::make_unique<Made::Workspace>(*made.derivatives); });
    WorldSlopes slopes(steps, n_t, n_u, made.n_p);
    LawSlopes of_law;
    const auto law = [&](long k, const double* x) {
      law_slopes(*made.derivatives, *workspace, made.rollout.state_model(),
                 {x, made.parameters(p, task), std::size_t(x0.rows()), std::size_t(made.n_p)}, of_law);
      slopes.by_x.middleRows(k * n_u, n_u) = of_law.by_x;
      slopes.by_p.middleRows(k * n_u, n_u) = of_law.by_p;
      return of_law.u.data();
    };
    auto states = result.motions.x.middleCols(world * steps, steps);
    made.linear->run(x0.col(world).data(), steps, law, states.data(), slopes);
    MatrixXd weights = MatrixXd::Zero(n_t, steps);
    by_states(world, states, weights);
    if (weights.rows() != n_t || weights.cols() != steps)
      throw ArgumentError("roll-out: expected weights of " + std::to_string(n_t) + " x " +
                          std::to_string(steps) + ", got " + std::to_string(weights.rows()) + " x " +
                          std::to_string(weights.cols()));
    const WorldGradient g = gradient_of(slopes, weights, MatrixXd(), true);
    result.start.col(world) = g.start, result.parameters.col(world) = g.parameters;
  });
  return result;
}

}  // namespace dyntape
