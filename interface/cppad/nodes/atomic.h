// SPDX-License-Identifier: BSD-3-Clause
//
// Functions that the user writes by hand, as one node of a recording: by their Taylor coefficients of every order that is asked for.
//
//   class Square : public atomic_four<double> {
//    public:
//     Square() : atomic_four<double>("square") {}
//     bool forward(size_t, const vector<bool>&, size_t low, size_t up, const vector<double>& tx, vector<double>& ty) override;
//     bool reverse(size_t, const vector<bool>&, size_t up, const vector<double>& tx, const vector<double>& ty,
//                  vector<double>& px, const vector<double>& py) override;
//   } square;
//   square(ax, ay);
//
// tx[j (up + 1) + k] is coefficient k of x[j].  A member that gives false, as those that are not overridden do, is an ArgumentError
// that names function and order, when it is needed.  The object outlives the functions that use it; if not, that is said.  Patterns
// come from jac_sparsity, or are full; the rest of CppAD's members may be overridden, and nobody needs them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <dyntape/interface/cppad/ad_fun.h>

namespace CppAD::inline dyntape_names {

enum ad_type_enum { identical_zero_enum, constant_enum, dynamic_enum, variable_enum, number_ad_type_enum };

namespace detail {

// What the generations have in common, by vectors of coefficients.
template <class Base>
class AtomicFunction {
 public:
  explicit AtomicFunction(const std::string& name)
      : name_(name), alive_(std::make_shared<AtomicFunction*>(this)) {}
  AtomicFunction(const AtomicFunction& other) : AtomicFunction(other.name_) {}
  AtomicFunction& operator=(const AtomicFunction&) { return *this; }
  virtual ~AtomicFunction() { *alive_ = nullptr; }

  const std::string& atomic_name() const { return name_; }

  virtual bool coefficients(std::size_t call, std::size_t low, std::size_t up, std::size_t m,
                            const vector<Base>& tx, vector<Base>& ty) = 0;
  virtual bool coefficients(std::size_t call, std::size_t low, std::size_t up, std::size_t m,
                            const vector<AD<Base>>& tx, vector<AD<Base>>& ty) = 0;
  virtual bool adjoints(std::size_t call, std::size_t up, const vector<Base>& tx, const vector<Base>& ty,
                        vector<Base>& px, const vector<Base>& py) = 0;
  virtual bool adjoints(std::size_t call, std::size_t up, const vector<AD<Base>>& tx,
                        const vector<AD<Base>>& ty, vector<AD<Base>>& px, const vector<AD<Base>>& py) = 0;
  // Entries of the Jacobian; false: all.
  virtual bool dependencies(std::size_t, std::size_t, std::size_t, std::vector<std::size_t>&,
                            std::vector<std::size_t>&) {
    return false;
  }

 protected:
  // y = f(x), recorded where x is.
  std::vector<AD<Base>> call(std::size_t call_id, const std::vector<AD<Base>>& x, std::size_t m);
  template <class ADVector>
  void call_of(std::size_t call_id, const ADVector& ax, ADVector& ay) {
    const auto y = call(call_id, entries_of(ax), std::size_t(ay.size()));
    for (std::size_t i = 0; i < y.size(); ++i) ay[i] = y[i];
  }

 private:
  std::string name_;
  std::shared_ptr<AtomicFunction*> alive_;  // to null when it goes
};

}  // namespace detail

template <class Base>
class atomic_four : public detail::AtomicFunction<Base> {
 public:
  explicit atomic_four(const std::string& name) : detail::AtomicFunction<Base>(name) {}
  template <class ADVector>
  void operator()(const ADVector& ax, ADVector& ay) {
    this->call_of(0, ax, ay);
  }
  template <class ADVector>
  void operator()(std::size_t call_id, const ADVector& ax, ADVector& ay) {
    this->call_of(call_id, ax, ay);
  }

  virtual bool for_type(std::size_t, const vector<ad_type_enum>&, vector<ad_type_enum>&) { return false; }
  virtual bool forward(std::size_t, const vector<bool>&, std::size_t, std::size_t, const vector<Base>&,
                       vector<Base>&) {
    return false;
  }
  virtual bool forward(std::size_t, const vector<bool>&, std::size_t, std::size_t, const vector<AD<Base>>&,
                       vector<AD<Base>>&) {
    return false;
  }
  virtual bool reverse(std::size_t, const vector<bool>&, std::size_t, const vector<Base>&,
                       const vector<Base>&, vector<Base>&, const vector<Base>&) {
    return false;
  }
  virtual bool reverse(std::size_t, const vector<bool>&, std::size_t, const vector<AD<Base>>&,
                       const vector<AD<Base>>&, vector<AD<Base>>&, const vector<AD<Base>>&) {
    return false;
  }
  virtual bool jac_sparsity(std::size_t, bool, const vector<bool>&, const vector<bool>&, const vector<bool>&,
                            sparse_rc<vector<std::size_t>>&) {
    return false;
  }
  virtual bool jac_sparsity(std::size_t, bool, const vector<bool>&, const vector<bool>&,
                            sparse_rc<vector<std::size_t>>&) {
    return false;
  }
  virtual bool hes_sparsity(std::size_t, const vector<bool>&, const vector<bool>&, const vector<bool>&,
                            sparse_rc<vector<std::size_t>>&) {
    return false;
  }
  virtual bool hes_sparsity(std::size_t, const vector<bool>&, const vector<bool>&,
                            sparse_rc<vector<std::size_t>>&) {
    return false;
  }
  virtual bool rev_depend(std::size_t, const vector<bool>&, vector<bool>&, const vector<bool>&) {
    return false;
  }
  virtual bool rev_depend(std::size_t, vector<bool>&, const vector<bool>&) { return false; }

 private:
  static vector<bool> all(std::size_t n) {
    vector<bool> selected(n);
    for (bool& s : selected) s = true;
    return selected;
  }
  bool coefficients(std::size_t call, std::size_t low, std::size_t up, std::size_t m, const vector<Base>& tx,
                    vector<Base>& ty) override {
    return forward(call, all(m), low, up, tx, ty);
  }
  bool coefficients(std::size_t call, std::size_t low, std::size_t up, std::size_t m,
                    const vector<AD<Base>>& tx, vector<AD<Base>>& ty) override {
    return forward(call, all(m), low, up, tx, ty);
  }
  bool adjoints(std::size_t call, std::size_t up, const vector<Base>& tx, const vector<Base>& ty,
                vector<Base>& px, const vector<Base>& py) override {
    return reverse(call, all(tx.size() / (up + 1)), up, tx, ty, px, py);
  }
  bool adjoints(std::size_t call, std::size_t up, const vector<AD<Base>>& tx, const vector<AD<Base>>& ty,
                vector<AD<Base>>& px, const vector<AD<Base>>& py) override {
    return reverse(call, all(tx.size() / (up + 1)), up, tx, ty, px, py);
  }
  bool dependencies(std::size_t call, std::size_t n, std::size_t m, std::vector<std::size_t>& row,
                    std::vector<std::size_t>& col) override {
    sparse_rc<vector<std::size_t>> pattern;
    vector<bool> none(n);
    for (bool& zero : none) zero = false;
    if (!jac_sparsity(call, false, none, all(n), all(m), pattern) &&
        !jac_sparsity(call, false, all(n), all(m), pattern))
      return false;
    row = detail::sizes_of(pattern.row());
    col = detail::sizes_of(pattern.col());
    return true;
  }
};

template <class Base>
class atomic_three : public detail::AtomicFunction<Base> {
 public:
  using Types = vector<ad_type_enum>;

  explicit atomic_three(const std::string& name) : detail::AtomicFunction<Base>(name) {}
  template <class ADVector>
  void operator()(const ADVector& ax, ADVector& ay) {
    this->call_of(0, ax, ay);
  }

  virtual bool for_type(const vector<Base>&, const Types&, Types&) { return false; }
  virtual bool forward(const vector<Base>&, const Types&, std::size_t, std::size_t, std::size_t,
                       const vector<Base>&, vector<Base>&) {
    return false;
  }
  virtual bool forward(const vector<AD<Base>>&, const Types&, std::size_t, std::size_t, std::size_t,
                       const vector<AD<Base>>&, vector<AD<Base>>&) {
    return false;
  }
  virtual bool reverse(const vector<Base>&, const Types&, std::size_t, const vector<Base>&,
                       const vector<Base>&, vector<Base>&, const vector<Base>&) {
    return false;
  }
  virtual bool reverse(const vector<AD<Base>>&, const Types&, std::size_t, const vector<AD<Base>>&,
                       const vector<AD<Base>>&, vector<AD<Base>>&, const vector<AD<Base>>&) {
    return false;
  }
  virtual bool jac_sparsity(const vector<Base>&, const Types&, bool, const vector<bool>&, const vector<bool>&,
                            sparse_rc<vector<std::size_t>>&) {
    return false;
  }
  virtual bool hes_sparsity(const vector<Base>&, const Types&, const vector<bool>&, const vector<bool>&,
                            sparse_rc<vector<std::size_t>>&) {
    return false;
  }
  virtual bool rev_depend(const vector<Base>&, const Types&, vector<bool>&, const vector<bool>&) {
    return false;
  }

 private:
  static Types variables(std::size_t n) {
    Types types(n);
    for (auto& type : types) type = variable_enum;
    return types;
  }
  template <class S>
  static vector<S> values(const vector<S>& tx, std::size_t up) {
    vector<S> x(tx.size() / (up + 1));
    for (std::size_t j = 0; j < x.size(); ++j) x[j] = tx[j * (up + 1)];
    return x;
  }
  bool coefficients(std::size_t, std::size_t low, std::size_t up, std::size_t, const vector<Base>& tx,
                    vector<Base>& ty) override {
    const auto x = values(tx, up);
    return forward(x, variables(x.size()), variable_enum, low, up, tx, ty);
  }
  bool coefficients(std::size_t, std::size_t low, std::size_t up, std::size_t, const vector<AD<Base>>& tx,
                    vector<AD<Base>>& ty) override {
    const auto x = values(tx, up);
    return forward(x, variables(x.size()), variable_enum, low, up, tx, ty);
  }
  bool adjoints(std::size_t, std::size_t up, const vector<Base>& tx, const vector<Base>& ty, vector<Base>& px,
                const vector<Base>& py) override {
    const auto x = values(tx, up);
    return reverse(x, variables(x.size()), up, tx, ty, px, py);
  }
  bool adjoints(std::size_t, std::size_t up, const vector<AD<Base>>& tx, const vector<AD<Base>>& ty,
                vector<AD<Base>>& px, const vector<AD<Base>>& py) override {
    const auto x = values(tx, up);
    return reverse(x, variables(x.size()), up, tx, ty, px, py);
  }
};

// The second generation.
template <class Base>
class atomic_base : public detail::AtomicFunction<Base> {
 public:
  enum option_enum { pack_sparsity_enum, bool_sparsity_enum, set_sparsity_enum };

  explicit atomic_base(const std::string& name, option_enum = bool_sparsity_enum)
      : detail::AtomicFunction<Base>(name) {}
  template <class ADVector>
  void operator()(const ADVector& ax, ADVector& ay, std::size_t id = 0) {
    this->call_of(id, ax, ay);
  }
  static void clear() {}

  virtual bool forward(std::size_t, std::size_t, const vector<bool>&, vector<bool>&, const vector<Base>&,
                       vector<Base>&) {
    return false;
  }
  virtual bool forward(std::size_t, std::size_t, const vector<bool>&, vector<bool>&, const vector<AD<Base>>&,
                       vector<AD<Base>>&) {
    return false;
  }
  virtual bool reverse(std::size_t, const vector<Base>&, const vector<Base>&, vector<Base>&,
                       const vector<Base>&) {
    return false;
  }
  virtual bool reverse(std::size_t, const vector<AD<Base>>&, const vector<AD<Base>>&, vector<AD<Base>>&,
                       const vector<AD<Base>>&) {
    return false;
  }

 private:
  bool coefficients(std::size_t, std::size_t low, std::size_t up, std::size_t, const vector<Base>& tx,
                    vector<Base>& ty) override {
    vector<bool> vx, vy;  // without entries: nobody asks which are variables
    return forward(low, up, vx, vy, tx, ty);
  }
  bool coefficients(std::size_t, std::size_t low, std::size_t up, std::size_t, const vector<AD<Base>>& tx,
                    vector<AD<Base>>& ty) override {
    vector<bool> vx, vy;
    return forward(low, up, vx, vy, tx, ty);
  }
  bool adjoints(std::size_t, std::size_t up, const vector<Base>& tx, const vector<Base>& ty, vector<Base>& px,
                const vector<Base>& py) override {
    return reverse(up, tx, ty, px, py);
  }
  bool adjoints(std::size_t, std::size_t up, const vector<AD<Base>>& tx, const vector<AD<Base>>& ty,
                vector<AD<Base>>& px, const vector<AD<Base>>& py) override {
    return reverse(up, tx, ty, px, py);
  }
};

namespace detail {
// A function of one number without slope, as one node; `of` lives as long as the program.
template <class Base>
AD<Base> discrete_call(const char* name, Base (*of)(const Base&), const AD<Base>& x);
}  // namespace detail

}  // namespace CppAD::inline dyntape_names

// Makes of Base name(const Base&) a function of AD<Base>: steps and tables, whose derivatives are zero.
#define CPPAD_DISCRETE_FUNCTION(Base, name)                       \
  inline ::CppAD::AD<Base> name(const ::CppAD::AD<Base>& x) {     \
    return ::CppAD::detail::discrete_call<Base>(#name, &name, x); \
  }
