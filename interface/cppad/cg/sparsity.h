// SPDX-License-Identifier: BSD-3-Clause
//
// CppADCodeGen's functions of sparsity patterns and of sparse derivatives.
//
//   auto sets = jacobianSparsitySet<std::vector<std::set<size_t>>, double>(f);      // one set for each row
//   auto bools = hessianSparsity<std::vector<bool>, double>(f);                     // of the sum of the results, row by row
//   generateSparsityIndexes(sets, rows, cols);
//   SparseForjacHessianWork work;      // of one function and its patterns
//   sparseForJacHessian(f, x, w, y, sets, jrow, jcol, jac, hes_sets, hrow, hcol, hes, work);
#pragma once

#include <set>
#include <string>
#include <vector>

#include <dyntape/interface/cppad/ad_fun.h>

namespace CppAD::inline dyntape_names::cg {

template <class Vector, class Base>
Vector jacobianSparsity(const ADFun<Base>& f) {
  return detail::to_vector<Vector>(detail::sets_of(f.core().jacobian_pattern(false)), false);
}
template <class Vector, class Base>
Vector hessianSparsity(const ADFun<Base>& f, const std::set<std::size_t>& of_range) {
  std::vector<bool> chosen(f.Range(), false);
  for (std::size_t i : of_range) {
    detail::check_index("hessianSparsity: result", i, f.Range());
    chosen[i] = true;
  }
  return detail::to_vector<Vector>(detail::sets_of(f.core().hessian_pattern(chosen)), false);
}
// Patterns of Hessians are symmetric: `transpose` changes nothing.
template <class Vector, class Base>
Vector hessianSparsity(const ADFun<Base>& f, bool /*transpose*/ = false) {
  return detail::to_vector<Vector>(
      detail::sets_of(f.core().hessian_pattern(std::vector<bool>(f.Range(), true))), false);
}
template <class Vector, class Base>
Vector hessianSparsity(const ADFun<Base>& f, std::size_t i, bool /*transpose*/ = false) {
  return hessianSparsity<Vector, Base>(f, std::set<std::size_t>{i});
}

#define DYNTAPE_SAME_PATTERN(name, as)                   \
  template <class Vector, class Base, class... Which>    \
  Vector name(const ADFun<Base>& f, const Which&... w) { \
    return as<Vector, Base>(f, w...);                    \
  }
DYNTAPE_SAME_PATTERN(jacobianForwardSparsity, jacobianSparsity)
DYNTAPE_SAME_PATTERN(jacobianReverseSparsity, jacobianSparsity)
DYNTAPE_SAME_PATTERN(jacobianSparsitySet, jacobianSparsity)
DYNTAPE_SAME_PATTERN(jacobianForwardSparsitySet, jacobianSparsity)
DYNTAPE_SAME_PATTERN(jacobianReverseSparsitySet, jacobianSparsity)
DYNTAPE_SAME_PATTERN(hessianSparsitySet, hessianSparsity)
#undef DYNTAPE_SAME_PATTERN

// --- entries as rows and columns ---
template <class VectorSet, class SizeVector>
void generateSparsityIndexes(const VectorSet& pattern, SizeVector& row, SizeVector& col) {
  std::size_t nnz = 0, k = 0;
  for (std::size_t i = 0; i < std::size_t(pattern.size()); ++i) nnz += pattern[i].size();
  row.resize(nnz), col.resize(nnz);
  for (std::size_t i = 0; i < std::size_t(pattern.size()); ++i) {
    for (std::size_t j : pattern[i]) row[k] = i, col[k++] = j;
  }
}
template <class VectorBool, class SizeVector>
void generateSparsityIndexes(const VectorBool& pattern, std::size_t m, std::size_t n, SizeVector& row,
                             SizeVector& col) {
  const detail::Sets sets = detail::sets_of(pattern, m, n, false);
  generateSparsityIndexes(sets.sets, row, col);
}
template <class SizeVector, class VectorSet>
void generateSparsitySet(const SizeVector& row, const SizeVector& col, VectorSet& pattern) {
  for (std::size_t k = 0; k < std::size_t(row.size()); ++k) pattern[row[k]].insert(col[k]);
}
template <class SizeVector, class VectorSet>
sparse_rc<SizeVector> toSparsityPattern(const VectorSet& pattern, std::size_t m, std::size_t n) {
  sparse_rc<SizeVector> entries;
  detail::to_rc(detail::sets_of(pattern, m, n, false), false, entries);
  return entries;
}

// --- products and sums: what is in `result` already stays ---
template <class VectorSet, class Result>
void addMatrixSparsity(const VectorSet& a, std::size_t rows, Result& result) {
  for (std::size_t i = 0; i < rows; ++i) result[i].insert(a[i].begin(), a[i].end());
}
template <class VectorSet, class Result>
void addMatrixSparsity(const VectorSet& a, Result& result) {
  addMatrixSparsity(a, std::size_t(a.size()), result);
}
template <class VectorSet, class Result>
void addTransMatrixSparsity(const VectorSet& a, std::size_t rows, Result& result) {
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t j : a[i]) result[j].insert(i);
  }
}
template <class VectorSet, class Result>
void addTransMatrixSparsity(const VectorSet& a, Result& result) {
  addTransMatrixSparsity(a, std::size_t(a.size()), result);
}
template <class VectorSet>
VectorSet transposePattern(const VectorSet& a, std::size_t rows, std::size_t cols) {
  VectorSet transposed(cols);
  addTransMatrixSparsity(a, rows, transposed);
  return transposed;
}
// result (m x q) += a (m x n) b (n x q)
template <class A, class B, class Result>
void multMatrixMatrixSparsity(const A& a, const B& b, Result& result, std::size_t m, std::size_t /*n*/,
                              std::size_t /*q*/) {
  for (std::size_t i = 0; i < m; ++i) {
    for (std::size_t k : a[i]) result[i].insert(b[k].begin(), b[k].end());
  }
}
template <class A, class B, class Result>
void multMatrixMatrixSparsity(const A& a, const B& b, Result& result, std::size_t q) {
  multMatrixMatrixSparsity(a, b, result, std::size_t(a.size()), std::size_t(b.size()), q);
}
// result (n x q) += aᵀ b with a (m x n), b (m x q)
template <class A, class B, class Result>
void multMatrixTransMatrixSparsity(const A& a, const B& b, Result& result, std::size_t m, std::size_t /*n*/,
                                   std::size_t /*q*/) {
  for (std::size_t k = 0; k < m; ++k) {
    for (std::size_t i : a[k]) result[i].insert(b[k].begin(), b[k].end());
  }
}
// The transpose of a b, result (n x q) += (a b)ᵀ, of the transpose of a (m x q) and b (m x n).
template <class A, class B, class Result>
void multMatrixMatrixSparsityTrans(const A& a_transposed, const B& b, Result& result, std::size_t m,
                                   std::size_t n, std::size_t q) {
  multMatrixTransMatrixSparsity(b, a_transposed, result, m, n, q);
}

// --- value, Jacobian and Hessian at the entries (row, col); returns the number of sweeps ---
struct SparseForjacHessianWork {
  sparse_jacobian_work jac;
  sparse_hessian_work hes;
  void clear() { *this = {}; }
};
// Of several weights at once: w and hes are vectors of vectors.
template <class Base, class Vector, class Weights, class VectorSet, class SizeVector>
std::size_t sparseForJacHessian(ADFun<Base>& f, const Vector& x, const Weights& w, Vector& y,
                                const VectorSet& jac_pattern, const SizeVector& jac_row,
                                const SizeVector& jac_col, Vector& jac, const VectorSet& hes_pattern,
                                const SizeVector& hes_row, const SizeVector& hes_col, Weights& hes,
                                SparseForjacHessianWork& work) {
  std::size_t sweeps = f.SparseJacobianForward(x, jac_pattern, jac_row, jac_col, jac, work.jac);
  for (std::size_t k = 0; k < std::size_t(w.size()); ++k)
    sweeps += f.SparseHessian(x, w[k], hes_pattern, hes_row, hes_col, hes[k], work.hes);
  y = f.Forward(0, x);
  return sweeps;
}
template <class Base, class Vector, class VectorSet, class SizeVector>
std::size_t sparseForJacHessian(ADFun<Base>& f, const Vector& x, const Vector& w, Vector& y,
                                const VectorSet& jac_pattern, const SizeVector& jac_row,
                                const SizeVector& jac_col, Vector& jac, const VectorSet& hes_pattern,
                                const SizeVector& hes_row, const SizeVector& hes_col, Vector& hes,
                                SparseForjacHessianWork& work) {
  const std::vector<Vector> weights{w};
  std::vector<Vector> hessians{hes};
  const std::size_t sweeps = sparseForJacHessian(f, x, weights, y, jac_pattern, jac_row, jac_col, jac,
                                                 hes_pattern, hes_row, hes_col, hessians, work);
  hes = hessians[0];
  return sweeps;
}

// --- printing ---
template <class Vector>
void print(const Vector& v) {
  std::cout << "[";
  for (std::size_t i = 0; i < std::size_t(v.size()); ++i) std::cout << (i ? ", " : "") << v[i];
  std::cout << "]";
  std::cout.flush();
}
template <class Type>
void print(const std::vector<std::vector<Type>>& rows) {
  for (const auto& row : rows) print(row), std::cout << "\n";
}
template <class SizeVector, class Vector>
void printTripletMatrix(const SizeVector& row, const SizeVector& col, const Vector& values) {
  for (std::size_t k = 0; k < std::size_t(row.size()); ++k)
    std::cout << "(" << row[k] << ", " << col[k] << "): " << values[k] << "\n";
}
template <class SizeVector>
void printSparsityPattern(const SizeVector& row, const SizeVector& col, const std::string& name,
                          std::size_t m) {
  std::vector<std::set<std::size_t>> sets(m);
  generateSparsitySet(row, col, sets);
  std::cout << name << " sparsity:\n";
  for (std::size_t i = 0; i < m; ++i) {
    std::cout << " " << i << ":";
    for (std::size_t j : sets[i]) std::cout << " " << j;
    std::cout << "\n";
  }
}
template <class Pattern>
void printSparsityPattern(const Pattern& pattern, const std::string& name, std::size_t m, std::size_t n) {
  std::vector<std::size_t> row, col;
  generateSparsityIndexes(detail::sets_of(pattern, m, n, false).sets, row, col);
  printSparsityPattern(row, col, name, m);
}

}  // namespace CppAD::inline dyntape_names::cg
