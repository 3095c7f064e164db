// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/ocs2/cpp_ad_sparsity.h>

#include <algorithm>
#include <iterator>
#include <memory>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/derive/sparsity.h>
#include <dyntape/autodiff/error.h>

namespace dyntape::ocs2 {
namespace {

// One a thread: a tape of OCS2's begins in one call and ends in another.
std::unique_ptr<Recorder>& open_tape() {
  thread_local std::unique_ptr<Recorder> open;
  return open;
}

}  // namespace

void Independent(ad_vector_t& x) {
  RecordOptions options;
  for (const AD& entry : x) options.variables.push_back(entry.value());
  open_tape().reset();
  open_tape() = std::make_unique<Recorder>("tape", static_cast<std::size_t>(x.size()), 0, options);
  x = open_tape()->x();
}

ad_fun_t::ad_fun_t(const ad_vector_t& x, const ad_vector_t& y) {
  const std::unique_ptr<Recorder> open = std::move(open_tape());
  if (!open) throw ArgumentError("ad_fun_t: no recording is open in this thread; call Independent(x) before");
  const ad_vector_t& begun = open->x();
  const bool same =
      begun.size() == x.size() && std::equal(x.begin(), x.end(), begun.begin(), [](const AD& a, const AD& b) {
        return a.is_recorded() && a.id() == b.id() && a.tape() == b.tape();
      });
  if (!same) throw ArgumentError("ad_fun_t: x is not what Independent(x) began with");
  function_ = open->end(y);
}

namespace cppad_sparsity {

SparsityPattern fromPattern(const Pattern& pattern, bool isLowerTriangle) {
  SparsityPattern sets(pattern.rows);
  for (std::size_t k = 0; k < pattern.nnz(); ++k) {
    sets[pattern.row[k]].insert(pattern.col[k]);
    if (isLowerTriangle) sets[pattern.col[k]].insert(pattern.row[k]);
  }
  return sets;
}

SparsityPattern getJacobianSparsityPattern(const ad_fun_t& fun) {
  return fromPattern(jacobian_sparsity(fun.recorded()));
}

SparsityPattern getHessianSparsityPattern(const ad_fun_t& fun) {
  return fromPattern(sparse_hessian(fun.recorded()).pattern, true);
}

SparsityPattern getJacobianVariableSparsity(int rangeDim, int variableDim) {
  SparsityPattern sets(static_cast<std::size_t>(rangeDim));
  for (auto& row : sets)
    for (std::size_t j = 0; j < static_cast<std::size_t>(variableDim); ++j) row.insert(row.end(), j);
  return sets;
}

SparsityPattern getHessianVariableSparsity(int variableDim, int parameterDim) {
  const auto n = static_cast<std::size_t>(variableDim);
  SparsityPattern sets(n + static_cast<std::size_t>(parameterDim));
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i; j < n; ++j) sets[i].insert(sets[i].end(), j);
  return sets;
}

SparsityPattern getIntersection(const SparsityPattern& p0, const SparsityPattern& p1) {
  if (p0.size() != p1.size())
    throw ArgumentError("getIntersection: patterns of " + std::to_string(p0.size()) + " and " +
                        std::to_string(p1.size()) + " rows; expected as many");
  SparsityPattern both(p0.size());
  for (std::size_t i = 0; i < p0.size(); ++i)
    std::set_intersection(p0[i].begin(), p0[i].end(), p1[i].begin(), p1[i].end(),
                          std::inserter(both[i], both[i].begin()));
  return both;
}

std::size_t getNumberOfNonZeros(const SparsityPattern& sparsity) {
  std::size_t count = 0;
  for (const auto& row : sparsity) count += row.size();
  return count;
}

}  // namespace cppad_sparsity
}  // namespace dyntape::ocs2
