// SPDX-License-Identifier: BSD-3-Clause
//
// Atomic functions of CppAD's second generation, with patterns as vectors of sets or of bools.  Later generations
// are in atomic.h.
//
//   class Square : public atomic_base<double> {
//     bool forward(size_t p, size_t q, const vector<bool>& vx, vector<bool>& vy, const vector<double>& tx, vector<double>& ty) override;
//     bool reverse(size_t q, const vector<double>& tx, const vector<double>& ty, vector<double>& px, const vector<double>& py) override;
//     bool for_sparse_jac(size_t q, const vector<bool>& r, vector<bool>& s, const vector<double>& x) override;   // s = J r
//   };
#pragma once

#include <set>
#include <string>

#include <dyntape/interface/cppad/nodes/atomic.h>

namespace CppAD::inline dyntape_names {

template <class Base>
class atomic_base : public detail::AtomicFunction<Base> {
 public:
  enum option_enum { pack_sparsity_enum, bool_sparsity_enum, set_sparsity_enum };

  explicit atomic_base(const std::string& name, option_enum = bool_sparsity_enum)
      : detail::AtomicFunction<Base>(name) {}
  template <class ADVector>
  void operator()(const ADVector& ax, ADVector& ay, std::size_t id = 0) {
    set_old(id);
    this->call_of(id, ax, ay);
  }
  static void clear() {}
  void option(option_enum) {}  // each kind of vector is tried
  virtual void set_old(std::size_t) {}

#define DYNTAPE_ATOMIC_TWO(S)                                                                           \
  virtual bool forward(std::size_t, std::size_t, const vector<bool>&, vector<bool>&, const vector<S>&,  \
                       vector<S>&) {                                                                    \
    return false;                                                                                       \
  }                                                                                                     \
  virtual bool reverse(std::size_t, const vector<S>&, const vector<S>&, vector<S>&, const vector<S>&) { \
    return false;                                                                                       \
  }
  DYNTAPE_ATOMIC_TWO(Base)
  DYNTAPE_ATOMIC_TWO(AD<Base>)
#undef DYNTAPE_ATOMIC_TWO

  // s = J r, (n q) to (m q); the transpose of s = r J by columns; the Hessian h (n n) of s . f; and v = J^T u + (s .
  // f)'' r.
#define DYNTAPE_ATOMIC_TWO(Set)                                                                              \
  virtual bool for_sparse_jac(std::size_t, const Set&, Set&) { return false; }                               \
  virtual bool for_sparse_jac(std::size_t q, const Set& r, Set& s, const vector<Base>&) {                    \
    return for_sparse_jac(q, r, s);                                                                          \
  }                                                                                                          \
  virtual bool rev_sparse_jac(std::size_t, const Set&, Set&) { return false; }                               \
  virtual bool rev_sparse_jac(std::size_t q, const Set& rt, Set& st, const vector<Base>&) {                  \
    return rev_sparse_jac(q, rt, st);                                                                        \
  }                                                                                                          \
  virtual bool for_sparse_hes(const vector<bool>&, const vector<bool>&, const vector<bool>&, Set&) {         \
    return false;                                                                                            \
  }                                                                                                          \
  virtual bool for_sparse_hes(const vector<bool>& vx, const vector<bool>& r, const vector<bool>& s, Set& h,  \
                              const vector<Base>&) {                                                         \
    return for_sparse_hes(vx, r, s, h);                                                                      \
  }                                                                                                          \
  virtual bool rev_sparse_hes(const vector<bool>&, const vector<bool>&, vector<bool>&, std::size_t,          \
                              const Set&, const Set&, Set&) {                                                \
    return false;                                                                                            \
  }                                                                                                          \
  virtual bool rev_sparse_hes(const vector<bool>& vx, const vector<bool>& s, vector<bool>& t, std::size_t q, \
                              const Set& r, const Set& u, Set& v, const vector<Base>&) {                     \
    return rev_sparse_hes(vx, s, t, q, r, u, v);                                                             \
  }
  DYNTAPE_ATOMIC_TWO(vector<bool>)
  DYNTAPE_ATOMIC_TWO(vectorBool)
  DYNTAPE_ATOMIC_TWO(vector<std::set<std::size_t>>)
#undef DYNTAPE_ATOMIC_TWO

 private:
  using Call = detail::AtomicCall<Base>;
  using Sparsity = sparse_rc<vector<std::size_t>>;

  template <class S>
  bool forward_without_types(std::size_t id, std::size_t low, std::size_t up, const vector<S>& tx,
                             vector<S>& ty) {
    vector<bool> vx, vy;  // empty: which entries are variables is not needed
    set_old(id);
    return forward(low, up, vx, vy, tx, ty);
  }
  DYNTAPE_ATOMIC_NUMBERS(Base, forward_without_types(call.id, low, up, tx, ty),
                         (set_old(call.id), reverse(up, tx, ty, px, py)))
  DYNTAPE_ATOMIC_NUMBERS(AD<Base>, forward_without_types(call.id, low, up, tx, ty),
                         (set_old(call.id), reverse(up, tx, ty, px, py)))

  int generation() const override { return 2; }
  static vector<bool> moving(const Call& call) {
    return call.which([](ad_type_enum type) { return type == variable_enum; });
  }
  bool result_types(const Call& call, vector<ad_type_enum>& types) override {
    const vector<bool> vx = moving(call);
    vector<bool> vy = Call::constant_bools(call.n_out, false);
    vector<Base> y(call.n_out);
    if (!forward(0, 0, vx, vy, call.values, y)) return false;
    ad_type_enum of_parameters = constant_enum;
    for (const auto type : call.types) {
      if (type == dynamic_enum) of_parameters = dynamic_enum;
    }
    for (std::size_t i = 0; i < call.n_out; ++i) types[i] = vy[i] ? variable_enum : of_parameters;
    return true;
  }

  template <class Set>
  static Set empty_rows(std::size_t n, std::size_t cols) {
    Set set(detail::kIsOfSets<Set> ? n : n * cols);
    if constexpr (!detail::kIsOfSets<Set>) {
      for (std::size_t k = 0; k < n * cols; ++k) set[k] = false;
    }
    return set;
  }
  template <class Set>
  static Set identity(std::size_t n) {
    Set set = empty_rows<Set>(n, n);
    for (std::size_t k = 0; k < n; ++k) {
      if constexpr (detail::kIsOfSets<Set>) {
        set[k].insert(k);
      } else {
        set[k * n + k] = true;
      }
    }
    return set;
  }
  template <class Set>
  static bool give(const Set& set, std::size_t rows, std::size_t cols, bool transpose, Sparsity& pattern) {
    detail::to_rc(detail::sets_of(set, rows, cols, transpose), false, pattern);
    return true;
  }
  template <class Set>
  bool jacobian_by(const Call& call, Sparsity& pattern) {
    const std::size_t n = call.n_in(), m = call.n_out;
    Set s = empty_rows<Set>(m, n), st = empty_rows<Set>(n, m);
    if (for_sparse_jac(n, identity<Set>(n), s, call.parameters)) return give(s, m, n, false, pattern);
    return rev_sparse_jac(m, identity<Set>(m), st, call.parameters) && give(st, n, m, true, pattern);
  }
  template <class Set>
  bool hessian_by(const Call& call, const vector<bool>& s, Sparsity& pattern) {
    const std::size_t n = call.n_in();
    Set h = empty_rows<Set>(n, n);
    const vector<bool> vx = moving(call);
    if (for_sparse_hes(vx, call.all_in(), s, h, call.parameters)) return give(h, n, n, false, pattern);
    vector<bool> t = Call::constant_bools(n, false);
    return rev_sparse_hes(vx, s, t, n, identity<Set>(n), empty_rows<Set>(call.n_out, n), h,
                          call.parameters) &&
           give(h, n, n, false, pattern);
  }
  using Sets = vector<std::set<std::size_t>>;
  bool jacobian_entries(const Call& call, bool, Sparsity& pattern) override {
    return jacobian_by<vector<bool>>(call, pattern) || jacobian_by<vectorBool>(call, pattern) ||
           jacobian_by<Sets>(call, pattern);
  }
  bool hessian_entries(const Call& call, std::size_t i, Sparsity& pattern) override {
    vector<bool> s = Call::constant_bools(call.n_out, false);
    s[i] = true;
    return hessian_by<vector<bool>>(call, s, pattern) || hessian_by<vectorBool>(call, s, pattern) ||
           hessian_by<Sets>(call, s, pattern);
  }
};

}  // namespace CppAD::inline dyntape_names
