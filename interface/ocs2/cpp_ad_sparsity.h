// SPDX-License-Identifier: BSD-3-Clause
//
// OCS2's tape type and its patterns of what depends on what.
//
//   ad_vector_t x = ad_vector_t::Ones(3);
//   Independent(x);
//   ad_fun_t tape(x, f(x));
//   SparsityPattern jacobian = cppad_sparsity::getJacobianSparsityPattern(tape);      // a set of columns for each row
#pragma once

#include <set>
#include <vector>

#include <dyntape/autodiff/graph/function.h>
#include <dyntape/interface/ocs2/names.h>

namespace dyntape::ocs2 {

// Begins a recording in this thread: x (n) becomes the variables, at the values that it has.  One that is open is over.
void Independent(ad_vector_t& x);

// What was recorded since Independent(x).
class ad_fun_t {
 public:
  ad_fun_t() = default;
  // Ends the recording; ArgumentError where none is open in this thread, or x is not what it began with.
  ad_fun_t(const ad_vector_t& x, const ad_vector_t& y);
  explicit ad_fun_t(Function function) : function_(std::move(function)) {}

  void optimize() {}  // it is simplified while it is recorded
  std::size_t Domain() const { return function_.n_x(); }
  std::size_t Range() const { return function_.n_y(); }
  const Function& recorded() const { return function_; }

 private:
  Function function_;
};

namespace cppad_names {
using ocs2::Independent;
template <class Base>
using ADFun = ad_fun_t;
}  // namespace cppad_names

namespace cppad_sparsity {

using SparsityPattern = std::vector<std::set<std::size_t>>;

SparsityPattern getJacobianSparsityPattern(const ad_fun_t& fun);
// Of all outputs together, both triangles.
SparsityPattern getHessianSparsityPattern(const ad_fun_t& fun);
// All of the first variableDim columns, in rangeDim rows.
SparsityPattern getJacobianVariableSparsity(int rangeDim, int variableDim);
// The upper triangle of variableDim rows, then parameterDim empty ones.
SparsityPattern getHessianVariableSparsity(int variableDim, int parameterDim);
// What both have; ArgumentError for other numbers of rows.
SparsityPattern getIntersection(const SparsityPattern& p0, const SparsityPattern& p1);
std::size_t getNumberOfNonZeros(const SparsityPattern& sparsity);
SparsityPattern fromPattern(const Pattern& pattern, bool isLowerTriangle = false);

}  // namespace cppad_sparsity
}  // namespace dyntape::ocs2
