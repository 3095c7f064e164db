// SPDX-License-Identifier: BSD-3-Clause
//
// A small program from lambdas of recorded scalars.
#pragma once

#include <functional>

#include <dyntape/autodiff/record/record.h>
#include <dyntape/codegen/compiled_function.h>
#include <dyntape/interface/control/nlp/nlp.h>
#include "ocp_problems.h"

namespace dyntape::test {

class RecordedNlp : public Nlp {
 public:
  using Recorded = std::function<VectorXad(const VectorXad&)>;
  // `all`: f, then g.
  RecordedNlp(const Recorded& all, std::size_t n, std::vector<double> g_lower, std::vector<double> g_upper)
      : function_(CompiledFunction::make(
            record("program", n, 0, [&](const VectorXad& x, const VectorXad&) { return all(x); }),
            {.order = Order::kSecond, .route = Route::kInterpreter})),
        workspace_(function_) {
    const double infinity = std::numeric_limits<double>::infinity();
    shape_.x_lower.assign(n, -infinity), shape_.x_upper.assign(n, infinity);
    shape_.g_lower = std::move(g_lower), shape_.g_upper = std::move(g_upper);
    const Pattern& J = function_.jacobian_pattern();
    shape_.jacobian.rows = shape_.m(), shape_.jacobian.cols = n;
    for (std::size_t e = 0; e < J.nnz(); ++e) {
      if (J.row[e] == 0) continue;
      shape_.jacobian.row.push_back(J.row[e] - 1);
      shape_.jacobian.col.push_back(J.col[e]);
    }
    shape_.hessian = function_.hessian_pattern();
    for (std::size_t e = 0; e < shape_.hessian.nnz(); ++e) {
      if (shape_.hessian.row[e] < shape_.hessian.col[e])
        std::swap(shape_.hessian.row[e], shape_.hessian.col[e]);
    }
    y_.resize(function_.n_y()), J_.resize(J.nnz());
  }

  void bound(std::size_t i, double lower, double upper) {
    shape_.x_lower[i] = lower, shape_.x_upper[i] = upper;
  }

  void row_bounds(std::size_t j, double lower, double upper) {
    shape_.g_lower[j] = lower, shape_.g_upper[j] = upper;
  }

  const NlpShape& shape() const override { return shape_; }
  bool objective(const double* x, double& value) override {
    function_.value(x, nullptr, y_.data(), workspace_);
    value = y_[0];
    return std::isfinite(value);
  }
  bool constraints(const double* x, double* g) override {
    function_.value(x, nullptr, y_.data(), workspace_);
    std::copy(y_.begin() + 1, y_.end(), g);
    return std::all_of(y_.begin(), y_.end(), [](double v) { return std::isfinite(v); });
  }
  bool gradient(const double* x, double* gradient) override {
    std::fill(gradient, gradient + shape_.n(), 0.0);
    first(x, [&](std::uint32_t row, std::uint32_t col, double value) {
      if (row == 0) gradient[col] = value;
    });
    return true;
  }
  bool jacobian(const double* x, double* nonzeros) override {
    first(x, [&](std::uint32_t row, std::uint32_t, double value) {
      if (row > 0) *nonzeros++ = value;
    });
    return true;
  }
  bool hessian(const double* x, double sigma, const double* lambda, double* nonzeros) override {
    std::vector<double> w{sigma};
    w.insert(w.end(), lambda, lambda + shape_.m());
    function_.second_order(x, nullptr, w.data(), nullptr, nullptr, nonzeros, workspace_);
    return true;
  }

 private:
  template <class F>
  void first(const double* x, const F& use) {
    function_.first_order(x, nullptr, y_.data(), J_.data(), workspace_);
    const Pattern& J = function_.jacobian_pattern();
    for (std::size_t e = 0; e < J.nnz(); ++e) use(J.row[e], J.col[e], J_[e]);
  }

  CompiledFunction function_;
  CompiledFunction::Workspace workspace_;
  NlpShape shape_;
  std::vector<double> y_, J_;
};

}  // namespace dyntape::test
