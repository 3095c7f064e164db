// SPDX-License-Identifier: BSD-3-Clause
//
// The sparse calls of ADFun, old and new (ad_fun.h).
//
//   sparse_rc<SizeVector> eye(n, n, n), pattern;                        eye.set(k, k, k)
//   f.for_jac_sparsity(eye, false, false, false, pattern);              // pattern of dy/dx
//   sparse_jac_work work;                                               // stores the groups of columns
//   f.sparse_jac_for(1, x, subset, pattern, "cppad", work);             // returns the number of sweeps
//   f.SparseJacobian(x);                                                // dense rows, an old call
//
// Patterns follow from the structure: both branches of a condition count.  dependency = true adds the dependencies
// of comparisons, signs and steps.  Colourings are this project's; a symmetric colouring of a Hessian uses that an
// entry is in two columns.
#pragma once

#include <set>
#include <string>
#include <vector>

#include <dyntape/interface/cppad/detail/fun.h>
#include <dyntape/interface/cppad/detail/sets.h>
#include <dyntape/interface/cppad/sparse.h>

namespace CppAD::inline dyntape_names {

struct sparse_jac_work {
  void clear() { colors = {}; }
  detail::Colors colors;
};
struct sparse_hes_work {
  void clear() { colors = {}; }
  detail::Colors colors;
};
// For the old calls.
struct sparse_jacobian_work {
  std::string color_method = "cppad";
  void clear() { *this = {}; }
  detail::Colors colors;
};
struct sparse_hessian_work {
  std::string color_method = "cppad.symmetric";
  void clear() { *this = {}; }
  detail::Colors colors;
};

namespace detail {

template <class Self, class Base>
class SparseCalls {
 public:
  using Size = std::size_t;

  // --- patterns: S = J R and S = R J; any SizeVector ---
  template <class V>
  void for_jac_sparsity(const sparse_rc<V>& R, bool transpose, bool dependency, bool internal_bool,
                        sparse_rc<V>& S) {
    const Sets r = sets_of(R, transpose);
    check_size("for_jac_sparsity: the pattern's rows", r.sets.size(), fun().domain());
    for_jac_ = r;
    for_jac_is_bool_ = internal_bool;
    to_rc(product(sets_of(fun().jacobian_pattern(dependency)), r), transpose, S);
  }
  template <class V>
  void rev_jac_sparsity(const sparse_rc<V>& R, bool transpose, bool dependency, bool /*internal_bool*/,
                        sparse_rc<V>& S) {
    const Sets r = sets_of(R, transpose);
    check_size("rev_jac_sparsity: the pattern's columns", r.cols, fun().range());
    to_rc(product(r, sets_of(fun().jacobian_pattern(dependency))), transpose, S);
  }
  // The number of stored entries of the last for_jac_sparsity or ForSparseJac, as sets or as bools; 0 frees them.
  Size size_forward_set() const { return for_jac_is_bool_ ? 0 : kept_entries(); }
  Size size_forward_bool() const { return for_jac_is_bool_ ? kept_entries() : 0; }
  void size_forward_set(Size) { for_jac_ = {}; }
  void size_forward_bool(Size) { for_jac_ = {}; }
  // The pattern of H R, with R of the last for_jac_sparsity.
  template <class BoolVector, class V>
  void rev_hes_sparsity(const BoolVector& select_range, bool transpose, bool /*internal_bool*/,
                        sparse_rc<V>& S) {
    check_size("rev_hes_sparsity: the size of select_range", select_range.size(), fun().range());
    if (for_jac_.sets.empty())
      refuse("rev_hes_sparsity: for_jac_sparsity comes first, and has not been called");
    to_rc(product(sets_of(fun().hessian_pattern(bools_of(select_range))), for_jac_), transpose, S);
  }
  template <class BoolVector, class V>
  void for_hes_sparsity(const BoolVector& select_domain, const BoolVector& select_range,
                        bool /*internal_bool*/, sparse_rc<V>& S) {
    check_size("for_hes_sparsity: the size of select_domain", select_domain.size(), fun().domain());
    check_size("for_hes_sparsity: the size of select_range", select_range.size(), fun().range());
    Sets h = sets_of(fun().hessian_pattern(bools_of(select_range)));
    keep_selected(h, bools_of(select_domain), bools_of(select_domain));
    to_rc(h, false, S);
  }
  template <class BoolVector, class V>
  void subgraph_sparsity(const BoolVector& select_domain, const BoolVector& select_range, bool transpose,
                         sparse_rc<V>& S) {
    check_size("subgraph_sparsity: the size of select_domain", select_domain.size(), fun().domain());
    check_size("subgraph_sparsity: the size of select_range", select_range.size(), fun().range());
    Sets j = sets_of(fun().kept_pattern(true));
    keep_selected(j, bools_of(select_range), bools_of(select_domain));
    to_rc(j, transpose, S);
  }
  // Bytes of the patterns that subgraph calls store for later calls; clear_subgraph() frees them.
  Size size_random() const { return static_cast<const Self&>(*this).has_function() ? fun().kept_bytes() : 0; }
  void clear_subgraph() { fun().forget_patterns(); }

  // --- the old calls: patterns as vectors of bools, row by row, or of sets ---
  template <class VectorSet>
  VectorSet ForSparseJac(Size q, const VectorSet& r, bool transpose = false, bool dependency = false) {
    const Sets of_r = sets_of(r, transpose ? q : fun().domain(), transpose ? fun().domain() : q, transpose);
    for_jac_ = of_r;
    for_jac_is_bool_ = !kIsOfSets<VectorSet>;
    return to_vector<VectorSet>(product(sets_of(fun().jacobian_pattern(dependency)), of_r), transpose);
  }
  template <class VectorSet>
  VectorSet RevSparseJac(Size q, const VectorSet& r, bool transpose = false, bool dependency = false) {
    const Sets of_r = sets_of(r, transpose ? fun().range() : q, transpose ? q : fun().range(), transpose);
    return to_vector<VectorSet>(product(of_r, sets_of(fun().jacobian_pattern(dependency))), transpose);
  }
  // s (1 x m).  Returns the transpose of H R (q x n), with R of the last ForSparseJac; if `transpose`, H R (n x q).
  template <class VectorSet>
  VectorSet RevSparseHes(Size q, const VectorSet& s, bool transpose = false) {
    const Sets of_s = sets_of(s, 1, fun().range(), false);
    if (for_jac_.cols != q)
      refuse("RevSparseHes: q is " + std::to_string(q) + ", and the last ForSparseJac had " +
             std::to_string(for_jac_.cols));
    return to_vector<VectorSet>(product(sets_of(fun().hessian_pattern(selected(of_s))), for_jac_),
                                !transpose);
  }
  // r (1 x n) selects variables, s (1 x m) selects results.
  template <class VectorSet>
  VectorSet ForSparseHes(const VectorSet& r, const VectorSet& s) {
    const Sets of_r = sets_of(r, 1, fun().domain(), false), of_s = sets_of(s, 1, fun().range(), false);
    Sets h = sets_of(fun().hessian_pattern(selected(of_s)));
    keep_selected(h, selected(of_r), selected(of_r));
    return to_vector<VectorSet>(h, false);
  }

  // --- values of the entries of a subset; return the number of sweeps ---
  template <class V, class BaseVector>
  Size sparse_jac_for(Size /*group_max*/, const BaseVector& x, sparse_rcv<V, BaseVector>& subset,
                      const sparse_rc<V>& pattern, const std::string& coloring, sparse_jac_work& work) {
    check_coloring("sparse_jac_for", coloring);
    return jacobian_entries(x, subset, pattern, true, work.colors);
  }
  template <class V, class BaseVector>
  Size sparse_jac_rev(const BaseVector& x, sparse_rcv<V, BaseVector>& subset, const sparse_rc<V>& pattern,
                      const std::string& coloring, sparse_jac_work& work) {
    check_coloring("sparse_jac_rev", coloring);
    return jacobian_entries(x, subset, pattern, false, work.colors);
  }
  template <class V, class BaseVector>
  Size sparse_hes(const BaseVector& x, const BaseVector& w, sparse_rcv<V, BaseVector>& subset,
                  const sparse_rc<V>& pattern, const std::string& coloring, sparse_hes_work& work) {
    check_coloring("sparse_hes", coloring);
    std::vector<Base> found;
    const Size sweeps =
        fun().sparse_hessian(Self::values(x), Self::values(w), entries(subset.row(), subset.col()),
                             read(pattern, work.colors), uses_symmetry(coloring), work.colors, found);
    for (Size k = 0; k < found.size(); ++k) subset.set(k, found[k]);
    return sweeps;
  }
  template <class V, class BaseVector>
  void subgraph_jac_rev(const BaseVector& x, sparse_rcv<V, BaseVector>& subset) {
    Colors colors;
    std::vector<Base> found;
    fun().sparse_jacobian(Self::values(x), entries(subset.row(), subset.col()), fun().kept_pattern(false),
                          false, colors, found);
    for (Size k = 0; k < found.size(); ++k) subset.set(k, found[k]);
  }
  template <class BoolVector, class V, class BaseVector>
  void subgraph_jac_rev(const BoolVector& select_domain, const BoolVector& select_range, const BaseVector& x,
                        sparse_rcv<V, BaseVector>& matrix_out) {
    sparse_rc<V> pattern;
    Sets j = sets_of(fun().kept_pattern(false));
    keep_selected(j, bools_of(select_range), bools_of(select_domain));
    to_rc(j, false, pattern);
    matrix_out = sparse_rcv<V, BaseVector>(pattern);
    subgraph_jac_rev(x, matrix_out);
  }
  // Selects the variables of the next calls.  The other overload, after Forward, differentiates result ell:
  // dw[j q + k] for the variables j in col.
  template <class BoolVector>
  requires(!std::is_arithmetic_v<BoolVector>) void subgraph_reverse(const BoolVector& select_domain) {
    check_size("subgraph_reverse: the size of select_domain", select_domain.size(), fun().domain());
    subgraph_domain_ = bools_of(select_domain);
  }
  template <class BaseVector, class SizeVector>
  void subgraph_reverse(Size q, Size ell, SizeVector& col, BaseVector& dw) {
    if (subgraph_domain_.empty())
      refuse("subgraph_reverse: select_domain comes first, and has not been given");
    std::vector<Size> places;
    std::vector<Base> found;
    fun().subgraph_reverse(q, ell, subgraph_domain_, places, found);
    col = SizeVector(places.size());
    for (Size k = 0; k < places.size(); ++k) col[k] = places[k];
    dw = Self::template made<BaseVector>(found);
  }

  // --- the old calls for values: dense, row by row; or entries (row, col) ---
  template <class BaseVector>
  BaseVector SparseJacobian(const BaseVector& x) {
    return Self::template made<BaseVector>(fun().jacobian(Self::values(x)));
  }
  template <class BaseVector, class VectorSet>
  BaseVector SparseJacobian(const BaseVector& x, const VectorSet& p) {
    Sets sets = sets_of(p, fun().range(), fun().domain(), false);
    std::vector<Base> J = fun().jacobian(Self::values(x));
    keep_entries(J, sets);
    return Self::template made<BaseVector>(J);
  }
  template <class BaseVector, class VectorSet, class SizeVector>
  Size SparseJacobianForward(const BaseVector& x, const VectorSet& p, const SizeVector& row,
                             const SizeVector& col, BaseVector& jac, sparse_jacobian_work& work) {
    return old_jacobian(x, p, row, col, jac, true, work);
  }
  template <class BaseVector, class VectorSet, class SizeVector>
  Size SparseJacobianReverse(const BaseVector& x, const VectorSet& p, const SizeVector& row,
                             const SizeVector& col, BaseVector& jac, sparse_jacobian_work& work) {
    return old_jacobian(x, p, row, col, jac, false, work);
  }
  template <class BaseVector>
  BaseVector SparseHessian(const BaseVector& x, const BaseVector& w) {
    return Self::template made<BaseVector>(fun().hessian(Self::values(x), Self::values(w)));
  }
  template <class BaseVector, class VectorSet>
  BaseVector SparseHessian(const BaseVector& x, const BaseVector& w, const VectorSet& p) {
    Sets sets = sets_of(p, fun().domain(), fun().domain(), false);
    std::vector<Base> H = fun().hessian(Self::values(x), Self::values(w));
    keep_entries(H, sets);
    return Self::template made<BaseVector>(H);
  }
  template <class BaseVector, class VectorSet, class SizeVector>
  Size SparseHessian(const BaseVector& x, const BaseVector& w, const VectorSet& p, const SizeVector& row,
                     const SizeVector& col, BaseVector& hes, sparse_hessian_work& work) {
    std::vector<Base> found;
    const Size sweeps = fun().sparse_hessian(Self::values(x), Self::values(w), entries(row, col),
                                             read(p, fun().domain(), fun().domain(), work.colors),
                                             uses_symmetry(work.color_method), work.colors, found);
    hes = Self::template made<BaseVector>(found);
    return sweeps;
  }

 private:
  Fun<Base>& fun() const { return static_cast<const Self&>(*this).core(); }

  template <class V, class BaseVector>
  Size jacobian_entries(const BaseVector& x, sparse_rcv<V, BaseVector>& subset, const sparse_rc<V>& pattern,
                        bool forward, Colors& colors) {
    std::vector<Base> found;
    const Size sweeps = fun().sparse_jacobian(Self::values(x), entries(subset.row(), subset.col()),
                                              read(pattern, colors), forward, colors, found);
    for (Size k = 0; k < found.size(); ++k) subset.set(k, found[k]);
    return sweeps;
  }
  template <class BaseVector, class VectorSet, class SizeVector>
  Size old_jacobian(const BaseVector& x, const VectorSet& p, const SizeVector& row, const SizeVector& col,
                    BaseVector& jac, bool forward, sparse_jacobian_work& work) {
    std::vector<Base> found;
    const Size sweeps = fun().sparse_jacobian(Self::values(x), entries(row, col),
                                              read(p, fun().range(), fun().domain(), work.colors), forward,
                                              work.colors, found);
    jac = Self::template made<BaseVector>(found);
    return sweeps;
  }
  // The pattern of a call; empty if the groups of columns are known.
  template <class V>
  Pattern read(const sparse_rc<V>& pattern, const Colors& colors) const {
    return colors.empty() ? pattern_of(sets_of(pattern, false)) : Pattern();
  }
  template <class VectorSet>
  Pattern read(const VectorSet& p, Size rows, Size cols, const Colors& colors) const {
    return colors.empty() ? pattern_of(sets_of(p, rows, cols, false)) : Pattern();
  }
  template <class V>
  Entries entries(const V& row, const V& col) const {
    return {sizes_of(row), sizes_of(col)};
  }
  void keep_entries(std::vector<Base>& dense, const Sets& sets) const {
    for (Size i = 0; i < sets.sets.size(); ++i) {
      auto next = sets.sets[i].begin();
      for (Size j = 0; j < sets.cols; ++j) {
        if (next != sets.sets[i].end() && *next == j) {
          ++next;
        } else {
          dense[i * sets.cols + j] = Base(0);
        }
      }
    }
  }

  Size kept_entries() const {
    Size entries = 0;
    for (const auto& row : for_jac_.sets) entries += row.size();
    return entries;
  }

  Sets for_jac_;
  bool for_jac_is_bool_ = false;
  std::vector<bool> subgraph_domain_;
};

}  // namespace detail

}  // namespace CppAD::inline dyntape_names
