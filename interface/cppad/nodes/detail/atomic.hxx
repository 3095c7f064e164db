// SPDX-License-Identifier: BSD-3-Clause
//
// Functions of the user: their calls, recorded and in series.
#pragma once

#include <algorithm>
#include <iostream>
#include <map>
#include <mutex>

#include <dyntape/autodiff/evaluate/taylor.h>
#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/interface/cppad/nodes/atomic.h>
#include <dyntape/interface/cppad/detail/fun.hxx>

namespace CppAD::inline dyntape_names::detail {

template <class Base>
struct AtomicAt {  // one call of it
  std::shared_ptr<AtomicFunction<Base>*> alive;
  std::string name;
  AtomicCall<Base> call;

  std::size_t n_in() const { return call.n_in(); }
  std::size_t n_out() const { return call.n_out; }
  AtomicFunction<Base>& function() const {
    if (!*alive) refuse("atomic function \"" + name + "\" is evaluated after its object has been destroyed");
    return **alive;
  }
  [[noreturn]] void refuse_order(const char* what, std::size_t order, bool recorded) const {
    refuse("atomic function \"" + name + "\": its " + what + (recorded ? " of AD" : "") +
           " gives false for order " + std::to_string(order));
  }
  template <class S>
  vector<S> forward(std::size_t up, const vector<S>& tx) const {
    vector<S> ty(n_out() * (up + 1));
    if (!function().coefficients(call, 0, up, tx, ty)) refuse_order("forward", up, !std::is_same_v<S, Base>);
    return ty;
  }
  template <class S>
  vector<S> reverse(std::size_t up, const vector<S>& tx, const vector<S>& py) const {
    const vector<S> ty = forward(up, tx);
    vector<S> px(tx.size());
    if (!function().adjoints(call, up, tx, ty, px, py)) refuse_order("reverse", up, !std::is_same_v<S, Base>);
    return px;
  }
};

template <class Base, class T>
class AtomicSeries : public SeriesKernel<T> {
 public:
  using Many = std::vector<Series<T>>;
  explicit AtomicSeries(AtomicAt<Base> at) : at_(std::move(at)) {}

  Many forward(const Many& in) const override {
    const std::size_t up = longest(in, 1) - 1;
    const vector<T> ty = at_.forward(up, packed(in, up));
    Many out(at_.n_out());
    for (std::size_t i = 0; i < out.size(); ++i) {
      std::size_t n = up + 1;
      while (n > 1 && IdenticalZero(given(ty[i * (up + 1) + n - 1]))) --n;
      if (n > 1) n = up + 1;
      out[i].resize(n);
      for (std::size_t k = 0; k < n; ++k) out[i][k] = ty[i * (up + 1) + k];
    }
    return out;
  }
  // Adjoints begin with the highest order.
  Many reverse(const Many& in, const Many&, const Many& adjoints) const override {
    const std::size_t up = longest(adjoints, longest(in, 1)) - 1;
    vector<T> py(at_.n_out() * (up + 1));
    for (std::size_t i = 0; i < at_.n_out(); ++i) {
      for (std::size_t k = 0; k <= up; ++k) py[i * (up + 1) + up - k] = adjoints[i].at(k);
    }
    const vector<T> px = at_.reverse(up, packed(in, up), py);
    Many of_in(in.size());
    for (std::size_t j = 0; j < in.size(); ++j) {
      of_in[j].resize(up + 1);
      for (std::size_t k = 0; k <= up; ++k) of_in[j][k] = px[j * (up + 1) + up - k];
    }
    return of_in;
  }

 private:
  static std::size_t longest(const Many& many, std::size_t n) {
    for (const auto& series : many) n = std::max(n, series.size());
    return n;
  }
  static vector<T> packed(const Many& in, std::size_t up) {
    vector<T> t(in.size() * (up + 1));
    for (std::size_t j = 0; j < in.size(); ++j) {
      for (std::size_t k = 0; k <= up; ++k) t[j * (up + 1) + k] = in[j].at(k);
    }
    return t;
  }
  AtomicAt<Base> at_;
};

template <class Base>
struct AtomicInSeries : KernelInSeries, KernelOver<Base>, KernelOver<AD<Base>> {
  explicit AtomicInSeries(AtomicAt<Base> a) : at(std::move(a)) {}
  std::shared_ptr<const SeriesKernel<Base>> series(const Base*) const override {
    return std::make_shared<AtomicSeries<Base, Base>>(at);
  }
  std::shared_ptr<const SeriesKernel<AD<Base>>> series(const AD<Base>*) const override {
    return std::make_shared<AtomicSeries<Base, AD<Base>>>(at);
  }
  bool jacobian(bool dependency, Pattern& pattern) const override {
    sparse_rc<vector<std::size_t>> entries;
    if (!at.function().jacobian_entries(at.call, dependency, entries)) return false;
    pattern = pattern_of(sets_of(entries, false));
    return true;
  }
  bool hessian(std::size_t i, Pattern& pattern) const override {
    sparse_rc<vector<std::size_t>> entries;
    if (!at.function().hessian_entries(at.call, i, entries)) return false;
    pattern = pattern_of(sets_of(entries, false));
    return true;
  }
  KernelName called() const override {
    const auto generation = at.function().generation();
    return {generation == 4   ? KernelName::kAtomicFour
            : generation == 3 ? KernelName::kAtomicThree
                              : KernelName::kOther,
            at.name, at.call.id};
  }
  AtomicAt<Base> at;
};

std::string c_identifier(const std::string& name);
// With its derivatives in doubles.
std::shared_ptr<const Callee> callee_of_doubles(const AtomicAt<double>& at);

template <class Base>
std::shared_ptr<const Callee> atomic_callee(const AtomicAt<Base>& at) {
  if constexpr (std::is_same_v<Base, double>) {
    return callee_of_doubles(at);
  } else {
    if constexpr (std::is_same_v<Base, AD<double>>) {
      if (AtomicFunction<double>* const plain = at.function().of_doubles()) {
        const std::size_t n = at.n_in();
        AtomicAt<double> of{plain->alive(),
                            at.name,
                            {at.call.id, at.n_out(), at.call.types, vector<double>(n), vector<double>(n)}};
        for (std::size_t j = 0; j < n; ++j)
          of.call.values[j] = at.call.values[j].value(),
          of.call.parameters[j] = at.call.parameters[j].value();
        return callee_of_doubles(of);
      }
    }
    return std::make_shared<Callee>(c_identifier(at.name), at.n_in(), at.n_out(), Kernel());
  }
}

template <class Base>
ad_type_enum type_of(const AD<Base>& x) {
  if (IdenticalZero(x)) return identical_zero_enum;
  return Variable(x) ? variable_enum : Dynamic(x) ? dynamic_enum : constant_enum;
}

// What each result is, as the function says, or else what the highest argument is.
template <class Base>
vector<ad_type_enum> types_of_results(const AtomicAt<Base>& at) {
  vector<ad_type_enum> types(at.n_out());
  ad_type_enum highest = constant_enum;
  for (const auto type : at.call.types) highest = std::max(highest, type);
  for (auto& type : types) type = highest;
  if (!at.function().result_types(at.call, types)) {
    for (auto& type : types) type = highest;
  }
  return types;
}

template <class Base>
struct NamedAtomics {
  std::mutex mutex;
  std::map<std::string, std::vector<AtomicFunction<Base>*>> of_name;
};
template <class Base>
NamedAtomics<Base>& named_atomics() {
  static auto* const named = new NamedAtomics<Base>;  // outlives static atomic functions
  return *named;
}

template <class Base>
AtomicFunction<Base>::AtomicFunction(const std::string& name)
    : name_(name), alive_(std::make_shared<AtomicFunction*>(this)) {
  const std::scoped_lock lock(named_atomics<Base>().mutex);
  named_atomics<Base>().of_name[name_].push_back(this);
}

template <class Base>
AtomicFunction<Base>::~AtomicFunction() {
  *alive_ = nullptr;
  const std::scoped_lock lock(named_atomics<Base>().mutex);
  std::erase(named_atomics<Base>().of_name[name_], this);
}

// The last one of this name that lives.
template <class Base>
std::vector<AD<Base>> atomic_by_name(const std::string& name, std::size_t call_id,
                                     const std::vector<AD<Base>>& x, std::size_t m) {
  std::unique_lock lock(named_atomics<Base>().mutex);
  const auto& functions = named_atomics<Base>().of_name[name];
  if (functions.empty()) refuse("there is no atomic function \"" + name + "\"; construct it first");
  AtomicFunction<Base>& function = *functions.back();
  lock.unlock();
  return function.call(call_id, x, m);
}

// Results that are constants are no nodes, and those that are dynamic come from a call of their own, in which variables are constants.
template <class Base>
std::vector<AD<Base>> AtomicFunction<Base>::call(std::size_t call_id, const std::vector<AD<Base>>& x,
                                                 std::size_t m) {
  if constexpr (IsBase<AD<Base>>) {
    if (const auto fun = recorded()) {
      if (x.size() != fun->domain() || m != fun->range())
        refuse("checkpoint \"" + name_ + "\": got " + std::to_string(x.size()) + " arguments and " +
               std::to_string(m) + " results, expected " + std::to_string(fun->domain()) + " and " +
               std::to_string(fun->range()));
      return on_recorded(*fun)->forward(0, x, std::cout);
    }
  }
  const vector<Base> none(x.size());
  AtomicAt<Base> at{alive_, name_, {call_id, m, vector<ad_type_enum>(x.size()), none, none}};
  bool moves = false;
  for (std::size_t j = 0; j < x.size(); ++j) {
    at.call.types[j] = type_of(x[j]);
    at.call.values[j] = x[j].value();
    at.call.parameters[j] =
        at.call.types[j] == variable_enum ? numeric_limits<Base>::quiet_NaN() : x[j].value();
    moves = moves || at.call.types[j] >= dynamic_enum;
  }
  const vector<Base> y = at.forward(0, at.call.values);
  std::vector<AD<Base>> results(y.begin(), y.end());
  if (!moves) return results;
  const vector<ad_type_enum> types = types_of_results(at);
  for (const ad_type_enum wanted : {dynamic_enum, variable_enum}) {
    if (std::find(types.begin(), types.end(), wanted) == types.end()) continue;
    AtomicAt<Base> part = at;
    std::vector<AD<Base>> arguments = x;
    for (std::size_t j = 0; j < x.size() && wanted == dynamic_enum; ++j) {
      if (at.call.types[j] == variable_enum) arguments[j] = Var2Par(x[j]), part.call.types[j] = constant_enum;
    }
    const auto made = record_call(atomic_callee(part), std::make_shared<AtomicInSeries<Base>>(part),
                                  arguments, std::vector<Base>(y.begin(), y.end()));
    for (std::size_t i = 0; i < m; ++i) {
      if (types[i] == wanted) results[i] = made[i];
    }
  }
  return results;
}

}  // namespace CppAD::inline dyntape_names::detail
