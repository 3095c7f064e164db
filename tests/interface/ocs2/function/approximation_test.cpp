// SPDX-License-Identifier: BSD-3-Clause
//
// OCS2's result types: shapes, sums, checks.
#include <gtest/gtest.h>

#include <sstream>

#include <dyntape/autodiff/error.h>
#include <dyntape/interface/ocs2/approximation.h>

namespace dyntape::approximation_test {
namespace {

TEST(Approximation, ZeroHasTheShapesOfTheContract) {
  const auto a = ScalarFunctionQuadraticApproximation::Zero(4, 2);
  EXPECT_EQ(checkSize(4, 2, a, "a"), "");
  EXPECT_EQ(a.dfdux.rows(), 2);  // input times state
  EXPECT_EQ(a.dfdux.cols(), 4);
  EXPECT_EQ(checkSize(4, 2, ScalarFunctionLinearApproximation::Zero(4, 2), "a"), "");
  EXPECT_EQ(checkSize(3, 4, 2, VectorFunctionLinearApproximation::Zero(3, 4, 2), "a"), "");
  const auto v = VectorFunctionQuadraticApproximation::Zero(3, 4, 2);
  EXPECT_EQ(checkSize(3, 4, 2, v, "v"), "");
  EXPECT_EQ(v.dfdux.size(), 3u);
  const auto no_inputs = ScalarFunctionQuadraticApproximation::Zero(4);
  EXPECT_EQ(no_inputs.dfdu.size() + no_inputs.dfduu.size() + no_inputs.dfdux.size(), 0);
  EXPECT_EQ(checkSize(4, 3, a, "cost"),
            "cost.dfdu is (2 x 1), expected (3 x 1)\ncost.dfdux is (2 x 4), expected (3 x 4)\n"
            "cost.dfduu is (2 x 2), expected (3 x 3)\n");
}

TEST(Approximation, SumsAndMultiples) {
  auto a = ScalarFunctionQuadraticApproximation::Zero(2, 1);
  a.f = 1;
  a.dfdx << 1, 2;
  a.dfdxx << 1, 2, 2, 5;
  a.dfdux << 3, 4;
  a.dfduu << 6;
  const auto b = 2.0 * a + a * 0.5;
  EXPECT_EQ(b.f, 2.5);
  EXPECT_EQ(b.dfdx, 2.5 * a.dfdx);
  EXPECT_EQ(b.dfdxx, 2.5 * a.dfdxx);
  EXPECT_EQ(b.dfdux, 2.5 * a.dfdux);
  EXPECT_EQ(b.dfduu, 2.5 * a.dfduu);
  auto state_only = ScalarFunctionQuadraticApproximation::Zero(2);
  state_only += a;  // an empty block is zero
  EXPECT_EQ(state_only.dfdux, a.dfdux);
  EXPECT_THROW(state_only += ScalarFunctionQuadraticApproximation::Zero(3, 1), ArgumentError);

  auto v = VectorFunctionQuadraticApproximation::Zero(2, 2, 1);
  v.dfdxx[1] = a.dfdxx;
  v += 3.0 * v;
  EXPECT_EQ(v.dfdxx[1], 4.0 * a.dfdxx);
  EXPECT_TRUE(v.dfdxx[0].isZero(0));
  EXPECT_THROW((v += VectorFunctionQuadraticApproximation::Zero(3, 2, 1)), ArgumentError);
}

TEST(Approximation, TextNamesTheBlocks) {
  std::ostringstream out;
  out << ScalarFunctionQuadraticApproximation::Zero(1, 1)
      << VectorFunctionQuadraticApproximation::Zero(2, 1, 1);
  for (const char* block : {"f: 0", "dfdx:", "dfdu:", "dfdxx:", "dfdux:", "dfduu:", "dfdxx[1]:"}) {
    EXPECT_NE(out.str().find(block), std::string::npos) << block;
  }
}

// Rounding noise of a large singular matrix is no complaint; a negative direction is, at every scale.
TEST(Approximation, PositiveSemiDefiniteOnTheScaleOfTheMatrix) {
  const matrix_t J = matrix_t::Random(3, 12);
  for (double scale : {1e-12, 1.0, 1e12}) {
    const matrix_t H = scale * (J.transpose() * J);
    EXPECT_EQ(checkBeingPSD((H + H.transpose()) / 2, "H"), "");
    const matrix_t bad = H - 1e-6 * scale * matrix_t::Identity(12, 12);
    EXPECT_NE(checkBeingPSD((bad + bad.transpose()) / 2, "H").find("least eigenvalue"), std::string::npos);
  }
  EXPECT_EQ(checkBeingPSD(matrix_t::Zero(2, 3), "H"), "H is not square: (2 x 3)\n");
  EXPECT_EQ(checkBeingPSD(matrix_t::Constant(2, 2, std::nan("")), "H"), "H is not finite\n");
  EXPECT_EQ(checkBeingPSD((matrix_t(2, 2) << 1, 1, 0, 1).finished(), "H"), "H is not symmetric\n");
}

}  // namespace
}  // namespace dyntape::approximation_test
