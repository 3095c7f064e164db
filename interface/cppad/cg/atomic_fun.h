// SPDX-License-Identifier: BSD-3-Clause
//
// Functions in recordings of CG<Base>.
//
//   CGAtomicFun<double> again(checkpoint_or_atomic, x);             // a function over AD<double>, in recordings of AD<CG<double>>
//   CGAtomicFunBridge<double> bridge("name", f);                    // a recorded function: ADFun<CG<double>>
//   CGAtomicGenericModel<double>& of_model = model->asAtomic();     // a model, in recordings of AD<double>
//
// Recorded functions and models enter a recording statement by statement: libraries compile them together with the
// code around, patterns are exact, and the objects need not outlive the recording.  A function that the user wrote
// by hand is one node; libraries with such a node are interpreted.
#pragma once

#include <set>
#include <string>

#include <dyntape/interface/cppad/cg/model.h>
#include <dyntape/interface/cppad/cg/sparsity.h>
#include <dyntape/interface/cppad/nodes/atomic_base.h>

namespace CppAD::inline dyntape_names::cg {

template <class Base>
class CGAbstractAtomicFun : public atomic_base<CG<Base>> {
 public:
  using Sets = CppAD::vector<std::set<std::size_t>>;
  using atomic_base<CG<Base>>::atomic_base;

  // These properties belong to the recorded function; they do not depend on the arguments.
  Sets jacobianForwardSparsitySet(std::size_t, const CppAD::vector<CG<Base>>&) {
    return jacobianSparsitySet<Sets, CG<Base>>(function());
  }
  Sets jacobianReverseSparsitySet(std::size_t, const CppAD::vector<CG<Base>>&) {
    return jacobianSparsitySet<Sets, CG<Base>>(function());
  }
  Sets hessianSparsitySet(std::size_t, const CppAD::vector<CG<Base>>&) {
    return cg::hessianSparsitySet<Sets, CG<Base>>(function());
  }

 private:
  ADFun<CG<Base>> function() { return ADFun<CG<Base>>(this->recorded()); }
};

// A function over AD<Base>, for recordings of AD<CG<Base>>.
template <class Base>
class CGAtomicFun : public CGAbstractAtomicFun<Base> {
 public:
  using Inner = detail::AtomicFunction<Base>;

  // `x`, a point to evaluate at while recording, and what follows are not needed.
  template <class Vector>
  CGAtomicFun(Inner& inner, const Vector& /*x*/, bool /*standAlone*/ = false)
      : CGAbstractAtomicFun<Base>(inner.atomic_name()), inner_(&inner) {}

 private:
  using S = CG<Base>;
  using Call = detail::AtomicCall<S>;

  std::shared_ptr<detail::Fun<S>> recorded() override {
    const auto fun = inner_->recorded();
    return fun ? detail::on_recorded(*fun) : nullptr;
  }
  Inner* of_doubles() override { return inner_; }
  static detail::AtomicCall<Base> call_of_inner(const Call& call) {
    const std::size_t n = call.n_in();
    detail::AtomicCall<Base> of{call.id, call.n_out, call.types, vector<Base>(n), vector<Base>(n)};
    for (std::size_t j = 0; j < n; ++j)
      of.values[j] = call.values[j].value(), of.parameters[j] = call.parameters[j].value();
    return of;
  }
  static bool all_constant(const vector<S>& t) {
    for (const S& x : t) {
      if (!x.isParameter()) return false;
    }
    return true;
  }
  static vector<Base> plain(const vector<S>& t) {
    vector<Base> values(t.size());
    for (std::size_t k = 0; k < t.size(); ++k) values[k] = t[k].value();
    return values;
  }
  static bool give(const vector<Base>& values, vector<S>& t) {
    for (std::size_t k = 0; k < t.size(); ++k) t[k] = values[k];
    return true;
  }
  bool coefficients(const Call& call, std::size_t low, std::size_t up, const vector<S>& tx,
                    vector<S>& ty) override {
    if (all_constant(tx)) {
      vector<Base> y(ty.size());
      return inner_->coefficients(call_of_inner(call), low, up, plain(tx), y) && give(y, ty);
    }
    if (up > 0) return inner_->coefficients(call_of_inner(call), low, up, tx, ty);
    const auto y = inner_->call(call.id, detail::entries_of(tx), call.n_out);
    for (std::size_t i = 0; i < y.size(); ++i) ty[i] = y[i];
    return true;
  }
  bool coefficients(const Call&, std::size_t, std::size_t, const vector<AD<S>>&, vector<AD<S>>&) override {
    return false;
  }
  bool adjoints(const Call& call, std::size_t up, const vector<S>& tx, const vector<S>& ty, vector<S>& px,
                const vector<S>& py) override {
    if (!all_constant(tx) || !all_constant(py))
      return inner_->adjoints(call_of_inner(call), up, tx, ty, px, py);
    vector<Base> p(px.size());
    return inner_->adjoints(call_of_inner(call), up, plain(tx), plain(ty), p, plain(py)) && give(p, px);
  }
  bool adjoints(const Call&, std::size_t, const vector<AD<S>>&, const vector<AD<S>>&, vector<AD<S>>&,
                const vector<AD<S>>&) override {
    return false;
  }
  bool jacobian_entries(const Call& call, bool dependency, sparse_rc<vector<std::size_t>>& pattern) override {
    return inner_->jacobian_entries(call_of_inner(call), dependency, pattern);
  }
  bool hessian_entries(const Call& call, std::size_t i, sparse_rc<vector<std::size_t>>& pattern) override {
    return inner_->hessian_entries(call_of_inner(call), i, pattern);
  }

  Inner* inner_;
};

// A recorded function with a name.
template <class Base>
class CGAtomicFunBridge : public CGAbstractAtomicFun<Base> {
 public:
  CGAtomicFunBridge(const std::string& name, ADFun<CG<Base>>& f, bool /*standAlone*/ = false,
                    bool /*cacheSparsities*/ = true)
      : CGAbstractAtomicFun<Base>(name), f_(f.shared_core()) {}
  template <class... Elements>
  void setCustomSparseJacobianElements(const Elements&...) {}  // derivatives are of the statements
  template <class... Elements>
  void setCustomSparseHessianElements(const Elements&...) {}

 private:
  std::shared_ptr<detail::Fun<CG<Base>>> recorded() override { return f_; }
  std::shared_ptr<detail::Fun<CG<Base>>> f_;
};

// A model, for recordings of AD<Base>.
template <class Base>
class CGAtomicGenericModel : public atomic_base<Base> {
 public:
  explicit CGAtomicGenericModel(GenericModel<Base>& model)
      : atomic_base<Base>(model.getName()), f_(model.recorded()) {}

 private:
  std::shared_ptr<detail::Fun<Base>> recorded() override { return f_; }
  std::shared_ptr<detail::Fun<Base>> f_;
};

template <class Base>
CGAtomicGenericModel<Base>& GenericModel<Base>::asAtomic() {
  if (!atomic_) atomic_ = std::make_shared<CGAtomicGenericModel<Base>>(*this);
  return *atomic_;
}

}  // namespace CppAD::inline dyntape_names::cg
