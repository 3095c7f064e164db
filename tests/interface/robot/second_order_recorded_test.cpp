// SPDX-License-Identifier: BSD-3-Clause
//
// The analytic Hessian against the tape's, two derivations that share nothing; and recorded itself.
#include <gtest/gtest.h>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/dynamics/algorithms/second_order.h>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::second_order_recorded_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<double> list(const VectorXd& x) { return {x.begin(), x.end()}; }

class RecordedSecondOrder : public ::testing::TestWithParam<unsigned long> {};

// mu^T tau(q (+) w, v, a) recorded over (w, v, a), at w = 0.
TEST_P(RecordedSecondOrder, AgreesWithTheTape) {
  Random random(GetParam());
  const Base base = GetParam() % 2 ? Base::kFloating : Base::kFixed;
  const Model<double> model = random_tree(random, {.joints = 4, .base = base});
  const State s = random_state(model, random);
  const VectorXd mu = random.vector(model.nv);
  const int n = model.nv;
  const Model<AD> taped = model.cast<AD>();
  const Function f = record("mu tau", 3 * n, [&](const VectorXad& x) {
    Data<AD> data(taped);
    const VectorXad w = x.head(n), v = x.segment(n, n), a = x.tail(n), q = s.q.cast<AD>();
    VectorXad y(1);
    y[0] = rnea<AD>(taped, data, integrate<AD>(taped, q, w), v, a).dot(VectorXad(mu.cast<AD>()));
    return y;
  });
  VectorXd x(3 * n);
  x << VectorXd::Zero(n), s.v, s.a;
  const SparseFunction h = sparse_hessian(f);
  const std::vector<double> entries = evaluate(h.function, list(x), {}, {1.0});
  MatrixXd tape = MatrixXd::Zero(3 * n, 3 * n);
  for (std::size_t k = 0; k < entries.size(); ++k) {
    tape(h.pattern.row[k], h.pattern.col[k]) = tape(h.pattern.col[k], h.pattern.row[k]) = entries[k];
  }
  Data<double> data(model);
  Hessian<double> hessian(model);
  EXPECT_LE(relative_error(id_hessian(model, data, hessian, s.q, s.v, s.a, mu), tape), 1e-13);
}

// The same templates on the tape: q, v, tau and lambda are variables.
TEST_P(RecordedSecondOrder, IsRecordable) {
  Random random(GetParam());
  const Base base = GetParam() % 2 ? Base::kFloating : Base::kFixed;
  const Model<double> model = random_tree(random, {.joints = 4, .base = base});
  const State s = random_state(model, random);
  const int n = model.nv, nq = model.nq;
  const Model<AD> taped = model.cast<AD>();
  const Function f = record("hessian", nq + 3 * n, [&](const VectorXad& x) {
    Data<AD> data(taped);
    Hessian<AD> hessian(taped);
    const VectorXad q = x.head(nq), v = x.segment(nq, n), tau = x.segment(nq + n, n), lambda = x.tail(n);
    const MatrixX<AD> H = fd_hessian<AD>(taped, data, hessian, q, v, tau, lambda);
    return VectorXad(H.reshaped());
  });
  const VectorXd lambda = random.vector(n);
  VectorXd x(nq + 3 * n);
  x << s.q, s.v, s.tau, lambda;
  const std::vector<double> y = evaluate(f, list(x));
  Data<double> data(model);
  Hessian<double> hessian(model);
  const MatrixXd H = fd_hessian(model, data, hessian, s.q, s.v, s.tau, lambda);
  EXPECT_LE(relative_error(H.reshaped(), Eigen::Map<const VectorXd>(y.data(), H.size())), 1e-12);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RecordedSecondOrder, ::testing::Range(1UL, 7UL));

}  // namespace
}  // namespace dyntape::dynamics::second_order_recorded_test
