// SPDX-License-Identifier: BSD-3-Clause
//
// Functions that are recorded once and used in other recordings.
//
//   checkpoint<double> once("once", algo, ax, ay);       // records algo(ax, ay) here
//   chkpoint_two<double> again(f, "again");              // of an existing function
//   once(au, av);                                        // in any recording, or outside
//
// A call records the function's statements, so that equal statements are shared with the code around.  If the
// function has dynamic parameters, a call records one node, which takes the parameters of the last new_dynamic() at
// each evaluation; the checkpoint must outlive the node.
#pragma once

#include <string>

#include <dyntape/interface/cppad/nodes/atomic_base.h>

namespace CppAD::inline dyntape_names {

// A checkpoint of an existing function, with atomic_three's types.
template <class Base>
class chkpoint_two : public atomic_three<Base> {
 public:
  // CppAD's further arguments choose how to find derivatives; here derivatives are derived, and the arguments have
  // no effect.
  chkpoint_two(const ADFun<Base>& f, const std::string& name, bool = false, bool = true, bool = true,
               bool = false)
      : atomic_three<Base>(name) {
    f_ = f;
  }
  // Sets the parameters of all calls, recorded before or after.
  template <class Vector>
  void new_dynamic(const Vector& p) {
    f_.new_dynamic(p);
  }
  std::size_t size_var() const { return f_.size_var(); }

 private:
  using Call = detail::AtomicCall<Base>;
  using Sparsity = sparse_rc<vector<std::size_t>>;
  template <class S>
  using Many = vector<S>;

  std::shared_ptr<detail::Fun<Base>> recorded() override {
    return f_.size_dyn_ind() > 0 ? nullptr : f_.shared_core();
  }
  template <class Function, class S>
  static bool adjoints_of(Function&& f, std::size_t up, const Many<S>& tx, Many<S>& px, const Many<S>& py) {
    f.Forward(up, tx);
    px = f.Reverse(up + 1, py);
    return true;
  }
  bool coefficients(const Call&, std::size_t, std::size_t up, const Many<Base>& tx, Many<Base>& ty) override {
    ty = f_.Forward(up, tx);
    return true;
  }
  bool coefficients(const Call&, std::size_t, std::size_t up, const Many<AD<Base>>& tx,
                    Many<AD<Base>>& ty) override {
    if constexpr (detail::IsBase<AD<Base>>) ty = f_.base2ad().Forward(up, tx);
    return detail::IsBase<AD<Base>>;
  }
  bool adjoints(const Call&, std::size_t up, const Many<Base>& tx, const Many<Base>&, Many<Base>& px,
                const Many<Base>& py) override {
    return adjoints_of(f_, up, tx, px, py);
  }
  bool adjoints(const Call&, std::size_t up, const Many<AD<Base>>& tx, const Many<AD<Base>>&,
                Many<AD<Base>>& px, const Many<AD<Base>>& py) override {
    if constexpr (detail::IsBase<AD<Base>>) adjoints_of(f_.base2ad(), up, tx, px, py);
    return detail::IsBase<AD<Base>>;
  }
  bool jacobian_entries(const Call&, bool dependency, Sparsity& pattern) override {
    detail::to_rc(detail::sets_of(f_.core().jacobian_pattern(dependency)), false, pattern);
    return true;
  }
  bool hessian_entries(const Call& call, std::size_t i, Sparsity& pattern) override {
    std::vector<bool> only(call.n_out, false);
    only[i] = true;
    detail::to_rc(detail::sets_of(f_.core().hessian_pattern(only)), false, pattern);
    return true;
  }

  ADFun<Base> f_;
};

// A checkpoint of an algorithm, recorded by the constructor.
template <class Base>
class checkpoint : public atomic_base<Base> {
 public:
  using option_enum = typename atomic_base<Base>::option_enum;

  // CppAD's further arguments choose how to find patterns; here patterns are derived, and the arguments have no
  // effect.
  template <class Algo, class ADVector>
  checkpoint(const char* name, Algo& algo, const ADVector& ax, ADVector& ay, option_enum = {}, bool = true)
      : atomic_base<Base>(name) {
    ADVector x = ax;
    for (std::size_t j = 0; j < std::size_t(x.size()); ++j) x[j] = Var2Par(x[j]);
    Independent(x);
    algo(x, ay);
    f_.Dependent(x, ay);
    for (std::size_t i = 0; i < std::size_t(ay.size()); ++i) ay[i] = Var2Par(ay[i]);
  }
  std::size_t size_var() const { return f_.size_var(); }

 private:
  std::shared_ptr<detail::Fun<Base>> recorded() override { return f_.shared_core(); }
  ADFun<Base> f_;
};
template <class Base>
using chkpoint_one = checkpoint<Base>;

}  // namespace CppAD::inline dyntape_names
