// SPDX-License-Identifier: BSD-3-Clause
// ipopt::solve, against optima and multipliers in closed form.
#include <cppad/ipopt/solve.hpp>

#include <stdexcept>

#include "programs.h"

static_assert(CPPAD_HAS_IPOPT == 1);

namespace {

using Result = CppAD::ipopt::solve_result<DVector>;

struct FgEval {
  using ADvector = AVector;
  std::function<void(ADvector& fg, const ADvector& x)> code;
  void operator()(ADvector& fg, const ADvector& x) { code(fg, x); }
};

struct Bounds {
  DVector xl, xu, gl, gu;
};

Result solved(const std::string& options, const DVector& xi, const Bounds& b, FgEval fg) {
  Result result;
  CppAD::ipopt::solve<DVector, FgEval>("Integer print_level 0\nString sb yes\nNumeric tol 1e-10\n" + options,
                                       xi, b.xl, b.xu, b.gl, b.gu, fg, result);
  return result;
}

void squared_distance(AVector& fg, const AVector& x) {
  fg[0] = (x[0] - 3) * (x[0] - 3) + (x[1] + 1) * (x[1] + 1);
  fg[1] = x[0] + x[1];
}

TEST(CppadIpopt, NearestPointOfALine) {
  const Bounds bounds{{-10, -10}, {10, 10}, {1}, {1}};
  for (const char* options : {"", "Retape false\n", "Sparse true forward\n", "Sparse true reverse\n",
                              "Sparse false\n", "Sparse false forward\n", "Retape true\n"}) {
    const Result result = solved(options, {5, 5}, bounds, {squared_distance});
    EXPECT_EQ(result.status, Result::success) << options;
    expect_near(result.x, {2.5, -1.5}, 1e-8);
    expect_near(result.g, {1}, 1e-8);
    expect_near(result.lambda, {1}, 1e-7);
    EXPECT_NEAR(result.obj_value, 0.5, 1e-8);
  }
}

TEST(CppadIpopt, MultipliersOfBounds) {
  const Result result = solved("Numeric bound_relax_factor 0\n", {3, 1}, {{2, -4}, {5, -1}, {}, {}},
                               {[](AVector& fg, const AVector& x) { fg[0] = 3 * x[0] + x[1] * x[1]; }});
  EXPECT_EQ(result.status, Result::success);
  expect_near(result.x, {2, -1}, 1e-7);
  expect_near(result.zl, {3, 0}, 1e-6);
  expect_near(result.zu, {0, 2}, 1e-6);
  EXPECT_EQ(result.g.size(), 0u);
}

// Below 1, the function is the tangent of its parabola: a recording there has no minimum.
TEST(CppadIpopt, BranchesAreFollowedWithRetape) {
  const FgEval code{[](AVector& fg, const AVector& x) {
    if (x[0] < 1)
      fg[0] = 3 - 2 * x[0];
    else
      fg[0] = (x[0] - 2) * (x[0] - 2);
  }};
  const Bounds bounds{{-10}, {10}, {}, {}};
  expect_near(solved("Retape true\n", {0}, bounds, code).x, {2}, 1e-6);
  expect_near(solved("", {0}, bounds, code).x, {10}, 1e-6);
}

TEST(CppadIpopt, LimitOfIterations) {
  const Result result = solved("Integer max_iter 1\n", {-1.2, 1}, {{-10, -10}, {10, 10}, {}, {}},
                               {[](AVector& fg, const AVector& x) {
                                 fg[0] = 100 * pow(x[1] - x[0] * x[0], 2.0) + pow(1 - x[0], 2.0);
                               }});
  EXPECT_EQ(result.status, Result::maxiter_exceeded);
}

TEST(CppadIpopt, Refuses) {
  const Bounds bounds{{-10, -10}, {10, 10}, {1}, {1}};
  using dyntape::ArgumentError;
  const auto sentence = [&](const std::string& options, const DVector& xi) {
    return sentence_of<ArgumentError>([&] { solved(options, xi, bounds, {squared_distance}); });
  };
  EXPECT_NE(sentence("Integer no_such_option 3\n", {1, 1}).find("no_such_option"), std::string::npos);
  EXPECT_NE(sentence("Numeric tol -1\n", {1, 1}).find("tol -1"), std::string::npos);
  EXPECT_NE(sentence("Retape true\nSparse true forward\n", {1, 1}).find("both"), std::string::npos);
  EXPECT_NE(sentence("Sparse true sideways\n", {1, 1}).find("sideways"), std::string::npos);
  EXPECT_NE(sentence("", {1}).find("1, 2 and 2 entries"), std::string::npos);
}

TEST(CppadIpopt, ExceptionsArePassedOn) {
  int calls = 0;
  const FgEval code{[&](AVector& fg, const AVector& x) {
    if (++calls > 3) throw std::domain_error("the fourth point");
    squared_distance(fg, x);
  }};
  const Bounds bounds{{-10, -10}, {10, 10}, {1}, {1}};
  EXPECT_EQ(sentence_of<std::domain_error>([&] {
              solved("Retape true\n", {5, 5}, bounds, code);
            }),
            "the fourth point");
  AVector x(1);
  Independent(x);  // no recording is open
  ADouble::abort_recording();
}

}  // namespace
