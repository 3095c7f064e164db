// SPDX-License-Identifier: BSD-3-Clause
//
// Costs as OCS2's users write them: of states, of states and inputs, by Gauss-Newton.
#include <cmath>
#include <utility>

#include "program.h"

namespace {

using ocs2::ad_scalar_t;
using ocs2::ad_vector_t;
using ocs2::matrix_t;
using ocs2::PreComputation;
using ocs2::scalar_t;
using ocs2::TargetTrajectories;
using ocs2::vector_t;

const vector_t kState = (vector_t(2) << 0.3, -0.8).finished(), kInput = vector_t::Constant(1, 0.6);

class StateTracking final : public ocs2::StateCostCppAd {
 public:
  explicit StateTracking(const std::string& folder) {
    initialize(2, 2, "state_tracking", folder, true, false);
  }
  StateTracking* clone() const override { return new StateTracking(*this); }
  vector_t getParameters(scalar_t time, const TargetTrajectories& target,
                         const PreComputation&) const override {
    return target.getDesiredState(time);
  }

 protected:
  ad_scalar_t costFunction(ad_scalar_t time, const ad_vector_t& state,
                           const ad_vector_t& parameters) const override {
    const ad_vector_t e = state - parameters;
    return time * e(0) * e(0) + e(1) * e(1) * e(1);
  }
};

class Costs : public Program {};

TEST_F(Costs, OfAStateAgainstItsReference) {
  const TargetTrajectories target({0, 2}, {vector_t::Zero(2), vector_t::Ones(2)});
  const std::unique_ptr<ocs2::StateCost> cost(
      StateTracking(folder()).clone());  // what it was cloned of is gone
  const vector_t e = kState - vector_t::Constant(2, 0.5);
  EXPECT_TRUE(cost->isActive(1));
  EXPECT_NEAR(cost->getValue(1, kState, target, PreComputation()), e[0] * e[0] + std::pow(e[1], 3), 1e-15);
  const auto a = cost->getQuadraticApproximation(1, kState, target, PreComputation());
  EXPECT_NEAR(a.f, e[0] * e[0] + std::pow(e[1], 3), 1e-15);
  expect_near(a.dfdx, (vector_t(2) << 2 * e[0], 3 * e[1] * e[1]).finished());
  expect_near(a.dfdxx, (matrix_t(2, 2) << 2, 0, 0, 6 * e[1]).finished());
  EXPECT_EQ(a.dfdu.size(), 0);
  EXPECT_EQ(ocs2::checkSize(2, -1, a, "cost"), "");
}

class StateInputExample final : public ocs2::StateInputCostCppAd {
 public:
  explicit StateInputExample(const std::string& folder) {
    initialize(2, 1, 0, "state_input", folder, true, false);
  }
  StateInputExample* clone() const override { return new StateInputExample(*this); }

 protected:
  ad_scalar_t costFunction(ad_scalar_t, const ad_vector_t& x, const ad_vector_t& u,
                           const ad_vector_t&) const override {
    return 0.5 * x.dot(x) + x(0) * u(0) * u(0) + sin(x(1)) * u(0);
  }
};

TEST_F(Costs, OfStateAndInput) {
  const StateInputExample cost(folder());
  const auto a = cost.getQuadraticApproximation(0, kState, kInput, {}, PreComputation());
  const double s = std::sin(kState[1]), c = std::cos(kState[1]), u = kInput[0];
  EXPECT_NEAR(a.f, cost.getValue(0, kState, kInput, {}, PreComputation()), 1e-15);
  expect_near(a.dfdx, (vector_t(2) << kState[0] + u * u, kState[1] + c * u).finished());
  expect_near(a.dfdu, vector_t::Constant(1, 2 * kState[0] * u + s));
  expect_near(a.dfdxx, (matrix_t(2, 2) << 1, 0, 0, 1 - s * u).finished());
  expect_near(a.dfdux, (matrix_t(1, 2) << 2 * u, c).finished());
  expect_near(a.dfduu, matrix_t::Constant(1, 1, 2 * kState[0]));
  EXPECT_EQ(ocs2::checkSize(2, 1, a, "cost"), "");
}

class Residuals final : public ocs2::StateInputCostGaussNewtonAd {
 public:
  explicit Residuals(const std::string& folder) { initialize(2, 1, 3, "residuals", folder, true, false); }
  Residuals* clone() const override { return new Residuals(*this); }
  vector_t weights = (vector_t(3) << 1, 2, 0.5).finished();  // tuned without another library

  vector_t getParameters(scalar_t, const TargetTrajectories&, const PreComputation&) const override {
    return weights;
  }

 protected:
  ad_vector_t costVectorFunction(ad_scalar_t, const ad_vector_t& x, const ad_vector_t& u,
                                 const ad_vector_t& p) const override {
    ad_vector_t y(3);
    y << x(0) * x(1), sin(x(0)) + u(0), u(0) * u(0);
    return y.cwiseProduct(p);
  }
};

TEST_F(Costs, ByGaussNewtonAlwaysPositive) {
  Residuals cost(folder());
  for (const double weight : {1.0, 3.0}) {
    cost.weights[0] = weight;
    vector_t y(3);
    y << weight * kState.prod(), 2 * (std::sin(kState[0]) + kInput[0]), 0.5 * kInput[0] * kInput[0];
    matrix_t J(3, 3);
    J << weight * kState[1], weight * kState[0], 0, 2 * std::cos(kState[0]), 0, 2, 0, 0, kInput[0];
    const auto a = cost.getQuadraticApproximation(0, kState, kInput, {}, PreComputation());
    EXPECT_NEAR(a.f, 0.5 * y.squaredNorm(), 1e-15);
    EXPECT_NEAR(cost.getValue(0, kState, kInput, {}, PreComputation()), a.f, 1e-15);
    const matrix_t H = J.transpose() * J;
    expect_near(a.dfdx, (J.transpose() * y).head(2));
    expect_near(a.dfdu, (J.transpose() * y).tail(1));
    expect_near(a.dfdxx, H.topLeftCorner(2, 2));
    expect_near(a.dfdux, H.bottomLeftCorner(1, 2));
    expect_near(a.dfduu, H.bottomRightCorner(1, 1));
    EXPECT_EQ(ocs2::checkBeingPSD(a.dfdxx, "dfdxx"), "");
  }
}

class Forgetful final : public ocs2::StateCostCppAd {
 public:
  Forgetful* clone() const override { return new Forgetful(*this); }

 protected:
  ad_scalar_t costFunction(ad_scalar_t, const ad_vector_t& x, const ad_vector_t&) const override {
    return x(0);
  }
};

// Keeps a number from one recording to the next.
class Leaking final : public ocs2::StateCostCppAd {
 public:
  Leaking* clone() const override { return new Leaking(*this); }

 protected:
  ad_scalar_t costFunction(ad_scalar_t, const ad_vector_t& x, const ad_vector_t&) const override {
    return std::exchange(kept_, x(0)) * x(0);
  }

 private:
  mutable ad_scalar_t kept_;
};

TEST_F(Costs, ErrorsOfARecordingNameTheClientsLine) {
  Leaking cost;
  cost.initialize(1, 0, "leaking", folder(), true, false);
  const std::string said = dyntape::message_of<dyntape::RecordingError>(
      [&] { cost.initialize(1, 0, "leaking", folder(), true, false); });
  EXPECT_NE(said.find("costs_test.cpp:" + std::to_string(__LINE__ - 1)), std::string::npos) << said;
}

TEST_F(Costs, MistakesAreSentences) {
  using dyntape::message_of;
  const std::string forgot =
      message_of<dyntape::ArgumentError>([] { Forgetful().getValue(0, kState, {}, PreComputation()); });
  EXPECT_NE(forgot.find("initialize() has to be called"), std::string::npos) << forgot;
  const StateInputExample cost(folder());
  const std::string size = message_of<dyntape::ArgumentError>(
      [&] { cost.getValue(0, vector_t::Zero(3), kInput, {}, PreComputation()); });
  EXPECT_NE(size.find("state has 3 entries, function \"state_input\" expects 2"), std::string::npos) << size;
  const std::string target = message_of<dyntape::ArgumentError>(
      [&] { StateTracking(folder()).getValue(0, kState, {}, PreComputation()); });
  EXPECT_NE(target.find("no states"), std::string::npos) << target;
}

}  // namespace
