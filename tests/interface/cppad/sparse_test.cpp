// SPDX-License-Identifier: BSD-3-Clause
// Patterns and sparse derivatives, of both generations, and subgraphs.
#include <random>
#include <utility>

#include <set>

#include "programs.h"

namespace {

using Sizes = CPPAD_TESTVECTOR(std::size_t);
using Bools = CPPAD_TESTVECTOR(bool);
using Rc = CppAD::sparse_rc<Sizes>;
using Rcv = CppAD::sparse_rcv<Sizes, DVector>;
using VectorOfSets = CPPAD_TESTVECTOR(std::set<std::size_t>);

const DVector kAt{2, 3, 5};

ADFun<double> example() {  // J: (0, 0), (0, 1), (1, 2), (2, 0)
  return recorded({1, 1, 1}, [](const AVector& x) -> std::vector<ADouble> {
    return {x[0] * x[1], x[2] * x[2], 2 * x[0]};
  });
}
const std::vector<double> kJacobian = {3, 2, 0, 0, 0, 10, 2, 0, 0};

Rc identity(std::size_t n) {
  Rc eye(n, n, n);
  for (std::size_t k = 0; k < n; ++k) eye.set(k, k, k);
  return eye;
}
Rc entries(std::size_t nr, std::size_t nc, const std::vector<std::pair<std::size_t, std::size_t>>& at) {
  Rc rc(nr, nc, at.size());
  for (std::size_t k = 0; k < at.size(); ++k) rc.set(k, at[k].first, at[k].second);
  return rc;
}
const Rc kPattern = entries(3, 3, {{0, 0}, {0, 1}, {1, 2}, {2, 0}});
Bools all(std::size_t n) {
  Bools v(n);
  for (bool& b : v) b = true;
  return v;
}

TEST(CppadSparse, RcHoldsEntries) {
  Rc rc(2, 3, 2);
  rc.set(0, 1, 2), rc.set(1, 0, 0);
  rc.push_back(0, 2);
  EXPECT_EQ(rc.nnz(), 3u);
  EXPECT_EQ(rc.nr(), 2u);
  EXPECT_EQ(rc.nc(), 3u);
  const Sizes by_row = rc.row_major(), by_col = rc.col_major();
  EXPECT_EQ(by_row[0], 1u);
  EXPECT_EQ(by_row[1], 2u);
  EXPECT_EQ(by_row[2], 0u);
  EXPECT_EQ(by_col[0], 1u);
  EXPECT_TRUE(rc == entries(2, 3, {{0, 0}, {0, 2}, {1, 2}}));
  EXPECT_FALSE(rc == entries(2, 3, {{0, 0}, {0, 1}, {1, 2}}));
  Rc other;
  other.swap(rc);
  EXPECT_EQ(rc.nnz(), 0u);
}

TEST(CppadSparse, RcvHoldsValues) {
  Rcv matrix(kPattern);
  matrix.set(0, 5.0);
  matrix.set(1, 0, 1, 6.0);
  EXPECT_EQ(matrix.val()[0], 5);
  EXPECT_EQ(matrix.val()[1], 6);
  EXPECT_EQ(matrix.nnz(), 4u);
  EXPECT_TRUE(matrix.pat() == kPattern);
}

TEST(CppadSparse, ForwardAndReversePatterns) {
  ADFun<double> f = example();
  Rc pattern;
  f.for_jac_sparsity(identity(3), false, false, false, pattern);
  EXPECT_TRUE(pattern == kPattern);
  f.rev_jac_sparsity(identity(3), false, false, true, pattern);
  EXPECT_TRUE(pattern == kPattern);
  f.for_jac_sparsity(identity(3), true, false, false, pattern);
  EXPECT_TRUE(pattern == entries(3, 3, {{0, 0}, {1, 0}, {2, 1}, {0, 2}}));
  f.for_jac_sparsity(entries(3, 1, {{1, 0}}), false, false, false, pattern);
  EXPECT_TRUE(pattern == entries(3, 1, {{0, 0}}));
}

TEST(CppadSparse, DependencyGoesThroughComparisons) {
  ADFun<double> f = recorded({1, 1}, [](const AVector& x) -> std::vector<ADouble> {
    return {CondExpLt(x[0], ADouble(1), x[1], ADouble(2)), sign(x[0])};
  });
  Rc pattern;
  f.for_jac_sparsity(identity(2), false, false, false, pattern);
  EXPECT_TRUE(pattern == entries(2, 2, {{0, 1}}));
  f.for_jac_sparsity(identity(2), false, true, false, pattern);
  EXPECT_TRUE(pattern == entries(2, 2, {{0, 0}, {0, 1}, {1, 0}}));
}

TEST(CppadSparse, HessianPatterns) {
  ADFun<double> f = example();
  Rc pattern;
  Bools range = all(3);
  range[1] = false;
  f.for_hes_sparsity(all(3), range, false, pattern);
  EXPECT_TRUE(pattern == entries(3, 3, {{0, 1}, {1, 0}}));
  Rc ignored;
  f.for_jac_sparsity(identity(3), false, false, false, ignored);
  f.rev_hes_sparsity(all(3), false, false, pattern);
  EXPECT_TRUE(pattern == entries(3, 3, {{0, 1}, {1, 0}, {2, 2}}));
  Bools domain = all(3);
  domain[2] = false;
  f.for_hes_sparsity(domain, all(3), true, pattern);
  EXPECT_TRUE(pattern == entries(3, 3, {{0, 1}, {1, 0}}));
}

TEST(CppadSparse, JacobianEntriesInBothModes) {
  ADFun<double> f = example();
  Rcv subset(entries(3, 3, {{2, 0}, {0, 1}, {1, 2}}));
  CppAD::sparse_jac_work work;
  EXPECT_EQ(f.sparse_jac_for(10, kAt, subset, kPattern, "cppad", work), 2u)
      << "columns 0 and 2 share a sweep";
  expect_near(subset.val(), {2, 2, 10});
  Rcv again(subset.pat());
  EXPECT_EQ(f.sparse_jac_for(1, kAt, again, kPattern, "cppad", work), 2u);
  expect_near(again.val(), {2, 2, 10});
  work.clear();
  Rcv reverse(subset.pat());
  EXPECT_EQ(f.sparse_jac_rev(kAt, reverse, kPattern, "cppad", work), 2u);
  expect_near(reverse.val(), {2, 2, 10});
}

TEST(CppadSparse, HessianEntriesByEveryColouring) {
  ADFun<double> f = example();
  for (const char* coloring : {"cppad.symmetric", "cppad.general", "colpack.symmetric"}) {
    CppAD::sparse_hes_work work;
    Rcv subset(entries(3, 3, {{1, 0}, {0, 1}, {2, 2}}));
    EXPECT_EQ(
        f.sparse_hes(kAt, DVector{10, 1, 1}, subset, entries(3, 3, {{0, 1}, {1, 0}, {2, 2}}), coloring, work),
        1u);
    expect_near(subset.val(), {10, 10, 2});
  }
}

// x0 (x1 + ... ) + sum of x_j^3: one row and column and the diagonal.
ADFun<double> arrow(std::size_t n) {
  return recorded(std::vector<double>(n, 0.5), [](const AVector& x) -> std::vector<ADouble> {
    ADouble sum = x[0] * x[0] * x[0], others = 0;
    for (std::size_t j = 1; j < x.size(); ++j) sum += x[j] * x[j] * x[j], others += x[j];
    return {sum + x[0] * others};
  });
}

TEST(CppadSparse, SymmetryHalvesNoRowButSavesSweeps) {
  const std::size_t n = 70;  // more than the bits of a word
  ADFun<double> f = arrow(n);
  Rc pattern;
  f.for_hes_sparsity(all(n), all(1), false, pattern);
  EXPECT_EQ(pattern.nnz(), n + 2 * (n - 1));
  DVector x(n);
  for (std::size_t j = 0; j < n; ++j) x[j] = double(j) / 3;
  for (const auto& [coloring, sweeps] :
       {std::pair("cppad.symmetric", std::size_t(2)), {"cppad.general", n}}) {
    CppAD::sparse_hes_work work;
    Rcv subset(pattern);
    EXPECT_EQ(f.sparse_hes(x, DVector{1}, subset, pattern, coloring, work), sweeps) << coloring;
    for (std::size_t k = 0; k < subset.nnz(); ++k)
      EXPECT_DOUBLE_EQ(subset.val()[k], subset.row()[k] == subset.col()[k] ? 6 * x[subset.row()[k]] : 1);
  }
}

// Sums of products of pairs drawn at random, against the coefficients that were drawn; the entries that are asked for as well.
TEST(CppadSparse, RandomHessiansByEveryColouring) {
  std::mt19937 random(7);
  for (int trial = 0; trial < 40; ++trial) {
    const std::size_t n = 2 + random() % 12;
    std::vector<std::vector<double>> H(n, std::vector<double>(n, 0.0));
    for (std::size_t draw = 0; draw < 2 * n; ++draw) {
      const std::size_t i = random() % n, j = random() % n;
      H[i][j] = H[j][i] = double(1 + random() % 9);
    }
    ADFun<double> f = recorded(std::vector<double>(n, 0.5), [&](const AVector& x) -> std::vector<ADouble> {
      ADouble y = 0;
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j <= i; ++j) y += H[i][j] * (i == j ? 0.5 : 1) * x[i] * x[j];
      }
      return {y};
    });
    std::vector<std::pair<std::size_t, std::size_t>> full, asked;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        if (H[i][j] != 0) full.emplace_back(i, j);
        if (random() % 3 == 0) asked.emplace_back(i, j);
      }
    }
    const auto rc = [n](const auto& places) {
      Rc made(n, n, places.size());
      for (std::size_t k = 0; k < places.size(); ++k) made.set(k, places[k].first, places[k].second);
      return made;
    };
    Rc pattern;
    f.for_hes_sparsity(all(n), all(1), false, pattern);
    EXPECT_TRUE(pattern == rc(full));
    for (const char* coloring : {"cppad.symmetric", "cppad.general"}) {
      CppAD::sparse_hes_work work;
      Rcv subset(rc(asked));
      DVector x(n);
      for (double& v : x) v = 0.25;
      f.sparse_hes(x, DVector{1}, subset, pattern, coloring, work);
      for (std::size_t k = 0; k < asked.size(); ++k)
        EXPECT_DOUBLE_EQ(subset.val()[k], H[asked[k].first][asked[k].second]) << coloring;
    }
  }
}

TEST(CppadSparse, CopiesKeepTheForwardPattern) {
  ADFun<double> f = example(), copy, swapped;
  f.ForSparseJac(3, VectorOfSets{{0}, {1}, {2}});
  copy = f;
  EXPECT_EQ(copy.size_forward_set(), f.size_forward_set());
  EXPECT_GT(copy.size_forward_set(), 0u);
  swapped.swap(copy);
  EXPECT_EQ(copy.size_forward_set(), 0u);
  EXPECT_GT(swapped.size_forward_set(), 0u);
  CppAD::sparse_hessian_work work;
  work.color_method = "cppad.general";
  work.clear();
  EXPECT_EQ(work.color_method, "cppad.symmetric");
}

TEST(CppadSparse, OldPatternsOfBoolsAndSets) {
  ADFun<double> f = example();
  Bools eye(9);
  VectorOfSets sets(3);
  for (std::size_t k = 0; k < 9; ++k) eye[k] = k % 4 == 0;
  for (std::size_t k = 0; k < 3; ++k) sets[k].insert(k);
  const Bools forward = f.ForSparseJac(3, eye), reverse = f.RevSparseJac(3, eye);
  const VectorOfSets of_sets = f.ForSparseJac(3, sets);
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_EQ(forward[i * 3 + j], kJacobian[i * 3 + j] != 0);
      EXPECT_EQ(reverse[i * 3 + j], kJacobian[i * 3 + j] != 0);
      EXPECT_EQ(of_sets[i].count(j) == 1, kJacobian[i * 3 + j] != 0);
    }
  }
}

TEST(CppadSparse, OldHessianPatterns) {
  ADFun<double> f = example();
  VectorOfSets eye(3), s(1), r(1);
  for (std::size_t k = 0; k < 3; ++k) eye[k].insert(k), r[0].insert(k);
  s[0].insert(0);
  f.ForSparseJac(3, eye);
  for (const VectorOfSets& h : {f.RevSparseHes(3, s), f.ForSparseHes(r, s)}) {
    EXPECT_EQ(h[0], std::set<std::size_t>{1});
    EXPECT_EQ(h[1], std::set<std::size_t>{0});
    EXPECT_TRUE(h[2].empty());
  }
}

// H of x0 x1 + x0 x2^2: the result is R^T H, q x n, and H R, n x q, if transposed, of R (n x q) or its transpose.
TEST(CppadSparse, OldHessianPatternsOfFewerColumns) {
  ADFun<double> f = recorded(
      {1, 1, 1}, [](const AVector& x) -> std::vector<ADouble> { return {x[0] * x[1] + x[0] * x[2] * x[2]}; });
  const Bools s{true}, r{false, true, true, false, false, false},  // R: (0, 1), (1, 0)
      r_transposed{false, true, false, true, false, false};
  f.ForSparseJac(2, r);
  const Bools of_rows = f.RevSparseHes(2, s);
  f.ForSparseJac(2, r_transposed, true);
  const Bools of_columns = f.RevSparseHes(2, s, true);
  const bool expected[2][3] = {{true, false, false}, {false, true, true}};  // rows 1 and 0 of H
  ASSERT_EQ(of_rows.size(), 6u);
  ASSERT_EQ(of_columns.size(), 6u);
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_EQ(of_rows[i * 3 + j], expected[i][j]) << i << ", " << j;
      EXPECT_EQ(of_columns[j * 2 + i], expected[i][j]) << i << ", " << j;
    }
  }
  VectorOfSets of_s(1), of_r(3);
  of_s[0] = {0}, of_r[0] = {1}, of_r[1] = {0};
  f.ForSparseJac(2, of_r);
  const VectorOfSets sets = f.RevSparseHes(2, of_s);
  ASSERT_EQ(sets.size(), 2u);
  EXPECT_EQ(sets[0], (std::set<std::size_t>{0}));
  EXPECT_EQ(sets[1], (std::set<std::size_t>{1, 2}));
}

// The first call fills the work; the others need no pattern.
TEST(CppadSparse, FilledWorkStandsForThePattern) {
  ADFun<double> f = example();
  VectorOfSets p(3), h(3);
  p[0] = {0, 1}, p[1] = {2}, p[2] = {0};
  h[0] = {1}, h[1] = {0}, h[2] = {2};
  DVector values(2);
  CppAD::sparse_jacobian_work forward, reverse;
  const Sizes row{0, 1}, col{1, 2};
  f.SparseJacobianForward(DVector{1, 1, 1}, p, row, col, values, forward);
  f.SparseJacobianReverse(DVector{1, 1, 1}, p, row, col, values, reverse);
  f.SparseJacobianForward(kAt, VectorOfSets(), row, col, values, forward);
  expect_near(values, {2, 10});
  f.SparseJacobianReverse(kAt, Bools(), row, col, values, reverse);
  expect_near(values, {2, 10});
  CppAD::sparse_hessian_work hessian;
  const DVector w{10, 1, 1};
  f.SparseHessian(kAt, DVector{1, 1, 1}, h, Sizes{0, 2}, Sizes{1, 2}, values, hessian);
  f.SparseHessian(kAt, w, VectorOfSets(), Sizes{0, 2}, Sizes{1, 2}, values, hessian);
  expect_near(values, {10, 2});
  EXPECT_NE(sentence_of<dyntape::ArgumentError>([&] {
              f.SparseJacobianForward(kAt, p, Sizes{0}, Sizes{1}, values, forward);
            }).find("work"),
            std::string::npos);
}

TEST(CppadSparse, OldValues) {
  ADFun<double> f = example();
  expect_near(f.SparseJacobian(kAt), kJacobian);
  VectorOfSets p(3), h(3);
  p[0] = {0, 1}, p[1] = {2}, p[2] = {0};
  h[0] = {1}, h[1] = {0}, h[2] = {2};
  expect_near(f.SparseJacobian(kAt, p), kJacobian);
  const Sizes row{0, 1}, col{1, 2};
  DVector values(2);
  CppAD::sparse_jacobian_work work;
  EXPECT_EQ(f.SparseJacobianForward(kAt, p, row, col, values, work), 1u);
  expect_near(values, {2, 10});
  work.clear();
  f.SparseJacobianReverse(kAt, p, row, col, values, work);
  expect_near(values, {2, 10});
  const DVector w{10, 1, 1};
  expect_near(f.SparseHessian(kAt, w), {0, 10, 0, 10, 0, 0, 0, 0, 2});
  expect_near(f.SparseHessian(kAt, w, h), {0, 10, 0, 10, 0, 0, 0, 0, 2});
  CppAD::sparse_hessian_work hessian_work;
  hessian_work.color_method = "cppad.general";
  f.SparseHessian(kAt, w, h, Sizes{0, 2}, Sizes{1, 2}, values, hessian_work);
  expect_near(values, {10, 2});
}

TEST(CppadSubgraph, PatternsRowsAndJacobians) {
  ADFun<double> f = example();
  Rc pattern;
  Bools range = all(3);
  range[0] = false;
  f.subgraph_sparsity(all(3), range, false, pattern);
  EXPECT_TRUE(pattern == entries(3, 3, {{1, 2}, {2, 0}}));
  f.subgraph_reverse(all(3));
  f.Forward(0, kAt);
  Sizes col;
  DVector dw;
  f.subgraph_reverse(1, 0, col, dw);
  ASSERT_EQ(col.size(), 2u);
  EXPECT_EQ(dw[col[0]], 3);
  EXPECT_EQ(dw[col[1]], 2);
  Rcv subset(kPattern), selected;
  f.subgraph_jac_rev(kAt, subset);
  expect_near(subset.val(), {3, 2, 10, 2});
  f.subgraph_jac_rev(all(3), range, kAt, selected);
  expect_near(selected.val(), {10, 2});
  EXPECT_GT(f.size_random(), 0u);  // the pattern
  f.clear_subgraph();
  EXPECT_EQ(f.size_random(), 0u);
}

// A subset that asks for what is zero by structure, beyond the last column that is not.
TEST(CppadSubgraph, StructuralZerosInTheSubset) {
  ADFun<double> f =
      recorded({1, 1, 1}, [](const AVector& x) -> std::vector<ADouble> { return {x[0] * x[0]}; });
  Rcv subset(entries(1, 3, {{0, 0}, {0, 1}, {0, 2}}));
  f.subgraph_jac_rev(DVector{3, 1, 1}, subset);
  expect_near(subset.val(), {6, 0, 0});
}

TEST(CppadSparse, OnLargeTapesColumnsShareSweeps) {
  const std::size_t n = 200;
  ADFun<double> f = recorded(std::vector<double>(n, 0.5), [](const AVector& x) {
    std::vector<ADouble> y;
    for (std::size_t i = 0; i + 1 < x.size(); ++i) y.push_back(x[i] * sin(x[i + 1]));
    return y;
  });
  Rc pattern;
  f.for_jac_sparsity(identity(n), false, false, false, pattern);
  EXPECT_EQ(pattern.nnz(), 2 * (n - 1));
  Rcv subset(pattern);
  CppAD::sparse_jac_work work;
  DVector x(n);
  for (double& v : x) v = 0.5;
  EXPECT_EQ(f.sparse_jac_for(1, x, subset, pattern, "cppad", work), 2u);
  for (std::size_t k = 0; k < subset.nnz(); ++k)
    EXPECT_NEAR(subset.val()[k], subset.row()[k] == subset.col()[k] ? std::sin(0.5) : 0.5 * std::cos(0.5),
                1e-14);
}

// By sweeps at first, and by the derived graph where they are asked for often: the same, at every point and parameter, with branches that are
// not taken, and where a slope is infinite.
TEST(CppadSparseHessian, OftenAskedForIsTheSame) {
  const std::size_t n = 12;
  std::vector<ADouble> x(n), p{0.5}, y(2);
  for (std::size_t j = 0; j < n; ++j) x[j] = 0.3 + 0.1 * double(j);
  Independent(x, 0, true, p);
  y[0] = 0, y[1] = 0;
  for (std::size_t j = 0; j < n; ++j) {
    const ADouble next = x[(j + 1) % n];
    y[0] += sin(x[j] * next) * p[0] + CondExpGt(x[j], ADouble(0), sqrt(x[j] + next * next), next);
    y[1] += exp(p[0] * next) / (1.0 + x[j] * x[j]);
  }
  ADFun<double> f(x, y);
  const auto at = [&](std::size_t k) {
    std::vector<double> point(n);
    for (std::size_t j = 0; j < n; ++j) point[j] = std::sin(double(7 * k + 3 * j));
    return point;
  };
  for (std::size_t k = 0; k < 40; ++k) {
    ADFun<double> fresh;
    fresh = f;
    const std::vector<double> w{1.0 - 0.1 * double(k), k % 3 == 0 ? 0.0 : 2.0},
        parameter{0.2 + 0.01 * double(k)};
    f.new_dynamic(parameter), fresh.new_dynamic(parameter);
    const std::vector<double> got = f.Hessian(at(k), w), expected = fresh.Hessian(at(k), w);
    for (std::size_t i = 0; i < n * n; ++i)
      EXPECT_NEAR(got[i], expected[i], 1e-12 * (1 + std::abs(expected[i])));
    f.Forward(0, at(k));  // what was asked before leaves nothing
    EXPECT_EQ(f.size_order(), 1u);
  }
  // sqrt(x0) at 0: sweeps decide what is infinite and what is not.
  auto pole =
      recorded({0, 1}, [](const AVector& v) { return std::vector<ADouble>{sqrt(v[0]) + v[1] * v[1]}; });
  const std::vector<double> first = pole.Hessian(std::vector<double>{0, 1}, std::size_t(0));
  for (int k = 0; k < 100; ++k) {
    const std::vector<double> again = pole.Hessian(std::vector<double>{0, 1}, std::size_t(0));
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_TRUE(again[i] == first[i] || (std::isnan(again[i]) && std::isnan(first[i])));
  }
  EXPECT_EQ(first[3], 2);
}

}  // namespace
