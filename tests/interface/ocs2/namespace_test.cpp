// SPDX-License-Identifier: BSD-3-Clause
//
// Code that stands in OCS2's own namespace, with one include.
#include <dyntape/interface/ocs2/ocs2_namespace.h>
#include <gtest/gtest.h>

#include "interface/temporary_cache.h"

namespace ocs2 {

class QuadraticCost final : public StateInputCostCppAd {
 public:
  QuadraticCost(matrix_t Q, matrix_t R, const std::string& folder) : Q_(std::move(Q)), R_(std::move(R)) {
    initialize(static_cast<std::size_t>(Q_.rows()), static_cast<std::size_t>(R_.rows()), 0, "quadratic",
               folder, true, false);
  }
  QuadraticCost* clone() const override { return new QuadraticCost(*this); }

 protected:
  ad_scalar_t costFunction(ad_scalar_t, const ad_vector_t& state, const ad_vector_t& input,
                           const ad_vector_t&) const override {
    const ad_vector_t Qx = Q_.cast<ad_scalar_t>() * state, Ru = R_.cast<ad_scalar_t>() * input;
    return 0.5 * state.dot(Qx) + 0.5 * input.dot(Ru);
  }

 private:
  matrix_t Q_, R_;
};

TEST(OwnNamespace, ACostOfTheirs) {
  const dyntape::TemporaryCache cache;
  const matrix_t Q = (matrix_t(2, 2) << 2, 0.5, 0.5, 1).finished(), R = matrix_t::Identity(1, 1);
  const QuadraticCost cost(Q, R, cache.path());
  const auto a =
      cost.getQuadraticApproximation(0, vector_t::Ones(2), vector_t::Ones(1), {}, PreComputation());
  EXPECT_TRUE(a.dfdxx.isApprox(Q));
  EXPECT_TRUE(a.dfduu.isApprox(R));
  EXPECT_DOUBLE_EQ(a.f, 0.5 * Q.sum() + 0.5);
}

}  // namespace ocs2
