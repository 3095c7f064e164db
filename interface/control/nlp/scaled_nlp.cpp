// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/nlp/scaled_nlp.h>

#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

double power_of_two(double magnitude) {
  if (magnitude > 0 && std::isfinite(magnitude)) return std::exp2(std::round(std::log2(magnitude)));
  throw ArgumentError("a magnitude of a nonlinear program is " + io::shortest(magnitude) +
                      ", expected a positive number");
}

std::vector<double> powers_of_two(std::vector<double> scaling, std::size_t size, const char* of) {
  if (scaling.empty()) scaling.assign(size, 1.0);
  if (scaling.size() != size) {
    throw ArgumentError("the nonlinear program states " + std::to_string(scaling.size()) +
                        " nominal values of its " + of + ", expected " + std::to_string(size));
  }
  for (double& m : scaling) m = power_of_two(m);
  return scaling;
}

void multiply(std::vector<double>& values, const std::vector<double>& factors) {
  for (std::size_t i = 0; i < values.size(); ++i) values[i] *= factors[i];
}

void multiply(double* values, const std::vector<double>& factors) {
  for (std::size_t i = 0; i < factors.size(); ++i) values[i] *= factors[i];
}

void divide(std::vector<double>& values, const std::vector<double>& divisors) {
  for (std::size_t i = 0; i < values.size(); ++i) values[i] /= divisors[i];
}

// A solution in units that are smaller by these factors.
NlpSolution multiplied(NlpSolution s, const NlpScaling& by) {
  s.objective *= by.objective;
  multiply(s.x, by.x);
  multiply(s.g, by.g);
  divide(s.lambda, by.g);
  divide(s.lower_multiplier, by.x);
  divide(s.upper_multiplier, by.x);
  for (std::vector<double>* bound_multipliers : {&s.lambda, &s.lower_multiplier, &s.upper_multiplier}) {
    for (double& bound_multiplier : *bound_multipliers) bound_multiplier *= by.objective;
  }
  return s;
}

}  // namespace

ScaledNlp::ScaledNlp(Nlp& nlp, NlpScaling scaling) : nlp_(nlp), shape_(nlp.shape()) {
  scale_.objective = power_of_two(scaling.objective);
  scale_.x = powers_of_two(std::move(scaling.x), shape_.n(), "variables");
  scale_.g = powers_of_two(std::move(scaling.g), shape_.m(), "constraints");
  take_bounds();
  for (const double unit : scale_.x) of_gradient_.push_back(unit / scale_.objective);
  for (std::size_t k = 0; k < shape_.jacobian.nnz(); ++k)
    of_jacobian_.push_back(scale_.x[shape_.jacobian.col[k]] / scale_.g[shape_.jacobian.row[k]]);
  for (std::size_t k = 0; k < shape_.hessian.nnz(); ++k)
    of_hessian_.push_back(scale_.x[shape_.hessian.row[k]] * scale_.x[shape_.hessian.col[k]]);
  x_.resize(shape_.n());
  lambda_.resize(shape_.m());
}

void ScaledNlp::take_bounds() {
  const NlpShape& own = nlp_.shape();
  shape_.x_lower = own.x_lower, shape_.x_upper = own.x_upper;
  shape_.g_lower = own.g_lower, shape_.g_upper = own.g_upper;
  divide(shape_.x_lower, scale_.x);
  divide(shape_.x_upper, scale_.x);
  divide(shape_.g_lower, scale_.g);
  divide(shape_.g_upper, scale_.g);
}

std::vector<double> ScaledNlp::in_scaled_units(const std::vector<double>& x) const {
  std::vector<double> scaled = x;
  divide(scaled, scale_.x);
  return scaled;
}

NlpSolution ScaledNlp::in_scaled_units(NlpSolution s) const {
  NlpScaling inverse = scale_;
  inverse.objective = 1 / inverse.objective;
  for (std::vector<double>* part : {&inverse.x, &inverse.g}) {
    for (double& unit : *part) unit = 1 / unit;
  }
  return multiplied(std::move(s), inverse);
}

NlpSolution ScaledNlp::in_own_units(NlpSolution s) const {
  for (IterationRecord& record : s.log) record.objective *= scale_.objective;
  return multiplied(std::move(s), scale_);
}

const double* ScaledNlp::own(const double* x) {
  for (std::size_t i = 0; i < x_.size(); ++i) x_[i] = x[i] * scale_.x[i];
  return x_.data();
}

bool ScaledNlp::objective(const double* x, double& value) {
  const bool good = nlp_.objective(own(x), value);
  value /= scale_.objective;
  return good;
}

bool ScaledNlp::gradient(const double* x, double* gradient) {
  if (!nlp_.gradient(own(x), gradient)) return false;
  multiply(gradient, of_gradient_);
  return true;
}

bool ScaledNlp::constraints(const double* x, double* g) {
  if (!nlp_.constraints(own(x), g)) return false;
  for (std::size_t j = 0; j < scale_.g.size(); ++j) g[j] /= scale_.g[j];
  return true;
}

bool ScaledNlp::jacobian(const double* x, double* nonzeros) {
  if (!nlp_.jacobian(own(x), nonzeros)) return false;
  multiply(nonzeros, of_jacobian_);
  return true;
}

bool ScaledNlp::hessian(const double* x, double sigma, const double* lambda, double* nonzeros) {
  for (std::size_t j = 0; j < lambda_.size(); ++j) lambda_[j] = lambda[j] / scale_.g[j];
  if (!nlp_.hessian(own(x), sigma / scale_.objective, lambda_.data(), nonzeros)) return false;
  multiply(nonzeros, of_hessian_);
  return true;
}

}  // namespace dyntape
