// SPDX-License-Identifier: BSD-3-Clause
//
// Dynamics as OCS2's users write them, against derivatives by hand and by differences.
#include <cmath>

#include "program.h"

namespace {

using ocs2::ad_scalar_t;
using ocs2::ad_vector_t;
using ocs2::matrix_t;
using ocs2::PreComputation;
using ocs2::scalar_t;
using ocs2::vector_t;

class Pendulum final : public ocs2::SystemDynamicsBaseAD {
 public:
  explicit Pendulum(const std::string& folder) { initialize(2, 1, "pendulum", folder, true, false); }
  Pendulum* clone() const override { return new Pendulum(*this); }

 protected:
  ad_vector_t systemFlowMap(ad_scalar_t time, const ad_vector_t& x, const ad_vector_t& u,
                            const ad_vector_t&) const override {
    ad_vector_t dxdt(2);
    dxdt << x(1), -9.81 * sin(x(0)) + u(0) * cos(time);
    return dxdt;
  }
};

class Dynamics : public Program {};

TEST_F(Dynamics, FlowMapOfAPendulum) {
  Pendulum pendulum(folder());
  const vector_t x = (vector_t(2) << 0.4, -1).finished(), u = vector_t::Constant(1, 0.5);
  const scalar_t t = 0.3;
  expect_near(pendulum.computeFlowMap(t, x, u),
              (vector_t(2) << x[1], -9.81 * std::sin(x[0]) + u[0] * std::cos(t)).finished());
  const auto a = pendulum.linearApproximation(t, x, u);
  expect_near(a.f, pendulum.computeFlowMap(t, x, u));
  expect_near(a.dfdx, (matrix_t(2, 2) << 0, 1, -9.81 * std::cos(x[0]), 0).finished());
  expect_near(a.dfdu, (matrix_t(2, 1) << 0, std::cos(t)).finished());
  expect_near(pendulum.flowMapDerivativeTime(t, x, u), (vector_t(2) << 0, -u[0] * std::sin(t)).finished());
  expect_near(ocs2::finiteDifferenceDerivativeState(pendulum, t, x, u, 0, true, true), a.dfdx, 1e-9);
  expect_near(ocs2::finiteDifferenceDerivativeInput(pendulum, t, x, u), a.dfdu, 1e-9);
}

TEST_F(Dynamics, WithoutJumpsAndGuardsOfItsOwn) {
  Pendulum pendulum(folder());
  const vector_t x = (vector_t(2) << 0.4, -1).finished();
  expect_near(pendulum.computeJumpMap(0, x), x, 0);
  expect_near(pendulum.computeGuardSurfaces(0, x), vector_t::Constant(1, -1), 0);
  const auto jump = pendulum.jumpMapLinearApproximation(0, x);
  expect_near(jump.dfdx, matrix_t::Identity(2, 2), 0);
  EXPECT_EQ(jump.dfdu.rows(), 2);  // (n x 0), as in OCS2: no input at a jump
  EXPECT_EQ(jump.dfdu.cols(), 0);
  const auto guard = pendulum.guardSurfacesLinearApproximation(0, x, vector_t::Zero(1));
  expect_near(guard.dfdx, matrix_t::Zero(1, 2), 0);
  expect_near(guard.dfdu, matrix_t::Zero(1, 1), 0);
}

class Ball final : public ocs2::SystemDynamicsBaseAD {
 public:
  Ball(scalar_t restitution, const std::string& folder) : restitution_(restitution) {
    initialize(2, 0, "ball", folder, true, false);
  }
  Ball* clone() const override { return new Ball(*this); }

 protected:
  ad_vector_t systemFlowMap(ad_scalar_t, const ad_vector_t& x, const ad_vector_t&,
                            const ad_vector_t& p) const override {
    ad_vector_t dxdt(2);
    dxdt << x(1), p(0);
    return dxdt;
  }
  ad_vector_t systemJumpMap(ad_scalar_t, const ad_vector_t& x, const ad_vector_t& p) const override {
    ad_vector_t after(2);
    after << x(0), -p(0) * x(1);
    return after;
  }
  ad_vector_t systemGuardSurfaces(ad_scalar_t time, const ad_vector_t& x, const ad_vector_t&) const override {
    return ad_vector_t::Constant(1, x(0) - 0.1 * time);
  }
  vector_t getFlowMapParameters(scalar_t time, const PreComputation&) const override {
    return vector_t::Constant(1, -9.81 - time);
  }
  std::size_t getNumFlowMapParameters() const override { return 1; }
  vector_t getJumpMapParameters(scalar_t, const PreComputation&) const override {
    return vector_t::Constant(1, restitution_);
  }
  std::size_t getNumJumpMapParameters() const override { return 1; }

 private:
  scalar_t restitution_;
};

TEST_F(Dynamics, JumpsAndGuards) {
  Ball ball(0.8, folder());
  const vector_t x = (vector_t(2) << 0.5, -3).finished(), none;
  expect_near(ball.computeFlowMap(1, x, none), (vector_t(2) << -3, -10.81).finished());
  expect_near(ball.computeJumpMap(1, x), (vector_t(2) << 0.5, 2.4).finished());
  expect_near(ball.jumpMapLinearApproximation(1, x).dfdx, (matrix_t(2, 2) << 1, 0, 0, -0.8).finished());
  expect_near(ball.computeGuardSurfaces(1, x), vector_t::Constant(1, 0.4));
  expect_near(ball.guardSurfacesDerivativeTime(1, x, none), vector_t::Constant(1, -0.1));
  expect_near(ball.guardSurfacesLinearApproximation(1, x, none).dfdx, (matrix_t(1, 2) << 1, 0).finished());
  // One of another restitution has the same library.
  Ball other(0.5, folder());
  expect_near(other.computeJumpMap(1, x), (vector_t(2) << 0.5, 1.5).finished());
}

struct Wind final : PreComputation {
  scalar_t speed = 0;
  Wind* clone() const override { return new Wind(*this); }
  void request(RequestSet set, scalar_t time, const vector_t&, const vector_t&) override {
    if (set.contains(Request::Dynamics)) speed = 10 * time;
  }
};

class Sail final : public ocs2::SystemDynamicsBaseAD {
 public:
  explicit Sail(const std::string& folder) : SystemDynamicsBaseAD(Wind()) {
    initialize(1, 0, "sail", folder, true, false);
  }
  Sail* clone() const override { return new Sail(*this); }

 protected:
  ad_vector_t systemFlowMap(ad_scalar_t, const ad_vector_t& x, const ad_vector_t&,
                            const ad_vector_t& p) const override {
    return p - x;
  }
  vector_t getFlowMapParameters(scalar_t, const PreComputation& shared) const override {
    return vector_t::Constant(1, ocs2::cast<Wind>(shared).speed);
  }
  std::size_t getNumFlowMapParameters() const override { return 1; }
};

TEST_F(Dynamics, PreComputationIsAskedBefore) {
  Sail sail(folder());
  EXPECT_EQ(sail.computeFlowMap(2, vector_t::Ones(1), {})[0], 19);
  const std::unique_ptr<ocs2::SystemDynamicsBase> clone(sail.clone());
  EXPECT_EQ(clone->linearApproximation(3, vector_t::Ones(1), {}).f[0], 29);
  EXPECT_EQ(clone->jumpMapLinearApproximation(3, vector_t::Ones(1)).dfdx(0, 0), 1);
}

class CartPole final : public ocs2::SystemDynamicsBaseAD {
 public:
  explicit CartPole(const std::string& folder) { initialize(4, 1, "cartpole_dynamics", folder, true, false); }
  CartPole* clone() const override { return new CartPole(*this); }

 protected:
  ad_vector_t systemFlowMap(ad_scalar_t, const ad_vector_t& x, const ad_vector_t& u,
                            const ad_vector_t&) const override {
    const double cart = 2, pole = 0.2, length = 0.5, inertia = pole * length * length / 3, g = 9.81;
    const ad_scalar_t c = cos(x(0)), s = sin(x(0));
    Eigen::Matrix<ad_scalar_t, 2, 2> I;
    I << inertia + pole * length * length, pole * length * c, pole * length * c, cart + pole;
    Eigen::Matrix<ad_scalar_t, 2, 1> rhs(pole * g * length * s, u(0) + pole * length * x(2) * x(2) * s);
    ad_vector_t dxdt(4);
    dxdt << x.tail<2>(), I.inverse() * rhs;
    return dxdt;
  }
};

TEST_F(Dynamics, CartPoleByDifferences) {
  CartPole system(folder());
  for (int seed = 0; seed < 5; ++seed) {
    std::srand(static_cast<unsigned>(seed));
    const vector_t x = vector_t::Random(4), u = vector_t::Random(1);
    const auto a = system.linearApproximation(0, x, u);
    expect_near(a.dfdx, ocs2::finiteDifferenceDerivativeState(system, 0, x, u, 0, true, true), 1e-8);
    expect_near(a.dfdu, ocs2::finiteDifferenceDerivativeInput(system, 0, x, u, 0, true, true), 1e-8);
  }
}

TEST_F(Dynamics, ClonesGoToOtherThreads) {
  std::unique_ptr<ocs2::SystemDynamicsBase> clone;
  {
    const CartPole system(folder());
    clone.reset(system.clone());
  }
  EXPECT_TRUE(clone->linearApproximation(0, vector_t::Ones(4), vector_t::Ones(1)).dfdx.allFinite());
}

}  // namespace
