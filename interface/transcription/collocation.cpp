// SPDX-License-Identifier: BSD-3-Clause
//
// Evaluation; construction is in collocation_layout.cpp, messages are in collocation_names.cpp.
#include <dyntape/interface/transcription/collocation.h>

#include <algorithm>
#include <cmath>
#include <cstring>

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

// One call for all points, one for the end; repeated questions about the same x cost nothing.
bool Collocation::evaluate_values(const double* x) {
  if (same(x_values_, x)) return values_good_;
  std::copy(x, x + x_values_.size(), x_values_.begin());
  values_good_ = node_->values(x, t_.data(), y_.data()) &&
                 terminal_->values(end_point(x), &t_.back(), y_.data() + used_ * node_->n_y()) &&
                 all_finite(y_);
  return values_good_;
}

bool Collocation::evaluate_first(const double* x) {
  if (same(x_first_, x)) return first_good_;
  std::copy(x, x + x_first_.size(), x_first_.begin());
  first_good_ = node_->first(x, t_.data(), first_y_.data(), first_j_.data()) &&
                terminal_->first(end_point(x), &t_.back(), first_y_.data() + used_ * node_->n_y(),
                                 first_j_.data() + used_ * node_->jacobian().nnz()) &&
                all_finite(first_y_) && all_finite(first_j_);
  return first_good_;
}

bool Collocation::objective(const double* x, double& value) {
  if (!evaluate_values(x)) return false;
  const std::size_t n_y = node_->n_y();
  value = 0;
  for (std::size_t p = 0; p < used_; ++p) value += quadrature_[p] * y_[(p + 1) * n_y - 1];
  if (terminal_->n_y() > 0) value += y_.back();
  return true;
}

bool Collocation::gradient(const double* x, double* gradient) {
  if (!evaluate_first(x)) return false;
  std::fill(gradient, gradient + shape_.n(), 0.0);
  for (const GradientEntry& e : gradient_map_) gradient[e.target] += e.factor * first_j_[e.source];
  return true;
}

bool Collocation::constraints(const double* x, double* g) {
  if (!evaluate_values(x)) return false;
  const std::size_t n_y = node_->n_y(), n_c = stage_.path_rows.size(), n_e = stage_.terminal_rows.size();
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
        const double* rate = y_.data() + (k * stride_ + j) * n_y;
        for (std::size_t i = 0; i < n_x_; ++i) g[i] += beta * rate[i];
      }
    }
  }
  for (std::size_t p = 0; p < used_; ++p, g += n_c) {
    const double* rows = y_.data() + p * n_y + n_x_;
    std::copy(rows, rows + n_c, g);
  }
  const double* end = y_.data() + used_ * n_y;
  std::copy(end, end + n_e, g);
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
  const std::size_t n_y = node_->n_y(), n_c = stage_.path_rows.size(), n_e = stage_.terminal_rows.size();
  std::fill(weights_.begin(), weights_.end(), 0.0);
  for (std::size_t k = 0; k < intervals_; ++k) {
    const double h = step(k);
    for (std::size_t r = 0; r < rows_; ++r, lambda += n_x_) {
      for (std::size_t j = 0; j <= stride_; ++j) {
        const double beta = h * scheme_.beta(long(r), long(j));
        if (beta == 0) continue;
        double* w = weights_.data() + (k * stride_ + j) * n_y;
        for (std::size_t i = 0; i < n_x_; ++i) w[i] += beta * lambda[i];
      }
    }
  }
  for (std::size_t p = 0; p < used_; ++p, lambda += n_c) {
    double* w = weights_.data() + p * n_y;
    std::copy(lambda, lambda + n_c, w + n_x_);
    w[n_y - 1] = sigma * quadrature_[p];
  }
  if (terminal_->n_y() == 0) return;
  std::copy(lambda, lambda + n_e, weights_.data() + used_ * n_y);
  weights_.back() = sigma;
}

bool Collocation::hessian(const double* x, double sigma, const double* lambda, double* nonzeros) {
  std::fill(nonzeros, nonzeros + shape_.hessian.nnz(), 0.0);
  if (shape_.hessian_kind != HessianKind::kExact) return gauss_newton(x, sigma, nonzeros);
  collect_weights(sigma, lambda);
  const std::size_t values = used_ * node_->n_y(), jacobians = used_ * node_->jacobian().nnz();
  const std::size_t hessians = used_ * node_->hessian().nnz();
  std::copy(x, x + x_first_.size(), x_first_.begin());  // values and Jacobian come along
  const bool good =
      node_->second(x, t_.data(), weights_.data(), first_y_.data(), first_j_.data(), second_h_.data()) &&
      terminal_->second(end_point(x), &t_.back(), weights_.data() + values, first_y_.data() + values,
                        first_j_.data() + jacobians, second_h_.data() + hessians) &&
      all_finite(second_h_);
  first_good_ = good && all_finite(first_y_) && all_finite(first_j_);
  if (!good) return false;
  for (std::size_t e = 0; e < hessian_map_.size(); ++e) nonzeros[hessian_map_[e]] += second_h_[e];
  return true;
}

bool Collocation::gauss_newton(const double* x, double sigma, double* nonzeros) {
  if (!squares_) return true;
  const std::size_t values = used_ * squares_->n_y(), jacobians = used_ * squares_->jacobian().nnz();
  const bool good = squares_->first(x, t_.data(), residuals_.data(), residual_j_.data()) &&
                    terminal_squares_->first(end_point(x), &t_.back(), residuals_.data() + values,
                                             residual_j_.data() + jacobians) &&
                    all_finite(residual_j_);
  if (!good) return false;
  for (const SquareEntry& e : square_map_) {
    nonzeros[e.target] += sigma * e.factor * residual_j_[e.left] * residual_j_[e.right];
  }
  return true;
}

std::vector<double> Collocation::start() const {
  const auto guess = problem_.guess ? problem_.guess : straight_line(problem_);
  std::vector<double> x;
  x.reserve(shape_.n());
  for (double t : t_) {
    const Stage<double> stage = guess(t);
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
  return {Eigen::Map<const Eigen::VectorXd>(t_.data(), points), z.topRows(problem_.n_x()),
          z.middleRows(problem_.n_x(), problem_.n_a()), z.bottomRows(problem_.n_u()), scheme_};
}

std::vector<double> Collocation::variables(const Trajectory& trajectory) const {
  Eigen::MatrixXd z(static_cast<Eigen::Index>(n_z_), static_cast<Eigen::Index>(points_));
  z << trajectory.x, trajectory.a, trajectory.u;
  return {z.data(), z.data() + z.size()};
}

}  // namespace dyntape
