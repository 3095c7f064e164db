// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/lagrangian.h>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/record/linear_algebra.h>
#include <dyntape/autodiff/record/record.h>

namespace dyntape {

namespace {

using dynamics::Model;

// L(q (+) d, v) of variables (d, v) and parameters (q, p).
Function recorded_lagrangian(const System& system) {
  if (!system.lagrangian)
    throw ArgumentError("system \"" + system.name +
                        "\" has no Lagrangian, which the variational scheme needs; use implicit-midpoint");
  const Model<AD> model = system.model.cast<AD>();
  const auto nq = model.nq, nv = model.nv;
  return record(
      system.name + " Lagrangian", std::size_t(2 * nv), std::size_t(nq + system.n_p),
      [&](const VectorXad& x, const VectorXad& y) {
        const VectorXad q = dynamics::integrate<AD>(model, VectorXad(y.head(nq)), VectorXad(x.head(nv)));
        return VectorXad(VectorXad::Constant(1, system.lagrangian(q, x.tail(nv), y.tail(system.n_p))));
      },
      {}, nullptr, 0);
}

// A function of (d, v; q, p) at d = 0, as a callee of (0, v, q, p).
std::shared_ptr<const Callee> at_rest_in_chart(const Function& function, int nv) {
  std::vector<Binding> zeros;
  for (int k = 0; k < nv; ++k) zeros.push_back({std::size_t(k), 0.0});
  return dissolving_callee(all_as_variables(dyntape::bind(function, Block::kVariables, zeros)));
}

// Outputs of a sparse derivative and their places, those whose column is a v.
struct Part {
  std::vector<std::size_t> outputs;
  Pattern places;
};

Part columns_of_v(const Pattern& all, std::size_t nv) {
  Part part{{}, {all.rows, all.cols, {}, {}}};
  for (std::size_t k = 0; k < all.nnz(); ++k) {
    if (all.col[k] < nv) continue;
    part.outputs.push_back(k);
    part.places.row.push_back(all.row[k]);
    part.places.col.push_back(all.col[k]);
  }
  return part;
}

void check_quadratic(const System& system, const Function& mass) {
  for (std::uint32_t column : jacobian_sparsity(mass).col) {
    if (column < std::uint32_t(system.model.nv)) continue;
    throw ArgumentError("system \"" + system.name +
                        "\": the Lagrangian's second derivative by v depends on v; " +
                        "the variational scheme takes one that is quadratic in v");
  }
}

}  // namespace

Lagrangian::Lagrangian(const System& system) : nv_(system.model.nv) {
  const auto nv = std::size_t(nv_);
  const SparseFunction gradient = sparse_jacobian(recorded_lagrangian(system));
  slope_places_ = gradient.pattern;
  slopes_of_ = at_rest_in_chart(gradient.function, system.model.nv);
  const Part by_v = columns_of_v(gradient.pattern, nv);
  const SparseFunction second = sparse_jacobian(select_outputs(gradient.function, by_v.outputs));
  const Part twice_by_v = columns_of_v(second.pattern, nv);
  const Function mass = select_outputs(second.function, twice_by_v.outputs);
  check_quadratic(system, mass);
  mass_places_ = twice_by_v.places;
  for (std::uint32_t& row : mass_places_.row)
    row = by_v.places.col[row];  // which v that output is the slope by
  mass_of_ = at_rest_in_chart(mass, system.model.nv);
}

namespace {

VectorXad chart_arguments(const VectorXad& v, const VectorXad& q, const VectorXad& p) {
  VectorXad all(2 * v.size() + q.size() + p.size());
  all << VectorXad::Constant(v.size(), AD(0)), v, q, p;
  return all;
}

}  // namespace

dynamics::LagrangianDerivatives<AD> Lagrangian::derivatives(const VectorXad& q, const VectorXad& v,
                                                            const VectorXad& p) const {
  const VectorXad values = call(slopes_of_, chart_arguments(v, q, p));
  VectorXad all = VectorXad::Constant(2 * nv_, AD(0));
  for (std::size_t k = 0; k < slope_places_.nnz(); ++k) all[slope_places_.col[k]] = values[Eigen::Index(k)];
  return {all.head(nv_), all.tail(nv_)};
}

MatrixXad Lagrangian::mass(const VectorXad& q, const VectorXad& p) const {
  const VectorXad values = call(mass_of_, chart_arguments(VectorXad::Constant(nv_, AD(0)), q, p));
  MatrixXad M = MatrixXad::Constant(nv_, nv_, AD(0));
  for (std::size_t k = 0; k < mass_places_.nnz(); ++k)
    M(mass_places_.row[k] - nv_, mass_places_.col[k] - nv_) = values[Eigen::Index(k)];
  return M;
}

VectorXad Lagrangian::velocity(const VectorXad& q, const VectorXad& momentum, const VectorXad& p) const {
  const VectorXad at_rest = derivatives(q, VectorXad::Constant(nv_, AD(0)), p).v;
  return ldlt_solve(ldlt(mass(q, p)), VectorXad(momentum - at_rest));
}

}  // namespace dyntape
