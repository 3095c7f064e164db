// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/riccati/interior_point.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <utility>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/nlp/best_point.h>
#include <dyntape/interface/control/nlp/hessian_shift.h>
#include <dyntape/interface/control/nlp/settling.h>
#include <dyntape/interface/control/riccati/barrier_parameter.h>
#include <dyntape/interface/control/riccati/optimality.h>
#include <dyntape/interface/control/riccati/restoration.h>
#include <dyntape/interface/control/riccati/stage_checks.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;
using Clock = std::chrono::steady_clock;

// Named as in the source.
constexpr double kKappaEpsilon = 10, kKappaMu = 0.2, kThetaMu = 1.5, kTauMin = 0.99;
constexpr double kGammaTheta = 1e-5, kGammaPhi = 1e-8, kDelta = 1, kSTheta = 1.1, kSPhi = 2.3, kEta = 1e-8;
constexpr double kAlphaPart = 0.05, kKappaSoc = 0.99;
constexpr double kFirstBarrier = 0.1, kMostBarrier = 10, kBlocked = 0.1;
constexpr int kBlockedSteps = 3, kMostCorrections = 4, kAcceptableIterations = 10, kShiftedIterations = 4;
constexpr double kMostFirstBarriers = 1e3, kFixedPart = 0.8, kFloor = 2;  // kFloor: of the least barrier
constexpr double kPush = 1e-2, kWarmPush = 1e-9, kMostPrice = 1e3;
constexpr double kAcceptable = 1e-6, kEndless = 1e20;

double largest(const VectorXd& v) { return v.size() > 0 ? v.cwiseAbs().maxCoeff() : 0; }

}  // namespace

class StructuredInteriorPoint::Method {
 public:
  explicit Method(Nlp& nlp)
      : nlp_(nlp),
        kkt_(nlp),
        barrier_(nlp, kkt_),
        optimality_(barrier_, kkt_),
        n_(barrier_.n()),
        m_(barrier_.m()),
        gradient_(n_),
        jacobian_(Eigen::Index(nlp.shape().jacobian.nnz())),
        hessian_(Eigen::Index(nlp.shape().hessian.nnz())),
        lambda_(VectorXd::Zero(m_)) {
    for (KktVector* v : {&right_, &step_, &corrected_}) v->x.setZero(n_), v->s.setZero(m_), v->c.setZero(m_);
    diagonal_.sigma_x.setZero(n_), diagonal_.sigma_s.setZero(m_);
  }

  // Whether rows and variables are still of the kinds that they were when all was laid out.
  bool fits() const { return kkt_.fits(); }

  NlpSolution solve(const std::vector<double>& start, const NlpSolution* warm, const SolverOptions& options) {
    options_ = options;
    least_barrier_ = std::min(options.tolerance, 1e-4) / (kKappaEpsilon + 1);
    barrier_.set_bounds(options.bound_relaxation);
    solution_ = {}, best_ = {}, solution_.x = start;
    shift_ = {}, progress_ = {}, settling_ = {}, is_tiny_ = false, has_matrices_ = false;
    begin_ = Clock::now();
    processor_begin_ = thread_seconds();
    if (has_crossed_bounds(nlp_.shape())) {
      solution_.status = SolveStatus::kBadOption;
      for (std::vector<double>* rows : {&solution_.g, &solution_.lambda}) rows->assign(std::size_t(m_), 0.0);
      for (std::vector<double>* multipliers : {&solution_.lower_multiplier, &solution_.upper_multiplier})
        multipliers->assign(std::size_t(n_), 0.0);
      return std::move(solution_);
    }
    solution_.status = run(start, warm);
    finish();
    solution_.times.total = seconds_since(begin_);
    solution_.times.processor = processor_seconds();
    return std::move(solution_);
  }

  Eigen::MatrixXd derivatives(const std::vector<std::size_t>& held) {
    if (!has_matrices_) return {};
    multipliers_.curve(barrier_, now_.w, diagonal_);
    diagonal_.shift = 0;
    if (!kkt_.factor(diagonal_)) return {};
    Eigen::MatrixXd derivatives = kkt_.follow(held);
    return derivatives.allFinite() ? derivatives : Eigen::MatrixXd();
  }

 private:
  double processor_seconds() const { return thread_seconds() - processor_begin_; }
  double mean_product() const { return multipliers_.mean_product(barrier_, now_.w); }
  bool is_over() const { return options_.stop.stop_requested() || is_late(); }
  bool is_late() const { return processor_seconds() > options_.max_seconds; }

  bool evaluate(BarrierPoint& point) {
    const Stopwatch watch(solution_.times.functions, solution_.times.function_calls);
    return barrier_.evaluate(point);
  }
  // The Hessian first: what it needs at the same point brings the others along.
  bool differentiate(bool with_hessian) {
    SolveTimes& times = solution_.times;
    if (with_hessian) {
      const Stopwatch watch(times.hessian, times.hessian_calls);
      if (!nlp_.hessian(now_.w.data(), 1, lambda_.data(), hessian_.data())) return false;
    }
    {
      const Stopwatch watch(times.jacobian, times.jacobian_calls);
      if (!nlp_.gradient(now_.w.data(), gradient_.data()) || !nlp_.jacobian(now_.w.data(), jacobian_.data()))
        return false;
    }
    kkt_.set(jacobian_.data(), hessian_.data());
    return gradient_.allFinite();
  }
  bool begin_at(const std::vector<double>& start, double push) {
    const Stopwatch watch(solution_.times.functions, solution_.times.function_calls);
    return barrier_.begin(start, push, now_);
  }

  SolveStatus run(const std::vector<double>& start, const NlpSolution* warm) {
    const bool is_near = warm || options_.first_barrier > 0;
    bool is_finite = begin_at(start, is_near ? kWarmPush : kPush);
    if (is_near && is_finite) is_finite = begin_at(start, std::clamp(kPush * now_.largest, kWarmPush, kPush));
    if (!is_finite || !differentiate(false))
      throw NumericalError("solve_with_riccati: the functions of the program are not finite at its start");
    mu_ = is_near && !warm ? options_.first_barrier : kFirstBarrier;
    blocked_ = 0, may_raise_ = !is_near;
    if (warm) take_over(*warm);
    if (!warm)
      is_near ? multipliers_.begin(barrier_, now_.w, mu_, HUGE_VAL) : multipliers_.set_ones(barrier_);
    if (!warm || !lambda_.allFinite()) least_squares_multipliers();
    if (!differentiate(true)) return SolveStatus::kNotFinite;
    filter_.begin(now_.sum);
    note(0, 0, 0, 0, 0);
    mode_ = BarrierMode(options_.barrier_update == BarrierUpdate::kAdaptive);
    most_barrier_ = std::max(kMostFirstBarriers * mean_product(), kFirstBarrier);
    for (int iteration = 1;; ++iteration) {
      if (const std::optional<SolveStatus> end = ended(iteration)) return has_matrices_ = true, *end;
      if (may_raise_ || !adapts_barrier()) raise_barrier(), lower_barrier();
      if (!newton_step()) return SolveStatus::kStepFailed;
      const double size = largest(w_step_);
      const Outcome outcome = search();
      if (outcome.status) return *outcome.status;
      shift_.note(outcome.trials, diagonal_.shift);
      if (!differentiate(true)) return SolveStatus::kNotFinite;
      note(iteration, size, outcome.primal, outcome.dual, outcome.trials, outcome.is_restored);
    }
  }

  // Multipliers of an earlier solve, and the barrier that they speak of.
  void take_over(const NlpSolution& warm) {
    std::copy(warm.lambda.begin(), warm.lambda.end(), lambda_.data());
    const double mu = multipliers_.take_over(barrier_, now_.w, warm, least_barrier_);
    mu_ = std::clamp(mu, least_barrier_, kFirstBarrier);
  }

  OptimalityErrors errors(double mu) const { return optimality_.errors(now_, multipliers_, mu); }

  std::optional<SolveStatus> ended(int iteration) {
    const OptimalityErrors e = errors(0);
    constexpr double kMostViolation = 1e-4;
    if (e.all <= options_.tolerance && e.dual <= options_.dual_tolerance &&
        std::max(e.primal, e.complementarity) <= kMostViolation)
      return SolveStatus::kSolved;
    const bool is_acceptable = e.all <= kAcceptable;
    progress_.note(is_acceptable, now_.f, e);
    // Steps with a corrected inertia converge linearly.  The check of second order decides whether the point is a minimum.
    const int enough = is_corrected_ ? kShiftedIterations : kAcceptableIterations;
    if (options_.stop_at_acceptable && progress_.acceptable() >= enough) return SolveStatus::kAcceptable;
    if (largest(now_.w) > kEndless) return SolveStatus::kDiverging;
    if (has_settled_) return SolveStatus::kSettled;
    if (options_.stop.stop_requested()) return SolveStatus::kStopped;
    if (iteration > options_.max_iterations) return SolveStatus::kIterationLimit;
    if (is_late()) return SolveStatus::kTimeLimit;
    if ((is_tiny_ && mu_ <= least_barrier_) || progress_.has_stalled())
      return is_acceptable ? SolveStatus::kAcceptable : SolveStatus::kStepTooSmall;
    return {};
  }

  // Whether the next step chooses its barrier.  The first one that no longer does holds one near that of the point.
  bool adapts_barrier() {
    const bool did = mode_.is_adaptive();
    const bool is_over = is_tiny_ || mean_product() <= kFloor * least_barrier_;
    if (mode_.update(errors(0).all, is_over) || !did) return mode_.is_adaptive();
    hold_barrier();
    return false;
  }
  void hold_barrier() {
    mu_ = std::clamp(kFixedPart * mean_product(), least_barrier_, most_barrier_);
    filter_.clear();
    is_tiny_ = false;
  }
  // By the two parts of a step: -> step_ and mu_.
  void adaptive_step() {
    set_right(0);
    kkt_.solve(right_, step_);
    join(step_, w_step_);
    barrier_.slope(now_.w, 1, slope_);
    right_.x = -slope_.head(n_), right_.s = -slope_.tail(m_), right_.c.setZero();
    hold_still(right_);
    kkt_.solve(right_, corrected_);
    join(corrected_, soc_step_);
    const double dual = optimality_.stationarity().squaredNorm() / double(n_);
    const double primal = now_.c.squaredNorm() / std::max(1.0, double(m_));
    const double mu = QualityFunction(barrier_, now_.w, multipliers_, w_step_, soc_step_)
                          .minimum(dual, primal, step_part(), least_barrier_, most_barrier_);
    if (std::exchange(mu_, mu) != mu) filter_.clear();
    step_.x += mu * corrected_.x, step_.s += mu * corrected_.s, step_.c += mu * corrected_.c;
    set_right(mu);
  }
  // Of a distance to a bound, that a step may take.
  double step_part() const { return std::max(kTauMin, 1 - (mode_.is_adaptive() ? errors(0).all : mu_)); }

  // Steps that bounds cut short again and again: the first barrier was too weak for costs of this size to be kept off them.
  void raise_barrier() {
    if (blocked_ < kBlockedSteps || !may_raise_ || mu_ >= kMostBarrier) return;
    mu_ *= 10, blocked_ = 0;
    filter_.clear();
  }
  void lower_barrier() {
    while (mu_ > least_barrier_ && (is_tiny_ || errors(mu_).all <= kKappaEpsilon * mu_)) {
      mu_ = std::max(least_barrier_, std::min(kKappaMu * mu_, std::pow(mu_, kThetaMu)));
      may_raise_ = false;
      filter_.clear();
      is_tiny_ = false;
    }
  }

  // Shifts until the inertia is right.
  bool factor() {
    multipliers_.curve(barrier_, now_.w, diagonal_);
    double& shift = diagonal_.shift;
    shift = shift_.damping();
    is_corrected_ = !kkt_.factor(diagonal_);
    if (!is_corrected_) return true;
    for (shift = shift_.first(); !kkt_.factor(diagonal_); shift = shift_.larger(shift))
      if (!(shift <= HessianShift::kMost)) return false;
    return true;
  }

  void hold_still(KktVector& right) const {
    for (const Eigen::Index i : barrier_.still()) (i < n_ ? right.x[i] : right.s[i - n_]) = 0;
  }
  void set_right(double mu) {
    barrier_.slope(now_.w, mu, slope_);
    right_.x = -slope_.head(n_) - optimality_.lagrangian();
    slope_.head(n_) += gradient_;  // of the barrier function
    right_.s = lambda_ - slope_.tail(m_);
    right_.c = -now_.c;
    hold_still(right_);
  }

  bool newton_step() {
    if (!factor()) return false;
    if (mode_.is_adaptive()) {
      adaptive_step();
    } else {
      set_right(mu_);
      kkt_.solve(right_, step_);
    }
    join(step_, w_step_);
    multipliers_.step(barrier_, now_.w, w_step_, mu_);
    return w_step_.allFinite() && step_.c.allFinite();
  }
  void join(const KktVector& step, VectorXd& w) const {
    w.resize(n_ + m_);
    w << step.x, step.s;
  }
  struct Outcome {
    std::optional<SolveStatus> status = {};
    double primal = 0, dual = 0;
    int trials = 0;
    bool is_restored = false;
  };

  Outcome search() {
    const double tau = step_part();
    const double along = slope_.dot(w_step_);  // of the barrier function
    const double theta = now_.sum, phi = barrier_.value(now_, mu_);
    const double rounding = 10 * std::numeric_limits<double>::epsilon();
    const double dual = multipliers_.longest(tau);
    double length = barrier_.longest(now_.w, w_step_, tau);
    blocked_ = length < kBlocked ? blocked_ + 1 : 0;

    double relative = 0;
    for (Eigen::Index i = 0; i < n_ + m_; ++i)
      relative = std::max(relative, std::abs(w_step_[i]) / (1 + std::abs(now_.w[i])));
    const bool was_tiny = is_tiny_;
    is_tiny_ = relative < rounding && theta < 1e-4;
    if (is_tiny_) {
      trial_.w = now_.w + length * w_step_;
      if (!evaluate(trial_)) return {SolveStatus::kNotFinite};
      if (was_tiny && mu_ <= least_barrier_)
        return {progress_.acceptable() > 0 ? SolveStatus::kAcceptable : SolveStatus::kStepTooSmall};
      accept(length, dual, step_.c);
      return {{}, length, dual, 1};
    }

    double shortest = kGammaTheta;
    if (along < 0) {
      shortest = std::min(kGammaTheta, kGammaPhi * theta / -along);
      if (theta <= filter_.least_theta)
        shortest = std::min(shortest, kDelta * std::pow(theta, kSTheta) / std::pow(-along, kSPhi));
    }
    shortest *= kAlphaPart;
    const auto is_switching = [&](double alpha) {
      return along < 0 && alpha * std::pow(-along, kSPhi) > kDelta * std::pow(theta, kSTheta) &&
             theta <= filter_.least_theta;
    };
    const auto is_descent = [&](double alpha, double after) {
      return after - phi - kEta * alpha * along <= rounding * std::abs(phi);
    };
    // Of a trial point: taken by the filter and better than this one.
    double trial_phi = 0;
    const auto is_good = [&](const BarrierPoint& point, double alpha) {
      trial_phi = barrier_.value(point, mu_);
      if (!std::isfinite(trial_phi) || !filter_.takes(point.sum, trial_phi)) return false;
      if (is_switching(alpha)) return is_descent(alpha, trial_phi);
      return point.sum <= (1 - kGammaTheta) * theta ||
             trial_phi - phi + kGammaPhi * theta <= rounding * std::abs(phi);
    };

    int trials = 0;
    const auto take = [&](double alpha, const VectorXd& lambda_step) {
      if (!is_switching(alpha) || !is_descent(alpha, trial_phi)) filter_.add(theta, phi);
      accept(alpha, dual, lambda_step);
      return Outcome{{}, alpha, dual, trials};
    };
    for (double alpha = length; alpha > shortest || trials == 0; alpha /= 2) {
      ++trials;
      trial_.w = now_.w + alpha * w_step_;
      if (!evaluate(trial_)) continue;
      if (is_good(trial_, alpha)) return take(alpha, step_.c);
      if (trials == 1 && trial_.sum >= theta && correct(alpha, tau, is_good))
        return take(alpha, corrected_.c);
    }
    filter_.add(theta, phi);
    return restore(trials);
  }

  // Steps that make up for the curvature of the constraints; true where one leads to a good point, which is trial_ then.
  template <class Good>
  bool correct(double alpha, double tau, const Good& is_good) {
    soc_ = alpha * now_.c + trial_.c;
    double before = trial_.sum;
    for (int i = 0; i < kMostCorrections; ++i) {
      const VectorXd kept = right_.c;
      right_.c = -soc_;
      kkt_.solve(right_, corrected_);
      right_.c = kept;
      join(corrected_, soc_step_);
      if (!soc_step_.allFinite()) return false;
      const double length = barrier_.longest(now_.w, soc_step_, tau);
      trial_.w = now_.w + length * soc_step_;
      if (!evaluate(trial_)) return false;
      if (is_good(trial_, alpha)) return true;
      if (trial_.sum > kKappaSoc * before) return false;
      before = trial_.sum;
      soc_ = length * soc_ + trial_.c;
    }
    return false;
  }

  void accept(double primal, double dual, const VectorXd& lambda_step) {
    std::swap(now_, trial_);
    lambda_ += primal * lambda_step;
    multipliers_.move(barrier_, now_.w, dual, mu_);
  }
  // Those that leave the least of the gradient; zero where they are large.
  void least_squares_multipliers() {
    lambda_.setZero();
    diagonal_.sigma_x.setOnes(), diagonal_.sigma_s.setOnes();
    diagonal_.shift = 0;
    diagonal_.with_hessian = false;
    const bool good = kkt_.factor(diagonal_);
    diagonal_.with_hessian = true;
    if (!good) return;
    right_.x = -(gradient_ - multipliers_.lower.head(n_) + multipliers_.upper.head(n_));
    right_.s = multipliers_.lower.tail(m_) - multipliers_.upper.tail(m_);
    right_.c.setZero();
    hold_still(right_);
    kkt_.solve(right_, step_);
    if (step_.c.allFinite() && largest(step_.c) <= kMostPrice) lambda_ = step_.c;
  }

  Outcome restore(int trials) {
    const auto is_good = [&](const BarrierPoint& point) {
      const double phi = barrier_.value(point, mu_);
      return std::isfinite(phi) && filter_.takes(point.sum, phi);
    };
    const double small = std::min(options_.tolerance, 1e-8);
    if (now_.largest <= small)  // nothing to restore
      return {progress_.acceptable() > 0 ? SolveStatus::kAcceptable : SolveStatus::kStepTooSmall};
    Restoration restoration(nlp_, kkt_, barrier_);
    const RestorationEnd end = restoration.run(
        now_, mu_, small,
        {is_good, [this] { return is_over(); }, [this](BarrierPoint& point) { return evaluate(point); }});
    switch (end) {
      case RestorationEnd::kRestored:
        break;
      case RestorationEnd::kInfeasible:
        return {SolveStatus::kLocallyInfeasible};
      case RestorationEnd::kStopped:
        return {options_.stop.stop_requested() ? SolveStatus::kStopped : SolveStatus::kTimeLimit};
      case RestorationEnd::kFailed:
        return {SolveStatus::kRestorationFailed};
    }
    lambda_.setZero();
    if (!differentiate(false)) return {SolveStatus::kNotFinite};
    multipliers_.begin(barrier_, now_.w, mu_, HUGE_VAL);
    multipliers_.reset_above(kMostPrice, barrier_);
    least_squares_multipliers();
    if (mode_.end()) hold_barrier();
    return {{}, 0, 0, trials, true};
  }

  // Of every point that the method goes to.
  void note(int iteration, double size, double primal, double dual, int trials, bool is_restored = false) {
    optimality_.look(gradient_, lambda_, multipliers_);
    const OptimalityErrors e = errors(0);
    solution_.log.push_back(
        {iteration, now_.f, e.primal, e.dual, mu_, size, diagonal_.shift, dual, primal, trials, is_restored});
    has_settled_ = options_.stop_when_settled && settling_.note(solution_.log.back());
    if (options_.watch) options_.watch(solution_.log.back());
    if (!options_.stop.stop_possible()) return;
    rows_of(now_);
    best_.consider(nlp_.shape(), now_.w.data(), solution_.g.data(), now_.f);
  }
  void rows_of(const BarrierPoint& point) {
    solution_.g.resize(std::size_t(m_));
    nlp_.constraints(point.w.data(), solution_.g.data());
  }

  void finish() {
    solution_.x.assign(now_.w.data(), now_.w.data() + n_);
    solution_.objective = now_.f;
    solution_.lambda.assign(lambda_.data(), lambda_.data() + m_);
    solution_.lower_multiplier.assign(multipliers_.lower.data(), multipliers_.lower.data() + n_);
    solution_.upper_multiplier.assign(multipliers_.upper.data(), multipliers_.upper.data() + n_);
    rows_of(now_);
    if (solution_.status == SolveStatus::kStopped && !best_.x.empty()) best_.move_into(solution_);
  }

  Nlp& nlp_;
  SolverOptions options_;
  StagewiseKkt kkt_;
  Barrier barrier_;
  Optimality optimality_;
  Eigen::Index n_, m_;
  Clock::time_point begin_;
  NlpSolution solution_;

  BarrierPoint now_, trial_;
  BestPoint best_;
  VectorXd gradient_, jacobian_, hessian_;
  VectorXd lambda_;  // (m)
  BoundMultipliers multipliers_;
  double mu_ = kFirstBarrier, least_barrier_ = 0, processor_begin_ = 0;
  Settling settling_;
  HessianShift shift_;
  Progress progress_;
  int blocked_ = 0;
  bool may_raise_ = true, is_corrected_ = false;  // the latter: the inertia of the last step
  bool is_tiny_ = false, has_settled_ = false, has_matrices_ = false;  // the latter: kkt_ has those of now_
  Filter filter_;
  BarrierMode mode_;
  double most_barrier_ = kMostBarrier;  // of adaptive steps
  KktDiagonal diagonal_;
  KktVector right_, step_, corrected_;
  VectorXd w_step_, slope_, soc_, soc_step_;
};

StructuredInteriorPoint::StructuredInteriorPoint(Nlp& nlp)
    : nlp_(nlp), method_(std::make_unique<Method>(nlp)) {
  if (nlp.shape().hessian_kind == HessianKind::kLimitedMemory)
    refuse_stages("a limited-memory Hessian ties all stages; expected an exact or a Gauss-Newton one");
}
StructuredInteriorPoint::~StructuredInteriorPoint() = default;

Eigen::MatrixXd StructuredInteriorPoint::derivatives(const std::vector<std::size_t>& held) {
  return method_->derivatives(held);
}

NlpSolution StructuredInteriorPoint::solve(const std::vector<double>& start, const SolverOptions& options,
                                           const NlpSolution* warm) {
  const NlpShape& shape = nlp_.shape();
  check_stage_options(shape, start, options);
  if (warm && (warm->lambda.size() != shape.m() || warm->lower_multiplier.size() != shape.n() ||
               warm->upper_multiplier.size() != shape.n()))
    refuse_stages("the solution to go on from has multipliers of " + std::to_string(warm->lambda.size()) +
                  " rows and " + std::to_string(warm->lower_multiplier.size()) +
                  " variables, the problem has " + std::to_string(shape.m()) + " and " +
                  std::to_string(shape.n()));
  if (!method_->fits()) method_ = std::make_unique<Method>(nlp_);
  return method_->solve(start, warm, options);
}

}  // namespace dyntape
