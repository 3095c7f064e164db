// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/rollout/policy_rollout.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/run/threads.h>
#include <dyntape/interface/motion/robot_configuration.h>
#include <dyntape/interface/robot/workspace_pool.h>
#include <dyntape/interface/system/scene_system.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kDiverged = std::numeric_limits<double>::quiet_NaN();

// (nx x nt) how the entries of a state (q, v, motors) change with increments of the moving frame.
MatrixXd entries_by_increments(const dynamics::Model<double>& model, const VectorXd& x) {
  const Index nq = model.nq, nv = model.nv, rest = x.size() - nq;
  MatrixXd N = MatrixXd::Zero(nq + rest, nv + rest);
  N.bottomRightCorner(rest, rest).setIdentity();
  const VectorXd q = x.head(nq), none = VectorXd::Zero(nv);
  const VectorXd home = configuration_rate<double>(model, q, none);  // towards directions of length one
  for (Index k = 0; k < nv; ++k)
    N.col(k).head(nq) = configuration_rate<double>(model, q, VectorXd::Unit(nv, k)) - home;
  return N;
}

const Scene& scene_to_roll(const Scene& scene) {
  if (scene.robot.constraints.rigid.empty()) return scene;
  throw ArgumentError(
      "roll-out: scene \"" + scene.name +
      "\" has rigid contacts or hard limits, whose steps depend on each other; expected a scene "
      "without them, or simulate()");
}

// Several states in registers, of explicit schemes.
CodegenOptions options_of_rollout(const Scene& scene) {
  CodegenOptions options = scene.evaluation;
  const bool is_explicit =
      scene.integrator == Integrator::kRungeKutta4 || scene.integrator == Integrator::kSemiImplicitEuler;
  if (is_explicit) options.lanes = Lanes::kNative;
  return options;
}

}  // namespace

struct PolicyRollout::Made {
  // Jacobians of one world: rows of each step one below the other.
  struct Slopes {
    Slopes(Index steps, Index nt, Index n_u, Index n_p)
        : A(steps * nt, nt), B(steps * nt, n_u), by_x(steps * n_u, nt), by_p(steps * n_u, n_p) {}
    MatrixXd A, B, by_x, by_p;
  };
  using Workspace = CompiledFunction::Workspace;

  Made(const Scene& of, const Function& policy)
      : scene(scene_to_roll(of)),
        options(options_of_rollout(scene)),
        first(system_of(scene.robot), scene.integrator, options, false, 1, scene.tolerances),
        n_p(Index(policy.n_p())),
        law(policy),
        values(CompiledFunction::make(policy, tiered(Order::kValue))) {
    if (policy.n_x() != std::size_t(first.nx()) || policy.n_y() != std::size_t(first.n_u()))
      throw ArgumentError("policy \"" + policy.name + "\" takes " + std::to_string(policy.n_x()) +
                          " values and returns " + std::to_string(policy.n_y()) +
                          "; expected a function of the state, " + std::to_string(first.nx()) +
                          " values, that returns the " + std::to_string(first.n_u()) +
                          " commands of scene \"" + scene.name + "\"");
  }

  CodegenOptions tiered(Order order) const {
    CodegenOptions of_policy = scene.evaluation;
    of_policy.order = order;
    of_policy.route = options.route == Route::kInterpreter ? Route::kInterpreter : Route::kTiered;
    return of_policy;
  }

  void check_shapes(const MatrixXd& x0, const MatrixXd& p, int steps) const {
    const auto shape = [](const MatrixXd& m) {
      return std::to_string(m.rows()) + " x " + std::to_string(m.cols());
    };
    if (x0.rows() != first.nx())
      throw ArgumentError("roll-out: expected starts of " + std::to_string(first.nx()) + " x worlds, got " +
                          shape(x0));
    const bool fits = p.rows() == n_p && (p.cols() == 1 || p.cols() == x0.cols());
    if (!fits && !(n_p == 0 && p.size() == 0))
      throw ArgumentError("roll-out: expected parameters of " + std::to_string(n_p) + " x 1 or " +
                          std::to_string(n_p) + " x " + std::to_string(x0.cols()) + ", got " + shape(p));
    if (steps < 0)
      throw ArgumentError("roll-out: got " + std::to_string(steps) + " steps, expected 0 or more");
  }

  const double* parameters(const MatrixXd& p, Index world) const {
    return n_p == 0 ? nullptr : p.col(p.cols() == 1 ? 0 : world).data();
  }

  // Commands of worlds from `from` on; NaN where the state is not finite.
  void commands(const double* x, std::size_t stride, Index count, const MatrixXd& p, Index from, double* u) {
    const auto n_x = std::size_t(first.nx()), n_u = std::size_t(first.n_u());
    std::vector<std::uint32_t> status(std::size_t(count), 0);
    const Strides strides{.x = stride,
                          .p = p.cols() == 1 ? 0 : std::size_t(n_p),
                          .w = 0,
                          .y = n_u,
                          .jacobian = 0,
                          .hessian = 0};
    Points points;
    points.count = std::size_t(count), points.x = x, points.p = parameters(p, from), points.y = u;
    points.strides = &strides, points.status = status.data();
    const auto workspace = of_values.take([&] { return std::make_unique<Workspace>(values); });
    if (!values.run(Order::kValue, points, *workspace)) return;
    for (std::size_t k = 0; k < points.count; ++k) {
      if (status[k] == 0) continue;
      const double* at = x + k * stride;
      const bool is_finite = std::all_of(at, at + n_x, [](double e) { return std::isfinite(e); });
      if (is_finite) values.check({status[k], k}, points.count);
      std::fill_n(u + k * n_u, n_u, kDiverged);
    }
  }

  // One world with the Jacobians of its steps and of the policy; NaN from a step that failed on.
  void roll(const VectorXd& start, const double* p, int steps, Eigen::Ref<MatrixXd> states, Slopes& slopes) {
    const Index nt = first.nt(), n_u = first.n_u(), nx = first.nx();
    const auto stepper = with_jacobians.take([&] {
      return std::make_unique<Stepper>(system_of(scene.robot), scene.integrator, options, true, 1,
                                       scene.tolerances);
    });
    const auto workspace = of_slopes.take([&] { return std::make_unique<Workspace>(*derivatives); });
    VectorXd x = start, next(nx), all(nx + n_p), u(n_u);
    if (n_p > 0) all.tail(n_p) = VectorXd::Map(p, n_p);
    const Pattern& pattern = derivatives->jacobian_pattern();
    std::vector<double> nonzeros(pattern.nnz());
    MatrixXd A, B, P;
    bool goes_on = true;
    for (Index k = 0; k < steps; ++k) {
      MatrixXd J = MatrixXd::Zero(n_u, nx + n_p);
      if (goes_on) {
        all.head(nx) = x;
        derivatives->first_order(all.data(), nullptr, u.data(), nonzeros.data(), *workspace);
        for (std::size_t i = 0; i < nonzeros.size(); ++i)
          J(Index(pattern.row[i]), Index(pattern.col[i])) = nonzeros[i];
        goes_on = stepper->jacobians(double(k) * scene.step, scene.step, x.data(), u.data(), nullptr,
                                     next.data(), A, B, P);
      }
      if (!goes_on) {
        next.setConstant(kDiverged), A.setConstant(nt, nt, kDiverged), B.setConstant(nt, n_u, kDiverged);
        J.setConstant(kDiverged);
      }
      states.col(k) = next;
      slopes.A.middleRows(k * nt, nt) = A, slopes.B.middleRows(k * nt, nt) = B;
      slopes.by_x.middleRows(k * n_u, n_u) = J.leftCols(nx) * entries_by_increments(scene.robot.model, x);
      slopes.by_p.middleRows(k * n_u, n_u) = J.rightCols(n_p);
      x = next;
    }
  }

  void make_derivatives() {
    const std::scoped_lock lock(mutex);
    if (!derivatives) derivatives = CompiledFunction::make(all_as_variables(law), tiered(Order::kFirst));
  }

  const Scene scene;
  const CodegenOptions options;
  const Stepper first;
  const Index n_p;
  const Function law;
  const CompiledFunction values;
  std::optional<CompiledFunction> derivatives;
  std::mutex mutex;
  detail::WorkspacePool<Stepper> steppers, with_jacobians;
  detail::WorkspacePool<Workspace> of_values, of_slopes;
};

PolicyRollout::PolicyRollout(const Scene& scene, const Function& policy)
    : made_(std::make_unique<Made>(scene, policy)) {}
PolicyRollout::~PolicyRollout() = default;
PolicyRollout::PolicyRollout(PolicyRollout&&) noexcept = default;
PolicyRollout& PolicyRollout::operator=(PolicyRollout&&) noexcept = default;

int PolicyRollout::n_x() const { return made_->first.nx(); }
int PolicyRollout::n_t() const { return made_->first.nt(); }

PolicyMotions PolicyRollout::run(const MatrixXd& x0, const MatrixXd& p, int steps) {
  constexpr Index kWorlds = 16;  // of a thread at a time: a multiple of all lanes
  Made& made = *made_;
  made.check_shapes(x0, p, steps);
  const Index worlds = x0.cols(), nx = x0.rows(), n_u = made.first.n_u();
  PolicyMotions motions{steps, MatrixXd(nx, worlds * steps)};
  const auto of_world = std::size_t(nx * steps);
  codegen::run_tasks(std::size_t((worlds + kWorlds - 1) / kWorlds), [&](std::size_t part) {
    const Index from = Index(part) * kWorlds, count = std::min(kWorlds, worlds - from);
    const auto stepper = made.steppers.take([&] { return std::make_unique<Stepper>(made.first.twin()); });
    MatrixXd u(n_u, count);
    for (Index k = 0; k < steps; ++k) {
      const double t = double(k) * made.scene.step;
      StateRows rows;
      rows.count = std::size_t(count);
      rows.t = &t, rows.stride_t = 0;
      rows.x = k == 0 ? x0.col(from).data() : motions.x.col(from * steps + k - 1).data();
      rows.stride_x = k == 0 ? std::size_t(nx) : of_world;
      made.commands(rows.x, rows.stride_x, count, p, from, u.data());
      rows.u = u.data(), rows.stride_u = std::size_t(n_u);
      rows.x_next = motions.x.col(from * steps + k).data(), rows.stride_next = of_world;
      stepper->steps(made.scene.step, rows);  // a world that fails is NaN from here on
    }
  });
  return motions;
}

// With lambda_k the gradient by the state after step k, g_k = B_k^T lambda_k and F_k, P_k the policy's Jacobians:
//   lambda_{k-1} = w_{k-1} + A_k^T lambda_k + F_k^T g_k,    dJ/dp = sum P_k^T g_k
PolicyGradient PolicyRollout::gradient(const MatrixXd& x0, const MatrixXd& p, int steps,
                                       const CostGradient& by_states) {
  Made& made = *made_;
  made.check_shapes(x0, p, steps);
  made.make_derivatives();
  const Index worlds = x0.cols(), nt = made.first.nt(), n_u = made.first.n_u();
  PolicyGradient result{{steps, MatrixXd(x0.rows(), worlds * steps)},
                        MatrixXd::Zero(nt, worlds),
                        MatrixXd::Zero(made.n_p, worlds)};
  codegen::run_tasks(std::size_t(worlds), [&](std::size_t task) {
    const auto world = Index(task);
    auto states = result.motions.x.middleCols(world * steps, steps);
    Made::Slopes slopes(steps, nt, n_u, made.n_p);
    made.roll(x0.col(world), made.parameters(p, world), steps, states, slopes);
    MatrixXd weights = MatrixXd::Zero(nt, steps);
    by_states(world, states, weights);
    if (weights.rows() != nt || weights.cols() != steps)
      throw ArgumentError("roll-out: expected weights of " + std::to_string(nt) + " x " +
                          std::to_string(steps) + ", got " + std::to_string(weights.rows()) + " x " +
                          std::to_string(weights.cols()));
    VectorXd lambda = VectorXd::Zero(nt);
    for (Index k = steps; k-- > 0;) {
      lambda += weights.col(k);
      const VectorXd g = slopes.B.middleRows(k * nt, nt).transpose() * lambda;
      lambda = (slopes.A.middleRows(k * nt, nt).transpose() * lambda +
                slopes.by_x.middleRows(k * n_u, n_u).transpose() * g)
                   .eval();
      result.parameters.col(world) += slopes.by_p.middleRows(k * n_u, n_u).transpose() * g;
    }
    result.start.col(world) = lambda;
  });
  return result;
}

}  // namespace dyntape
