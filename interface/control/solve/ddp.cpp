// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/ddp.h>

#include <Eigen/Eigenvalues>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/control/discretize/end_cost.h>
#include <dyntape/interface/control/discretize/shooting_steps.h>
#include <dyntape/interface/control/solve/stage_secants.h>
#include <dyntape/interface/control/solve/trial_changes.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

CodegenOptions of_order(Order order, CodegenOptions options) {
  options.order = order;
  return options;
}

struct Motion {
  MatrixXd x, u;  // (n_x x N + 1), (n_u x N)
  double cost = 0;
};

class Ddp {
 public:
  Ddp(const Problem& problem, const DdpOptions& options, const CompiledFunction& step,
      const CompiledFunction& end)
      : problem_(problem),
        options_(options),
        N_(options.intervals),
        n_(problem.n_x()),
        m_(problem.n_u()),
        h_(problem.duration / options.intervals),
        steps_(step, problem, options.intervals),
        end_(end),
        stages_(steps_.stages()),
        policy_(std::size_t(N_)),
        at_end_(parameters_of(problem, problem.duration)) {
    slope_ = adjoint_ = MatrixXd::Constant(n_, N_ + 1, std::nan(""));
    for (LqrPolicy& policy : policy_) policy = {MatrixXd::Zero(m_, n_), VectorXd::Zero(m_)};
    is_limited_ =
        (problem.u.lower.array().abs() < HUGE_VAL).any() || (problem.u.upper.array().abs() < HUGE_VAL).any();
  }

  DdpSolution solve() {
    DdpSolution solution;
    start();
    solution.status = iterate(solution.iterations);
    solution.cost = now_.cost;
    solution.t = VectorXd::LinSpaced(N_ + 1, 0, problem_.duration);
    solution.x = now_.x, solution.u = now_.u;
    solution.policy = policy_;
    solution.slope = slope_, solution.adjoint = adjoint_;
    solution.is_saddle = solution.success() && is_saddle_;
    solution.is_minimum = solution.success() && shift_ == 0 && options_.hessian == DdpHessian::kExact;
    return solution;
  }

 private:
  bool is_gauss_newton() const { return options_.hessian == DdpHessian::kGaussNewton; }
  VectorXd limited(const VectorXd& u) const {
    return u.cwiseMax(problem_.u.lower).cwiseMin(problem_.u.upper);
  }

  void start() {
    const auto guess = [this](double t) { return problem_.first_guess(t); };
    now_.x.resize(n_, N_ + 1), now_.u.resize(m_, N_);
    for (int k = 0; k < N_; ++k) {
      const Stage<double> stage = guess(k * h_);
      if (stage.x.size() != n_ || stage.u.size() != m_)
        throw ArgumentError("problem \"" + problem_.name + "\": the guess at t = " + io::shortest(k * h_) +
                            " s has other sizes than the problem");
      now_.x.col(k) = stage.x;
      now_.u.col(k) = limited(stage.u);
    }
    now_.x.col(N_) = guess(problem_.duration).x;
    now_.x.col(0) = problem_.start;
    now_.cost = 0;
    VectorXd next(n_);
    for (int k = 0; k < N_; ++k) {
      const double cost = steps_.run(k, now_.x.col(k), now_.u.col(k), next);
      if (options_.start == DdpStart::kRollOut) now_.x.col(k + 1) = next;
      now_.cost += cost;
      if (next.allFinite() && std::isfinite(cost)) continue;
      throw NumericalError("problem \"" + problem_.name + "\": the step from t = " + io::shortest(k * h_) +
                           " s is not finite at the start: " + not_finite(next, cost));
    }
    now_.cost += end_.value(now_.x.col(N_), at_end_);
    if (!now_.x.allFinite() || !now_.u.allFinite() || !std::isfinite(now_.cost))
      throw NumericalError("problem \"" + problem_.name +
                           "\": the guess, or the cost of its end, is not finite");
  }

  std::string not_finite(const VectorXd& next, double cost) const {
    for (int i = 0; i < n_; ++i) {
      if (!std::isfinite(next[i]))
        return "it gives the state \"" + problem_.states[std::size_t(i)] + "\" as " + io::shortest(next[i]);
    }
    return "its cost is " + io::shortest(cost);
  }

  // A, B, c, g of all stages, and the end; the adjoint, and how far from a solution it is.
  DdpIteration linearise() {
    bool is_finite = steps_.linearise(now_.x, now_.u);
    gap_ = steps_.ends() - now_.x.rightCols(N_);
    for (int k = 0; k < N_; ++k) {
      LqrStage& s = stages_[std::size_t(k)];
      s.c = gap_.col(k);
      if (is_limited_) {
        s.lower = problem_.u.lower - now_.u.col(k);
        s.upper = problem_.u.upper - now_.u.col(k);
      }
    }
    end_.expand(now_.x.col(N_), at_end_, g_end_, H_end_);
    adjoint_.col(N_) = g_end_;
    is_finite = is_finite && g_end_.allFinite() && H_end_.allFinite() && std::isfinite(now_.cost);
    DdpIteration iteration{now_.cost, gap_.cwiseAbs().maxCoeff(), is_finite ? 0 : std::nan(""), shift_, 0};
    if (!is_finite) return iteration;
    slopes_ = sizes_ = VectorXd::Zero(m_);
    for (int k = N_ - 1; k >= 0; --k) {
      const LqrStage& s = stages_[std::size_t(k)];
      const VectorXd of_dynamics = s.B.transpose() * adjoint_.col(k + 1), of_cost = s.g.tail(m_);
      sizes_ = sizes_.cwiseMax(of_dynamics.cwiseAbs() + of_cost.cwiseAbs());
      slopes_ = slopes_.cwiseMax(projected(k, of_dynamics + of_cost));
      adjoint_.col(k) = s.g.head(n_) + s.A.transpose() * adjoint_.col(k + 1);
    }
    iteration.slope = adjoint_.allFinite() && sizes_.allFinite() ? slopes_.maxCoeff() : std::nan("");
    if (is_gauss_newton()) secants_.learn(stages_, now_.x, now_.u, adjoint_);
    return iteration;
  }

  // Of the entries of a slope those that a control can still follow downwards, else zero.
  VectorXd projected(int k, const VectorXd& slope) const {
    VectorXd open = slope.cwiseAbs();
    for (int i = 0; i < m_; ++i) {
      const double u = now_.u(i, k), lower = problem_.u.lower[i], upper = problem_.u.upper[i];
      if (lower >= upper || (u <= lower && slope[i] > 0) || (u >= upper && slope[i] < 0)) open[i] = 0;
    }
    return open;
  }

  bool is_closed(double gap, double tolerance) const {
    return gap <= tolerance * now_.x.cwiseAbs().maxCoeff();
  }
  bool has_no_slope(double tolerance) const { return (slopes_.array() <= tolerance * sizes_.array()).all(); }
  bool is_solved(const DdpIteration& at) const {
    return has_no_slope(options_.tolerance) && is_closed(at.gap, options_.tolerance);
  }
  bool is_acceptable(const DdpIteration& at) const {
    return has_no_slope(1e4 * options_.tolerance) && is_closed(at.gap, 1e-6);
  }
  // Newton's step moves nothing any more.  Steps of Gauss-Newton get shorter by a ratio each, and what they lead to is as far
  // as all of them together.
  bool is_still(const DdpIteration& at) {
    double size = 0;
    for (const LqrPolicy& policy : policy_) size = std::max(size, policy.k.cwiseAbs().maxCoeff());
    const double ratio = shift_ == 0 && last_size_ > 0 ? size / last_size_ : 1,
                 slower = std::max(ratio, std::exchange(last_ratio_, ratio));
    last_size_ = shift_ == 0 ? size : 0;
    if (shift_ > 0 || !is_closed(at.gap, options_.tolerance)) return false;
    const double share = is_gauss_newton() ? std::max(1e-3, 1 - slower) : 1;
    return size <= share * options_.tolerance * now_.u.cwiseAbs().maxCoeff();
  }

  // Where the merit cannot tell one motion from the next any more, Newton's steps still make the slope less; where nothing
  // does, it is over.
  bool has_stalled(const DdpIteration& at) {
    constexpr int kMost = 20;
    if (at.slope < 0.5 * least_slope_) stalled_ = 0, least_slope_ = at.slope;
    return is_near_rounding_ && ++stalled_ > kMost;
  }

  // False where a stage has no minimum.
  bool backward() { return (secants_.help() && backward(true)) || backward(false); }
  bool backward(bool with_secants) {
    Riccati riccati;
    riccati.begin(H_end_, g_end_);
    slope_.col(N_) = g_end_;
    for (int k = N_ - 1; k >= 0; --k) {
      LqrStage& s = stages_[std::size_t(k)];
      if (options_.hessian == DdpHessian::kExact) {
        weights_ << riccati.p() + riccati.P() * s.c, 1;
        steps_.curve(k, weights_);
      }
      bool is_convex = false;
      for (const bool with : {with_secants, false}) {
        if (is_gauss_newton()) s.H = secants_.hessian(std::size_t(k), with);
        if ((is_convex = riccati.push(s, shift_))) break;
      }
      if (!is_convex) {
        failed_stage_ = k;
        failed_ = riccati.input_curvature();
        return false;
      }
      policy_[std::size_t(k)] = riccati.policy();
      slope_.col(k) = riccati.p();
    }
    return true;
  }

  // Of a step of the quadratic problem: what the cost changes by to first order, and by its curvature.
  std::pair<double, double> predicted() const {
    VectorXd dx = VectorXd::Zero(n_), dz(n_ + m_);
    double linear = 0, curved = 0;
    for (int k = 0; k < N_; ++k) {
      const LqrStage& s = stages_[std::size_t(k)];
      dz << dx, policy_[std::size_t(k)].k + policy_[std::size_t(k)].K * dx;
      linear += s.g.dot(dz);
      curved += dz.dot(s.H.selfadjointView<Eigen::Lower>() * dz) / 2;
      const VectorXd moved = s.A * dx, driven = s.B * dz.tail(m_);
      dx = moved + driven + s.c;
    }
    return {linear + g_end_.dot(dx), curved + dx.dot(H_end_ * dx) / 2};
  }

  std::optional<Motion> rollout(double length) {
    Motion next{MatrixXd(n_, N_ + 1), MatrixXd(m_, N_), 0};
    next.x.col(0) = problem_.start;
    for (int k = 0; k < N_; ++k) {
      const LqrPolicy& policy = policy_[std::size_t(k)];
      next.u.col(k) = limited(now_.u.col(k) + length * policy.k + policy.K * (next.x.col(k) - now_.x.col(k)));
      next.cost += steps_.run(k, next.x.col(k), next.u.col(k), next.x.col(k + 1));
      if (!next.x.col(k + 1).allFinite() || !std::isfinite(next.cost)) return {};
      next.x.col(k + 1) -= (1 - length) * gap_.col(k);
    }
    next.cost += end_.value(next.x.col(N_), at_end_);
    if (!std::isfinite(next.cost)) return {};
    return next;
  }

  // The longest of 1, 1/2, ... that lowers the merit, cost + weight sum |gap|; 0: none.
  double search() {
    constexpr double kEnough = 1e-4, kShortest = 1e-7;
    const double gaps = gap_.cwiseAbs().sum();
    const auto [linear, curved] = predicted();
    if (gaps > 0) gap_weight_ = std::max(gap_weight_, (linear + std::max(0.0, curved)) / (0.9 * gaps));
    const double slope = linear - gap_weight_ * gaps, merit = now_.cost + gap_weight_ * gaps;
    const double rounding = 1e-14 * (1 + std::abs(merit)) * std::sqrt(double(N_));
    is_near_rounding_ = -slope <= 1e3 * rounding, promised_ = -slope;
    for (double length = 1; length > kShortest; length /= 2) {
      std::optional<Motion> next = rollout(length);
      if (!next) continue;
      const double change = next->cost + gap_weight_ * (1 - length) * gaps - merit;
      if (!(change <= kEnough * length * slope + rounding)) continue;  // NaN as well
      now_ = std::move(*next);
      return length;
    }
    return 0;
  }

  // The next shift, and whether there is one.
  bool raise_shift() {
    shift_ = std::max(1e-9, 10 * shift_);
    return shift_ <= 1e12;
  }

  // From a stationary point that is no minimum: the controls of the last stage that has none are moved along its most negative
  // curvature, and what is behind follows the best policies: the cost falls by the square of the length.  False where none does.
  bool leave_saddle() {
    constexpr int kMost = 5, kLongest = 20, kShortest = -40;  // powers of two
    constexpr double kEnough = 0.1;
    if (options_.hessian != DdpHessian::kExact || ++saddles_ > kMost) return false;
    const double kept = std::exchange(shift_, 0);
    const bool is_minimum = backward();
    shift_ = kept;
    if (is_minimum) return false;
    const int k = failed_stage_;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> own(failed_);
    const double curvature = own.eigenvalues()[0];
    if (!(curvature < 0)) return false;
    const VectorXd along = own.eigenvectors().col(0);
    for (LqrPolicy& policy : policy_) policy.k.setZero();
    for (int before = 0; before <= k; ++before) policy_[std::size_t(before)].K.setZero();
    gap_.setZero();
    const double cost = now_.cost;
    for (double length = std::ldexp(1.0, kLongest); length >= std::ldexp(1.0, kShortest); length /= 2) {
      policy_[std::size_t(k)].k = length * along;
      std::optional<Motion> next = rollout(1);
      if (!next || !(next->cost - cost <= kEnough * length * length * curvature / 2)) continue;
      now_ = std::move(*next);
      return true;
    }
    return false;
  }

  // Without second derivatives: where the cost falls by the square of a trial change, the point is no minimum, and is left
  // along it.  False where none lowers the cost.
  bool leave_along_trials() {
    constexpr int kMost = 5, kDoublings = 20;
    const std::vector<LqrPolicy> kept = policy_;
    bool is_left = false;
    for (const TrialChange& trial : falling_changes(problem_, steps_, end_, at_end_, now_.u, now_.cost)) {
      const auto along = [&](double length) {
        for (int k = 0; k < N_; ++k) {
          policy_[std::size_t(k)].K.setZero(), policy_[std::size_t(k)].k.setZero();
          policy_[std::size_t(k)].k[trial.control] = length * trial.shape[k];
        }
        return rollout(1);
      };
      is_saddle_ = true;
      if (++saddles_ > kMost) break;
      double length = trial.length;
      std::optional<Motion> best = along(length), next;
      if (!best) continue;
      for (int i = 0; i < kDoublings && (next = along(length *= 2)) && next->cost < best->cost; ++i)
        best = std::move(next);
      if (!(best->cost < now_.cost)) continue;
      now_ = std::move(*best);
      is_left = true, is_saddle_ = false;
      break;
    }
    policy_ = kept;
    return is_left;
  }

  // Newton's steps, of all curvature, promise less than the cost is rounded by.
  bool is_least(const DdpIteration& at) const {
    return options_.hessian == DdpHessian::kExact && shift_ == 0 && is_closed(at.gap, options_.tolerance) &&
           promised_ <= 1e-15 * now_.cost;
  }

  bool leave() {
    if (!(options_.hessian == DdpHessian::kExact ? leave_saddle() : leave_along_trials())) return false;
    least_slope_ = HUGE_VAL, stalled_ = 0, shift_ = 0;
    return true;
  }

  // The policy of a solution; a shift that is left says that it is no minimum.
  SolveStatus finish() {
    shift_ = 0;
    while (!backward())
      if (!raise_shift()) return SolveStatus::kStepFailed;
    return SolveStatus::kSolved;
  }

  SolveStatus iterate(std::vector<DdpIteration>& iterations) {
    const double begin = thread_seconds();
    const auto note = [&](const DdpIteration& at) {
      iterations.push_back(at);
      if (options_.watch) options_.watch(at);
    };
    for (int i = 0;; ++i) {
      DdpIteration at = linearise();
      if (!std::isfinite(at.slope)) return SolveStatus::kNotFinite;
      if (is_solved(at)) {
        note(at);
        const SolveStatus status = finish();
        if (status != SolveStatus::kSolved) return status;
        if (options_.hessian == DdpHessian::kExact && shift_ == 0) return status;
        if (!leave()) return finish();
        continue;
      }
      if (at.cost < -1e50) return SolveStatus::kDiverging;
      const SolveStatus at_rest = is_acceptable(at) ? SolveStatus::kAcceptable : SolveStatus::kStepTooSmall;
      if (has_stalled(at)) {
        // Where all derivatives are rounding, as of a pole that stands, no step along them leads down.
        if (is_closed(at.gap, options_.tolerance) && leave()) continue;
        if (at_rest == SolveStatus::kStepTooSmall && is_least(at)) return finish();
        return at_rest;
      }
      if (i == options_.max_iterations) return SolveStatus::kIterationLimit;
      if (thread_seconds() - begin > options_.max_seconds) return SolveStatus::kTimeLimit;
      for (;;) {
        if (options_.stop.stop_requested()) return SolveStatus::kStopped;
        const bool is_convex = backward();
        at.shift = shift_;
        if (is_convex && is_still(at)) {
          if (is_gauss_newton() && leave()) break;
          note(at);
          return SolveStatus::kSolved;
        }
        if (is_convex && (at.length = search()) > 0) break;
        if (raise_shift()) continue;
        if (is_closed(at.gap, options_.tolerance) && leave()) break;
        return is_convex ? at_rest : SolveStatus::kStepFailed;
      }
      if (at.length > 0.3) shift_ = shift_ > 1e-9 ? shift_ / 10 : 0;
      note(at);
    }
  }

  const Problem& problem_;
  const DdpOptions& options_;
  int N_, n_, m_;
  double h_;
  ShootingSteps steps_;
  EndCost end_;
  bool is_limited_ = false;
  std::vector<LqrStage>& stages_;
  std::vector<LqrPolicy> policy_;
  VectorXd at_end_, g_end_, weights_ = VectorXd(n_ + 1);
  MatrixXd H_end_, gap_, slope_, adjoint_;
  VectorXd slopes_, sizes_;  // (n_u) the largest, and the largest of what they are made of
  Motion now_;
  StageSecants secants_;
  double last_size_ = 0, last_ratio_ = 1;  // of the step before: its size, and by what it was shorter
  double shift_ = 0, gap_weight_ = 0, least_slope_ = HUGE_VAL, promised_ = HUGE_VAL;
  bool is_near_rounding_ = false;
  int stalled_ = 0, saddles_ = 0;
  bool is_saddle_ = false;  // the cost falls along a trial, and no length was found that leads on
  int failed_stage_ = -1;   // of the last backward pass that failed, and the curvature by its controls
  MatrixXd failed_;         // (n_u x n_u)
};

void check_options(const Problem& problem, const DdpOptions& options) {
  constexpr int kMostIntervals = 10000000;
  const auto refuse = [&](const std::string& what) {
    throw ArgumentError("problem \"" + problem.name + "\": " + what);
  };
  if (options.intervals < 1 || options.intervals > kMostIntervals)
    refuse(std::to_string(options.intervals) + " intervals, expected 1 to " + std::to_string(kMostIntervals));
  if (!(options.tolerance > 0 && options.tolerance < 1))
    refuse("a tolerance of " + io::shortest(options.tolerance) + ", expected a number between 0 and 1");
  if (options.max_iterations < 0)
    refuse("at most " + std::to_string(options.max_iterations) + " iterations, expected 0 or more");
}

}  // namespace

struct DdpSolver::Made {
  Problem problem;
  DdpOptions options;
  CompiledFunction step, end;
  double record_seconds, build_seconds;
};

DdpSolver::DdpSolver(const Problem& problem, const DdpOptions& options) {
  check_options(problem, options);
  const auto begin = std::chrono::steady_clock::now();
  const bool is_exact = options.hessian == DdpHessian::kExact;
  const RecordedShooting recorded = record_shooting(problem, options.scheme, !is_exact);
  const Order order = is_exact ? Order::kSecond : Order::kFirst;
  const double record_seconds = seconds_since(begin);
  made_ = std::make_unique<Made>(Made{
      problem, options, CompiledFunction::make(recorded.step, of_order(order, options.evaluation)),
      CompiledFunction::make(recorded.end, of_order(Order::kSecond, options.evaluation)), record_seconds, 0});
  made_->build_seconds = seconds_since(begin);
}

DdpSolver::DdpSolver(DdpSolver&&) noexcept = default;
DdpSolver& DdpSolver::operator=(DdpSolver&&) noexcept = default;
DdpSolver::~DdpSolver() = default;

const Problem& DdpSolver::problem() const { return made_->problem; }
const CompiledFunction& DdpSolver::step() const { return made_->step; }
const CompiledFunction& DdpSolver::end() const { return made_->end; }

void DdpSolver::set_values(const Problem& now) {
  Problem next = made_->problem;
  next.take_values(now);
  check_shooting(next);
  // Throws, if it does, before anything has changed.
  const double h = next.duration / made_->options.intervals;
  for (int k = 0; k <= 2 * made_->options.intervals; ++k) next.parameters.at(k / 2.0 * h);
  made_->problem = std::move(next);
}

BuildReport DdpSolver::build() const {
  BuildReport report;
  for (const CompiledFunction* f : {&made_->step, &made_->end}) add_to(report, *f);
  report.seconds.record = made_->record_seconds;
  return report;
}

DdpSolution DdpSolver::solve() {
  const Problem& problem = made_->problem;
  const auto begin = std::chrono::steady_clock::now();
  DdpSolution solution = Ddp(problem, made_->options, made_->step, made_->end).solve();
  solution.build_seconds = made_->build_seconds;
  solution.seconds = seconds_since(begin);
  if (solution.success() && made_->options.verify)
    solution.integration_error =
        error_of_steps(problem, solution.t, solution.x, solution.u, made_->options.stop);
  return solution;
}

DdpSolution solve_with_ddp(const Problem& problem, const DdpOptions& options) {
  return DdpSolver(problem, options).solve();
}

}  // namespace dyntape
