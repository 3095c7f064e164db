// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/rollout/policy_law.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <dyntape/interface/motion/robot_configuration.h>

namespace dyntape {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// (n_x x n_t) how the entries of a state (q, v, motors) change with increments of the moving frame.
MatrixXd entries_by_increments(const dynamics::Model<double>& model, const double* x, std::size_t n_x) {
  const Index nq = model.nq, nv = model.nv, rest = Index(n_x) - nq;
  MatrixXd N = MatrixXd::Zero(nq + rest, nv + rest);
  N.bottomRightCorner(rest, rest).setIdentity();
  const VectorXd q = VectorXd::Map(x, nq), none = VectorXd::Zero(nv);
  const VectorXd home = configuration_rate<double>(model, q, none);  // towards directions of length one
  for (Index k = 0; k < nv; ++k)
    N.col(k).head(nq) = configuration_rate<double>(model, q, VectorXd::Unit(nv, k)) - home;
  return N;
}

}  // namespace

void evaluate_law(const CompiledFunction& law, CompiledFunction::Workspace& workspace, Order order,
                  Points points, const Strides& strides, std::size_t n_x) {
  std::vector<std::uint32_t> status(points.count, 0);
  points.strides = &strides, points.status = status.data();
  if (!law.run(order, points, workspace)) return;
  for (std::size_t k = 0; k < points.count; ++k) {
    if (status[k] == 0) continue;
    const double* x = points.x + k * strides.x;
    if (std::all_of(x, x + n_x, [](double e) { return std::isfinite(e); }))
      law.check({status[k], k}, points.count);
    std::fill_n(points.y + k * strides.y, strides.y, std::numeric_limits<double>::quiet_NaN());
  }
}

void law_slopes(const CompiledFunction& derivatives, CompiledFunction::Workspace& workspace,
                const dynamics::Model<double>& model, const LawPoint& at, LawSlopes& slopes) {
  const auto n_x = at.n_x, n = at.n_x + at.n_p, n_u = std::size_t(derivatives.n_y());
  std::vector<double> all(at.x, at.x + n_x);
  all.insert(all.end(), at.p, at.p + at.n_p);
  const Pattern& pattern = derivatives.jacobian_pattern();
  std::vector<double> nonzeros(pattern.nnz());
  slopes.u.resize(Index(n_u));
  Points points;
  points.x = all.data(), points.y = slopes.u.data();
  if (!nonzeros.empty()) points.jacobian = nonzeros.data();
  evaluate_law(derivatives, workspace, Order::kFirst, points,
               {.x = n, .p = 0, .w = 0, .y = n_u, .jacobian = pattern.nnz(), .hessian = 0}, n_x);
  MatrixXd J = MatrixXd::Zero(Index(n_u), Index(n));
  for (std::size_t k = 0; k < nonzeros.size(); ++k)
    J(Index(pattern.row[k]), Index(pattern.col[k])) = nonzeros[k];
  slopes.by_x = J.leftCols(Index(n_x)) * entries_by_increments(model, at.x, n_x);
  slopes.by_p = J.rightCols(Index(at.n_p));
}

}  // namespace dyntape
