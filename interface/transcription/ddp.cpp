// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/transcription/ddp.h>

#include <chrono>
#include <cmath>
#include <optional>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/stopwatch.h>
#include <dyntape/interface/ocp/record_stage.h>
#include <dyntape/interface/transcription/verify.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// A function of one stage, dense.
class DenseFunction {
 public:
  DenseFunction(const Function& f, const CodegenOptions& options)
      : function_(CompiledFunction::make(f, options)),
        workspace_(function_),
        J_(function_.jacobian_pattern().nnz()),
        H_(function_.hessian_pattern().nnz()) {}

  VectorXd value(const VectorXd& x, const VectorXd& p) {
    VectorXd y(Eigen::Index(function_.n_y()));
    function_.value(x.data(), p.data(), y.data(), workspace_);
    return y;
  }
  MatrixXd jacobian(const VectorXd& x, const VectorXd& p, VectorXd& y) {
    y.resize(Eigen::Index(function_.n_y()));
    function_.first_order(x.data(), p.data(), y.data(), J_.data(), workspace_);
    MatrixXd J = MatrixXd::Zero(y.size(), x.size());
    const Pattern& at = function_.jacobian_pattern();
    for (std::size_t k = 0; k < at.nnz(); ++k) J(at.row[k], at.col[k]) = J_[k];
    return J;
  }
  MatrixXd hessian(const VectorXd& x, const VectorXd& p, const VectorXd& w) {
    function_.second_order(x.data(), p.data(), w.data(), nullptr, nullptr, H_.data(), workspace_);
    MatrixXd H = MatrixXd::Zero(x.size(), x.size());
    const Pattern& at = function_.hessian_pattern();
    for (std::size_t k = 0; k < at.nnz(); ++k) H(at.row[k], at.col[k]) = H(at.col[k], at.row[k]) = H_[k];
    return H;
  }

 private:
  CompiledFunction function_;
  CompiledFunction::Workspace workspace_;
  std::vector<double> J_, H_;
};

CodegenOptions with_curvature(CodegenOptions options) {
  options.order = Order::kSecond;
  return options;
}

struct Motion {
  MatrixXd x, u;  // (n_x x N + 1), (n_u x N)
  double cost = 0;
};

class Ddp {
 public:
  Ddp(const Problem& problem, const DdpOptions& options, const RecordedShooting& recorded)
      : problem_(problem),
        options_(options),
        N_(options.intervals),
        n_(problem.n_x()),
        m_(problem.n_u()),
        h_(problem.duration / options.intervals),
        step_(recorded.step, with_curvature(options.evaluation)),
        end_(recorded.end, with_curvature(options.evaluation)),
        stages_(std::size_t(N_)),
        policy_(std::size_t(N_)),
        at_k_(2) {
    const auto is_finite = [](double limit) { return std::abs(limit) < HUGE_VAL; };
    is_limited_ = std::any_of(problem.u.lower.begin(), problem.u.lower.end(), is_finite) ||
                  std::any_of(problem.u.upper.begin(), problem.u.upper.end(), is_finite);
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
    return solution;
  }

 private:
  const VectorXd& parameters(int k) {
    at_k_ << k * h_, h_;
    return at_k_;
  }
  VectorXd point(const Motion& motion, int k) const {
    VectorXd z(n_ + m_);
    z << motion.x.col(k), motion.u.col(k);
    return z;
  }
  VectorXd at_end() const { return VectorXd::Constant(1, problem_.duration); }
  VectorXd limited(const VectorXd& u) const {
    return u.cwiseMax(problem_.u.lower).cwiseMin(problem_.u.upper);
  }

  void start() {
    const auto guess = problem_.guess ? problem_.guess : straight_line(problem_);
    now_.x.resize(n_, N_ + 1), now_.u.resize(m_, N_);
    for (int k = 0; k < N_; ++k) {
      const Stage<double> stage = guess(k * h_);
      now_.x.col(k) = stage.x;
      now_.u.col(k) = limited(stage.u);
    }
    now_.x.col(N_) = guess(problem_.duration).x;
    now_.x.col(0) = problem_.start;
    now_.cost = 0;
    for (int k = 0; k < N_; ++k) {
      const VectorXd y = step_.value(point(now_, k), parameters(k));
      if (options_.start == DdpStart::kRollOut) now_.x.col(k + 1) = y.head(n_);
      now_.cost += y[n_];
      if (y.allFinite()) continue;
      throw NumericalError("problem \"" + problem_.name + "\": the step from t = " + io::shortest(k * h_) +
                           " s is not finite at the start");
    }
    now_.cost += end_.value(now_.x.col(N_), at_end())[0];
  }

  // A, B, c, g of all stages, and the end; the adjoint, and how far from a solution it is.
  DdpIteration linearise() {
    gap_.resize(n_, N_);
    VectorXd y;
    for (int k = 0; k < N_; ++k) {
      const MatrixXd J = step_.jacobian(point(now_, k), parameters(k), y);
      LqStage& s = stages_[std::size_t(k)];
      s.A = J.topLeftCorner(n_, n_), s.B = J.topRightCorner(n_, m_), s.g = J.row(n_);
      s.c = gap_.col(k) = y.head(n_) - now_.x.col(k + 1);
      if (is_limited_) {
        s.lower = problem_.u.lower - now_.u.col(k);
        s.upper = problem_.u.upper - now_.u.col(k);
      }
    }
    const VectorXd last = now_.x.col(N_);
    g_end_ = end_.jacobian(last, at_end(), y).row(0);
    H_end_ = end_.hessian(last, at_end(), VectorXd::Ones(1));
    adjoint_.resize(n_, N_ + 1);
    adjoint_.col(N_) = g_end_;
    DdpIteration iteration{now_.cost, gap_.cwiseAbs().maxCoeff(), 0, shift_, 0};
    largest_slope_ = 0;
    for (int k = N_ - 1; k >= 0; --k) {
      const LqStage& s = stages_[std::size_t(k)];
      const VectorXd of_dynamics = s.B.transpose() * adjoint_.col(k + 1), of_cost = s.g.tail(m_);
      largest_slope_ = std::max(largest_slope_, (of_dynamics.cwiseAbs() + of_cost.cwiseAbs()).maxCoeff());
      iteration.slope = std::max(iteration.slope, projected(k, of_dynamics + of_cost));
      adjoint_.col(k) = s.g.head(n_) + s.A.transpose() * adjoint_.col(k + 1);
    }
    return iteration;
  }

  // The largest entry that a control can still follow downwards.
  double projected(int k, const VectorXd& slope) const {
    double most = 0;
    for (int i = 0; i < m_; ++i) {
      const double u = now_.u(i, k);
      const bool stays =
          (u <= problem_.u.lower[i] && slope[i] > 0) || (u >= problem_.u.upper[i] && slope[i] < 0);
      if (!stays) most = std::max(most, std::abs(slope[i]));
    }
    return most;
  }

  bool is_solved(const DdpIteration& at) const {
    return at.slope <= options_.tolerance * (1 + largest_slope_) &&
           at.gap <= options_.tolerance * (1 + now_.x.cwiseAbs().maxCoeff());
  }

  bool is_acceptable(const DdpIteration& at) const {
    return at.slope <= 1e4 * options_.tolerance * (1 + largest_slope_) &&
           at.gap <= 1e-6 * (1 + now_.x.cwiseAbs().maxCoeff());
  }

  // Where the merit cannot tell one motion from the next any more, Newton's steps still make the slope less; where nothing
  // does, it is over.
  bool has_stalled(const DdpIteration& at) {
    constexpr int kMost = 20;
    if (at.slope < 0.5 * least_slope_) stalled_ = 0, least_slope_ = at.slope;
    return is_near_rounding_ && ++stalled_ > kMost;
  }

  // False where a stage has no minimum.
  bool backward() {
    slope_.resize(n_, N_ + 1);
    Riccati riccati;
    riccati.begin(H_end_, g_end_);
    slope_.col(N_) = g_end_;
    for (int k = N_ - 1; k >= 0; --k) {
      LqStage& s = stages_[std::size_t(k)];
      VectorXd weights = VectorXd::Zero(n_ + 1);
      if (options_.hessian == DdpHessian::kExact) weights.head(n_) = riccati.p() + riccati.P() * s.c;
      weights[n_] = 1;
      s.H = step_.hessian(point(now_, k), parameters(k), weights);
      if (!riccati.push(s, shift_)) return false;
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
      const LqStage& s = stages_[std::size_t(k)];
      const LqPolicy& policy = policy_[std::size_t(k)];
      dz << dx, policy.k + policy.K * dx;
      linear += s.g.dot(dz);
      curved += dz.dot(s.H * dz) / 2;
      dx = s.A * dx + s.B * dz.tail(m_) + s.c;
    }
    return {linear + g_end_.dot(dx), curved + dx.dot(H_end_ * dx) / 2};
  }

  std::optional<Motion> roll_out(double length) {
    Motion next{MatrixXd(n_, N_ + 1), MatrixXd(m_, N_), 0};
    next.x.col(0) = problem_.start;
    for (int k = 0; k < N_; ++k) {
      const LqPolicy& policy = policy_[std::size_t(k)];
      next.u.col(k) = limited(now_.u.col(k) + length * policy.k + policy.K * (next.x.col(k) - now_.x.col(k)));
      const VectorXd y = step_.value(point(next, k), parameters(k));
      if (!y.allFinite()) return {};
      next.x.col(k + 1) = y.head(n_) - (1 - length) * gap_.col(k);
      next.cost += y[n_];
    }
    next.cost += end_.value(next.x.col(N_), at_end())[0];
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
    is_near_rounding_ = -slope <= 1e3 * rounding;
    for (double length = 1; length > kShortest; length /= 2) {
      std::optional<Motion> next = roll_out(length);
      if (!next) continue;
      const double change = next->cost + gap_weight_ * (1 - length) * gaps - merit;
      if (change > kEnough * length * slope + rounding) continue;
      now_ = std::move(*next);
      return length;
    }
    return 0;
  }

  SolveStatus iterate(std::vector<DdpIteration>& iterations) {
    constexpr double kLeast = 1e-9, kMost = 1e12, kFactor = 10;
    for (int i = 0;; ++i) {
      DdpIteration at = linearise();
      if (!std::isfinite(at.slope)) return SolveStatus::kNotFinite;
      if (is_solved(at)) {
        iterations.push_back(at);
        while (!backward()) {  // the policy there
          if ((shift_ = std::max(kLeast, kFactor * shift_)) > kMost) return SolveStatus::kStepFailed;
        }
        return SolveStatus::kSolved;
      }
      if (has_stalled(at)) return is_acceptable(at) ? SolveStatus::kAcceptable : SolveStatus::kStepTooSmall;
      if (i == options_.max_iterations) return SolveStatus::kIterationLimit;
      if (options_.stop.stop_requested()) return SolveStatus::kStopped;
      for (;;) {
        const bool is_convex = backward();
        at.shift = shift_;
        if (is_convex && (at.length = search()) > 0) break;
        if ((shift_ = std::max(kLeast, kFactor * shift_)) > kMost)
          return is_convex ? SolveStatus::kStepTooSmall : SolveStatus::kStepFailed;
      }
      shift_ = shift_ > kLeast && at.length > 0.3 ? shift_ / kFactor : at.length > 0.3 ? 0 : shift_;
      iterations.push_back(at);
    }
  }

  const Problem& problem_;
  const DdpOptions& options_;
  int N_, n_, m_;
  double h_;
  DenseFunction step_, end_;
  bool is_limited_ = false;
  std::vector<LqStage> stages_;
  std::vector<LqPolicy> policy_;
  VectorXd at_k_, g_end_;
  MatrixXd H_end_, gap_, slope_, adjoint_;
  Motion now_;
  double shift_ = 0, gap_weight_ = 0, largest_slope_ = 0, least_slope_ = HUGE_VAL;
  bool is_near_rounding_ = false;
  int stalled_ = 0;
};

double worst_defect(const Problem& problem, const DdpSolution& solution) {
  double worst = 0;
  for (Eigen::Index k = 0; k < solution.u.cols(); ++k) {
    const VectorXd u = solution.u.col(k);
    const Simulation run =
        simulate(problem, solution.x.col(k), solution.t[k], solution.t[k + 1], [&](double) { return u; });
    const double off = (run.x - solution.x.col(k + 1)).cwiseAbs().maxCoeff();
    if (!(off <= worst)) worst = off;  // NaN as well
  }
  return worst;
}

}  // namespace

DdpSolution solve_by_ddp(const Problem& problem, const DdpOptions& options) {
  if (options.intervals < 1)
    throw ArgumentError("problem \"" + problem.name + "\": " + std::to_string(options.intervals) +
                        " intervals, expected 1 or more");
  auto begin = std::chrono::steady_clock::now();
  Ddp ddp(problem, options, record_shooting(problem));
  const double build_seconds = seconds_since(begin);
  begin = std::chrono::steady_clock::now();
  DdpSolution solution = ddp.solve();
  solution.build_seconds = build_seconds;
  solution.seconds = seconds_since(begin);
  if (solution.success()) solution.true_defect = worst_defect(problem, solution);
  return solution;
}

}  // namespace dyntape
