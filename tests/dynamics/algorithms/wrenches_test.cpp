// SPDX-License-Identifier: BSD-3-Clause
//
// Wrenches against Jacobians of the frames they act at, and against central differences in 113 bits.
#include <gtest/gtest.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/algorithms/energy.h>
#include <dyntape/dynamics/effects/effects.h>
#include <dyntape/dynamics/effects/wrenches.h>

#include <memory>

#include "dynamics/random_robots.h"

namespace dyntape::dynamics::wrenches_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using MatrixXq = MatrixX<Float128>;
using VectorXq = VectorX<Float128>;

class WrenchesOn : public ::testing::TestWithParam<unsigned long> {
 protected:
  WrenchesOn() : random(GetParam()) {
    const RandomTreeShape shape{2 + random.below(6), GetParam() % 2 ? Base::kFloating : Base::kFixed,
                                GetParam() % 5 == 0, GetParam() % 7 == 0};
    model = random_tree(random, shape);
    s = random_state(model, random);
    for (int k = 0; k < 4; ++k) {
      frames.push_back(random.below(model.njoints()));
      wrenches.push_back(wrench_at_frame(model, frames.back(), k < 2 ? FixedIn::kWorld : FixedIn::kBody,
                                         {random.vector3(5), random.vector3(5)}));
    }
    data = std::make_unique<Data<double>>(model);
    w = std::make_unique<WrenchTorques<double>>(model);
  }

  // The derivative of the torques, by central differences in 113 bits.
  MatrixXd derivatives(const std::vector<Wrench<double>>& of) const {
    const Model<Float128> exact = model.cast<Float128>();
    Data<Float128> data128(exact);
    WrenchTorques<Float128> w128(exact);
    std::vector<Wrench<Float128>> wrenches128;
    for (const Wrench<double>& wrench : of) wrenches128.push_back(wrench.cast<Float128>());
    const VectorXq q = s.q.cast<Float128>();
    const Float128 h(1e-11);
    MatrixXq d(model.nv, model.nv);
    for (int k = 0; k < model.nv; ++k) {
      const VectorXq step = VectorXq::Unit(model.nv, k) * h;
      const VectorXq up =
          wrench_torques<Float128>(exact, data128, w128, wrenches128, integrate<Float128>(exact, q, step));
      const VectorXq down =
          wrench_torques<Float128>(exact, data128, w128, wrenches128, integrate<Float128>(exact, q, -step));
      d.col(k) = (up - down) / (2 * h);
    }
    return d.cast<double>();
  }

  Random random;
  Model<double> model;
  State s;
  std::vector<int> frames;
  std::vector<Wrench<double>> wrenches;
  std::unique_ptr<Data<double>> data;
  std::unique_ptr<WrenchTorques<double>> w;
};

TEST_P(WrenchesOn, TorquesAreTransposedJacobiansTimesWrenches) {
  VectorXd sum = VectorXd::Zero(model.nv);
  for (std::size_t k = 0; k < wrenches.size(); ++k) {
    const bool turns = wrenches[k].fixed_in == FixedIn::kBody;
    sum += frame_jacobian(model, *data, s.q, frames[k],
                          turns ? ReferenceFrame::kLocal : ReferenceFrame::kLocalWorldAligned)
               .transpose() *
           wrenches[k].value.vector();
  }
  EXPECT_LE(relative_error(wrench_torques(model, *data, *w, wrenches, s.q), sum), 1e-13);
}

TEST_P(WrenchesOn, DerivativesMatchDifferences) {
  const MatrixXd D = wrench_torque_derivatives(model, *data, *w, wrenches, s.q);
  EXPECT_LE(relative_error(D, derivatives(wrenches)), 1e-13);
  const VectorXd tau = w->tau;
  EXPECT_EQ(wrench_torques(model, *data, *w, wrenches, s.q), tau);
}

// The same torques at q and another derivative: who fixes a wrench of the world to its body is wrong.
TEST_P(WrenchesOn, FixedInTheWorldIsNotFixedInTheBody) {
  wrenches.resize(2);
  const MatrixXd D = wrench_torque_derivatives(model, *data, *w, wrenches, s.q);
  const VectorXd tau = w->tau;
  std::vector<Wrench<double>> turned = wrenches;
  for (Wrench<double>& wrench : turned) {
    const Placement<double> X_WF = data->X_WB[wrench.body] * wrench.X_BF;
    wrench.fixed_in = FixedIn::kBody;
    wrench.value = {X_WF.R.transpose() * wrench.value.linear, X_WF.R.transpose() * wrench.value.angular};
  }
  wrench_torque_derivatives(model, *data, *w, turned, s.q);
  EXPECT_LE(relative_error(w->tau, tau), 1e-13);
  EXPECT_LE(relative_error(w->dtau_dq, derivatives(turned)), 1e-13);
  bool turns = false;  // does any body that carries a wrench?
  for (const Wrench<double>& wrench : wrenches) {
    for (int i = wrench.body; i >= 0; i = model.parent[i]) {
      for (int k = 0; k < data->tree.count[i]; ++k) turns |= data->tree.dofs[data->tree.first[i] + k].angular;
    }
  }
  if (!turns) return;
  EXPECT_GT(relative_error(w->dtau_dq, D), 1e-3);
}

TEST_P(WrenchesOn, FixedInTheBodyAreExternalForces) {
  wrenches.erase(wrenches.begin(), wrenches.begin() + 2);
  std::vector<Force<double>> external(model.njoints());
  for (const Wrench<double>& wrench : wrenches) {
    external[wrench.body] = external[wrench.body] + act(wrench.X_BF, wrench.value);
  }
  DynamicsTerms<double> acting;
  acting.external = &external;
  id_derivatives(model, *data, s.q, s.v, s.a, acting);
  const VectorXd tau = data->tau;
  const MatrixXd dq = data->dtau_dq;
  id_derivatives(model, *data, s.q, s.v, s.a);
  const MatrixXd D = wrench_torque_derivatives(model, *data, *w, wrenches, s.q);
  EXPECT_LE(relative_error(data->tau - w->tau, tau), 1e-13);
  EXPECT_LE(relative_error(data->dtau_dq - D, dq), 1e-13);
}

// Weight is a force fixed in the world at each centre of mass.
TEST_P(WrenchesOn, WeightIsOne) {
  wrenches.clear();
  for (int i = 0; i < model.njoints(); ++i) {
    Wrench<double> weight;
    weight.body = i;
    weight.X_BF.p = model.inertias[i].com;
    weight.fixed_in = FixedIn::kWorld;
    weight.value.linear = model.gravity * model.inertias[i].mass;
    wrenches.push_back(weight);
  }
  wrench_torque_derivatives(model, *data, *w, wrenches, s.q);
  EnergyGradients<double> e(model);
  gravity_derivatives(model, *data, e, s.q);
  const double size = model.gravity.norm();
  EXPECT_LE((w->tau + data->g).cwiseAbs().maxCoeff(), 1e-13 * size * (1 + data->g.cwiseAbs().maxCoeff()));
  EXPECT_LE((w->dtau_dq + e.dg_dq).cwiseAbs().maxCoeff(), 1e-13 * size * (1 + e.dg_dq.cwiseAbs().maxCoeff()));
}

TEST_P(WrenchesOn, RootPositionEntersNothing) {
  if (model.joints[0].type != JointType::kFreeFlyer) return;
  const MatrixXd D = wrench_torque_derivatives(model, *data, *w, wrenches, s.q);
  const VectorXd tau = w->tau;
  s.q.head<3>() += Eigen::Vector3d(1e8, -1e8, 3e7);
  EXPECT_EQ(wrench_torque_derivatives(model, *data, *w, wrenches, s.q), D);
  EXPECT_EQ(w->tau, tau);
  EXPECT_EQ(D.leftCols<3>(), MatrixXd::Zero(model.nv, 3));
}

TEST_P(WrenchesOn, DerivativesOfDynamicsDifferByTheirs) {
  Effects<double> effects;
  EffectTorques<double> torques(model);
  inverse_dynamics_derivatives(model, *data, torques, effects, s.q, s.v, s.a);
  const VectorXd tau = data->tau;
  const MatrixXd dq = data->dtau_dq, dv = data->dtau_dv;
  effects.wrenches = wrenches;
  inverse_dynamics_derivatives(model, *data, torques, effects, s.q, s.v, s.a);
  const MatrixXd D = wrench_torque_derivatives(model, *data, *w, wrenches, s.q);
  EXPECT_EQ(data->tau, tau - w->tau);
  EXPECT_EQ(data->dtau_dq, dq - D);
  EXPECT_EQ(data->dtau_dv, dv);
}

INSTANTIATE_TEST_SUITE_P(Seeds, WrenchesOn, ::testing::Range(1UL, 21UL));

// A body's number goes wrong more easily than a frame's name.
std::vector<Wrench<double>> push_on(int body) {
  Wrench<double> wrench;
  wrench.body = body;
  wrench.fixed_in = FixedIn::kWorld;
  wrench.value.linear = Eigen::Vector3d(1, 2, 3);
  return {wrench};
}

TEST(Wrenches, OnTheWorldDoNothing) {
  Random random(3);
  const Model<double> model = random_tree(random);
  Data<double> data(model);
  WrenchTorques<double> w(model);
  wrench_torque_derivatives<double>(model, data, w, push_on(-1), neutral(model));
  EXPECT_EQ(w.tau, VectorXd::Zero(model.nv));
  EXPECT_EQ(w.dtau_dq, MatrixXd::Zero(model.nv, model.nv));
}

TEST(Wrenches, WrongArgumentsAreNamed) {
  Random random(3);
  const Model<double> model = random_tree(random), other = random_tree(random, {3});
  Data<double> data(model);
  WrenchTorques<double> w(model), small(other);
  const VectorXd q = neutral(model), v = VectorXd::Zero(model.nv);
  const auto none = push_on(-1), lost = push_on(model.njoints());
  EXPECT_THROW(wrench_torques<double>(model, data, w, none, q.head(1)), ArgumentError);
  EXPECT_THROW(wrench_torques<double>(model, data, small, none, q), ArgumentError);
  EXPECT_THROW(wrench_torques<double>(model, data, w, lost, q), ArgumentError);
  EXPECT_THROW(wrench_at_frame(model, 99, FixedIn::kBody, Force<double>()), ArgumentError);
  Effects<double> effects;
  EffectTorques<double> torques(model);
  effects.wrenches = lost;
  EXPECT_THROW(forward_dynamics(model, data, torques, effects, q, v, v), ArgumentError);
}

}  // namespace
}  // namespace dyntape::dynamics::wrenches_test
