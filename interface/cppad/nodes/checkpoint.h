// SPDX-License-Identifier: BSD-3-Clause
//
// Functions that are recorded once and used in other recordings.
//
//   checkpoint<double> once("once", algo, ax, ay);       // algo(ax, ay), recorded here
//   chkpoint_two<double> again(f, "again");              // of a function that there is
//   once(au, av);                                        // in any recording, or outside
//
// A call records the function's statements, so that equal ones are shared with everything around.  Of a function with dynamic parameters it
// records one node, which takes the parameters of the last new_dynamic() whenever it is evaluated; the checkpoint has to outlive it.
#pragma once

#include <string>

#include <dyntape/interface/cppad/nodes/atomic_base.h>

namespace CppAD::inline dyntape_names {

namespace detail {

// A function with dynamic parameters as one node.
template <class Base>
class CheckpointCall : public AtomicFunction<Base> {
 public:
  CheckpointCall(const ADFun<Base>& f, const std::string& name) : AtomicFunction<Base>(name) { f_ = f; }
  template <class ADVector>
  void operator()(const ADVector& ax, ADVector& ay) {
    this->call_of(0, ax, ay);
  }
  ADFun<Base>& function() { return f_; }

 private:
  using Call = AtomicCall<Base>;
  template <class S>
  using Many = vector<S>;

  bool coefficients(const Call&, std::size_t, std::size_t up, const Many<Base>& tx, Many<Base>& ty) override {
    ty = f_.Forward(up, tx);
    return true;
  }
  bool coefficients(const Call&, std::size_t, std::size_t up, const Many<AD<Base>>& tx,
                    Many<AD<Base>>& ty) override {
    ty = f_.base2ad().Forward(up, tx);
    return true;
  }
  bool adjoints(const Call&, std::size_t up, const Many<Base>& tx, const Many<Base>&, Many<Base>& px,
                const Many<Base>& py) override {
    f_.Forward(up, tx);
    px = f_.Reverse(up + 1, py);
    return true;
  }
  bool adjoints(const Call&, std::size_t up, const Many<AD<Base>>& tx, const Many<AD<Base>>&,
                Many<AD<Base>>& px, const Many<AD<Base>>& py) override {
    auto recorded = f_.base2ad();
    recorded.Forward(up, tx);
    px = recorded.Reverse(up + 1, py);
    return true;
  }
  using Sparsity = sparse_rc<vector<std::size_t>>;
  bool jacobian_entries(const Call&, bool dependency, Sparsity& pattern) override {
    to_rc(sets_of(f_.core().jacobian_pattern(dependency)), false, pattern);
    return true;
  }
  bool hessian_entries(const Call& call, std::size_t i, Sparsity& pattern) override {
    std::vector<bool> only(call.n_out, false);
    only[i] = true;
    to_rc(sets_of(f_.core().hessian_pattern(only)), false, pattern);
    return true;
  }

  ADFun<Base> f_;
};

}  // namespace detail

template <class Base>
class chkpoint_two {
 public:
  // What follows the name chooses in CppAD how derivatives are found; here they are derived.
  chkpoint_two(const ADFun<Base>& f, const std::string& name, bool = false, bool = true, bool = true,
               bool = false)
      : name_(name) {
    f_ = f;
    call_ = std::make_shared<detail::CheckpointCall<Base>>(f, name);  // also by its name, from a graph
  }
  // Parameters of all calls, recorded before or after.
  template <class Vector>
  void new_dynamic(const Vector& p) {
    f_.new_dynamic(p);
    call_->function().new_dynamic(p);
  }
  template <class ADVector>
  void operator()(const ADVector& ax, ADVector& ay) {
    if (std::size_t(ax.size()) != f_.Domain())
      detail::refuse("checkpoint \"" + name_ + "\": got " + std::to_string(ax.size()) +
                     " arguments, expected " + std::to_string(f_.Domain()));
    if (f_.size_dyn_ind() > 0) return (*call_)(ax, ay);
    ADFun<AD<Base>, Base> inlined = f_.base2ad();
    const auto values = inlined.Forward(0, detail::entries_of(ax));
    for (std::size_t i = 0; i < values.size(); ++i) ay[i] = values[i];
  }
  const std::string& atomic_name() const { return name_; }
  std::size_t size_var() const { return f_.size_var(); }

 protected:
  chkpoint_two(const std::string& name) : name_(name) {}
  ADFun<Base> f_;
  std::string name_;
  std::shared_ptr<detail::CheckpointCall<Base>> call_;
};

template <class Base>
class checkpoint : public chkpoint_two<Base> {
 public:
  using option_enum = typename atomic_base<Base>::option_enum;

  // What follows ay chooses in CppAD how patterns are found; here they are derived.
  template <class Algo, class ADVector>
  checkpoint(const char* name, Algo& algo, const ADVector& ax, ADVector& ay, option_enum = {}, bool = true)
      : chkpoint_two<Base>(std::string(name)) {
    ADVector x = ax;
    for (std::size_t j = 0; j < std::size_t(x.size()); ++j) x[j] = Var2Par(x[j]);
    Independent(x);
    algo(x, ay);
    this->f_.Dependent(x, ay);
    for (std::size_t i = 0; i < std::size_t(ay.size()); ++i) ay[i] = Var2Par(ay[i]);
  }
  void option(option_enum) {}
  static void clear() {}
};
template <class Base>
using chkpoint_one = checkpoint<Base>;

}  // namespace CppAD::inline dyntape_names
