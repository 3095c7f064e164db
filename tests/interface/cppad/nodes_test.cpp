// SPDX-License-Identifier: BSD-3-Clause
// What stands in recordings besides operators: arrays, steps, functions of the user, checkpoints, prints.
#include <sstream>

#include "programs.h"

namespace {

using Sizes = CPPAD_TESTVECTOR(std::size_t);
using CppAD::vector;

TEST(CppadVecAd, LoadsByARecordedIndex) {
  AVector ax(2), ay(1);
  ax[0] = 1.5, ax[1] = 3;
  Independent(ax);
  CppAD::VecAD<double> table(3);
  for (std::size_t i = 0; i < 3; ++i) table[i] = double(10 * (i + 1)) * ax[1];
  ay[0] = table[ax[0]];
  ADFun<double> f(ax, ay);
  expect_near(f.Forward(0, DVector{1.5, 3}), {60});
  expect_near(f.Forward(0, DVector{2.0, 3}), {90});
  expect_near(f.Forward(0, DVector{0.2, 3}), {30});
  expect_near(f.Jacobian(DVector{2.9, 3}), {0, 30});
}

TEST(CppadVecAd, StoresByARecordedIndex) {
  AVector ax(2), ay(3);
  ax[0] = 0, ax[1] = 5;
  Independent(ax);
  CppAD::VecAD<double> array(3);
  const ADouble zero = 0;
  array[zero] = 1.0;
  for (int i = 0; i < 3; ++i) array[i] = double(i);
  array[ax[0]] = ax[1];
  array[ax[0]] += 2.0;
  for (int i = 0; i < 3; ++i) ay[std::size_t(i)] = array[ADouble(i)];
  ADFun<double> f(ax, ay);
  expect_near(f.Forward(0, DVector{0, 5}), {7, 1, 2});
  expect_near(f.Forward(0, DVector{2, 5}), {0, 1, 7});
  expect_near(f.Jacobian(DVector{1, 5}), {0, 0, 0, 1, 0, 0});
}

TEST(CppadVecAd, ElementsCompute) {
  AVector ax(1), ay(1);
  ax[0] = 1;
  Independent(ax);
  CppAD::VecAD<double> array(2);
  array[std::size_t(0)] = 2.0, array[std::size_t(1)] = 3.0;
  ay[0] = array[ax[0]] * array[ADouble(0)] + ax[0] * array[ax[0]] - array[ax[0]] / 3.0;
  ADFun<double> f(ax, ay);
  expect_near(f.Forward(0, DVector{1}), {8});
  EXPECT_EQ(array.size(), 2u);
}

double stairs(const double& x) { return std::floor(2 * x); }
CPPAD_DISCRETE_FUNCTION(double, stairs)

TEST(CppadDiscrete, StepsHaveValuesAndNoSlope) {
  ADFun<double> f = recorded({1}, [](const AVector& x) -> std::vector<ADouble> {
    return {stairs(x[0]) * x[0], stairs(ADouble(3))};
  });
  expect_near(f.Forward(0, DVector{1.7}), {5.1, 6});
  expect_near(f.Forward(1, DVector{1}), {3, 0});
  expect_near(f.Reverse(1, DVector{1, 1}), {3});
  expect_near(f.Hessian(DVector{1.7}, DVector{1, 1}), {0});
  CppAD::sparse_rc<Sizes> eye(1, 1, 1), pattern;
  eye.set(0, 0, 0);
  f.for_jac_sparsity(eye, false, true, false, pattern);
  EXPECT_EQ(pattern.nnz(), 1u);
}

TEST(CppadDiscrete, AreRecordedAgain) {
  ADFun<double> f =
      recorded({1}, [](const AVector& x) -> std::vector<ADouble> { return {stairs(x[0]) * x[0]}; });
  auto af = f.base2ad();
  AVector ax(1);
  ax[0] = 1;
  Independent(ax);
  AVector ay = af.Jacobian(ax);
  ADFun<double> g(ax, ay);
  expect_near(g.Forward(0, DVector{2.6}), {5});
}

// y = x0 x1, to any order, of every generation.
template <class S>
void product_forward(std::size_t low, std::size_t up, const vector<S>& tx, vector<S>& ty) {
  for (std::size_t k = low; k <= up; ++k) {
    ty[k] = S(0);
    for (std::size_t j = 0; j <= k; ++j) ty[k] = ty[k] + tx[j] * tx[up + 1 + k - j];
  }
}
template <class S>
void product_reverse(std::size_t up, const vector<S>& tx, vector<S>& px, const vector<S>& py) {
  for (std::size_t k = 0; k <= 2 * up + 1; ++k) px[k] = S(0);
  for (std::size_t k = 0; k <= up; ++k) {
    for (std::size_t j = 0; j <= k; ++j) {
      px[j] = px[j] + py[k] * tx[up + 1 + k - j];
      px[up + 1 + k - j] = px[up + 1 + k - j] + py[k] * tx[j];
    }
  }
}

class Four : public CppAD::atomic_four<double> {
 public:
  Four() : CppAD::atomic_four<double>("product four") {}
  bool forward(std::size_t id, const vector<bool>&, std::size_t low, std::size_t up, const vector<double>& tx,
               vector<double>& ty) override {
    product_forward(low, up, tx, ty);
    for (double& y : ty) y *= double(id + 1);
    return true;
  }
  bool forward(std::size_t, const vector<bool>&, std::size_t low, std::size_t up, const vector<ADouble>& tx,
               vector<ADouble>& ty) override {
    product_forward(low, up, tx, ty);
    return true;
  }
  bool reverse(std::size_t id, const vector<bool>&, std::size_t up, const vector<double>& tx,
               const vector<double>&, vector<double>& px, const vector<double>& py) override {
    product_reverse(up, tx, px, py);
    for (double& x : px) x *= double(id + 1);
    return true;
  }
  bool reverse(std::size_t, const vector<bool>&, std::size_t up, const vector<ADouble>& tx,
               const vector<ADouble>&, vector<ADouble>& px, const vector<ADouble>& py) override {
    product_reverse(up, tx, px, py);
    return true;
  }
};

class Three : public CppAD::atomic_three<double> {
 public:
  Three() : CppAD::atomic_three<double>("product_three") {}
  using Types = vector<CppAD::ad_type_enum>;
  bool forward(const vector<double>&, const Types&, std::size_t, std::size_t low, std::size_t up,
               const vector<double>& tx, vector<double>& ty) override {
    product_forward(low, up, tx, ty);
    return true;
  }
  bool reverse(const vector<double>&, const Types&, std::size_t up, const vector<double>& tx,
               const vector<double>&, vector<double>& px, const vector<double>& py) override {
    product_reverse(up, tx, px, py);
    return true;
  }
  bool jac_sparsity(const vector<double>&, const Types&, bool, const vector<bool>&, const vector<bool>&,
                    CppAD::sparse_rc<vector<std::size_t>>&) override {
    return false;
  }
};

class Two : public CppAD::atomic_base<double> {
 public:
  Two() : CppAD::atomic_base<double>("product_two") {}
  bool forward(std::size_t low, std::size_t up, const vector<bool>&, vector<bool>& vy,
               const vector<double>& tx, vector<double>& ty) override {
    if (vy.size() > 0) vy[0] = true;
    product_forward(low, up, tx, ty);
    return true;
  }
  bool reverse(std::size_t up, const vector<double>& tx, const vector<double>&, vector<double>& px,
               const vector<double>& py) override {
    product_reverse(up, tx, px, py);
    return true;
  }
};

template <class Atomic>
class AtomicPrograms : public ::testing::Test {
 protected:
  Atomic atomic_;
  ADFun<double> make() {
    AVector ax(2), ay(1), au(2);
    ax[0] = 2, ax[1] = 3;
    Independent(ax);
    au[0] = sin(ax[0]), au[1] = ax[1] * ax[1];
    atomic_(au, ay);
    ay[0] = ay[0] * ax[1];
    ADFun<double> f;
    f.Dependent(ax, ay);
    return f;
  }
};
using Generations = ::testing::Types<Two, Three, Four>;
TYPED_TEST_SUITE(AtomicPrograms, Generations);

TYPED_TEST(AtomicPrograms, ValuesAndSlopesInBothModes) {
  ADFun<double> f = this->make();
  const DVector x{0.5, 2};
  expect_near(f.Forward(0, x), {std::sin(0.5) * 8});
  expect_near(f.Forward(1, DVector{1, 0}), {std::cos(0.5) * 8});
  expect_near(f.Reverse(1, DVector{1}), {std::cos(0.5) * 8, std::sin(0.5) * 12});
  expect_near(f.Jacobian(x), {std::cos(0.5) * 8, std::sin(0.5) * 12});
}

TYPED_TEST(AtomicPrograms, SecondAndHigherOrders) {
  ADFun<double> f = this->make();
  const DVector x{0.5, 2};
  const double s = std::sin(0.5), c = std::cos(0.5);
  expect_near(f.Hessian(x, std::size_t(0)), {-s * 8, c * 12, c * 12, s * 12});
  f.Forward(0, x), f.Forward(1, DVector{1, 0}), f.Forward(2, DVector{0, 0});
  expect_near(f.Forward(3, DVector{0, 0}), {-c * 8 / 6});
  expect_near(f.Reverse(3, DVector{1}), {c * 8, -s * 8, -c * 4, s * 12, c * 12, -s * 6});
}

// An element at a recorded index is taken by every function and operator, on either side.
TEST(CppadVecAD, ElementsAreRecordedValues) {
  AVector ax{1, 0.5}, ay(4);
  Independent(ax);
  CppAD::VecAD<double> table(2);
  table[std::size_t(0)] = 0.25, table[std::size_t(1)] = ax[1];
  ay[0] = sin(table[ax[0]]) + pow(table[ax[0]], 2.0) * 3.0;
  ay[1] = pow(table[ax[0]], table[ax[0]]) - table[ax[0]] / 2.0;
  table[ax[0]] *= 4;
  ay[2] = CondExpLt(ADouble(table[ax[0]]), ADouble(1), ADouble(0), ADouble(1));
  ay[3] = -table[ax[0]];
  EXPECT_TRUE(table[ax[0]] > 1.5);
  ADFun<double> f(ax, ay);
  expect_near(f.Forward(0, DVector{1, 0.5}), {std::sin(0.5) + 0.75, std::sqrt(0.5) - 0.25, 1, -2});
  expect_near(f.Forward(0, DVector{0, 0.5}), {std::sin(0.25) + 0.1875, std::pow(0.25, 0.25) - 0.125, 1, -1});
}

// y = (u2^2, u0 u1): types of the results, and the pattern of the Hessian, by what the function says.
class Typed : public CppAD::atomic_three<double> {
 public:
  Typed() : CppAD::atomic_three<double>("typed") {}
  using Types = vector<CppAD::ad_type_enum>;
  bool for_type(const vector<double>&, const Types& x, Types& y) override {
    y[0] = x[2], y[1] = std::max(x[0], x[1]);
    return true;
  }
  bool forward(const vector<double>&, const Types&, std::size_t need, std::size_t, std::size_t up,
               const vector<double>& x, vector<double>& y) override {
    EXPECT_GT(need, std::size_t(CppAD::variable_enum)) << "all results are needed";
    if (up == 0) y[0] = x[2] * x[2], y[1] = x[0] * x[1];
    return up == 0;
  }
  bool jac_sparsity(const vector<double>&, const Types&, bool, const vector<bool>&, const vector<bool>&,
                    CppAD::sparse_rc<vector<std::size_t>>& pattern) override {
    pattern.resize(2, 3, 3);
    pattern.set(0, 0, 2), pattern.set(1, 1, 0), pattern.set(2, 1, 1);
    return true;
  }
  bool hes_sparsity(const vector<double>&, const Types&, const vector<bool>&, const vector<bool>& y,
                    CppAD::sparse_rc<vector<std::size_t>>& pattern) override {
    pattern.resize(3, 3, (y[0] ? 1u : 0u) + (y[1] ? 2u : 0u));
    if (y[0]) pattern.set(0, 2, 2);
    if (y[1]) pattern.set(pattern.nnz() - 2, 0, 1), pattern.set(pattern.nnz() - 1, 1, 0);
    return true;
  }
};

TEST(CppadAtomic, ResultsHaveTheTypesThatItSays) {
  Typed typed;
  std::vector<ADouble> x{2}, p{3}, y(2);
  Independent(x, p);
  typed(std::vector<ADouble>{5, p[0], x[0]}, y);
  EXPECT_TRUE(Variable(y[0]));
  EXPECT_TRUE(Dynamic(y[1]));
  ADFun<double> f(x, y);
  f.new_dynamic(DVector{7});
  expect_near(f.Forward(0, DVector{4}), {16, 35});
  EXPECT_FALSE(f.Parameter(0));
  EXPECT_TRUE(f.Parameter(1));
  std::vector<ADouble> u{1}, v(2);
  Independent(u);
  typed(std::vector<ADouble>{5, 6, u[0]}, v);
  EXPECT_TRUE(Constant(v[1]));
  AD<double>::abort_recording();
}

TEST(CppadAtomic, HessianPatternIsWhatItSays) {
  Typed typed;
  AVector u{1, 2, 3}, y(2);
  Independent(u);
  typed(u, y);
  ADFun<double> f(u, y);
  CppAD::sparse_rc<Sizes> pattern;
  f.for_hes_sparsity(vector<bool>{true, true, true}, vector<bool>{true, true}, false, pattern);
  CppAD::sparse_rc<Sizes> expected(3, 3, 3);
  expected.set(0, 0, 1), expected.set(1, 1, 0), expected.set(2, 2, 2);
  EXPECT_TRUE(pattern == expected) << pattern;
  f.for_hes_sparsity(vector<bool>{true, true, true}, vector<bool>{true, false}, false, pattern);
  EXPECT_EQ(pattern.nnz(), 1u);
}

// y = x^2 with reverse of first order only, which is all that Reverse(1) needs after Forward(1) and Forward(2).
class FirstOrderSquare : public CppAD::atomic_three<double> {
 public:
  FirstOrderSquare() : CppAD::atomic_three<double>("first_order_square") {}
  using Types = vector<CppAD::ad_type_enum>;
  bool forward(const vector<double>&, const Types&, std::size_t, std::size_t, std::size_t up,
               const vector<double>& tx, vector<double>& ty) override {
    for (std::size_t k = 0; k <= up; ++k) {
      ty[k] = 0;
      for (std::size_t j = 0; j <= k; ++j) ty[k] += tx[j] * tx[k - j];
    }
    return true;
  }
  bool reverse(const vector<double>&, const Types&, std::size_t up, const vector<double>& tx,
               const vector<double>&, vector<double>& px, const vector<double>& py) override {
    px[0] = 2 * tx[0] * py[0];
    return up == 0;
  }
};

TEST(CppadAtomic, ReverseAsksForTheOrdersThatItNeeds) {
  FirstOrderSquare square;
  AVector ax{3}, ay(1);
  Independent(ax);
  square(ax, ay);
  ay[0] = ay[0] * 5;
  ADFun<double> f(ax, ay);
  f.Forward(1, DVector{2}), f.Forward(2, DVector{0});
  expect_near(f.Reverse(1, DVector{1}), {30});
}

// Its order one is reverse only, and its pattern is asked for by patterns alone.
class ReverseSquare : public CppAD::atomic_four<double> {
 public:
  ReverseSquare() : CppAD::atomic_four<double>("reverse_square") {}
  bool dependency_was_asked = false;

 private:
  bool forward(std::size_t, const vector<bool>&, std::size_t, std::size_t up, const vector<double>& tx,
               vector<double>& ty) override {
    ty[0] = tx[0] * tx[0];
    return up == 0;
  }
  bool reverse(std::size_t, const vector<bool>&, std::size_t up, const vector<double>& tx,
               const vector<double>&, vector<double>& px, const vector<double>& py) override {
    px[0] = 2 * tx[0] * py[0];
    return up == 0;
  }
  bool jac_sparsity(std::size_t, bool dependency, const vector<bool>&, const vector<bool>&,
                    const vector<bool>&, CppAD::sparse_rc<vector<std::size_t>>& pattern) override {
    if (!dependency) throw std::logic_error("nobody asked for the pattern of slopes");
    dependency_was_asked = true;
    pattern.resize(1, 1, 0);
    return true;
  }
};

TEST(CppadAtomic, OrderOneInReverseIsEnoughForAJacobian) {
  ReverseSquare square;
  AVector ax{3}, ay(1);
  Independent(ax);
  square(ax, ay);
  ADFun<double> f(ax, ay);
  expect_near(f.Jacobian(DVector{5}), {10});
  CppAD::sparse_rc<Sizes> eye(1, 1, 1), pattern;
  eye.set(0, 0, 0);
  f.for_jac_sparsity(eye, false, true, false, pattern);
  EXPECT_TRUE(square.dependency_was_asked);
  EXPECT_EQ(pattern.nnz(), 0u);
}

// 3 p x^2 of a parameter that changes after the call has been recorded; derivatives in x to third order.
TEST(CppadCheckpoint, NewParametersReachRecordedCalls) {
  std::vector<ADouble> x{2}, p{4}, y(1);
  Independent(x, p);
  y[0] = p[0] * x[0] * x[0];
  ADFun<double> inner(x, y);
  CppAD::chkpoint_two<double> call(inner, "scaled_square");
  AVector ax{2}, ay(1);
  Independent(ax);
  call(ax, ay);
  ay[0] = 3 * ay[0];
  ADFun<double> f(ax, ay);
  expect_near(f.Forward(0, DVector{2}), {48});
  call.new_dynamic(DVector{5});
  expect_near(f.Forward(0, DVector{2}), {60});
  expect_near(f.Jacobian(DVector{2}), {60});
  expect_near(f.Hessian(DVector{2}, std::size_t(0)), {30});
  std::vector<ADouble> au{2}, av(1);
  Independent(au);
  av[0] = f.base2ad().Jacobian(au)[0];  // 30 x, recorded
  ADFun<double> slope(au, av);
  expect_near(slope.Jacobian(DVector{7}), {30});
}

TYPED_TEST(AtomicPrograms, PatternsCoverIt) {
  ADFun<double> f = this->make();
  CppAD::sparse_rc<Sizes> eye(2, 2, 2), pattern;
  eye.set(0, 0, 0), eye.set(1, 1, 1);
  f.for_jac_sparsity(eye, false, false, false, pattern);
  EXPECT_EQ(pattern.nnz(), 2u);
  vector<bool> domain{true, true}, range{true};
  f.for_hes_sparsity(domain, range, false, pattern);
  EXPECT_EQ(pattern.nnz(), 4u);
}

TEST(CppadAtomic, CallsWithANumber) {
  Four atomic;
  AVector ax(2), ay(1);
  ax[0] = 2, ax[1] = 3;
  Independent(ax);
  atomic(1, ax, ay);
  EXPECT_EQ(ay[0], 12);
  ADFun<double> f(ax, ay);
  expect_near(f.Jacobian(DVector{5, 7}), {14, 10});
}

TEST(CppadAtomic, RecordedAgainByItsFunctionsOfAd) {
  Four atomic;
  AVector ax(2), ay(1);
  ax[0] = 2, ax[1] = 3;
  Independent(ax);
  atomic(ax, ay);
  ADFun<double> f(ax, ay);
  auto af = f.base2ad();
  Independent(ax);
  AVector gradient = af.Jacobian(ax);
  ADFun<double> g(ax, gradient);
  expect_near(g.Forward(0, DVector{5, 7}), {7, 5});
  expect_near(g.Jacobian(DVector{5, 7}), {0, 1, 1, 0});
}

TEST(CppadAtomic, WhatIsNotWrittenIsSaid) {
  Three atomic;  // without AD
  AVector ax(2), ay(1);
  ax[0] = 2, ax[1] = 3;
  Independent(ax);
  atomic(ax, ay);
  ADFun<double> f(ax, ay);
  auto af = f.base2ad();
  const std::string sentence = sentence_of<dyntape::ArgumentError>([&] { af.Jacobian(ax); });
  EXPECT_NE(sentence.find("product_three"), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("order"), std::string::npos) << sentence;
}

TEST(CppadAtomic, OneThatIsGoneIsSaid) {
  ADFun<double> f;
  {
    Three atomic;
    AVector ax(2), ay(1);
    ax[0] = 2, ax[1] = 3;
    Independent(ax);
    atomic(ax, ay);
    f.Dependent(ax, ay);
  }
  const std::string sentence = sentence_of<dyntape::ArgumentError>([&] { f.Forward(0, DVector{1, 2}); });
  EXPECT_NE(sentence.find("destroyed"), std::string::npos) << sentence;
}

void two_steps(const AVector& x, AVector& y) { y[0] = x[0] + 0.1 * x[1], y[1] = x[1] - 0.1 * sin(x[0]); }

TEST(CppadCheckpoint, OfAnAlgorithm) {
  AVector ax(2), ay(2);
  ax[0] = 1, ax[1] = 0;
  CppAD::checkpoint<double> step("step", two_steps, ax, ay);
  Independent(ax);
  AVector au(2), av(2);
  for (std::size_t i = 0; i < 2; ++i) au[i] = ax[i];
  for (int k = 0; k < 3; ++k) step(au, av), au[0] = av[0], au[1] = av[1];
  ADFun<double> f(ax, au);
  double p = 0.3, v = 0.7;
  for (int k = 0; k < 3; ++k) {
    const double next = p + 0.1 * v;
    v -= 0.1 * std::sin(p);
    p = next;
  }
  expect_near(f.Forward(0, DVector{0.3, 0.7}), {p, v});
}

TEST(CppadCheckpoint, OfAFunctionWithDynamicParameters) {
  AVector ax(1), ap(1), ay(1);
  ax[0] = 1, ap[0] = 2;
  Independent(ax, ap);
  ay[0] = ap[0] * ax[0] * ax[0];
  ADFun<double> f(ax, ay);
  CppAD::chkpoint_two<double> square(f, "square", true, true, true, false);
  square.new_dynamic(DVector{5});
  Independent(ax);
  square(ax, ay);
  ADFun<double> g(ax, ay);
  expect_near(g.Jacobian(DVector{3}), {30});
  CppAD::chkpoint_one<double> again("again", two_steps, AVector{1, 2}, *std::make_unique<AVector>(2));
  EXPECT_EQ(again.atomic_name(), "again");
}

TEST(CppadPrintFor, PrintsWhereTheFlagIsNotPositive) {
  AVector ax(1), ay(1);
  ax[0] = 1;
  Independent(ax);
  CppAD::PrintFor(ax[0], "x is ", ax[0] * 2, " doubled\n");
  CppAD::PrintFor("always ", ax[0] + 1);
  ay[0] = ax[0];
  ADFun<double> f(ax, ay);
  EXPECT_EQ(f.Range(), 1u);
  EXPECT_GT(f.size_text(), 0u);
  std::ostringstream positive, negative, after;
  f.Forward(0, DVector{1}, positive);
  EXPECT_EQ(positive.str(), "always 2");
  f.Forward(0, DVector{-1}, negative);
  EXPECT_EQ(negative.str(), "x is -2 doubled\nalways 0");
  f.optimize("no_print_for_op");
  f.Forward(0, DVector{-1}, after);
  EXPECT_EQ(after.str(), "");
}

}  // namespace
