// SPDX-License-Identifier: BSD-3-Clause
//
// Calls: recorded functions and kernels as one node, and derivatives of any order through them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <dyntape/autodiff/derive/recorded_callee.h>
#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/record/record.h>

#include "dense.h"
#include "random_program.h"

namespace dyntape::testing::call_test {
namespace {

VectorXad one(const AD& y) { return VectorXad::Constant(1, y); }

std::size_t calls(const Function& f) {
  std::size_t n = 0;
  for (const Node& node : f.graph.nodes()) n += node.op == Op::Call;
  return n;
}

template <class F>
Function outer(F inner) {
  return record("outer", 3, 1, [&](const VectorXad& x, const VectorXad& p) {
    VectorXad in(2), y(2);
    in << x[0] * x[1], sin(x[2]) + p[0];
    const VectorXad a = inner(in);
    in << a[1], x[0];
    const VectorXad b = inner(in);
    y << a[0] * b[1] + b[0], exp(0.1 * b[0]) * x[1];
    return y;
  });
}

// The same function with its inner part called, and written out.
struct Pair {
  Function called, inlined;
};
Pair pair() {
  const auto body = [](const VectorXad& v) {
    VectorXad y(2);
    y << v[0] * cos(v[1]) + v[1] * v[1], sin(v[0]) / (2 + v[1]);
    return y;
  };
  const auto callee = recorded_callee(record("inner", 2, body));
  return {outer([&](const VectorXad& v) { return call(callee, v); }), outer(body)};
}

void expect_same(const Function& a, const Function& b, const std::vector<double>& x,
                 const std::vector<double>& p, const std::vector<double>& w, const char* what) {
  const std::vector<double> ya = evaluate(a, x, p, w), yb = evaluate(b, x, p, w);
  ASSERT_EQ(ya.size(), yb.size()) << what;
  for (std::size_t i = 0; i < ya.size(); ++i)
    EXPECT_NEAR(ya[i], yb[i], 1e-13 * (1 + std::abs(yb[i]))) << what << " " << i;
}

TEST(Call, DerivativesToFourthOrderAreThoseOfTheInlinedFunction) {
  const Pair f = pair();
  EXPECT_EQ(calls(f.called), 2u);
  EXPECT_LT(f.called.graph.size(), f.inlined.graph.size());
  Random random(1);
  const std::vector<double> x = random.vector(3, 0.3, 1.2), p = {0.4};
  Function a = f.called, b = f.inlined;
  expect_same(a, b, x, p, {}, "value");
  for (const char* mode : {"f", "r", "f", "r"}) {  // jvp of vjp of jvp ...
    const bool forward = *mode == 'f';
    a = forward ? jvp(a) : vjp(a);
    b = forward ? jvp(b) : vjp(b);
    expect_same(a, b, x, p, random.vector(a.n_w(), -1, 1), mode);
  }
  const Derivatives da = derive(f.called, Order::kSecond), db = derive(f.inlined, Order::kSecond);
  EXPECT_EQ(da.jacobian, db.jacobian);
  EXPECT_EQ(da.hessian, db.hessian);
  expect_same(da.function, db.function, x, p, {0.7, -0.3}, "derive");
  EXPECT_GT(calls(da.function), 0u);
}

TEST(Call, AnEqualCallIsTheSameCallAndManyCallsAreFoundQuickly) {
  const auto callee =
      recorded_callee(record("square", 1, [](const VectorXad& x) { return one(x[0] * x[0]); }));
  const Function f = record("many", 1, [&](const VectorXad& x) {
    AD sum = 0;
    for (int i = 0; i < 20000; ++i) sum += call(callee, one(x[0] + i % 10000))[0];
    return one(sum);
  });
  EXPECT_EQ(calls(f), 10000u);
  EXPECT_EQ(calls(compact(f)), 10000u);
}

TEST(Call, ThePatternOfTheCalleeIsRespected) {
  const auto callee = recorded_callee(record("apart", 2, [](const VectorXad& x) {
    VectorXad y(2);
    y << x[0] * x[0], exp(x[1]);
    return y;
  }));
  const Function f = record("f", 3, [&](const VectorXad& x) {
    VectorXad in(2), y(3);
    in << x[0], x[1];
    y << call(callee, in), x[2];
    return y;
  });
  const Pattern expected{3, 3, {0, 1, 2}, {0, 1, 2}};
  EXPECT_EQ(jacobian_sparsity(f), expected);
  EXPECT_EQ(derive(f, Order::kFirst).jacobian, expected);
  EXPECT_EQ(jacobian(f, {3, 0, 1}).diagonal(), Eigen::Vector3d(6, 1, 1));
}

// Found by bisection: unsorted, a column would be missed.
TEST(Call, APatternThatIsNoneIsRefused) {
  const auto message = [](const Pattern& pattern) -> std::string {
    Kernel swap;
    swap.evaluate = [](const double* in, double* out) { out[0] = in[1], out[1] = in[0]; };
    auto kernel = std::make_shared<Callee>("swap", 2, 2, swap);
    kernel->pattern = pattern;
    try {
      record("f", 2, [&](const VectorXad& x) { return call(kernel, x); });
    } catch (const ArgumentError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_EQ(message({2, 2, {0, 1}, {1, 0}}), "no error");
  EXPECT_EQ(message({}), "no error");
  EXPECT_EQ(
      message({2, 2, {1, 0}, {0, 1}}),
      "pattern of \"swap\": entry (0, 1) stands behind (1, 0), expected each once, sorted by row and then by "
      "column");
  EXPECT_NE(message({2, 2, {0, 0}, {1, 0}}).find("entry (0, 0) stands behind (0, 1)"), std::string::npos);
  EXPECT_NE(message({2, 2, {0, 0}, {1, 1}}).find("each once"), std::string::npos);
  EXPECT_EQ(message({2, 2, {0, 2}, {1, 0}}), "pattern of \"swap\": entry (2, 0) is beyond 2 x 2");
  EXPECT_EQ(message({2, 3, {0, 1}, {1, 0}}),
            "pattern of \"swap\": it is 2 x 3, expected outputs x inputs, 2 x 2");
  EXPECT_EQ(message({2, 2, {0, 1}, {1}}),
            "pattern of \"swap\": 2 rows for 1 columns of entries, expected as many");
}

// 2 u + 1 / (1 + exp(-x)): what u moves meets no infinity that exp makes of x.
TEST(Call, AnArgumentThatDoesNotMoveMeetsNoPoleInside) {
  const auto body = [](const VectorXad& x) { return one(2 * x[0] + 1 / (1 + exp(-x[1]))); };
  const Function written = record("shifted", 2, body);
  for (const auto& callee : {recorded_callee(written), dissolving_callee(written)}) {
    const Function f = record("f", 2, [&](const VectorXad& x) { return call(callee, x); });
    const Function moved = record("g", 1, 1, [&](const VectorXad& u, const VectorXad& p) {
      VectorXad in(2);
      in << u[0], p[0];
      return call(callee, in);
    });
    const std::vector<double> x = {3, -800};
    EXPECT_EQ(evaluate(f, x)[0], 6);
    EXPECT_EQ(evaluate(jvp(f), x, {}, {1, 0})[0], 2);
    EXPECT_EQ(evaluate(vjp(f), x, {}, {1})[0], 2);
    EXPECT_EQ(jacobian(f, x)(0, 0), 2);
    EXPECT_EQ(evaluate(jvp(moved), {3}, {-800}, {1})[0], 2);
    EXPECT_EQ(evaluate(vjp(moved), {3}, {-800}, {1})[0], 2);
    EXPECT_EQ(jacobian(moved, {3}, {-800})(0, 0), 2);
    EXPECT_EQ(evaluate(jvp(vjp(f)), x, {}, {1, 1, 0})[0], 0);
    EXPECT_EQ(evaluate(sparse_hessian(f).function, x, {}, {0})[0], 0);
  }
}

// Every argument moves alone in some column: the derivatives of the callee do not become as many.
TEST(Call, ManyArgumentsHaveFewDerivativesOfTheirCallee) {
  const auto body = [](const VectorXad& x) {
    VectorXad y(x.size());
    AD sum = 0;
    for (Eigen::Index i = 0; i < x.size(); ++i) y[i] = sum = sin(sum * x[i]) + 1 / x[i];
    return y;
  };
  const Function written = record("long", 60, body);
  const auto callee = recorded_callee(written);
  const Function called = record("f", 60, [&](const VectorXad& x) { return call(callee, x); });
  const Derivatives d = derive(called, Order::kFirst);
  EXPECT_LT(d.function.graph.callees().size(), 15u);
  Random random(5);
  const std::vector<double> x = random.vector(60, 0.5, 1.5);
  EXPECT_LT((jacobian(called, x) - jacobian(written, x)).cwiseAbs().maxCoeff(), 1e-12);
  std::vector<double> pole = x;
  pole[7] = 0;  // columns before and behind have numbers where the function written out has them
  const Eigen::MatrixXd j = jacobian(called, pole), expected = jacobian(written, pole);
  for (Eigen::Index k = 0; k < j.size(); ++k) {
    if (std::isfinite(expected(k))) {
      EXPECT_NEAR(j(k), expected(k), 1e-12) << k;
    }
  }
}

// What a callee makes of a dead branch is cut off, though its derivatives are calls on zeros there.
TEST(Call, InADeadBranchContributesZero) {
  const auto callee = recorded_callee(record("roots", 2, [](const VectorXad& x) {
    VectorXad y(2);
    y << log(x[0]) * x[1], 1 / x[0];
    return y;
  }));
  const Function f = record("guarded", 2, [&](const VectorXad& x) {
    const VectorXad y = call(callee, x);
    return one(select(x[0] > 0, y[0] + y[1], x[1] * x[1]) + select(x[0] > 0, y[1], 0));
  });
  for (double at : {0.0, -1.0}) {
    EXPECT_EQ(evaluate(f, {at, 3})[0], 9);
    EXPECT_EQ(jacobian(f, {at, 3}), (Eigen::MatrixXd(1, 2) << 0, 6).finished());
    EXPECT_EQ(evaluate(vjp(f), {at, 3}, {}, {1}), (std::vector<double>{0, 6}));
    EXPECT_EQ(hessian(f, {at, 3}, {1}), (Eigen::MatrixXd(2, 2) << 0, 0, 0, 2).finished());
    EXPECT_EQ(evaluate(vjp(jvp(f)), {at, 3}, {}, {1, 1, 1}), (std::vector<double>{0, 2}));
  }
}

TEST(Call, LifetimeOfDerivativeCallees) {
  auto callee = recorded_callee(record("inner", 1, [](const VectorXad& x) { return one(sin(x[0])); }));
  const std::weak_ptr<const Callee> watched = callee;
  {
    const auto first = jvp_callee(callee);
    EXPECT_EQ(first, jvp_callee(callee));  // made once ...
    Function f = record("f", 1, [&](const VectorXad& x) { return call(callee, x); });
    callee.reset();
    EXPECT_NEAR(evaluate(derive(f, Order::kSecond).function, {1}, {}, {1}).back(), -std::sin(1), 1e-15);
    EXPECT_FALSE(watched.expired());  // ... and held by the graph
  }
  EXPECT_TRUE(watched.expired());  // no cycle keeps them
}

TEST(Call, Errors) {
  const Function with_parameters =
      record("p", 1, 1, [](const VectorXad& x, const VectorXad& p) { return one(x[0] * p[0]); });
  EXPECT_THROW(recorded_callee(with_parameters), ArgumentError);
  EXPECT_NO_THROW(recorded_callee(all_as_variables(with_parameters)));
  const Function branching = record("b", 1, [](const VectorXad& x) { return one(x[0] > 0 ? x[0] : -x[0]); });
  EXPECT_THROW(recorded_callee(branching), ArgumentError);
  const auto callee = recorded_callee(all_as_variables(with_parameters));
  EXPECT_THROW(record("f", 1, [&](const VectorXad& x) { return call(callee, x); }), ArgumentError);
  Kernel square;
  square.evaluate = [](const double* in, double* out) { out[0] = in[0] * in[0]; };
  const auto kernel = std::make_shared<const Callee>("opaque", 1, 1, square);
  const Function f = record("f", 1, [&](const VectorXad& x) { return call(kernel, x); });
  EXPECT_EQ(evaluate(f, {3})[0], 9);
  EXPECT_THROW(jvp(f), ArgumentError);
  EXPECT_THROW(evaluate_as<float>(f, {3}), ArgumentError);
}

using Wrap = std::shared_ptr<const Callee> (*)(const Function&);

// A callee on 40 levels: two on each, which call the two below with the same argument.  2^39 ways lead down (the leaf is called once).
std::shared_ptr<const Callee> nested(Wrap wrap) {
  std::shared_ptr<const Callee> below[2];
  below[0] = below[1] =
      wrap(record("leaf", 1, [](const VectorXad& x) { return VectorXad(x.array().sin()); }));
  for (int level = 0; level < 40; ++level) {
    std::shared_ptr<const Callee> here[2];
    for (int k = 0; k < 2; ++k) {
      Function f;  // not recorded: that would evaluate it
      f.name = "level";
      f.inputs = {1, 0, 0};
      const NodeId x = f.graph.input(Block::kVariables, 0);
      const NodeId a = f.graph.call(below[0], {x})[0], b = f.graph.call(below[1], {x})[0];
      f.outputs = {f.graph.make(Op::Add, f.graph.make(Op::Mul, f.graph.constant(0.25 + 0.5 * k), a), b)};
      here[k] = wrap(f);
    }
    below[0] = here[0], below[1] = here[1];
  }
  return below[0];
}

TEST(Call, OperationsOfNestedCalleesAreCountedOnce) {
  const auto operations = count_operations(*nested(recorded_callee));
  const auto sines = std::find_if(operations.begin(), operations.end(),
                                  [](const OperationCount& entry) { return entry.op == Op::Sin; });
  ASSERT_NE(sines, operations.end());
  EXPECT_EQ(sines->count, std::size_t{1} << 39);
}

TEST(Call, EqualCallsDissolveOnce) {
  Function f;
  f.name = "f";
  f.inputs = {1, 0, 0};
  const auto wrap = [](const Function& function) { return dissolving_callee(function); };
  f.outputs = f.graph.call(nested(wrap), {f.graph.input(Block::kVariables, 0)});
  const Function g = dissolved(f);
  EXPECT_LT(total_operations(g), 200u);
  // Of c_n, the factors of sin(x): c_0 = 1, then 0.25 c + c' and 0.75 c + c'.
  double c[2] = {1, 1};
  for (int level = 0; level < 40; ++level) {
    const double next[2] = {0.25 * c[0] + c[1], 0.75 * c[0] + c[1]};
    c[0] = next[0], c[1] = next[1];
  }
  const double expected = c[0] * std::sin(0.3);
  EXPECT_NEAR(evaluate(g, {0.3})[0], expected, 1e-13 * expected);
}

TEST(Call, TheHashTellsEveryFunctionApart) {
  // A guard is not two more outputs.
  const Function outputs = record("f", 2, [](const VectorXad& x) {
    VectorXad y(3);
    y << x[0], less(x[0], x[1]), x[1];
    return y;
  });
  RecordOptions options;
  options.variables = {0.1, 0.2};
  const Function guarded = record(
      "f", 2, [](const VectorXad& x) { return VectorXad(VectorXad::Constant(1, x[0] < x[1] ? x[0] : x[1])); },
      options);
  EXPECT_NE(content_hash(outputs), content_hash(guarded));
  // Callees of one owner, and of none.
  struct Kernels {
    Callee all[2];
  };
  const auto kernels = std::make_shared<Kernels>();
  std::vector<std::string> hashes;
  for (int owned : {0, 1}) {
    for (int k : {0, 1}) {
      Kernel times;
      times.c_body = k == 0 ? "out[0] = 2.0 * in[0];" : "out[0] = 3.0 * in[0];";
      times.evaluate = [k](const double* in, double* out) { out[0] = (k + 2.0) * in[0]; };
      Callee& kernel = kernels->all[k] = Callee("times", 1, 1, times);
      const std::shared_ptr<const Callee> callee(
          owned ? std::shared_ptr<void>(kernels) : std::shared_ptr<void>(), &kernel);
      hashes.push_back(content_hash(record("f", 1, [&](const VectorXad& x) { return call(callee, x); })));
    }
  }
  EXPECT_NE(hashes[0], hashes[1]);
  EXPECT_NE(hashes[2], hashes[3]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Call, WhatCannotBeEvaluatedIsRefused) {
  const auto refusal = [](const std::variant<Kernel, Recorded>& body) -> std::string {
    const auto callee = std::make_shared<const Callee>("half", 1, 1, body);
    try {
      record("f", 1, [&](const VectorXad& x) { return call(callee, x); });
    } catch (const ArgumentError& e) {
      return e.what();
    }
    return "accepted";
  };
  const auto half =
      std::make_shared<const Function>(record("g", 1, [](const VectorXad& x) { return VectorXad(x / 2.0); }));
  EXPECT_EQ(refusal(Recorded{half}), "call of \"half\": it was not made by recorded_callee()");
  EXPECT_EQ(refusal(Kernel()), "call of \"half\": its kernel has no `evaluate`");
}

TEST(Call, DerivativesOfAnotherShapeAreRefused) {
  const auto message = [](int results) -> std::string {
    Kernel twice;
    twice.evaluate = [](const double* in, double* out) { out[0] = 2 * in[0], out[1] = 2 * in[1]; };
    auto kernel = std::make_shared<Callee>("twice", 2, 2, twice);
    kernel->jvp = kernel->vjp = [results]() -> std::shared_ptr<const Callee> {
      if (results < 0) return nullptr;
      return recorded_callee(record(
          "slope", 4, [&](const VectorXad& v) { return VectorXad(VectorXad::Constant(results, 2 * v[2])); }));
    };
    const Function f = record("f", 2, [&](const VectorXad& x) { return call(kernel, x); });
    try {
      derive(f, Order::kFirst);
    } catch (const ArgumentError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message(2), "accepted");
  for (int results : {0, 1, 3})
    EXPECT_NE(message(results).find("of \"twice\" is 4 -> " + std::to_string(results) + ", expected 4 -> 2"),
              std::string::npos)
        << message(results);
  EXPECT_NE(message(-1).find("of \"twice\" is null, expected 4 -> 2"), std::string::npos) << message(-1);
}

// The Hessian of an output whose weight is zero is zero, though the argument of its call has a pole there.
TEST(Call, AWeightOfZeroLeavesNothingOfACallAtAPole) {
  const auto root = [](const VectorXad& v) {
    const AD s = sqrt(abs(v[0]));
    return one(sin(s) - v[0] * sqrt(abs(s)));
  };
  const Function written = record("root", 1, root);
  for (const auto& callee : {recorded_callee(written), dissolving_callee(written)}) {
    const Function f = record("f", 2, [&](const VectorXad& x) {
      VectorXad y(2);
      y << call(callee, one(x[0] + 1 / x[1]))[0], x[0] * x[0];
      return y;
    });
    EXPECT_EQ(hessian(f, {1.16, 0}, {0, 1}), (Eigen::MatrixXd(2, 2) << 2, 0, 0, 0).finished());
  }
}

TEST(Call, TheHashCoversTheDerivativesThatAKernelGives) {
  const auto function = [](double slope) {
    Kernel twice;
    twice.evaluate = [](const double* in, double* out) { out[0] = 2 * in[0]; };
    twice.c_body = "out[0] = 2 * in[0];";
    auto kernel = std::make_shared<Callee>("kernel", 1, 1, twice);
    kernel->jvp = kernel->vjp = [slope] {
      return recorded_callee(record("slope", 2, [slope](const VectorXad& v) { return one(slope * v[1]); }));
    };
    return record("f", 1, [&](const VectorXad& x) { return call(kernel, x); });
  };
  EXPECT_EQ(content_hash(function(2)), content_hash(function(3)));  // the value is the same
  EXPECT_EQ(content_hash(function(2), 1), content_hash(function(2), 1));
  EXPECT_NE(content_hash(function(2), 1), content_hash(function(3), 1));
}

}  // namespace
}  // namespace dyntape::testing::call_test
