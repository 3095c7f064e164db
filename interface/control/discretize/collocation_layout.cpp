// SPDX-License-Identifier: BSD-3-Clause
//
// Construction: where the points stand, what bounds hold, and where every entry of the derivatives comes
// from.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <numeric>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/control/discretize/collocation.h>
#include <dyntape/interface/control/problem/scaled_time.h>

namespace dyntape {

namespace {

using Place = std::pair<std::size_t, std::size_t>;  // row, column

// Non-zeros of each row of a pattern: [first, last) of row i.
std::vector<std::size_t> row_begins(const Pattern& pattern) {
  std::vector<std::size_t> begins(pattern.rows + 1, 0);
  for (std::uint32_t row : pattern.row) ++begins[row + 1];
  std::partial_sum(begins.begin(), begins.end(), begins.begin());
  return begins;
}

void append(Pattern& pattern, std::size_t row, std::size_t col) {
  pattern.row.push_back(static_cast<std::uint32_t>(row));
  pattern.col.push_back(static_cast<std::uint32_t>(col));
}

// Numbers the places in sorted order and says which number each has.
std::vector<std::size_t> number_places(const std::vector<Place>& places, Pattern& pattern) {
  std::map<Place, std::size_t> numbers;
  for (const Place& place : places) numbers.emplace(place, 0);
  std::size_t next = 0;
  for (auto& [place, number] : numbers) {
    number = next++;
    append(pattern, place.first, place.second);
  }
  std::vector<std::size_t> result;
  for (const Place& place : places) result.push_back(numbers.at(place));
  return result;
}

std::size_t intervals_of(const MeshOptions& options) {
  if (!options.nodes.empty()) return options.nodes.size() - 1;
  return static_cast<std::size_t>(std::max(options.intervals, 0));
}

// Where the duration is free, nodes say how long it is at first; a solver may have left its range by rounding.
Problem with_duration_of(const std::vector<double>& nodes, Problem problem) {
  if (!problem.free_time || nodes.empty()) return problem;
  const double before = problem.duration;
  problem.duration = std::clamp(nodes.back(), problem.free_time->shortest, problem.free_time->longest);
  if (!problem.guess) return problem;
  problem.guess = [guess = problem.guess, stretch = before / problem.duration](double t) {
    Stage<double> stage = guess(stretch * t);
    stage.t = t;
    return stage;
  };
  return problem;
}

std::vector<double> scaled_to(double duration, std::vector<double> nodes) {
  if (nodes.empty() || nodes.back() == duration) return nodes;
  const double factor = duration / nodes.back();
  for (double& node : nodes) node *= factor;
  return nodes;
}

std::vector<Function> terms_of(const std::vector<RecordedInstant>& instants) {
  std::vector<Function> all;
  for (const RecordedInstant& instant : instants) all.push_back(instant.terms);
  return all;
}

std::vector<Function> squares_of(const std::vector<RecordedInstant>& instants) {
  std::vector<Function> all;
  for (const RecordedInstant& instant : instants) all.push_back(instant.squares);
  return all;
}

// A mesh that is none is refused later.
IntervalLength lengths_of(const Problem& problem, const MeshOptions& options) {
  const double duration = problem.free_time ? 1 : problem.duration;
  const auto not_later = [](double a, double b) { return !(a < b); };  // NaN included
  const bool increase =
      std::adjacent_find(options.nodes.begin(), options.nodes.end(), not_later) == options.nodes.end();
  if (options.nodes.size() >= 2 && increase) return interval_lengths(scaled_to(duration, options.nodes));
  if (options.nodes.empty() && options.intervals > 0 && instants_of(problem).size() > 1)
    return interval_lengths(scaled_to(duration, node_times(problem, options)));
  return [h = duration / std::max(options.intervals, 1)](double) { return h; };
}

RecordedStage timed_recording(const Problem& problem, double& seconds) {
  const auto begin = std::chrono::steady_clock::now();
  RecordedStage stage = record_stage(problem);
  seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return stage;
}

}  // namespace

BuildReport Collocation::build() const {
  BuildReport report;
  for (const auto* functions : {&functions_, &squares_}) {
    if (*functions) (*functions)->add_to(report);
  }
  report.seconds.record = record_seconds_;
  return report;
}

Collocation::Collocation(const Problem& problem, const MeshOptions& options)
    : Collocation(problem, options, nullptr) {}

Collocation::Collocation(const Collocation& ready, std::vector<double> nodes)
    : Collocation(with_duration_of(nodes, ready.asked_),
                  {.scheme = ready.scheme_,
                   .nodes = nodes,
                   .hessian = ready.shape_.hessian_kind,
                   .evaluation = ready.evaluation_,
                   .threads = ready.threads_},
                  &ready) {}

Collocation::Collocation(const Problem& problem, const MeshOptions& options, const Collocation* ready)
    : length_(lengths_of(problem, options)),
      asked_(problem),
      problem_(options.scheme.taken_by(scaled_time(problem), length_)),
      stage_(ready ? ready->stage_ : timed_recording(problem_, record_seconds_)),
      scheme_(options.scheme),
      n_x_(static_cast<std::size_t>(problem_.n_x())),
      n_z_(n_x_ + static_cast<std::size_t>(problem_.n_a() + problem_.n_u())),
      stride_(static_cast<std::size_t>(scheme_.points()) - 1),
      rows_(static_cast<std::size_t>(scheme_.rows())),
      evaluation_(options.evaluation),
      threads_(options.threads) {
  intervals_ = intervals_of(options);
  if (const std::string fault = scheme_.fault_on(static_cast<int>(intervals_)); !fault.empty())
    throw ArgumentError("problem \"" + problem_.name + "\": " + fault);
  points_ = intervals_ * stride_ + 1;
  first_used_ = scheme_.uses_first_point() ? 0 : 1;
  used_ = points_ - first_used_ - (scheme_.uses_last_point() ? 0 : 1);
  shape_.hessian_kind = options.hessian;
  evaluation_.order = options.hessian == HessianKind::kExact ? Order::kSecond : Order::kFirst;
  if (ready)
    functions_.emplace(*ready->functions_, used_, threads_);
  else
    functions_.emplace(stage_.node, terms_of(stage_.instants), evaluation_, used_, threads_);
  if (ready) evaluation_.force_rebuild = false;  // what is left to compile was compiled for `ready`
  check_size();
  place_points(options);
  place_parameters();
  set_variable_bounds();
  set_row_bounds();
  lay_out_jacobian();
  lay_out_gradient();
  lay_out_hessian(options.hessian);
  forget();
  y_.resize(functions_->values());
  first_y_ = weights_ = y_;
  first_j_.resize(functions_->jacobians());
  second_h_.resize(functions_->hessians());
}

std::size_t Collocation::held_rows() const {
  return std::size_t(scheme_.held.rows()) * std::size_t(problem_.n_u());
}

void Collocation::place_points(const MeshOptions& options) {
  MeshOptions mesh = options;
  if (asked_.free_time) mesh.nodes = scaled_to(1, mesh.nodes);
  const std::vector<double> nodes = node_times(problem_, mesh);
  for (const RecordedInstant& instant : stage_.instants)
    instant_points_.push_back(node_at_share(problem_, instant.share, nodes) * stride_);
  at_instants_.resize(instant_points_.size());
  t_.assign(points_, problem_.duration);
  quadrature_.assign(points_, 0.0);
  for (std::size_t k = 0; k < intervals_; ++k) {
    const double h = nodes[k + 1] - nodes[k];
    for (std::size_t j = 0; j <= stride_; ++j) {
      if (j < stride_) t_[k * stride_ + j] = nodes[k] + h * scheme_.c[long(j)];
      quadrature_[k * stride_ + j] += h * scheme_.gamma[long(j)];
    }
  }
  quadrature_.erase(quadrature_.begin(), quadrature_.begin() + long(first_used_));
  quadrature_.resize(used_);
}

// What the functions take at every point: its time, and the parameters then.
void Collocation::place_parameters() {
  parameters_.clear();
  for (double t : t_) {
    const Eigen::VectorXd values = parameters_of(problem_, t);
    parameters_.insert(parameters_.end(), values.begin(), values.end());
  }
}

// What was evaluated last is that no more.  Asked at an x that is all NaN the answer is no.
void Collocation::forget() {
  values_good_ = first_good_ = false;
  x_values_.assign(shape_.n(), std::nan(""));
  x_first_ = x_values_;
}

void Collocation::set_variable_bounds() {
  shape_.x_lower.clear();
  shape_.x_upper.clear();
  const auto append_bounds = [&](const Bounds& bounds) {
    shape_.x_lower.insert(shape_.x_lower.end(), bounds.lower.begin(), bounds.lower.end());
    shape_.x_upper.insert(shape_.x_upper.end(), bounds.upper.begin(), bounds.upper.end());
  };
  for (std::size_t p = 0; p < points_; ++p) {
    for (const Bounds* bounds : {&problem_.x, &problem_.a, &problem_.u}) append_bounds(*bounds);
  }
  const auto fix = [&](std::size_t i, double value) { shape_.x_lower[i] = shape_.x_upper[i] = value; };
  for (std::size_t i = 0; i < n_x_; ++i) {
    const double start = problem_.start[long(i)], goal = problem_.goal[long(i)];
    if (!std::isnan(start)) fix(i, start);
    if (!std::isnan(goal)) fix((points_ - 1) * n_z_ + i, goal);
  }
  for (std::size_t p : {std::size_t(0), points_ - 1}) {
    if (p >= first_used_ && p < first_used_ + used_) continue;
    const Stage<double> guess = problem_.first_guess(t_[p]);
    std::size_t i = p * n_z_ + n_x_;
    for (double a : guess.a) fix(i++, a);
    for (double u : guess.u) fix(i++, u);
  }
}

void Collocation::set_row_bounds() {
  // A node and what lies before it within its interval are a stage.
  for (std::size_t k = 0; k <= intervals_; ++k)
    shape_.stages.push_back(k == 0 ? 0 : ((k - 1) * stride_ + 1) * n_z_);
  shape_.g_lower.assign(first_path_row(), 0.0);
  shape_.g_upper.assign(first_path_row(), 0.0);
  const auto append_row = [&](const ConstraintRow& row) {
    shape_.g_lower.push_back(row.lower);
    shape_.g_upper.push_back(row.upper);
  };
  for (std::size_t p = 0; p < used_; ++p)
    std::for_each(stage_.path_rows.begin(), stage_.path_rows.end(), append_row);
  std::for_each(stage_.instant_rows.begin(), stage_.instant_rows.end(), append_row);
}

void Collocation::lay_out_jacobian() {
  const Pattern& block = functions_->node().jacobian_pattern();
  const std::vector<std::size_t> begin = row_begins(block);
  shape_.jacobian = {shape_.g_lower.size(), shape_.n(), {}, {}};
  const auto add = [&](std::size_t row, std::size_t col, double constant, double factor,
                       std::ptrdiff_t source) {
    append(shape_.jacobian, row, col);
    jacobian_map_.push_back({constant, factor, source});
  };
  // Row i of point p in row `row` of the program: alpha on the point's own state i, factor times the point's
  // Jacobian.
  const auto add_point = [&](std::size_t row, std::size_t p, std::size_t i, double alpha, double factor) {
    bool placed = alpha == 0;
    for (std::size_t e = begin[i]; factor != 0 && e < begin[i + 1]; ++e) {
      const std::size_t col = block.col[e];
      if (!placed && col > i) add(row, p * n_z_ + i, alpha, 0, -1);
      const bool own = alpha != 0 && col == i;
      placed = placed || col >= i;
      add(row, p * n_z_ + col, own ? alpha : 0, factor,
          static_cast<std::ptrdiff_t>((p - first_used_) * block.nnz() + e));
    }
    if (!placed) add(row, p * n_z_ + i, alpha, 0, -1);
  };
  std::size_t row = 0;
  for (std::size_t k = 0; k < intervals_; ++k) {
    for (std::size_t r = 0; r < rows_; ++r) {
      for (std::size_t i = 0; i < n_x_; ++i, ++row) {
        for (std::size_t j = 0; j <= stride_; ++j) {
          add_point(row, k * stride_ + j, i, scheme_.alpha(long(r), long(j)),
                    step(k) * scheme_.beta(long(r), long(j)));
        }
      }
    }
  }
  const std::size_t n_u = std::size_t(problem_.n_u());
  for (std::size_t k = 0; k < intervals_; ++k) {
    for (Eigen::Index r = 0; r < scheme_.held.rows(); ++r) {
      for (std::size_t i = 0; i < n_u; ++i, ++row) {
        for (std::size_t j = 0; j <= stride_; ++j) {
          const double weight = scheme_.held(r, long(j));
          if (weight != 0) add(row, (k * stride_ + j + 1) * n_z_ - n_u + i, weight, 0, -1);
        }
      }
    }
  }
  for (std::size_t p = first_used_; p < first_used_ + used_; ++p) {
    for (std::size_t i = 0; i < stage_.path_rows.size(); ++i) add_point(row++, p, n_x_ + i, 0, 1);
  }
  for (std::size_t k = 0; k < stage_.instants.size(); row += stage_.instants[k++].rows.size()) {
    const StageFunctions::Instant& instant = functions_->instants()[k];
    const Pattern& own = instant.function.jacobian_pattern();
    for (std::size_t e = 0; e < own.nnz(); ++e) {
      if (own.row[e] == stage_.instants[k].rows.size()) continue;  // the cost
      add(row + own.row[e], first_of_instant(k) + own.col[e], 0, 1,
          static_cast<std::ptrdiff_t>(instant.jacobian + e));
    }
  }
}

void Collocation::lay_out_gradient() {
  const CompiledFunction& node = functions_->node();
  const Pattern& block = node.jacobian_pattern();
  const std::vector<std::size_t> begin = row_begins(block);
  const std::size_t cost = node.n_y() - 1;
  for (std::size_t p = 0; p < used_; ++p) {
    for (std::size_t e = begin[cost]; e < begin[cost + 1]; ++e) {
      gradient_map_.push_back({(first_used_ + p) * n_z_ + block.col[e], quadrature_[p], p * block.nnz() + e});
    }
  }
  for (std::size_t k = 0; k < instant_points_.size(); ++k) {
    const StageFunctions::Instant& instant = functions_->instants()[k];
    const Pattern& own = instant.function.jacobian_pattern();
    for (std::size_t e = 0; e < own.nnz(); ++e) {
      if (own.row[e] + 1 != instant.function.n_y()) continue;
      gradient_map_.push_back({first_of_instant(k) + own.col[e], 1.0, instant.jacobian + e});
    }
  }
}

void Collocation::lay_out_hessian(HessianKind kind) {
  shape_.hessian = {shape_.n(), shape_.n(), {}, {}};
  if (kind == HessianKind::kExact) lay_out_exact_hessian();
  if (kind == HessianKind::kGaussNewton) lay_out_gauss_newton();
}

void Collocation::lay_out_exact_hessian() {
  const Pattern& block = functions_->node().hessian_pattern();
  std::vector<Place> places;
  for (std::size_t p = 0; p < used_; ++p) {
    for (std::size_t e = 0; e < block.nnz(); ++e) {
      const std::size_t first = (first_used_ + p) * n_z_;
      places.emplace_back(first + block.row[e], first + block.col[e]);
    }
  }
  for (std::size_t k = 0; k < instant_points_.size(); ++k) {
    const Pattern& own = functions_->instants()[k].function.hessian_pattern();
    const std::size_t first = first_of_instant(k);
    for (std::size_t e = 0; e < own.nnz(); ++e) places.emplace_back(first + own.row[e], first + own.col[e]);
  }
  hessian_map_ = number_places(places, shape_.hessian);
}

void Collocation::lay_out_gauss_newton() {
  for (const Term& term : problem_.terms) {
    if (term.role != Role::kCost || !term.curvature.empty()) continue;
    throw ArgumentError("problem \"" + problem_.name +
                        "\": Gauss-Newton needs every cost as squares of residuals, " + "and \"" + term.name +
                        "\" is a plain cost; use the exact Hessian or limited memory");
  }
  squares_.emplace(stage_.squares, squares_of(stage_.instants), evaluation_, used_, threads_);
  const Pattern& node = squares_->node().jacobian_pattern();
  std::vector<Place> places;
  const auto add = [&](const Pattern& block, std::size_t first_source, std::size_t first_variable,
                       double weight) {
    const std::vector<std::size_t> begin = row_begins(block);
    for (std::size_t r = 0; r < block.rows; ++r) {
      for (std::size_t i = begin[r]; i < begin[r + 1]; ++i) {
        for (std::size_t j = begin[r]; j <= i; ++j) {
          places.emplace_back(first_variable + block.col[i], first_variable + block.col[j]);
          square_map_.push_back({0, 2 * weight, first_source + i, first_source + j});
        }
      }
    }
  };
  for (std::size_t p = 0; p < used_; ++p) add(node, p * node.nnz(), (first_used_ + p) * n_z_, quadrature_[p]);
  for (std::size_t k = 0; k < instant_points_.size(); ++k) {
    const StageFunctions::Instant& instant = squares_->instants()[k];
    add(instant.function.jacobian_pattern(), instant.jacobian, first_of_instant(k), 1.0);
  }
  const std::vector<std::size_t> numbers = number_places(places, shape_.hessian);
  for (std::size_t e = 0; e < numbers.size(); ++e) square_map_[e].target = numbers[e];
  residuals_.resize(squares_->values());
  residual_j_.resize(squares_->jacobians());
}

}  // namespace dyntape
