// SPDX-License-Identifier: BSD-3-Clause
//
// The check of a dense Hessian: along random directions, and column by column where these disagree.
#include <gtest/gtest.h>

#include <cmath>

#include <dyntape/interface/control/nlp/derivative_check.h>

namespace dyntape::derivative_check_test {
namespace {

// |x|^2 / 2 + sin(a . x): H = 1 - sin(a . x) a a^T, to the lower triangle of which something may be added.
class Dense : public Nlp {
 public:
  explicit Dense(std::size_t n, double lie = 0) : lie_(lie) {
    shape_.x_lower.assign(n, -10);
    shape_.x_upper.assign(n, 10);
    shape_.jacobian.cols = shape_.hessian.rows = shape_.hessian.cols = n;
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t j = 0; j <= i; ++j) shape_.hessian.row.push_back(i), shape_.hessian.col.push_back(j);
      a_.push_back(std::cos(i) / std::sqrt(double(n)));
    }
  }
  const NlpShape& shape() const override { return shape_; }
  bool objective(const double* x, double& value) override {
    value = std::sin(along(x));
    for (std::size_t i = 0; i < a_.size(); ++i) value += 0.5 * x[i] * x[i];
    return true;
  }
  bool gradient(const double* x, double* g) override {
    ++gradients;
    const double slope = std::cos(along(x));
    for (std::size_t i = 0; i < a_.size(); ++i) g[i] = x[i] + slope * a_[i];
    return true;
  }
  bool constraints(const double*, double*) override { return true; }
  bool jacobian(const double*, double*) override { return true; }
  bool hessian(const double* x, double sigma, const double*, double* h) override {
    const double bend = std::sin(along(x));
    for (std::size_t k = 0; k < shape_.hessian.nnz(); ++k) {
      const std::size_t i = shape_.hessian.row[k], j = shape_.hessian.col[k];
      h[k] = sigma * (double(i == j) - bend * a_[i] * a_[j]);
    }
    h[shape_.hessian.nnz() / 2] += lie_;
    return true;
  }

  int gradients = 0;

 private:
  double along(const double* x) const {
    double sum = 0;
    for (std::size_t i = 0; i < a_.size(); ++i) sum += a_[i] * x[i];
    return sum;
  }
  NlpShape shape_;
  std::vector<double> a_;
  double lie_;
};

TEST(DerivativeCheck, LargeDenseHessiansAreComparedAlongDirections) {
  for (std::size_t n : {64, 65, 300}) {
    Dense honest(n);
    const DerivativeCheck check = check_derivatives(honest, std::vector<double>(n, 0.4));
    EXPECT_TRUE(check.good()) << n;
    EXPECT_LE(check.worst_second, 1e-6);
    EXPECT_EQ(check.hessian_directions, n > 64 ? 16u : 0u);
    if (n > 64) {
      EXPECT_LE(honest.gradients, 3 * 16 * 4 + 10);
    }
  }
}

TEST(DerivativeCheck, AWrongEntryOfALargeDenseHessianIsNamed) {
  Dense liar(100, 1e-3);
  const DerivativeCheck check = check_derivatives(liar, std::vector<double>(100, 0.4));
  ASSERT_EQ(check.mismatches.size(), 2u);  // in both triangles
  const std::size_t k = liar.shape().hessian.nnz() / 2;
  const std::string row = liar.variable_name(liar.shape().hessian.row[k]);
  EXPECT_NE((check.mismatches[0].row + check.mismatches[0].variable).find(row), std::string::npos);
  EXPECT_EQ(check.hessian_directions, 0u);
}

}  // namespace
}  // namespace dyntape::derivative_check_test
