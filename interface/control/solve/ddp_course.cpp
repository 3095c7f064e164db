// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/solve/ddp_course.h>

#include <cmath>
#include <numbers>
#include <utility>

#include <dyntape/autodiff/factorisations.h>
#include <dyntape/interface/control/solve/piece.h>
#include <dyntape/interface/io/stopwatch.h>

namespace dyntape {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

}  // namespace

// Each co_await stands in a statement of its own: in conditions gcc 12 makes wrong code of them.
struct DdpCourse::Solve {
  Solve(const DdpOptions& all, DdpWork& of_lanes, int own, std::optional<double> of_start)
      : options(all), work(of_lanes), lane(own), at(of_lanes.at(own)), knows_cost(of_start.has_value()) {
    if (of_start) cost = *of_start;
  }

  struct Pause {
    Solve& solve;
    DdpWish wish;
    bool await_ready() const { return false; }
    void await_suspend(std::coroutine_handle<> handle) { solve.waiting = handle, solve.wish = wish; }
    void await_resume() const {}
  };

  Pause linearise() { return {*this, DdpWish::kLinearise}; }
  Pause backward(bool with_secants) {
    at.shift = shift, at.with_secants = with_secants;
    return {*this, DdpWish::kBackward};
  }
  Pause roll_out(std::vector<double> wanted) {
    lengths = std::move(wanted);
    return {*this, DdpWish::kRollOut};
  }
  Pause roll_out(double length) { return roll_out(std::vector<double>(1, length)); }
  void accept(std::size_t trial) { accepted = int(trial), cost = costs[trial], knows_cost = true; }
  void note(const DdpIteration& now) {
    iterations.push_back(now);
    if (options.watch) options.watch(now);
  }

  bool is_exact() const { return options.hessian == DdpHessian::kExact; }
  bool is_closed(double tolerance) const { return at.gap <= tolerance * at.largest_x; }
  bool has_no_slope(double tolerance) const {
    return (at.slopes.array() <= tolerance * at.sizes.array()).all();
  }
  bool is_solved() const { return has_no_slope(options.tolerance) && is_closed(options.tolerance); }
  bool is_acceptable() const { return has_no_slope(1e4 * options.tolerance) && is_closed(1e-6); }

  // Newton's step moves nothing any more.  Steps of Gauss-Newton get shorter by a ratio each, and what they lead to is as far
  // as all of them together.
  bool is_still() {
    const double size = at.step_size, ratio = shift == 0 && last_size > 0 ? size / last_size : 1,
                 slower = std::max(ratio, std::exchange(last_ratio, ratio));
    last_size = shift == 0 ? size : 0;
    if (shift > 0 || !is_closed(options.tolerance)) return false;
    const double share = is_exact() ? 1 : std::max(1e-3, 1 - slower);
    return size <= share * options.tolerance * at.largest_u;
  }

  // Where the merit cannot tell one motion from the next any more, Newton's steps still make the slope less; where nothing
  // does, it is over.
  bool has_stalled(double slope) {
    constexpr int kMost = 20;
    if (slope < 0.5 * least_slope) stalled = 0, least_slope = slope;
    return is_near_rounding && ++stalled > kMost;
  }

  // Newton's steps, of all curvature, promise less than the cost is rounded by.
  bool is_least() const {
    return is_exact() && shift == 0 && is_closed(options.tolerance) && promised <= 1e-15 * cost;
  }

  // Whether there is a next one.
  bool raise_shift() {
    shift = std::max(1e-9, 10 * shift);
    return shift <= 1e12;
  }

  // False where a stage has no minimum.
  Piece<bool> step() {
    if (at.help) {
      co_await backward(true);
      if (at.is_convex) co_return true;
    }
    co_await backward(false);
    co_return at.is_convex;
  }

  // The longest of 1, 1/2, ... that lowers the merit, cost + weight sum |gap|; 0: none.
  Piece<double> search() {
    constexpr double kEnough = 1e-4, kShortest = 1e-7;
    if (at.gaps > 0)
      gap_weight = std::max(gap_weight, (at.linear + std::max(0.0, at.curved)) / (0.9 * at.gaps));
    const double slope = at.linear - gap_weight * at.gaps, merit = cost + gap_weight * at.gaps,
                 rounding = 1e-14 * (1 + std::abs(merit)) * std::sqrt(double(options.intervals));
    is_near_rounding = -slope <= 1e3 * rounding, promised = -slope;
    std::vector<double> left{1};
    while (!left.empty() && !options.stop.stop_requested()) {
      co_await roll_out(left);
      for (std::size_t i = 0; i < costs.size(); ++i) {
        const double change = costs[i] + gap_weight * (1 - lengths[i]) * at.gaps - merit;
        if (!std::isfinite(costs[i]) || !(change <= kEnough * lengths[i] * slope + rounding)) continue;
        accept(i);
        co_return lengths[i];
      }
      double next = lengths[costs.size() - 1] / 2;
      left.clear();
      for (; next > kShortest; next /= 2) left.push_back(next);
    }
    co_return 0.0;
  }

  // From a stationary point that is no minimum: the controls of the last stage that has none are moved along its most negative
  // curvature, and what is behind follows the best policies: the cost falls by the square of the length.  False where none does.
  Piece<bool> leave_saddle() {
    constexpr int kMost = 5, kLongest = 20, kShortest = -40;  // powers of two
    constexpr double kEnough = 0.1;
    if (++saddles > kMost) co_return false;
    const double kept = std::exchange(shift, 0);
    const bool is_minimum = co_await step();
    shift = kept;
    if (is_minimum) co_return false;
    const int k = at.failed_stage;
    const SymmetricEigen own = symmetric_eigen(at.failed);
    const double curvature = own.values[0];
    if (!(curvature < 0)) co_return false;
    MatrixXd change = MatrixXd::Zero(at.slopes.size(), options.intervals);
    change.col(k) = own.vectors.col(0);
    work.set_policy(lane, k, change);
    int power = kLongest;
    while (power >= kShortest) {
      std::vector<double> left;
      for (int i = power; i >= kShortest; --i) left.push_back(std::ldexp(1.0, i));
      co_await roll_out(std::move(left));
      for (std::size_t i = 0; i < costs.size(); ++i) {
        if (!(costs[i] - cost <= kEnough * lengths[i] * lengths[i] * curvature / 2)) continue;
        accept(i);
        co_return true;
      }
      power -= int(costs.size());
    }
    co_return false;
  }

  // Costs of these lengths, all of them.
  Piece<std::vector<double>> costs_of(std::vector<double> wanted) {
    std::vector<double> found;
    while (found.size() < wanted.size()) {
      std::vector<double> left(wanted.begin() + std::ptrdiff_t(found.size()), wanted.end());
      co_await roll_out(std::move(left));
      found.insert(found.end(), costs.begin(), costs.end());
    }
    co_return found;
  }

  // Each control changed by a few sines over the horizon, by a hundredth of its size.
  static std::vector<MatrixXd> trial_changes(const MatrixXd& u) {
    constexpr int kShapes = 4;
    constexpr double kLength = 1e-2;
    const Eigen::Index N = u.cols(), m = u.rows();
    const VectorXd sizes = kLength * u.cwiseAbs().rowwise().maxCoeff().cwiseMax(1.0);
    std::vector<MatrixXd> changes(std::size_t(kShapes * m), MatrixXd::Zero(m, N));
    for (Eigen::Index i = 0; i < kShapes * m; ++i)
      for (Eigen::Index k = 0; k < N; ++k)
        changes[std::size_t(i)](i / kShapes, k) =
            sizes[i / kShapes] *
            std::sin(std::numbers::pi * double(i % kShapes + 1) * (double(k) + 0.5) / double(N));
    return changes;
  }

  // Without second derivatives, or where these say nothing: if the cost of a stationary point falls by a trial change, the point is no
  // minimum, and is left along it: by the square, as the mean both ways says, or one way by the third order.  False where none
  // lowers the cost.
  Piece<bool> leave_along_trials() {
    constexpr int kMost = 5, kDoublings = 20;
    constexpr double kRounding = 1e-10, kOneWay = 100;
    const DdpMotion now = work.motion(lane);
    const std::vector<MatrixXd> changes = trial_changes(now.u);
    const std::vector<double> known = work.costs_of(lane, changes);
    for (std::size_t i = 0; i < changes.size() && !options.stop.stop_requested(); ++i) {
      double up = known.empty() ? 0 : known[2 * i], down = known.empty() ? 0 : known[2 * i + 1];
      if (known.empty()) {
        work.set_policy(lane, options.intervals, changes[i]);
        std::vector<double> ways(2, 1);
        ways[1] = -1;
        const std::vector<double> both = co_await costs_of(std::move(ways));
        up = both[0], down = both[1];
      }
      const double sum = up + down, least_change = std::min(up, down) - cost;
      const double rounding = kRounding * (1 + std::abs(cost));
      const bool falls = sum - 2 * cost < -rounding ||
                         (has_no_slope(options.tolerance) && least_change < -kOneWay * rounding);
      if (!std::isfinite(sum) || !falls) continue;
      is_saddle = true;
      if (++saddles > kMost) break;
      if (!known.empty()) work.set_policy(lane, options.intervals, changes[i]);
      double best = up < down ? 1 : -1, least = std::min(up, down);
      for (int doubled = 0; doubled < kDoublings; ++doubled) {
        co_await roll_out(2 * best);
        if (!(costs[0] < least)) break;
        least = costs[0], best *= 2;
      }
      if (!(least < cost)) continue;
      co_await roll_out(best);
      if (!std::isfinite(costs[0])) continue;
      accept(0);
      is_saddle = false;
      break;
    }
    work.set_policy(lane, now.policy);
    co_return accepted >= 0;
  }

  Piece<bool> leave() {
    bool is_left = false;
    if (is_exact()) is_left = co_await leave_saddle();
    if (!is_left) is_left = co_await leave_along_trials();
    if (is_left) least_slope = HUGE_VAL, stalled = 0, shift = 0;
    co_return is_left;
  }

  // The policy of a solution; a shift that is left says that it is no minimum.
  Piece<SolveStatus> finish() {
    shift = 0;
    for (;;) {
      const bool is_convex = co_await step();
      if (is_convex) co_return SolveStatus::kSolved;
      if (!raise_shift()) co_return SolveStatus::kStepFailed;
    }
  }

  Piece<SolveStatus> run() {
    const double begin = thread_seconds();
    bool goes_on = true;
    if (!knows_cost && options.start == DdpStart::kRollOut) {
      co_await roll_out(1.0);
      if (!std::isfinite(costs[0])) co_return SolveStatus::kNotFinite;
      accept(0);
    }
    for (int i = 0;; ++i) {
      co_await linearise();
      at.is_first = false;
      if (!std::exchange(knows_cost, true)) cost = at.cost;
      if (!at.is_finite || !std::isfinite(cost)) co_return SolveStatus::kNotFinite;
      DdpIteration now{cost, at.gap, at.slopes.maxCoeff(), shift, 0};
      if (is_solved()) {
        note(now);
        SolveStatus status = co_await finish();
        if (status != SolveStatus::kSolved) co_return status;
        if (is_exact() && shift == 0) co_return status;
        goes_on = co_await leave();
        if (goes_on) continue;
        status = co_await finish();
        co_return status;
      }
      if (cost < -1e50) co_return SolveStatus::kDiverging;
      const SolveStatus at_rest = is_acceptable() ? SolveStatus::kAcceptable : SolveStatus::kStepTooSmall;
      if (has_stalled(now.slope)) {
        // Where all derivatives are rounding, as of a pole that stands, no step along them leads down.
        goes_on = is_closed(options.tolerance);
        if (goes_on) goes_on = co_await leave();
        if (goes_on) continue;
        SolveStatus status = at_rest;
        if (at_rest == SolveStatus::kStepTooSmall && is_least()) status = co_await finish();
        co_return status;
      }
      if (i == options.max_iterations) co_return SolveStatus::kIterationLimit;
      if (thread_seconds() - begin > options.max_seconds) co_return SolveStatus::kTimeLimit;
      for (;;) {
        if (options.stop.stop_requested()) co_return SolveStatus::kStopped;
        const bool is_convex = co_await step();
        now.shift = shift;
        if (is_convex && is_still()) {
          goes_on = !is_exact();
          if (goes_on) goes_on = co_await leave();
          if (goes_on) break;
          note(now);
          co_return SolveStatus::kSolved;
        }
        if (is_convex) now.length = co_await search();
        if (options.stop.stop_requested()) co_return SolveStatus::kStopped;
        if (now.length > 0) break;
        if (raise_shift()) continue;
        goes_on = is_closed(options.tolerance);
        if (goes_on) goes_on = co_await leave();
        if (goes_on) break;
        co_return is_convex ? at_rest : SolveStatus::kStepFailed;
      }
      if (now.length > 0.3) shift = shift > 1e-9 ? shift / 10 : 0;
      note(now);
    }
  }

  const DdpOptions& options;
  DdpWork& work;
  int lane;
  DdpState& at;

  Piece<SolveStatus> course;
  std::coroutine_handle<> waiting;
  DdpWish wish = DdpWish::kNothing;
  std::vector<double> lengths, costs;
  int accepted = -1;

  bool knows_cost;
  double cost = 0;
  std::vector<DdpIteration> iterations;
  double last_size = 0, last_ratio = 1;
  double shift = 0, gap_weight = 0, least_slope = HUGE_VAL, promised = HUGE_VAL;
  bool is_near_rounding = false, is_saddle = false;
  int stalled = 0, saddles = 0;
};

DdpCourse::DdpCourse(const DdpOptions& options, DdpWork& work, int lane, std::optional<double> cost)
    : solve_(std::make_unique<Solve>(options, work, lane, cost)) {
  work.at(lane) = {};
  solve_->course = solve_->run();
  solve_->course.handle().resume();
}

DdpCourse::~DdpCourse() = default;
DdpCourse::DdpCourse(DdpCourse&&) noexcept = default;
DdpCourse& DdpCourse::operator=(DdpCourse&&) noexcept = default;

DdpWish DdpCourse::wish() const { return solve_->wish; }
const std::vector<double>& DdpCourse::lengths() const { return solve_->lengths; }
void DdpCourse::set_costs(std::vector<double> costs) { solve_->costs = std::move(costs); }

void DdpCourse::go_on() {
  solve_->wish = DdpWish::kNothing, solve_->accepted = -1;
  solve_->waiting.resume();
  if (solve_->wish == DdpWish::kNothing) solve_->course.result();  // throws what ended it
}

int DdpCourse::accepted() const { return solve_->accepted; }

DdpSolution DdpCourse::solution() {
  Solve& own = *solve_;
  DdpMotion motion = own.work.motion(own.lane);
  DdpSolution s;
  s.status = own.course.result(), s.cost = own.cost;
  const bool is_solved = s.status == SolveStatus::kSolved;
  s.is_minimum = is_solved && own.shift == 0 && own.is_exact();
  s.is_saddle = is_solved && own.is_saddle;
  s.x = std::move(motion.x), s.u = std::move(motion.u);
  s.slope = std::move(motion.slope), s.adjoint = std::move(motion.adjoint);
  s.policy = std::move(motion.policy);
  s.iterations = std::move(own.iterations);
  return s;
}

}  // namespace dyntape
