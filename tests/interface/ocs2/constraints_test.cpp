// SPDX-License-Identifier: BSD-3-Clause
//
// Constraints as OCS2's users write them, of either order, with parameters from a pre-computation.
#include <cmath>

#include "program.h"

namespace {

using ocs2::ad_scalar_t;
using ocs2::ad_vector_t;
using ocs2::ConstraintOrder;
using ocs2::matrix_t;
using ocs2::PreComputation;
using ocs2::scalar_t;
using ocs2::vector_t;

const vector_t kState = (vector_t(3) << 0.3, -0.8, 1.1).finished(),
               kInput = (vector_t(2) << 0.6, -0.2).finished();

struct Terrain final : PreComputation {
  scalar_t height = 0;
  void request(ocs2::RequestSet set, scalar_t time, const vector_t&, const vector_t&) override {
    if (set.contains(ocs2::Request::Constraint)) height = 2 * time;
  }
};

class Clearance final : public ocs2::StateConstraintCppAd {
 public:
  Clearance(ConstraintOrder order, const std::string& folder) : StateConstraintCppAd(order) {
    initialize(3, 1, "clearance", folder, false, false);
  }
  Clearance* clone() const override { return new Clearance(*this); }
  std::size_t getNumConstraints(scalar_t) const override { return 2; }
  bool isActive(scalar_t time) const override { return time > 0; }
  vector_t getParameters(scalar_t, const PreComputation& preComputation) const override {
    return vector_t::Constant(1, ocs2::cast<Terrain>(preComputation).height);
  }

 protected:
  ad_vector_t constraintFunction(ad_scalar_t, const ad_vector_t& x, const ad_vector_t& p) const override {
    ad_vector_t g(2);
    g << x(2) - p(0), x(0) * x(1) * x(1);
    return g;
  }
};

class Constraints : public Program {};

TEST_F(Constraints, OfAState) {
  Terrain terrain;
  terrain.request(ocs2::Request::Constraint + ocs2::Request::Approximation, 0.2, kState, kInput);
  const Clearance constraint(ConstraintOrder::Quadratic, folder());
  EXPECT_FALSE(constraint.isActive(0));
  const vector_t g = constraint.getValue(0.2, kState, terrain);
  expect_near(g, (vector_t(2) << kState[2] - 0.4, kState[0] * kState[1] * kState[1]).finished());
  const auto a = constraint.getQuadraticApproximation(0.2, kState, terrain);
  ASSERT_EQ(a.dfdxx.size(), constraint.getNumConstraints(0.2));
  expect_near(a.f, g);
  expect_near(a.dfdx,
              (matrix_t(2, 3) << 0, 0, 1, kState[1] * kState[1], 2 * kState[0] * kState[1], 0).finished());
  expect_near(a.dfdxx[0], matrix_t::Zero(3, 3));
  expect_near(a.dfdxx[1],
              (matrix_t(3, 3) << 0, 2 * kState[1], 0, 2 * kState[1], 2 * kState[0], 0, 0, 0, 0).finished());
  EXPECT_EQ(ocs2::checkSize(2, 3, -1, a, "clearance"), "");
  EXPECT_THROW(constraint.getValue(0.2, kState, PreComputation()), dyntape::ArgumentError);
}

TEST_F(Constraints, OfOrderLinearHaveNoCurvature) {
  Terrain terrain;
  const std::unique_ptr<ocs2::StateConstraint> constraint(
      Clearance(ConstraintOrder::Linear, folder()).clone());
  EXPECT_EQ(constraint->getOrder(), ConstraintOrder::Linear);
  const auto a = constraint->getLinearApproximation(0, kState, terrain);
  expect_near(a.dfdx,
              (matrix_t(2, 3) << 0, 0, 1, kState[1] * kState[1], 2 * kState[0] * kState[1], 0).finished());
  EXPECT_EQ(a.dfdu.size(), 0);
  const std::string said = dyntape::message_of<dyntape::ArgumentError>(
      [&] { constraint->getQuadraticApproximation(0, kState, terrain); });
  EXPECT_NE(said.find("order Linear"), std::string::npos) << said;
}

class FrictionCone final : public ocs2::StateInputConstraintCppAd {
 public:
  explicit FrictionCone(const std::string& folder) : StateInputConstraintCppAd(ConstraintOrder::Quadratic) {
    initialize(3, 2, 0, "friction_cone", folder, true, false);
  }
  FrictionCone* clone() const override { return new FrictionCone(*this); }
  std::size_t getNumConstraints(scalar_t) const override { return 1; }

 protected:
  ad_vector_t constraintFunction(ad_scalar_t, const ad_vector_t& x, const ad_vector_t& u,
                                 const ad_vector_t&) const override {
    return ad_vector_t::Constant(1, 0.7 * x(2) - sqrt(u.squaredNorm() + 0.04));
  }
};

TEST_F(Constraints, OfStateAndInput) {
  const FrictionCone cone(folder());
  const double n = std::sqrt(kInput.squaredNorm() + 0.04);
  const auto a = cone.getQuadraticApproximation(0, kState, kInput, PreComputation());
  expect_near(a.f, vector_t::Constant(1, 0.7 * kState[2] - n));
  expect_near(a.dfdx, (matrix_t(1, 3) << 0, 0, 0.7).finished());
  expect_near(a.dfdu, -kInput.transpose() / n);
  expect_near(a.dfdxx[0], matrix_t::Zero(3, 3));
  expect_near(a.dfdux[0], matrix_t::Zero(2, 3));
  expect_near(a.dfduu[0], -matrix_t::Identity(2, 2) / n + kInput * kInput.transpose() / (n * n * n));
  const auto linear = cone.getLinearApproximation(0, kState, kInput, PreComputation());
  expect_near(linear.dfdu, a.dfdu, 0);
}

}  // namespace
