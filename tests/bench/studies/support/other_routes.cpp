// SPDX-License-Identifier: BSD-3-Clause
#include "other_routes.h"

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algorithms/detail/forward_dynamics.hxx>
#include <dyntape/dynamics/algorithms/detail/inverse_dynamics.hxx>
#include <dyntape/dynamics/algorithms/detail/kinematics.hxx>
#include <dyntape/dynamics/model/detail/configuration.hxx>

namespace dyntape::tools {

using dynamics::VectorX;

namespace {

// Of entry i of a column, in blocks of nv columns that are written row by row.
int place(int column, int i, int nv) { return (column / nv * nv + i) * nv + column % nv; }

}  // namespace

ByJets::ByJets(const dynamics::Model<double>& model) : model_(model.cast<J>()), data_(model_) {}

void ByJets::evaluate(const Eigen::VectorXd& state, double* result) {
  constexpr int kColumns = 8;
  const int nv = model_.nv;
  for (int first = 0; first < 3 * nv; first += kColumns) {
    const int columns = std::min(kColumns, 3 * nv - first);
    VectorX<J> x = VectorX<J>::Zero(3 * nv);
    x.tail(2 * nv) = state.tail(2 * nv).cast<J>();
    for (int k = 0; k < columns; ++k) x[first + k].tangent(k) = 1;
    const VectorX<J> q = dynamics::integrate<J>(model_, state.head(model_.nq).cast<J>().eval(), x.head(nv));
    const VectorX<J>& y =
        dynamics::aba<J>(model_, data_, q, VectorX<J>(x.segment(nv, nv)), VectorX<J>(x.tail(nv)));
    for (int k = 0; k < columns; ++k)
      for (int i = 0; i < nv; ++i) result[place(first + k, i, nv)] = y[i].tangent(k);
  }
}

ByComplexStep::ByComplexStep(const dynamics::Model<double>& model) : model_(model.cast<C>()), data_(model_) {
  if (model.nq != model.nv)
    throw ArgumentError(
        "a quaternion is integrated by branches on its values, which complex numbers have none of");
}

void ByComplexStep::evaluate(const Eigen::VectorXd& state, double* result) {
  constexpr double kStep = 1e-100;  // its square is zero
  const int nv = model_.nv;
  VectorX<C> x = state.cast<C>();
  for (int k = 0; k < 3 * nv; ++k) {
    x[k] += C(0, kStep);
    const VectorX<C>& y = dynamics::aba<C>(model_, data_, VectorX<C>(x.head(nv)),
                                           VectorX<C>(x.segment(nv, nv)), VectorX<C>(x.tail(nv)));
    for (int i = 0; i < nv; ++i) result[place(k, i, nv)] = y[i].imag() / kStep;
    x[k] = state[k];
  }
}

ByFourthOrder::ByFourthOrder(const dynamics::Model<double>& model, double step)
    : model_(model), data_(model), step_(step) {}

void ByFourthOrder::evaluate(const Eigen::VectorXd& state, double* result) {
  const int nq = model_.nq, nv = model_.nv;
  Eigen::VectorXd q = state.head(nq), v = state.segment(nq, nv), tau = state.tail(nv);
  const auto column = [&](int k, double size, const auto& moved_by) {
    // A step that is a power of two moves what is near one by exactly that.
    const double h = std::exp2(std::round(std::log2(step_ * std::max(1.0, std::abs(size)))));
    const Eigen::VectorXd slope =
        (8 * (moved_by(h) - moved_by(-h)) - (moved_by(2 * h) - moved_by(-2 * h))) / (12 * h);
    for (int i = 0; i < nv; ++i) result[place(k, i, nv)] = slope[i];
  };
  for (int k = 0; k < nv; ++k) {
    column(k, nq == nv ? q[k] : 1.0, [&](double h) {
      return Eigen::VectorXd(dynamics::aba<double>(
          model_, data_,
          dynamics::integrate<double>(model_, q, Eigen::VectorXd(h * Eigen::VectorXd::Unit(nv, k))), v, tau));
    });
  }
  const auto along = [&](Eigen::VectorXd& moved, int block) {
    for (int k = 0; k < nv; ++k) {
      const double there = moved[k];
      column(block * nv + k, there, [&](double h) {
        moved[k] = there + h;
        const Eigen::VectorXd y = dynamics::aba<double>(model_, data_, q, v, tau);
        moved[k] = there;
        return y;
      });
    }
  };
  along(v, 1), along(tau, 2);
}

}  // namespace dyntape::tools
