// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/nodes/atomic.h>

#include <algorithm>
#include <cctype>
#include <iostream>
#include <map>
#include <mutex>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/interface/cppad/nodes/detail/atomic.hxx>

namespace CppAD::inline dyntape_names::detail {

namespace {

std::string c_identifier(const std::string& name) {
  std::string identifier =
      name.empty() || std::isdigit(static_cast<unsigned char>(name[0])) ? "f_" + name : name;
  for (char& c : identifier) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return identifier;
}

// The derivatives of a call in doubles, for derivation: by coefficients of orders 0 and 1.
struct AtomicKernels {
  static std::shared_ptr<Callee> callee(const AtomicAt<double>& at, const char* suffix, std::size_t n_in,
                                        std::size_t n_out,
                                        std::function<void(const double*, double*)> evaluate) {
    Kernel kernel;
    kernel.evaluate = std::move(evaluate);
    return std::make_shared<Callee>(c_identifier(at.name) + suffix, n_in, n_out, kernel);
  }
  // Order 1 along the second half of what comes in.
  static vector<double> along(const AtomicAt<double>& at, const double* x, const double* dx) {
    vector<double> tx(2 * at.n_in());
    for (std::size_t j = 0; j < at.n_in(); ++j) tx[2 * j] = x[j], tx[2 * j + 1] = dx[j];
    return tx;
  }
  static std::shared_ptr<const Callee> forward_1(const AtomicAt<double>& at) {
    return callee(at, "_forward", 2 * at.n_in(), at.n_out(), [at](const double* in, double* out) {
      const vector<double> ty = at.forward(1, along(at, in, in + at.n_in()));
      for (std::size_t i = 0; i < at.n_out(); ++i) out[i] = ty[2 * i + 1];
    });
  }
  static std::shared_ptr<const Callee> reverse_1(const AtomicAt<double>& at) {
    const auto gradient =
        callee(at, "_reverse", at.n_in() + at.n_out(), at.n_in(), [at](const double* in, double* out) {
          const vector<double> tx(in, in + at.n_in()), py(in + at.n_in(), in + at.n_in() + at.n_out()),
              px = at.reverse(0, tx, py);
          std::copy(px.begin(), px.end(), out);
        });
    gradient->jvp = [at] { return reverse_2(at); };
    return gradient;
  }
  // (x, w, dx, dw): how the gradient changes along dx and dw.
  static std::shared_ptr<const Callee> reverse_2(const AtomicAt<double>& at) {
    const std::size_t n = at.n_in(), m = at.n_out();
    return callee(at, "_reverse_2", 2 * (n + m), n, [at, n, m](const double* in, double* out) {
      vector<double> py(2 * m);
      for (std::size_t i = 0; i < m; ++i) py[2 * i + 1] = in[n + i], py[2 * i] = in[2 * n + m + i];
      const vector<double> px = at.reverse(1, along(at, in, in + n + m), py);
      for (std::size_t j = 0; j < n; ++j) out[j] = px[2 * j];
    });
  }
};

template <class Base>
std::shared_ptr<const Callee> atomic_callee(const AtomicAt<Base>& at) {
  if constexpr (std::is_same_v<Base, AD<double>>) {
    if (AtomicFunction<double>* const plain = at.function().of_doubles()) {
      const std::size_t n = at.n_in();
      AtomicAt<double> of{plain->alive(),
                          at.name,
                          {at.call.id, at.n_out(), at.call.types, vector<double>(n), vector<double>(n)}};
      for (std::size_t j = 0; j < n; ++j)
        of.call.values[j] = at.call.values[j].value(), of.call.parameters[j] = at.call.parameters[j].value();
      return atomic_callee(of);
    }
  }
  Kernel kernel;
  if constexpr (std::is_same_v<Base, double>) {
    kernel.evaluate = [at](const double* in, double* out) {
      const vector<double> ty = at.forward(0, vector<double>(in, in + at.n_in()));
      std::copy(ty.begin(), ty.end(), out);
    };
  }
  auto callee = std::make_shared<Callee>(c_identifier(at.name), at.n_in(), at.n_out(), kernel);
  if constexpr (std::is_same_v<Base, double>) {
    callee->jvp = [at] { return AtomicKernels::forward_1(at); };
    callee->vjp = [at] { return AtomicKernels::reverse_1(at); };
  }
  return callee;
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

}  // namespace

namespace {

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

}  // namespace

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
  if constexpr (kIsBase<AD<Base>>) {
    if (const auto fun = recorded()) {
      if (x.size() != fun->domain() || m != fun->range())
        refuse("checkpoint \"" + name_ + "\": got " + std::to_string(x.size()) + " arguments and " +
               std::to_string(m) + " results, expected " + std::to_string(fun->domain()) + " and " +
               std::to_string(fun->range()));
      return fun->on_recorded()->forward(0, x, std::cout);
    }
  }
  const vector<Base> none(x.size());
  AtomicAt<Base> at{alive_, name_, {call_id, m, vector<ad_type_enum>(x.size()), none, none}};
  bool moves = false;
  for (std::size_t j = 0; j < x.size(); ++j) {
    at.call.types[j] = type_of(x[j]);
    at.call.values[j] = x[j].value();
    at.call.parameters[j] = at.call.types[j] == variable_enum ? nan(Base(0)) : x[j].value();
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

template std::vector<AD<float>> atomic_by_name(const std::string&, std::size_t, const std::vector<AD<float>>&,
                                               std::size_t);
template std::vector<AD<double>> atomic_by_name(const std::string&, std::size_t,
                                                const std::vector<AD<double>>&, std::size_t);
template std::vector<AD<AD<double>>> atomic_by_name(const std::string&, std::size_t,
                                                    const std::vector<AD<AD<double>>>&, std::size_t);
template class AtomicFunction<float>;
template class AtomicFunction<double>;
template class AtomicFunction<AD<double>>;

}  // namespace CppAD::inline dyntape_names::detail
