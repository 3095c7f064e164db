// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/nlp/kkt.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/control/nlp/worst.h>

namespace dyntape {

namespace {

double violation(double value, double lower, double upper) {
  return worst(std::max(0.0, lower - value), value - upper);
}

// bound multiplier * distance to the bound from inside it; of a bound that is not there, or that would rather be passed, the
// bound multiplier itself.  What lies beyond the bound, as where a solver widens it, is a violation and no complementarity.
double product(double bound_multiplier, double inside) {
  if (std::isinf(inside)) return std::abs(bound_multiplier);
  return worst(std::abs(bound_multiplier * std::max(inside, 0.0)), -bound_multiplier);
}

bool rests(double value, double lower, double upper, double tolerance) {
  if (lower == upper) return false;
  const auto near = [&](double bound) {
    return std::isfinite(bound) && std::abs(value - bound) <= tolerance * std::max(1.0, std::abs(bound));
  };
  return near(lower) || near(upper);
}

}  // namespace

KktResiduals kkt_residuals(Nlp& problem, const NlpSolution& solution) {
  const NlpShape& shape = problem.shape();
  const std::size_t n = shape.n(), m = shape.m();
  std::vector<double> residual(n), g(m), jacobian(shape.jacobian.nnz());
  const double* x = solution.x.data();
  if (solution.lambda.size() != m || solution.lower_multiplier.size() != n) return {NAN, NAN, NAN};
  if (!problem.gradient(x, residual.data()) || !problem.jacobian(x, jacobian.data()) ||
      !problem.constraints(x, g.data())) {
    return {NAN, NAN, NAN};
  }
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    residual[shape.jacobian.col[k]] += solution.lambda[shape.jacobian.row[k]] * jacobian[k];
  }
  KktResiduals r;
  for (std::size_t i = 0; i < n; ++i) {
    r.feasibility = worst(r.feasibility, violation(x[i], shape.x_lower[i], shape.x_upper[i]));
    if (shape.x_lower[i] == shape.x_upper[i]) continue;
    residual[i] += solution.upper_multiplier[i] - solution.lower_multiplier[i];
    r.stationarity = worst(r.stationarity, std::abs(residual[i]));
    r.complementarity =
        worst(r.complementarity, product(solution.lower_multiplier[i], x[i] - shape.x_lower[i]));
    r.complementarity =
        worst(r.complementarity, product(solution.upper_multiplier[i], shape.x_upper[i] - x[i]));
  }
  for (std::size_t j = 0; j < m; ++j) {
    r.feasibility = worst(r.feasibility, violation(g[j], shape.g_lower[j], shape.g_upper[j]));
    const double inside = solution.lambda[j] > 0 ? shape.g_upper[j] - g[j] : g[j] - shape.g_lower[j];
    if (shape.g_lower[j] != shape.g_upper[j])
      r.complementarity = worst(r.complementarity, product(std::abs(solution.lambda[j]), inside));
  }
  return r;
}

ActiveBounds active_bounds(const Nlp& problem, const NlpSolution& solution, double tolerance) {
  const NlpShape& shape = problem.shape();
  ActiveBounds active;
  for (std::size_t i = 0; i < shape.n(); ++i) {
    if (rests(solution.x[i], shape.x_lower[i], shape.x_upper[i], tolerance)) active.variables.push_back(i);
  }
  for (std::size_t j = 0; j < solution.g.size(); ++j) {
    if (rests(solution.g[j], shape.g_lower[j], shape.g_upper[j], tolerance)) active.rows.push_back(j);
  }
  return active;
}

}  // namespace dyntape
