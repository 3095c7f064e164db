// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/sensitivity/rollout.h>

#include <cmath>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/control/problem/record_stage.h>
#include <dyntape/interface/control/sensitivity/checkpoints.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

CodegenOptions for_values(CodegenOptions options) {
  options.order = Order::kValue;
  return options;
}

}  // namespace

struct RolloutAdjoint::Made {
  // A function of one point and the products of weights with its Jacobian, parameters as variables.
  class Swept {
   public:
    Swept(const Function& function, const CodegenOptions& options)
        : value_(CompiledFunction::make(function, for_values(options))),
          product_(CompiledFunction::make(vjp(all_as_variables(function)), for_values(options))),
          of_value_(value_),
          of_product_(product_) {}

    VectorXd value(const VectorXd& x, const VectorXd& p) {
      VectorXd y(Eigen::Index(value_.n_y()));
      value_.value(x.data(), p.data(), y.data(), of_value_);
      return y;
    }
    // By (x, p).
    VectorXd derivatives(const VectorXd& x, const VectorXd& p, const VectorXd& weights) {
      all_.resize(x.size() + p.size());
      all_ << x, p;
      VectorXd result(all_.size());
      product_.check(product_.run(Order::kValue, {.x = all_.data(), .w = weights.data(), .y = result.data()},
                                  of_product_));
      return result;
    }

   private:
    CompiledFunction value_, product_;
    CompiledFunction::Workspace of_value_, of_product_;
    VectorXd all_;
  };

  Made(const Problem& given, const RolloutOptions& asked)
      : Made(given, asked, record_shooting(given), record_stage(given)) {}
  Made(const Problem& given, const RolloutOptions& asked, const RecordedShooting& steps,
       const RecordedStage& stage)
      : problem(given),
        options(asked),
        N(asked.intervals),
        n(given.n_x()),
        m(given.n_u()),
        n_p(given.parameters.size()),
        step(steps.step, asked.evaluation),
        end(steps.end, asked.evaluation),
        rate(stage.node, asked.evaluation) {
    if (N < 1) refuse(problem, "a roll-out of " + std::to_string(N) + " intervals, expected at least one");
    if (options.checkpoints < 0)
      refuse(problem, std::to_string(options.checkpoints) +
                          " checkpoints of a roll-out, expected 0, which keeps all, or more");
  }

  double h() const { return problem.duration / N; }
  double time(long k) const { return double(k) * h(); }

  VectorXd of_step(long k) const {
    VectorXd p(2 + 3 * n_p);
    p.head(2) << time(k), h();
    for (int part = 0; part < 3; ++part)
      p.segment(2 + part * n_p, n_p) = problem.parameters.at((double(k) + part / 2.0) * h());
    return p;
  }
  VectorXd at_end() const { return parameters_of(problem, problem.duration); }
  static VectorXd point(const VectorXd& x, const VectorXd& u) {
    VectorXd z(x.size() + u.size());
    z << x, u;
    return z;
  }
  static VectorXd with_cost(const VectorXd& derivatives) {
    VectorXd weights(derivatives.size() + 1);
    weights << derivatives, 1;
    return weights;
  }

  RolloutGradient begin(const MatrixXd& u) const {
    if (u.rows() != m || u.cols() != N)
      refuse(problem, "the controls of a roll-out are " + std::to_string(u.rows()) + " x " +
                          std::to_string(u.cols()) + ", expected " + std::to_string(m) + " x " +
                          std::to_string(N) + ", a column an interval");
    RolloutGradient g;
    g.controls.setZero(m, N);
    g.parameters.setZero(n_p);
    return g;
  }

  // One step of (x, cost so far).
  void forward(long k, const MatrixXd& u, const VectorXd& x, VectorXd& next) {
    next = step.value(point(x.head(n), u.col(k)), of_step(k));
    next[n] += x[n];
    if (next.allFinite()) return;
    throw NumericalError("problem \"" + problem.name + "\": the step from t = " + io::shortest(time(k)) +
                         " s is not finite");
  }
  VectorXd start() const {
    VectorXd x(n + 1);
    x << problem.start, 0;
    return x;
  }
  // The whole cost, and its slope by the last state; what it says of parameters is noted.
  VectorXd finish(const VectorXd& x, RolloutGradient& g) {
    g.cost = x[n] + end.value(x.head(n), at_end())[0];
    const VectorXd derivatives = end.derivatives(x.head(n), at_end(), VectorXd::Ones(1));
    if (!std::isfinite(g.cost) || !derivatives.allFinite())
      throw NumericalError("problem \"" + problem.name +
                           "\": the cost of the end, or its slope, is not finite");
    g.parameters += derivatives.tail(n_p);
    return derivatives.head(n);
  }

  Problem problem;
  RolloutOptions options;
  int N;
  Eigen::Index n, m, n_p;
  Swept step, end, rate;  // (x, u; t, h, p, p_m, p_e) -> x', cost; (x; t, p) -> M; (x, u; t, p) -> f, L
};

RolloutAdjoint::RolloutAdjoint(const Problem& problem, const RolloutOptions& options)
    : made_(std::make_unique<Made>(problem, options)) {}
RolloutAdjoint::~RolloutAdjoint() = default;
RolloutAdjoint::RolloutAdjoint(RolloutAdjoint&&) noexcept = default;
RolloutAdjoint& RolloutAdjoint::operator=(RolloutAdjoint&&) noexcept = default;

void RolloutAdjoint::set_values(const Problem& now) {
  Problem next = made_->problem;
  next.take_values(now);
  check_shooting(next);
  made_->problem = std::move(next);
}

RolloutGradient RolloutAdjoint::discrete(const MatrixXd& u) {
  Made& made = *made_;
  const Eigen::Index n = made.n, m = made.m, n_p = made.n_p;
  RolloutGradient g = made.begin(u);
  const bool keeps_all = made.options.checkpoints == 0;
  if (keeps_all) g.adjoint.resize(n, made.N + 1);
  const auto note = [&](long k, const VectorXd& adjoint) {
    if (keeps_all) g.adjoint.col(k) = adjoint;
  };
  const ReverseSweep sweep = reverse_sweep(
      made.N, keeps_all ? made.N : made.options.checkpoints, made.start(),
      {.forward = [&](long k, const VectorXd& x, VectorXd& next) { made.forward(k, u, x, next); },
       .end =
           [&](const VectorXd& x) {
             VectorXd adjoint = made.finish(x, g);
             note(made.N, adjoint);
             return adjoint;
           },
       .back =
           [&](long k, const VectorXd& x, VectorXd& adjoint) {
             const VectorXd derivatives = made.step.derivatives(Made::point(x.head(n), u.col(k)),
                                                                made.of_step(k), Made::with_cost(adjoint));
             adjoint = derivatives.head(n);
             g.controls.col(k) = derivatives.segment(n, m);
             for (int part = 0; part < 3; ++part)
               g.parameters += derivatives.segment(n + m + 2 + part * n_p, n_p);
             note(k, adjoint);
           }});
  g.start = sweep.adjoint;
  g.forward_steps = sweep.forward_steps;
  return g;
}

RolloutGradient RolloutAdjoint::continuous(const MatrixXd& u) {
  Made& made = *made_;
  const Eigen::Index n = made.n, m = made.m, n_p = made.n_p;
  const double h = made.h();
  RolloutGradient g = made.begin(u);
  MatrixXd states(n + 1, made.N + 1);
  VectorXd now = made.start(), next;
  states.col(0) = now;
  for (int k = 0; k < made.N; ++k, now = next) {
    made.forward(k, u, now, next);
    states.col(k + 1) = next;
  }
  g.forward_steps = made.N;
  VectorXd mu = made.finish(now, g);
  g.adjoint.resize(n, made.N + 1);
  g.adjoint.col(made.N) = mu;
  for (long k = made.N - 1; k >= 0; --k) {
    const VectorXd held = u.col(k), x0 = states.col(k).head(n), x1 = states.col(k + 1).head(n);
    const auto told = [&](double part) { return parameters_of(made.problem, (double(k) + part) * h); };
    const VectorXd f0 = made.rate.value(Made::point(x0, held), told(0)).head(n),
                   f1 = made.rate.value(Made::point(x1, held), told(1)).head(n);
    const VectorXd middle = (x0 + x1) / 2 + h / 8 * (f0 - f1);
    // What the integrals gather by (x, u, t, p), all at once: minus the rate of mu, and the rates of the derivatives.
    const auto rates = [&](double part, const VectorXd& x, const VectorXd& adjoint) {
      return made.rate.derivatives(Made::point(x, held), told(part), Made::with_cost(adjoint));
    };
    const VectorXd g1 = rates(1, x1, mu), g2 = rates(0.5, middle, mu + h / 2 * g1.head(n)),
                   g3 = rates(0.5, middle, mu + h / 2 * g2.head(n)), g4 = rates(0, x0, mu + h * g3.head(n));
    const VectorXd gathered = h / 6 * (g1 + 2 * g2 + 2 * g3 + g4);
    mu += gathered.head(n);
    g.controls.col(k) = gathered.segment(n, m);
    g.parameters += gathered.tail(n_p);
    g.adjoint.col(k) = mu;
  }
  g.start = mu;
  return g;
}

}  // namespace dyntape
