// SPDX-License-Identifier: BSD-3-Clause
//
// Kernels of the user in series.
#pragma once

#include <dyntape/autodiff/evaluate/taylor.h>
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
      while (n > 1 && IdenticalZero(ty[i * (up + 1) + n - 1])) --n;
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
struct AtomicInSeries : KernelInSeries {
  explicit AtomicInSeries(AtomicAt<Base> a) : at(std::move(a)) {}
  std::shared_ptr<const SeriesKernel<Base>> of(Base) const override {
    return std::make_shared<AtomicSeries<Base, Base>>(at);
  }
  std::shared_ptr<const SeriesKernel<AD<Base>>> of(AD<Base>) const override {
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

}  // namespace CppAD::inline dyntape_names::detail
