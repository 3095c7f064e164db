// SPDX-License-Identifier: BSD-3-Clause
//
// Jets and the complex step through the recursions: derivatives that share no line with the analytic ones.
#include <gtest/gtest.h>

#include <bit>
#include <complex>
#include <limits>

#include <dyntape/autodiff/scalars/jet_eigen.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/detail/forward_dynamics.hxx>
#include <dyntape/dynamics/algorithms/detail/inverse_dynamics.hxx>
#include <dyntape/dynamics/model/detail/configuration.hxx>
#include "dynamics/random_robots.h"

namespace dyntape::jets_of_robots_test {
namespace {

using namespace dynamics;  // NOLINT: the tests speak its language
using Eigen::MatrixXd;

constexpr double kEps = std::numeric_limits<double>::epsilon();

// (nv x 3 nv): derivatives of rnea (or aba) with respect to tangent increments of q, to v and to its last
// argument, N columns a run.
template <int N>
MatrixXd jacobian_by_jets(const Model<double>& model, const State& s, bool forward) {
  using J = Jet<double, N>;
  const Model<J> m = model.cast<J>();
  Data<J> data(m);
  const int nv = model.nv;
  MatrixXd d(nv, 3 * nv);
  for (int first = 0; first < 3 * nv; first += N) {
    VectorX<J> x = VectorX<J>::Zero(3 * nv);
    x.segment(nv, nv) = s.v.cast<J>();
    x.tail(nv) = (forward ? s.tau : s.a).template cast<J>();
    for (int k = 0; k < N && first + k < 3 * nv; ++k) x[first + k].tangent(k) = 1;
    const VectorX<J> q = integrate<J>(m, s.q.cast<J>().eval(), x.head(nv));
    const VectorX<J> v = x.segment(nv, nv), w = x.tail(nv);
    const VectorX<J>& y = forward ? aba<J>(m, data, q, v, w) : rnea<J>(m, data, q, v, w);
    for (int k = 0; k < N && first + k < 3 * nv; ++k) {
      for (int i = 0; i < nv; ++i) d(i, first + k) = y[i].tangent(k);
    }
  }
  return d;
}

TEST(JetsOfRobots, AgreeWithTheAnalyticDerivatives) {
  Random random(1);
  for (int trial = 0; trial < 6; ++trial) {
    const Model<double> model =
        random_tree(random, {.joints = 6, .base = trial % 2 ? Base::kFloating : Base::kFixed});
    Data<double> data(model);
    const State s = random_state(model, random);
    const int nv = model.nv;
    id_derivatives<double>(model, data, s.q, s.v, s.a);
    MatrixXd analytic(nv, 3 * nv);
    analytic << data.dtau_dq, data.dtau_dv, data.M;
    const MatrixXd inverse = jacobian_by_jets<8>(model, s, false);
    for (int block = 0; block < 3; ++block) {
      EXPECT_LT(relative_error(analytic.middleCols(block * nv, nv), inverse.middleCols(block * nv, nv)),
                1e-13);
    }
    fd_derivatives<double>(model, data, s.q, s.v, s.tau);
    analytic << data.ddq_dq, data.ddq_dv, data.Minv;
    const MatrixXd forward = jacobian_by_jets<8>(model, s, true);
    for (int block = 0; block < 3; ++block) {
      EXPECT_LT(relative_error(analytic.middleCols(block * nv, nv), forward.middleCols(block * nv, nv)),
                1e-13);
    }
  }
}

TEST(JetsOfRobots, OneFourAndEightDirectionsHaveTheSameBits) {
  Random random(2);
  const Model<double> model = random_tree(random, {.joints = 5, .base = Base::kFloating});
  const State s = random_state(model, random);
  for (bool forward : {false, true}) {
    const MatrixXd one = jacobian_by_jets<1>(model, s, forward);
    EXPECT_TRUE((one.array() == jacobian_by_jets<4>(model, s, forward).array()).all());
    EXPECT_TRUE((one.array() == jacobian_by_jets<8>(model, s, forward).array()).all());
  }
}

// tau(q + i h e) on a chain: the imaginary part over h is a derivative without a difference, held against the
// analytic derivatives in 113 bits.
TEST(JetsOfRobots, ComplexStepThroughAChain) {
  using C = std::complex<double>;
  const double h = 1e-100;
  Random random(3);
  Model<double> model;
  model.gravity = random.vector3(10);
  for (int i = 0; i < 5; ++i) {
    const JointType type = i == 2 ? JointType::kPrismatic : JointType::kRevolute;
    model.add_joint(i - 1, random_joint(random, "joint " + std::to_string(i), type), random_placement(random),
                    random_inertia(random));
  }
  const Model<C> m = model.cast<C>();
  Data<C> data(m);
  const State s = random_state(model, random);
  const int nv = model.nv;
  MatrixXd inverse(nv, 3 * nv), forward(nv, 3 * nv);
  for (int k = 0; k < 3 * nv; ++k) {
    VectorX<C> q = s.q.cast<C>(), v = s.v.cast<C>(), a = s.a.cast<C>(), tau = s.tau.cast<C>();
    if (k < nv) q[k] += C(0, h);
    if (k >= nv && k < 2 * nv) v[k - nv] += C(0, h);
    if (k >= 2 * nv) a[k - 2 * nv] += C(0, h), tau[k - 2 * nv] += C(0, h);
    inverse.col(k) = rnea<C>(m, data, q, v, a).imag() / h;
    forward.col(k) = aba<C>(m, data, q, v, tau).imag() / h;
  }
  const Model<Float128> wide = model.cast<Float128>();
  Data<Float128> exact(wide);
  const VectorX<Float128> q = s.q.cast<Float128>(), v = s.v.cast<Float128>(), a = s.a.cast<Float128>();
  const VectorX<Float128> tau = s.tau.cast<Float128>();
  id_derivatives<Float128>(wide, exact, q, v, a);
  EXPECT_LT(relative_error(inverse.leftCols(nv), exact.dtau_dq.cast<double>()), 4 * kEps);
  EXPECT_LT(relative_error(inverse.middleCols(nv, nv), exact.dtau_dv.cast<double>()), 4 * kEps);
  EXPECT_LT(relative_error(inverse.rightCols(nv), exact.M.cast<double>()), 4 * kEps);
  fd_derivatives<Float128>(wide, exact, q, v, tau);
  EXPECT_LT(relative_error(forward.leftCols(nv), exact.ddq_dq.cast<double>()), 1e-12);
  EXPECT_LT(relative_error(forward.middleCols(nv, nv), exact.ddq_dv.cast<double>()), 1e-12);
  EXPECT_LT(relative_error(forward.rightCols(nv), exact.Minv.cast<double>()), 1e-12);
}

}  // namespace
}  // namespace dyntape::jets_of_robots_test
