// SPDX-License-Identifier: BSD-3-Clause
//
// Functions that the user writes by hand: each call is one node of a recording.  The user gives their Taylor
// coefficients, of every order that a program needs.
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
// tx[j (up + 1) + k] is coefficient k of x[j].  Patterns come from jac_sparsity and hes_sparsity; without these
// members the patterns are full.  for_type gives the types of the results.  rev_depend may be overridden, but is
// never called.
//
// The object must outlive the functions that use it; otherwise an error says so.  ArgumentError, with name and
// order: an evaluation needs a member that is not overridden or that returns false.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <dyntape/interface/cppad/ad_fun.h>

namespace CppAD::inline dyntape_names {

enum ad_type_enum { identical_zero_enum, constant_enum, dynamic_enum, variable_enum, number_ad_type_enum };

namespace detail {

// One call of an atomic function, with its arguments at the recording point.
template <class Base>
struct AtomicCall {
  std::size_t id = 0, n_out = 0;
  vector<ad_type_enum> types;  // of the arguments
  vector<Base> values;         // of the arguments
  vector<Base> parameters;     // the same with NaN for variables

  std::size_t n_in() const { return types.size(); }
  vector<bool> all_in() const { return constant_bools(n_in(), true); }
  vector<bool> all_out() const { return constant_bools(n_out, true); }
  vector<bool> which(bool (*has)(ad_type_enum)) const {
    vector<bool> these(n_in());
    for (std::size_t j = 0; j < n_in(); ++j) these[j] = has(types[j]);
    return these;
  }
  static vector<bool> constant_bools(std::size_t n, bool value) {
    vector<bool> bools(n);
    for (bool& b : bools) b = value;
    return bools;
  }
};

// The common base of the generations, by vectors of coefficients.  A member returns false if it does not know the
// result.
template <class Base>
class AtomicFunction {
 public:
  using Call = AtomicCall<Base>;
  using Sparsity = sparse_rc<vector<std::size_t>>;

  explicit AtomicFunction(const std::string& name);
  AtomicFunction(const AtomicFunction& other) : AtomicFunction(other.name_) {}
  AtomicFunction& operator=(const AtomicFunction&) { return *this; }
  virtual ~AtomicFunction();

  // 4: calls have an id; of 3 and 4 CppAD's graphs have operators.
  virtual int generation() const { return 3; }

  const std::string& atomic_name() const { return name_; }

  // The function, if it is recorded: its calls enter other recordings statement by statement.  Null: a call is one
  // node.
  virtual std::shared_ptr<Fun<Base>> recorded() { return nullptr; }
  // The function of doubles that this function represents in recordings of recorded values; null: none.
  virtual AtomicFunction<double>* of_doubles() { return nullptr; }

  virtual bool result_types(const Call&, vector<ad_type_enum>&) { return false; }
  virtual bool coefficients(const Call& call, std::size_t low, std::size_t up, const vector<Base>& tx,
                            vector<Base>& ty) = 0;
  virtual bool coefficients(const Call& call, std::size_t low, std::size_t up, const vector<AD<Base>>& tx,
                            vector<AD<Base>>& ty) = 0;
  virtual bool adjoints(const Call& call, std::size_t up, const vector<Base>& tx, const vector<Base>& ty,
                        vector<Base>& px, const vector<Base>& py) = 0;
  virtual bool adjoints(const Call& call, std::size_t up, const vector<AD<Base>>& tx,
                        const vector<AD<Base>>& ty, vector<AD<Base>>& px, const vector<AD<Base>>& py) = 0;
  // Entries of the Jacobian (or of all dependencies), and of the Hessian of output i (both triangles).  Called for
  // patterns only.
  virtual bool jacobian_entries(const Call&, bool /*dependency*/, Sparsity&) { return false; }
  virtual bool hessian_entries(const Call&, std::size_t, Sparsity&) { return false; }

  const std::shared_ptr<AtomicFunction*>& alive() const { return alive_; }
  // y = f(x), in the recording of x.
  std::vector<AD<Base>> call(std::size_t call_id, const std::vector<AD<Base>>& x, std::size_t m);

 protected:
  template <class ADVector>
  void call_of(std::size_t call_id, const ADVector& ax, ADVector& ay) {
    const auto y = call(call_id, entries_of(ax), std::size_t(ay.size()));
    for (std::size_t i = 0; i < y.size(); ++i) ay[i] = y[i];
  }

 private:
  std::string name_;
  std::shared_ptr<AtomicFunction*> alive_;  // set to null by the destructor
};

// Implements these members by those of a generation, for numbers of type S.
#define DYNTAPE_ATOMIC_NUMBERS(S, forward_call, reverse_call)                                              \
  bool coefficients(const Call& call, std::size_t low, std::size_t up, const vector<S>& tx, vector<S>& ty) \
      override {                                                                                           \
    return forward_call;                                                                                   \
  }                                                                                                        \
  bool adjoints(const Call& call, std::size_t up, const vector<S>& tx, const vector<S>& ty, vector<S>& px, \
                const vector<S>& py) override {                                                            \
    return reverse_call;                                                                                   \
  }

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
  using Call = detail::AtomicCall<Base>;
  using Sparsity = sparse_rc<vector<std::size_t>>;
  DYNTAPE_ATOMIC_NUMBERS(Base, forward(call.id, call.all_out(), low, up, tx, ty),
                         reverse(call.id, call.all_in(), up, tx, ty, px, py))
  DYNTAPE_ATOMIC_NUMBERS(AD<Base>, forward(call.id, call.all_out(), low, up, tx, ty),
                         reverse(call.id, call.all_in(), up, tx, ty, px, py))
  int generation() const override { return 4; }
  bool result_types(const Call& call, vector<ad_type_enum>& types) override {
    return for_type(call.id, call.types, types);
  }
  static vector<bool> moving(const Call& call) {
    return call.which([](ad_type_enum type) { return type == variable_enum; });
  }
  static vector<bool> zeros(const Call& call) {
    return call.which([](ad_type_enum type) { return type == identical_zero_enum; });
  }
  bool jacobian_entries(const Call& call, bool dependency, Sparsity& pattern) override {
    return jac_sparsity(call.id, dependency, zeros(call), moving(call), call.all_out(), pattern) ||
           jac_sparsity(call.id, dependency, moving(call), call.all_out(), pattern);
  }
  bool hessian_entries(const Call& call, std::size_t i, Sparsity& pattern) override {
    vector<bool> only = Call::constant_bools(call.n_out, false);
    only[i] = true;
    return hes_sparsity(call.id, zeros(call), moving(call), only, pattern) ||
           hes_sparsity(call.id, moving(call), only, pattern);
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
  using Call = detail::AtomicCall<Base>;
  using Sparsity = sparse_rc<vector<std::size_t>>;
  template <class S>
  static vector<S> values(const vector<S>& tx, std::size_t up) {
    vector<S> x(tx.size() / (up + 1));
    for (std::size_t j = 0; j < x.size(); ++j) x[j] = tx[j * (up + 1)];
    return x;
  }
  // This generation has no type for zeros.
  static Types types_of(const Call& call) {
    Types types = call.types;
    for (auto& type : types) type = type == identical_zero_enum ? constant_enum : type;
    return types;
  }
  static vector<bool> moving(const Call& call) {
    return call.which([](ad_type_enum type) { return type == variable_enum; });
  }
  DYNTAPE_ATOMIC_NUMBERS(Base, forward(values(tx, up), types_of(call), number_ad_type_enum, low, up, tx, ty),
                         reverse(values(tx, up), types_of(call), up, tx, ty, px, py))
  DYNTAPE_ATOMIC_NUMBERS(AD<Base>,
                         forward(values(tx, up), types_of(call), number_ad_type_enum, low, up, tx, ty),
                         reverse(values(tx, up), types_of(call), up, tx, ty, px, py))
  bool result_types(const Call& call, Types& types) override {
    return for_type(call.parameters, types_of(call), types);
  }
  bool jacobian_entries(const Call& call, bool dependency, Sparsity& pattern) override {
    return jac_sparsity(call.parameters, types_of(call), dependency, moving(call), call.all_out(), pattern);
  }
  bool hessian_entries(const Call& call, std::size_t i, Sparsity& pattern) override {
    vector<bool> only = Call::constant_bools(call.n_out, false);
    only[i] = true;
    return hes_sparsity(call.parameters, types_of(call), moving(call), only, pattern);
  }
};

namespace detail {
// Calls a function of one number without slope, as one node; `of` lives as long as the program.
template <class Base>
AD<Base> discrete_call(const char* name, Base (*of)(const Base&), const AD<Base>& x);
}  // namespace detail

}  // namespace CppAD::inline dyntape_names

// Makes a function of AD<Base> from Base name(const Base&): a step or a table, with derivative zero.
#define CPPAD_DISCRETE_FUNCTION(Base, name)                       \
  inline ::CppAD::AD<Base> name(const ::CppAD::AD<Base>& x) {     \
    return ::CppAD::detail::discrete_call<Base>(#name, &name, x); \
  }
