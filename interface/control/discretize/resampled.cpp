// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/discretize/resampled.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

namespace dyntape {

namespace {

// The interval between points, or between nodes, that holds a time: entry k with times[k] <= t.
int interval_with(double t, const std::vector<double>& times) {
  const auto next = std::upper_bound(times.begin(), times.end(), t);
  return std::clamp(int(next - times.begin()) - 1, 0, int(times.size()) - 2);
}

// x' at the first and the last point of an interval, a column each, by the controls of the interval: where these are held, or
// extrapolated, those of its neighbours are others.
std::vector<Eigen::MatrixXd> rates_at_ends(const Problem& problem, const Trajectory& motion) {
  std::vector<Eigen::MatrixXd> rates;
  for (int k = 0; k < motion.intervals(); ++k) {
    rates.emplace_back(motion.x.rows(), 2);
    for (int end = 0; end < 2; ++end) {
      const int p = motion.node(k + end);
      rates.back().col(end) = problem.rate(
          problem.stage(motion.t[p], motion.x.col(p), motion.acceleration(k, end), motion.control(k, end)));
    }
  }
  return rates;
}

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kSame = 1e-9;  // of nominal values

// x with the nearest turns for one control; nothing if it needs none.
std::optional<std::vector<double>> nearest_turns(const StagedPhase& phase, std::size_t control,
                                                 const NlpShape& shape, const std::vector<double>& x) {
  std::vector<double> near = x;
  bool has_turns = false;
  for (std::size_t p = phase.first_used; p < phase.first_used + phase.used; ++p) {
    const std::size_t at = phase.variable_of(p) + control;
    if (std::isfinite(shape.x_lower[at]) || std::isfinite(shape.x_upper[at])) return {};
    if (p == phase.first_used) continue;
    const double turns = std::round((near[at] - near[at - phase.n_z]) / kTurn);
    if (!std::isfinite(turns)) return {};
    near[at] -= kTurn * turns;
    has_turns = has_turns || turns != 0;
  }
  if (!has_turns) return {};
  return near;
}

// The objective, then the constraints, in nominal values; empty if they cannot be evaluated.
std::vector<double> results(StagedNlp& nlp, const std::vector<double>& x, const NlpScaling& scaling) {
  std::vector<double> all(1 + nlp.shape().m());
  if (!nlp.objective(x.data(), all[0]) || !nlp.constraints(x.data(), all.data() + 1)) return {};
  all[0] /= scaling.objective;
  for (std::size_t i = 0; i < scaling.g.size(); ++i) all[1 + i] /= scaling.g[i];
  return all;
}

bool are_same(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (!(std::abs(a[i] - b[i]) <= kSame * (1 + std::abs(a[i])))) return false;
  return true;
}

// Weights of the points in the quadrature of a cost over a phase of length one.
std::vector<double> weights_of(const StagedPhase& phase) {
  const Eigen::VectorXd& gamma = phase.scheme().gamma;
  const bool is_even = gamma.isZero(0);  // the costs are among the results of a step
  std::vector<double> weights(phase.points, 0.0);
  for (std::size_t k = 0; k < phase.intervals; ++k) {
    const double h = phase.step(k) / phase.t.back();
    for (std::size_t i = 0; i <= phase.stride; ++i)
      weights[k * phase.stride + i] += h * (is_even ? 1 / double(phase.stride + 1) : gamma[Eigen::Index(i)]);
  }
  return weights;
}

// Multipliers at points of a mesh as functions of time: divided by the points' weights, linear between points.
class MultiplierDensities {
 public:
  explicit MultiplierDensities(const StagedPhase& phase) : phase_(phase), weights_(weights_of(phase)) {}

  // In order of time; `multipliers` must outlive the object.
  void add(std::size_t point, const double* multipliers) {
    if (!(weights_[point] > 0)) return;
    shares_.push_back(phase_.t[point] / phase_.t.back());
    points_.push_back({weights_[point], multipliers});
  }
  // Of the multiplier of index i, at a fraction of the phase.
  double at(double share, std::size_t i) const {
    if (points_.empty()) return 0;
    if (share <= shares_.front()) return points_.front().density(i);
    if (share >= shares_.back()) return points_.back().density(i);
    const auto k = std::size_t(interval_with(share, shares_));
    const double fraction = (share - shares_[k]) / (shares_[k + 1] - shares_[k]);
    return (1 - fraction) * points_[k].density(i) + fraction * points_[k + 1].density(i);
  }

 private:
  struct Point {
    double weight;
    const double* multipliers;
    double density(std::size_t i) const { return multipliers[i] / weight; }
  };
  const StagedPhase& phase_;
  std::vector<double> weights_, shares_;
  std::vector<Point> points_;
};

void take_bounds(const StagedPhase& from, const std::vector<double>& multipliers, const StagedPhase& to,
                 std::vector<double>& taken) {
  MultiplierDensities densities(from);
  for (std::size_t p = 0; p < from.points; ++p) densities.add(p, &multipliers[from.variable_of(p)]);
  const std::vector<double> weights = weights_of(to);
  for (std::size_t p = 0; p < to.points; ++p)
    for (std::size_t i = 0; i < to.n_z; ++i)
      taken[to.variable_of(p) + i] = weights[p] * densities.at(to.t[p] / to.t.back(), i);
}

std::vector<const RowBlock*> blocks_of(const StagedProgram& program, RowBlock::Kind kind, std::size_t phase) {
  std::vector<const RowBlock*> blocks;
  for (const RowBlock& block : program.rows)
    if (block.kind == kind && block.phase == phase) blocks.push_back(&block);
  return blocks;
}

void take_rows(const StagedProgram& from, const std::vector<double>& lambda, const StagedProgram& to,
               std::size_t phase, std::vector<double>& taken) {
  MultiplierDensities densities(from.phases[phase]);
  for (const RowBlock* block : blocks_of(from, RowBlock::Kind::kPath, phase))
    densities.add(block->place, &lambda[block->row]);
  const StagedPhase& now = to.phases[phase];
  const std::vector<double> weights = weights_of(now);
  for (const RowBlock* block : blocks_of(to, RowBlock::Kind::kPath, phase))
    for (std::size_t i = 0; i < block->size; ++i)
      taken[block->row + i] = weights[block->place] * densities.at(now.t[block->place] / now.t.back(), i);
  for (const RowBlock::Kind kind : {RowBlock::Kind::kInstant, RowBlock::Kind::kLink}) {
    const auto before = blocks_of(from, kind, phase), after = blocks_of(to, kind, phase);
    for (std::size_t k = 0; k < after.size(); ++k)
      std::copy_n(&lambda[before[k]->row], after[k]->size, &taken[after[k]->row]);
  }
}

}  // namespace

NlpSolution with_multipliers_of(const StagedNlp& from, const NlpSolution& solution, const StagedNlp& to,
                                std::vector<double> x) {
  NlpSolution warm;
  warm.x = std::move(x);
  warm.lambda.assign(to.shape().m(), std::numeric_limits<double>::quiet_NaN());
  for (std::vector<double>* multipliers : {&warm.lower_multiplier, &warm.upper_multiplier})
    multipliers->assign(to.shape().n(), 0.0);
  for (std::size_t k = 0; k < to.phases(); ++k) {
    take_bounds(from.phase(k), solution.lower_multiplier, to.phase(k), warm.lower_multiplier);
    take_bounds(from.phase(k), solution.upper_multiplier, to.phase(k), warm.upper_multiplier);
    take_rows(from.program(), solution.lambda, to.program(), k, warm.lambda);
  }
  return warm;
}

Eigen::VectorXd cubic(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                      const Eigen::VectorXd& slope_from, const Eigen::VectorXd& slope_to, double h,
                      double s) {
  const double r = 1 - s;
  return r * r * (1 + 2 * s) * from + s * s * (1 + 2 * r) * to + h * s * r * (r * slope_from - s * slope_to);
}

// x' at every point.
Eigen::MatrixXd rates_of(const Problem& problem, Trajectory motion) {
  Eigen::MatrixXd rates(motion.x.rows(), motion.points());
  motion.extend_to_unused();
  for (int p = 0; p < motion.points(); ++p)
    rates.col(p) =
        problem.rate(problem.stage(motion.t[p], motion.x.col(p), motion.a.col(p), motion.u.col(p)));
  return rates;
}

std::vector<double> halved(const Trajectory& motion) {
  std::vector<double> nodes;
  for (int k = 0; k < motion.intervals(); ++k) {
    const double from = motion.t[motion.node(k)], to = motion.t[motion.node(k + 1)];
    nodes.insert(nodes.end(), {from, from + (to - from) / 2});
  }
  nodes.push_back(motion.t[motion.points() - 1]);
  return nodes;
}

MotionBetween::MotionBetween(const Problem& problem, const Trajectory& motion)
    : problem_(problem), motion_(motion), rates_(rates_of(problem, motion)) {
  const bool jumps = !motion.scheme.uses_first_point() || !motion.scheme.uses_last_point();
  if (jumps) at_ends_ = rates_at_ends(problem, motion);
}

Stage<double> MotionBetween::at(int p, double fraction) const {
  const int stride = motion_.scheme.points() - 1, k = p / stride;
  const bool is_first = !at_ends_.empty() && p == motion_.node(k),
             is_last = !at_ends_.empty() && p + 1 == motion_.node(k + 1);
  const Eigen::VectorXd rate = is_first ? at_ends_[std::size_t(k)].col(0) : rates_.col(p),
                        next_rate = is_last ? at_ends_[std::size_t(k)].col(1) : rates_.col(p + 1);
  const double h = motion_.t[p + 1] - motion_.t[p], t = motion_.t[p] + fraction * h;
  const double begin = motion_.t[motion_.node(k)], end = motion_.t[motion_.node(k + 1)];
  const double of_interval = (t - begin) / (end - begin);
  return problem_.stage(t, cubic(motion_.x.col(p), motion_.x.col(p + 1), rate, next_rate, h, fraction),
                        motion_.acceleration(k, of_interval), motion_.control(k, of_interval));
}

Trajectory resampled(const Problem& problem, const Trajectory& motion, const std::vector<double>& times) {
  const auto n = static_cast<Eigen::Index>(times.size());
  const std::vector<double> points(motion.t.begin(), motion.t.end());
  const MotionBetween between(problem, motion);
  Trajectory result{Eigen::Map<const Eigen::VectorXd>(times.data(), n),
                    Eigen::MatrixXd(motion.x.rows(), n),
                    Eigen::MatrixXd(motion.a.rows(), n),
                    Eigen::MatrixXd(motion.u.rows(), n),
                    motion.scheme,
                    motion.u_lower,
                    motion.u_upper};
  for (Eigen::Index i = 0; i < n; ++i) {
    const int p = interval_with(result.t[i], points);
    const double h = points[std::size_t(p) + 1] - points[std::size_t(p)];
    const Stage<double> s = between.at(p, (result.t[i] - points[std::size_t(p)]) / h);
    result.x.col(i) = s.x, result.a.col(i) = s.a, result.u.col(i) = s.u;
  }
  return result;
}

std::vector<double> without_turns(StagedNlp& nlp, std::vector<double> x, const NlpScaling& scaling) {
  std::vector<double> before;
  for (std::size_t k = 0; k < nlp.phases(); ++k) {
    const StagedPhase& phase = nlp.phase(k);
    for (std::size_t c = phase.n_x; c < phase.n_z; ++c) {
      std::optional<std::vector<double>> near = nearest_turns(phase, c, nlp.shape(), x);
      if (!near) continue;
      if (before.empty()) before = results(nlp, x, scaling);
      if (!before.empty() && are_same(before, results(nlp, *near, scaling))) x = std::move(*near);
    }
  }
  return x;
}

}  // namespace dyntape
