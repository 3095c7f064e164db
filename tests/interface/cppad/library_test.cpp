// SPDX-License-Identifier: BSD-3-Clause
// Functions of the layer as functions of the project: compiled, with parameters, guards, batches and names.
#include <dyntape/interface/cppad/library.h>

#include "programs.h"

namespace {

using dyntape::CodegenOptions;
using dyntape::CompiledFunction;
using dyntape::Order;

ADFun<double> with_parameter() {
  AVector ax(2), ap(1), ay(2);
  ax[0] = 1, ax[1] = 2, ap[0] = 3;
  Independent(ax, ap);
  ay[0] = ap[0] * sin(ax[0]) * ax[1], ay[1] = exp(ax[1] * ap[0]);
  ADFun<double> f;
  f.Dependent(ax, ay);
  f.function_name_set("with_parameter");
  return f;
}

TEST(CppadLibrary, ValueJacobianAndHessian) {
  ADFun<double> f = with_parameter();
  CodegenOptions options;
  options.order = Order::kSecond;
  const CompiledFunction g = CppAD::to_library(f, options);
  EXPECT_EQ(g.name(), "with_parameter");
  EXPECT_EQ(g.n_p(), 1u);
  const auto all = g.evaluate(Order::kSecond, {0.5, 0.25}, {2}, {1, 1});
  f.new_dynamic(DVector{2});
  const DVector x{0.5, 0.25}, y = f.Forward(0, x), J = f.Jacobian(x), H = f.Hessian(x, DVector{1, 1});
  EXPECT_EQ(all.y, std::vector<double>(y.begin(), y.end()));
  const dyntape::Pattern& pattern = g.jacobian_pattern();
  for (std::size_t k = 0; k < pattern.nnz(); ++k)
    EXPECT_NEAR(all.jacobian[k], J[pattern.row[k] * 2 + pattern.col[k]], 1e-14);
  const dyntape::Pattern& lower = g.hessian_pattern();
  for (std::size_t k = 0; k < lower.nnz(); ++k)
    EXPECT_NEAR(all.hessian[k], H[lower.row[k] * 2 + lower.col[k]], 1e-14);
}

TEST(CppadLibrary, ManyPointsInLanes) {
  CodegenOptions options;
  options.lanes = dyntape::Lanes::kNative;
  const CompiledFunction g = CppAD::to_library(with_parameter(), options);
  CompiledFunction::Workspace workspace(g);
  std::vector<double> x, y(2 * 33), p(33, 3.0);
  for (int i = 0; i < 66; ++i) x.push_back(0.01 * i);
  g.check(g.run(Order::kValue, {.count = 33, .x = x.data(), .p = p.data(), .y = y.data()}, workspace), 33);
  for (std::size_t i = 0; i < 33; ++i) EXPECT_NEAR(y[2 * i], 3 * std::sin(x[2 * i]) * x[2 * i + 1], 1e-14);
}

TEST(CppadLibrary, PrintsAreLeftOut) {
  AVector ax(1), ay(1);
  ax[0] = 1;
  Independent(ax);
  CppAD::PrintFor("x ", ax[0]);
  ay[0] = ax[0] * 2;
  ADFun<double> f(ax, ay);
  EXPECT_EQ(CppAD::to_function(f).n_y(), 1u);
}

class Cube : public CppAD::atomic_four<double> {
 public:
  Cube() : CppAD::atomic_four<double>("cube") {}
  bool forward(std::size_t, const CppAD::vector<bool>&, std::size_t, std::size_t up,
               const CppAD::vector<double>& tx, CppAD::vector<double>& ty) override {
    if (up > 1) return false;
    ty[0] = tx[0] * tx[0] * tx[0];
    if (up == 1) ty[1] = 3 * tx[0] * tx[0] * tx[1];
    return true;
  }
  bool reverse(std::size_t, const CppAD::vector<bool>&, std::size_t up, const CppAD::vector<double>& tx,
               const CppAD::vector<double>&, CppAD::vector<double>& px,
               const CppAD::vector<double>& py) override {
    if (up > 1) return false;
    px[0] = 3 * tx[0] * tx[0] * py[0];
    if (up == 1) px[0] += 6 * tx[0] * tx[1] * py[1], px[1] = 3 * tx[0] * tx[0] * py[1];
    return true;
  }
};

TEST(CppadLibrary, AtomicFunctionsAreInterpreted) {
  Cube cube;
  AVector ax(2), ay(1), au(1), av(1);
  ax[0] = 1, ax[1] = 2;
  Independent(ax);
  au[0] = ax[0] * ax[1];
  cube(au, av);
  ay[0] = av[0] + ax[0];
  ADFun<double> f(ax, ay);
  CodegenOptions options;
  options.order = Order::kSecond;
  const CompiledFunction g = CppAD::to_library(f, options);
  EXPECT_EQ(g.route(), dyntape::Route::kInterpreter);
  const auto all = g.evaluate(Order::kSecond, {2, 3}, {}, {1});
  EXPECT_EQ(all.y[0], 218);
  EXPECT_EQ(all.jacobian, (std::vector<double>{3 * 36 * 3 + 1, 3 * 36 * 2}));
  const DVector H = f.Hessian(DVector{2, 3}, std::size_t(0));
  EXPECT_EQ(all.hessian, (std::vector<double>{H[0], H[2], H[3]}));
}

double level(const double& x) { return std::floor(x); }
CPPAD_DISCRETE_FUNCTION(double, level)

TEST(CppadLibrary, DiscreteFunctionsAreInterpreted) {
  ADFun<double> f =
      recorded({1}, [](const AVector& x) -> std::vector<ADouble> { return {level(x[0]) * x[0]}; });
  const auto all = CppAD::to_library(f).evaluate(Order::kFirst, {2.5});
  EXPECT_EQ(all.y[0], 5);
  EXPECT_EQ(all.jacobian[0], 2);
}

// Derivatives that were recorded by nesting are functions like any other.
TEST(CppadLibrary, OfRecordedDerivatives) {
  ADFun<double> f =
      recorded({1, 2}, [](const AVector& x) -> std::vector<ADouble> { return {x[0] * x[0] * x[1]}; });
  auto af = f.base2ad();
  AVector ax{1, 2};
  Independent(ax);
  AVector ay = af.Hessian(ax, std::size_t(0));
  ADFun<double> h(ax, ay);
  EXPECT_EQ(CppAD::to_library(h).evaluate(Order::kValue, {3, 5}).y, (std::vector<double>{10, 6, 6, 0}));
}

}  // namespace
