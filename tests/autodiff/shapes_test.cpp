// SPDX-License-Identifier: BSD-3-Clause
//
// Outputs and inputs, nesting, second derivatives and sparsity (hard cases 39-46 and 73-98).
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>

#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/record/record.h>

#include "dense.h"
#include "random.h"

namespace dyntape::testing::shapes_test {
namespace {

VectorXad one(const AD& y) { return VectorXad::Constant(1, y); }
using Entries = std::set<std::pair<std::uint32_t, std::uint32_t>>;
Entries entries(const Pattern& p) {
  Entries e;
  for (std::size_t k = 0; k < p.nnz(); ++k) e.emplace(p.row[k], p.col[k]);
  EXPECT_EQ(e.size(), p.nnz()) << "an entry is listed twice";
  return e;
}

TEST(Shapes, Case39_AParameterThatIsZeroWhileRecordingDoesNotFold) {
  RecordOptions options;
  options.parameters = {0};
  const Function f = record(
      "scaled", 1, 1,
      [](const VectorXad& x, const VectorXad& p) { return one(x[0] * p[0] + pow(x[0], p[0])); }, options);
  EXPECT_EQ(evaluate(f, {2}, {3})[0], 14);
  EXPECT_EQ(jacobian(f, {2}, {3})(0, 0), 3 + 12);
}

TEST(Shapes, Case46_AConstantZeroCutsThePattern) {
  const Function f = record("cut", 2, [](const VectorXad& x) { return one(0 * x[0] + x[1]); });
  EXPECT_EQ(entries(jacobian_sparsity(f)), (Entries{{0, 1}}));
}

TEST(Shapes, AnyVectorOfDoublesIsAnArgument) {
  const Function f = record("identity", 4, [](const VectorXad& x) { return x; });
  using Vector = std::vector<double>;
  Eigen::MatrixXd m =
      Eigen::MatrixXd::NullaryExpr(4, 4, [](Eigen::Index i, Eigen::Index j) { return double(i + 4 * j); });
  EXPECT_EQ(evaluate(f, {0, 1, 2, 3}), (Vector{0, 1, 2, 3}));
  EXPECT_EQ(evaluate(f, m.col(1)), (Vector{4, 5, 6, 7}));
  EXPECT_EQ(evaluate(f, m.reshaped().segment(2, 4)), (Vector{2, 3, 4, 5}));
  EXPECT_EQ(evaluate(f, std::array<double, 4>{3, 2, 1, 0}), (Vector{3, 2, 1, 0}));
  EXPECT_EQ(evaluate(f, Eigen::MatrixXd(m.topLeftCorner(2, 2))), (Vector{0, 1, 4, 5}));
  // The entries are not adjacent in memory: they are copied.
  EXPECT_EQ(evaluate(f, m.row(1)), (Vector{1, 5, 9, 13}));
  EXPECT_EQ(evaluate(f, m.diagonal()), (Vector{0, 5, 10, 15}));
  EXPECT_EQ(evaluate(f, m.topLeftCorner(2, 2)), (Vector{0, 1, 4, 5}));
  EXPECT_EQ(evaluate(f, m.block(0, 0, 1, 4)), (Vector{0, 4, 8, 12}));
  EXPECT_EQ(evaluate(f, (m.block<2, 2>(1, 1))), (Vector{5, 6, 9, 10}));
}

TEST(Shapes, ExpressionsOfEigenAreArguments) {
  const Function f =
      record("sums", 4, 2, [](const VectorXad& x, const VectorXad& p) { return VectorXad(x * p.sum()); });
  using Vector = std::vector<double>;
  const Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(6, 0, 5);
  EXPECT_EQ(evaluate(f, q.head(4) + q.tail(4), q.head(2)), (Vector{2, 4, 6, 8}));
  EXPECT_EQ(evaluate(f, 2 * q.segment(1, 4), {1, 2}), (Vector{6, 12, 18, 24}));
  EXPECT_EQ(evaluate(f, Eigen::MatrixXd::Identity(4, 6) * q, Eigen::Vector2d::Ones()), (Vector{0, 2, 4, 6}));
  EXPECT_EQ(evaluate(f, q.head(4).reverse(), {0, 1}), (Vector{3, 2, 1, 0}));
  // Adjacent numbers are not copied.
  const Numbers segment = q.segment(2, 3), sum = q + q, copy = sum;
  EXPECT_EQ(segment.data(), q.data() + 2);
  EXPECT_EQ(copy.data()[5], 10);
}

TEST(Shapes, Case73_NoOutputsAndNoInputs) {
  const Function none = record("none", 2, [](const VectorXad&) { return VectorXad(0); });
  const Function parameters =
      record("parameters", 0, 1, [](const VectorXad&, const VectorXad& p) { return one(2 * p[0]); });
  EXPECT_TRUE(evaluate(none, {1, 2}).empty());
  EXPECT_EQ(evaluate(parameters, {}, {4})[0], 8);
  for (const Function& f : {none, parameters}) {
    const Derivatives d = derive(f, Order::kSecond);
    EXPECT_EQ(d.jacobian.nnz(), 0u);
    EXPECT_EQ(d.hessian.nnz(), 0u);
    EXPECT_EQ(d.function.n_y(), f.n_y());
    EXPECT_EQ(jvp(f).n_y(), f.n_y());
    EXPECT_EQ(vjp(f).n_y(), f.n_x());
  }
  EXPECT_TRUE(evaluate(Function(), {}).empty());
}

TEST(Shapes, Case74_DegenerateOutputs) {
  const Function f = record("degenerate", 2, 1, [](const VectorXad& x, const VectorXad& p) {
    VectorXad y(8);
    y << 5, p[0], x[0], x[0], x[1], -x[0], x[0] * x[1], x[1] * x[0];
    return y;
  });
  EXPECT_EQ(evaluate(f, {2, 3}, {7}), (std::vector<double>{5, 7, 2, 2, 3, -2, 6, 6}));
  Eigen::MatrixXd expected(8, 2);
  expected << 0, 0, 0, 0, 1, 0, 1, 0, 0, 1, -1, 0, 3, 2, 3, 2;
  EXPECT_EQ(jacobian(f, {2, 3}, {7}), expected);
  EXPECT_EQ(hessian(f, {2, 3}, {1, 1, 1, 1, 1, 1, 2, 3}, {7}),
            (Eigen::MatrixXd(2, 2) << 0, 5, 5, 0).finished());
  EXPECT_EQ(evaluate(vjp(f), {2, 3}, {7}, {1, 1, 1, 1, 1, 1, 1, 1}), (std::vector<double>{7, 5}));
}

TEST(Shapes, Case75_AnUnusedInputHasNoColumnAndNoNode) {
  const Function f = record("unused", 3, [](const VectorXad& x) { return one(x[0] * x[2]); });
  EXPECT_EQ(entries(jacobian_sparsity(f)), (Entries{{0, 0}, {0, 2}}));
  for (const Node& node : f.graph.nodes()) EXPECT_FALSE(node.op == Op::Input && node.b == 1);
  EXPECT_EQ(evaluate(vjp(f), {2, 9, 3}, {}, {1}), (std::vector<double>{3, 0, 2}));
}

TEST(Shapes, Case76_ResultsMayOverwriteTheArguments) {
  const Interpreter run(record("swap", 2, [](const VectorXad& x) { return VectorXad(x.reverse()); }));
  Interpreter::Workspace workspace(run);
  double x[] = {1, 2};
  EXPECT_EQ(run(x, nullptr, nullptr, x, workspace), 0u);
  EXPECT_EQ(x[0], 2);
  EXPECT_EQ(x[1], 1);
}

TEST(Shapes, Case104_WrongSizesAreNamed) {
  const Function f =
      record("sized", 2, 1, [](const VectorXad& x, const VectorXad& p) { return one(x[0] * x[1] * p[0]); });
  const auto message = [&](const std::vector<double>& x, const std::vector<double>& p,
                           const std::vector<double>& w) {
    try {
      evaluate(f, x, p, w);
    } catch (const ArgumentError& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  EXPECT_EQ(message({1}, {1}, {}), "evaluate: x has 1 entries, function \"sized\" expects 2");
  EXPECT_EQ(message({1, 2}, {}, {}), "evaluate: p has 0 entries, function \"sized\" expects 1");
  EXPECT_EQ(message({1, 2}, {1}, {1}), "evaluate: w has 1 entries, function \"sized\" expects 0");
  EXPECT_THROW(evaluate_as<float>(f, {1}, {1}), ArgumentError);
  EXPECT_THROW(select_outputs(f, {1}), ArgumentError);
  EXPECT_THROW(bind(f, Block::kParameters, {{1, 0.0}}), ArgumentError);
  RecordOptions options;
  options.variables = {1};
  EXPECT_THROW(record(
                   "f", 2, [](const VectorXad& x) { return x; }, options),
               ArgumentError);
  options = {};
  options.output_names = {"a"};
  EXPECT_THROW(record(
                   "f", 2, [](const VectorXad& x) { return x; }, options),
               ArgumentError);
}

TEST(Nested, Case80_GradientOfGradientIsTheHessian) {
  const Function f =
      record("f", 2, [](const VectorXad& x) { return one(sin(x[0]) * x[1] + exp(x[0] * x[1])); });
  const std::vector<double> x = {0.7, -1.3};
  const Eigen::MatrixXd h = hessian(f, x, {1});
  const Function gradient = vjp(f), twice = vjp(gradient);
  for (int j = 0; j < 2; ++j) {
    const std::vector<double> column = evaluate(twice, x, {}, {1, j == 0 ? 1.0 : 0.0, j == 1 ? 1.0 : 0.0});
    for (int i = 0; i < 2; ++i) EXPECT_NEAR(column[i], h(i, j), 1e-14);
  }
}

TEST(Nested, Case82_ThreeAndFourLevels) {
  const Function f = record("x^5", 1, [](const VectorXad& x) { return one(pow(x[0], 5.0)); });
  Function d = f;
  const double expected[] = {32, 80, 160, 240, 240, 120, 0};
  std::vector<double> weights;
  for (double value : expected) {
    EXPECT_DOUBLE_EQ(evaluate(d, {2}, {}, weights)[0], value);
    d = jvp(d);
    weights.push_back(1);
  }
}

TEST(Nested, Case84_OnesAndZerosKeepTheInnerDerivative) {
  const Function f = record("ones", 1, 1, [](const VectorXad& x, const VectorXad& p) {
    return one(p[0] * x[0] * x[0] * x[0]);  // p = 0 or 1 on evaluation
  });
  for (double p : {0.0, 1.0}) EXPECT_EQ(hessian(f, {2}, {1}, {p})(0, 0), 12 * p);
  for (double x : {0.0, 1.0}) EXPECT_EQ(hessian(f, {x}, {1}, {1})(0, 0), 6 * x);
}

TEST(Second, Case86_Rosenbrock) {
  const Function f = record("rosenbrock", 2, [](const VectorXad& x) {
    return one(100 * pow(x[1] - x[0] * x[0], 2.0) + pow(1 - x[0], 2.0));
  });
  const Eigen::MatrixXd g = jacobian(f, {-1.2, 1}), h = hessian(f, {-1.2, 1}, {1});
  EXPECT_NEAR(g(0, 0), -215.6, 1e-12);
  EXPECT_NEAR(g(0, 1), -88, 1e-12);
  EXPECT_NEAR((h - (Eigen::MatrixXd(2, 2) << 1330, 480, 480, 200).finished()).norm(), 0, 1e-11);
}

TEST(Second, Case88_Patterns) {
  const auto pattern = [](std::size_t n, auto f) {
    const Function g = record("f", n, [&](const VectorXad& x) { return one(f(x)); });
    return entries(sparse_hessian(g).pattern);
  };
  EXPECT_EQ(pattern(3, [](const VectorXad& x) { return 2 * x[0] - x[1] + x[2] / 3; }), Entries{});
  EXPECT_EQ(pattern(3, [](const VectorXad& x) { return x[0] * x[1] + x[2]; }), (Entries{{1, 0}}));
  EXPECT_EQ(pattern(2, [](const VectorXad& x) { return pow(x[0] + x[1], 2.0); }),
            (Entries{{0, 0}, {1, 0}, {1, 1}}));
  // Case 89: a cumulative sum, squared.
  EXPECT_EQ(pattern(4,
                    [](const VectorXad& x) {
                      AD sum = 0;
                      for (const AD& t : x) sum += t;
                      return sum * sum;
                    })
                .size(),
            10u);
  // Case 90: both branches count, what is compared does not.
  EXPECT_EQ(pattern(4, [](const VectorXad& x) { return select(x[0] < x[1], x[2] * x[2], x[3] * x[3]); }),
            (Entries{{2, 2}, {3, 3}}));
  // Case 91.
  EXPECT_EQ(pattern(2, [](const VectorXad& x) { return sin(0 * x[0]) + sign(x[0]) * x[1] + floor(x[1]); }),
            Entries{});
  // Division is linear in its numerator.
  EXPECT_EQ(pattern(2, [](const VectorXad& x) { return x[0] / x[1]; }), (Entries{{1, 0}, {1, 1}}));
}

TEST(Second, Case96_WholePatternEqualsDense) {
  Random random(96);
  SCOPED_TRACE(random.seed_text());
  for (int trial = 0; trial < 20; ++trial) {
    const std::size_t n = 2 + random.below(6);
    const Eigen::MatrixXd mask =
        Eigen::MatrixXd::NullaryExpr(static_cast<Eigen::Index>(n), static_cast<Eigen::Index>(n),
                                     [&] { return random.below(3) ? 0.0 : random.uniform(-1, 1); });
    const Function f =
        record("quadratic", n, [&](const VectorXad& x) { return one(x.dot(VectorXad(mask * x))); });
    EXPECT_LE((hessian(f, random.vector(n, -1, 1), {1}) - mask - mask.transpose()).norm(), 1e-14);
    std::size_t nnz = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j <= i; ++j) nnz += mask(i, j) + mask(j, i) != 0;
    }
    EXPECT_EQ(sparse_hessian(f).pattern.nnz(), nnz);
  }
}

TEST(Second, Case98_LinearOutputsCostNothing) {
  const Function f = record("mixed", 3, [](const VectorXad& x) {
    VectorXad y(3);
    y << x[0] + 2 * x[1], x[2] * x[2], x[1] - x[2];
    return y;
  });
  const Derivatives d = derive(f, Order::kSecond);
  EXPECT_EQ(entries(d.hessian), (Entries{{2, 2}}));
  EXPECT_EQ(d.function.n_w(), 3u);
  EXPECT_EQ(hessian(f, {1, 2, 3}, {10, 20, 30})(2, 2), 40);
}

}  // namespace
}  // namespace dyntape::testing::shapes_test
