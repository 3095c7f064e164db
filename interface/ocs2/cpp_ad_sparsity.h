// SPDX-License-Identifier: BSD-3-Clause
//
// OCS2's tape type and its sparsity patterns.
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

// Begins a recording in this thread: x (n) becomes the variables, with their present values.  Ends an open
// recording.
void Independent(ad_vector_t& x);

// The recording since Independent(x).
class ad_fun_t {
 public:
  ad_fun_t() = default;
  // Ends the recording.  ArgumentError: no recording is open in this thread, or x is not the vector that it began
  // with.
  ad_fun_t(const ad_vector_t& x, const ad_vector_t& y);
  explicit ad_fun_t(Function function) : function_(std::move(function)) {}

  void optimize() {}  // the recording is already simplified
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
// The pattern of the Hessian of all outputs together, both triangles.
SparsityPattern getHessianSparsityPattern(const ad_fun_t& fun);
// rangeDim rows, each with the first variableDim columns.
SparsityPattern getJacobianVariableSparsity(int rangeDim, int variableDim);
// The upper triangle of variableDim rows, then parameterDim empty rows.
SparsityPattern getHessianVariableSparsity(int variableDim, int parameterDim);
// The entries that both patterns have.  ArgumentError: the numbers of rows differ.
SparsityPattern getIntersection(const SparsityPattern& p0, const SparsityPattern& p1);
std::size_t getNumberOfNonZeros(const SparsityPattern& sparsity);
SparsityPattern fromPattern(const Pattern& pattern, bool isLowerTriangle = false);

}  // namespace cppad_sparsity
}  // namespace dyntape::ocs2
