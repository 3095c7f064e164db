// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluation; construction is in collocation_layout.cpp, messages are in collocation_names.cpp.
#include <dyntape/interface/control/discretize/collocation.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include <dyntape/interface/control/problem/scaled_time.h>

namespace dyntape {

namespace {

bool all_finite(const std::vector<double>& values) {
  // A sum is not finite if a term is not; one pass without branches.
  double sum = 0;
  for (double v : values) sum += v * 0.0;
  return sum == 0.0;
}

bool same(const std::vector<double>& a, const double* b) {
  return std::memcmp(a.data(), b, a.size() * sizeof(double)) == 0;
}

}  // namespace

// At all points and instants.
bool Collocation::evaluate(StageFunctions& f, Order order, const double* x, const Points& points) {
  Points at = points;
  at.x = x + first_used_ * n_z_, at.p = parameters_at(first_used_);
  for (std::size_t k = 0; k < at_instants_.size(); ++k)
    at_instants_[k] = {x + first_of_instant(k), parameters_at(instant_points_[k])};
  return f.run(order, at, at_instants_);
}

// Repeated questions about the same x cost nothing.
bool Collocation::evaluate_values(const double* x) {
  if (same(x_values_, x)) return values_good_;
  std::copy(x, x + x_values_.size(), x_values_.begin());
  values_good_ = evaluate(*functions_, Order::kValue, x, {.y = y_.data()}) && all_finite(y_);
  return values_good_;
}

bool Collocation::evaluate_first(const double* x) {
  if (same(x_first_, x)) return first_good_;
  std::copy(x, x + x_first_.size(), x_first_.begin());
  const Points results{.y = first_y_.data(), .jacobian = first_j_.data()};
  first_good_ =
      evaluate(*functions_, Order::kFirst, x, results) && all_finite(first_y_) && all_finite(first_j_);
  return first_good_;
}

void Collocation::set_parameters(const Parameters& now) {
  Problem next = asked_;
  next.parameters = now;
  set_values(next);
}

void Collocation::set_values(const Problem& now) {
  Problem next = asked_;
  next.take_values(now);
  Problem taken = scheme_.taken_by(scaled_time(next), length_);
  for (double t : t_) taken.parameters.at(t);  // throws, if it does, before anything has changed
  asked_ = std::move(next);
  problem_ = std::move(taken);
  place_parameters();
  set_variable_bounds();
  forget();
}

void Collocation::start_at(const Eigen::VectorXd& x) {
  asked_.start = x, problem_.start.head(x.size()) = x;
  std::copy(x.begin(), x.end(), shape_.x_lower.begin());
  std::copy(x.begin(), x.end(), shape_.x_upper.begin());
  forget();
}

bool Collocation::objective(const double* x, double& value) {
  if (!evaluate_values(x)) return false;
  const std::size_t n_y = stage_.node.n_y();
  value = 0;
  for (std::size_t p = 0; p < used_; ++p) value += quadrature_[p] * y_[(p + 1) * n_y - 1];
  for (const StageFunctions::Instant& instant : functions_->instants()) {
    if (instant.function.n_y() > 0) value += y_[instant.y + instant.function.n_y() - 1];
  }
  return true;
}

bool Collocation::gradient(const double* x, double* gradient) {
  if (!evaluate_first(x)) return false;
  std::fill(gradient, gradient + shape_.n(), 0.0);
  for (const GradientEntry& e : gradient_map_) gradient[e.target] += e.factor * first_j_[e.source];
  return true;
}

// What the scheme demands of the controls of each interval; behind the last row.
double* Collocation::held_controls(const double* x, double* g) const {
  const std::size_t n_u = std::size_t(problem_.n_u());
  for (std::size_t k = 0; k < intervals_; ++k) {
    for (Eigen::Index r = 0; r < scheme_.held.rows(); ++r, g += n_u) {
      std::fill(g, g + n_u, 0.0);
      for (std::size_t j = 0; j <= stride_; ++j) {
        const double* controls = x + (k * stride_ + j + 1) * n_z_ - n_u;
        for (std::size_t i = 0; i < n_u; ++i) g[i] += scheme_.held(r, long(j)) * controls[i];
      }
    }
  }
  return g;
}

bool Collocation::constraints(const double* x, double* g) {
  if (!evaluate_values(x)) return false;
  const std::size_t n_y = stage_.node.n_y(), n_c = stage_.path_rows.size();
  for (std::size_t k = 0; k < intervals_; ++k) {
    const double h = step(k);
    for (std::size_t r = 0; r < rows_; ++r, g += n_x_) {
      std::fill(g, g + n_x_, 0.0);
      for (std::size_t j = 0; j <= stride_; ++j) {
        const double alpha = scheme_.alpha(long(r), long(j)), beta = h * scheme_.beta(long(r), long(j));
        const double* state = x + (k * stride_ + j) * n_z_;
        if (alpha != 0) {
          for (std::size_t i = 0; i < n_x_; ++i) g[i] += alpha * state[i];
        }
        if (beta == 0) continue;
        const double* rate = y_.data() + (k * stride_ + j - first_used_) * n_y;
        for (std::size_t i = 0; i < n_x_; ++i) g[i] += beta * rate[i];
      }
    }
  }
  g = held_controls(x, g);
  for (std::size_t p = 0; p < used_; ++p, g += n_c) {
    const double* rows = y_.data() + p * n_y + n_x_;
    std::copy(rows, rows + n_c, g);
  }
  for (std::size_t k = 0; k < stage_.instants.size(); g += stage_.instants[k++].rows.size()) {
    const double* rows = y_.data() + functions_->instants()[k].y;
    std::copy(rows, rows + stage_.instants[k].rows.size(), g);
  }
  return true;
}

bool Collocation::jacobian(const double* x, double* nonzeros) {
  if (!evaluate_first(x)) return false;
  for (std::size_t e = 0; e < jacobian_map_.size(); ++e) {
    const JacobianEntry& entry = jacobian_map_[e];
    nonzeros[e] = entry.constant;
    if (entry.source >= 0) nonzeros[e] += entry.factor * first_j_[std::size_t(entry.source)];
  }
  return true;
}

// What multiplies each output of each point in sigma f + lambda . g.
void Collocation::collect_weights(double sigma, const double* lambda) {
  const std::size_t n_y = stage_.node.n_y(), n_c = stage_.path_rows.size();
  std::fill(weights_.begin(), weights_.end(), 0.0);
  for (std::size_t k = 0; k < intervals_; ++k) {
    const double h = step(k);
    for (std::size_t r = 0; r < rows_; ++r, lambda += n_x_) {
      for (std::size_t j = 0; j <= stride_; ++j) {
        const double beta = h * scheme_.beta(long(r), long(j));
        if (beta == 0) continue;
        double* w = weights_.data() + (k * stride_ + j - first_used_) * n_y;
        for (std::size_t i = 0; i < n_x_; ++i) w[i] += beta * lambda[i];
      }
    }
  }
  lambda += intervals_ * held_rows();
  for (std::size_t p = 0; p < used_; ++p, lambda += n_c) {
    double* w = weights_.data() + p * n_y;
    std::copy(lambda, lambda + n_c, w + n_x_);
    w[n_y - 1] = sigma * quadrature_[p];
  }
  for (std::size_t k = 0; k < stage_.instants.size(); ++k) {
    const StageFunctions::Instant& instant = functions_->instants()[k];
    if (instant.function.n_y() == 0) continue;
    const std::size_t rows = stage_.instants[k].rows.size();
    std::copy(lambda, lambda + rows, weights_.data() + instant.y);
    weights_[instant.y + rows] = sigma;
    lambda += rows;
  }
}

bool Collocation::hessian(const double* x, double sigma, const double* lambda, double* nonzeros) {
  std::fill(nonzeros, nonzeros + shape_.hessian.nnz(), 0.0);
  if (shape_.hessian_kind != HessianKind::kExact) return gauss_newton(x, sigma, nonzeros);
  collect_weights(sigma, lambda);
  std::copy(x, x + x_first_.size(), x_first_.begin());  // values and Jacobian come along
  const Points results{
      .w = weights_.data(), .y = first_y_.data(), .jacobian = first_j_.data(), .hessian = second_h_.data()};
  const bool good = evaluate(*functions_, Order::kSecond, x, results) && all_finite(second_h_);
  first_good_ = good && all_finite(first_y_) && all_finite(first_j_);
  if (!good) return false;
  for (std::size_t e = 0; e < hessian_map_.size(); ++e) nonzeros[hessian_map_[e]] += second_h_[e];
  return true;
}

bool Collocation::gauss_newton(const double* x, double sigma, double* nonzeros) {
  if (!squares_) return true;
  const Points results{.y = residuals_.data(), .jacobian = residual_j_.data()};
  if (!evaluate(*squares_, Order::kFirst, x, results) || !all_finite(residual_j_)) return false;
  for (const SquareEntry& e : square_map_) {
    nonzeros[e.target] += sigma * e.factor * residual_j_[e.left] * residual_j_[e.right];
  }
  return true;
}

std::vector<double> Collocation::start() const {
  std::vector<double> x;
  x.reserve(shape_.n());
  for (double t : t_) {
    const Stage<double> stage = problem_.first_guess(t);
    for (const Eigen::VectorXd* part : {&stage.x, &stage.a, &stage.u})
      x.insert(x.end(), part->begin(), part->end());
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (shape_.x_lower[i] == shape_.x_upper[i]) x[i] = shape_.x_lower[i];
  }
  return x;
}

Trajectory Collocation::trajectory(const std::vector<double>& x) const {
  const auto points = static_cast<Eigen::Index>(points_), n_z = static_cast<Eigen::Index>(n_z_);
  const Eigen::Map<const Eigen::MatrixXd> z(x.data(), n_z, points);
  const double duration = asked_.free_time ? z(asked_.n_x(), 0) : 1;
  Trajectory motion{duration * Eigen::Map<const Eigen::VectorXd>(t_.data(), points), z.topRows(asked_.n_x()),
                    z.middleRows(problem_.n_x(), problem_.n_a()), z.bottomRows(problem_.n_u()), scheme_};
  motion.limit_controls(problem_.u.lower, problem_.u.upper);
  motion.extend_to_unused();
  return motion;
}

std::vector<double> Collocation::variables(const Trajectory& trajectory) const {
  Eigen::MatrixXd z(static_cast<Eigen::Index>(n_z_), static_cast<Eigen::Index>(points_));
  z.topRows(asked_.n_x()) = trajectory.x;
  if (asked_.free_time) z.row(asked_.n_x()).setConstant(trajectory.t[trajectory.points() - 1]);
  z.middleRows(problem_.n_x(), problem_.n_a()) = trajectory.a;
  z.bottomRows(problem_.n_u()) = trajectory.u;
  return {z.data(), z.data() + z.size()};
}

void Collocation::make_earlier(NlpSolution& multipliers, int intervals) const {
  const auto move = [](std::vector<double>& values, std::size_t first, std::size_t last, std::size_t by) {
    if (by < last - first)
      std::copy(values.begin() + long(first + by), values.begin() + long(last), values.begin() + long(first));
  };
  const std::size_t by = std::min(std::size_t(std::max(intervals, 0)), intervals_),
                    n_c = stage_.path_rows.size();
  move(multipliers.lambda, 0, defects(), by * rows_ * n_x_);
  move(multipliers.lambda, defects(), first_path_row(), by * held_rows());
  move(multipliers.lambda, first_path_row(), first_instant_row(), by * stride_ * n_c);
  for (std::vector<double>* bound_multipliers :
       {&multipliers.lower_multiplier, &multipliers.upper_multiplier})
    move(*bound_multipliers, 0, points_ * n_z_, by * stride_ * n_z_);
}

}  // namespace dyntape
