// SPDX-License-Identifier: BSD-3-Clause
//
// Functions that are recorded once and stand in other recordings, statement by statement: equal ones are shared with everything around.
//
//   checkpoint<double> once("once", algo, ax, ay);       // algo(ax, ay), recorded here
//   chkpoint_two<double> again(f, "again");              // of a function that there is
//   once(au, av);                                        // in any recording, or outside
#pragma once

#include <string>

#include <dyntape/interface/cppad/ad_fun.h>

namespace dyntape::cppad {

template <class Base>
class chkpoint_two {
 public:
  // What follows the name chooses in CppAD how derivatives are found; here they are derived.
  chkpoint_two(const ADFun<Base>& f, const std::string& name, bool = false, bool = true, bool = true,
               bool = false)
      : name_(name) {
    f_ = f;
  }
  template <class Vector>
  void new_dynamic(const Vector& p) {
    f_.new_dynamic(p);
  }
  template <class ADVector>
  void operator()(const ADVector& ax, ADVector& ay) {
    if (std::size_t(ax.size()) != f_.Domain())
      detail::refuse("checkpoint \"" + name_ + "\": got " + std::to_string(ax.size()) +
                     " arguments, expected " + std::to_string(f_.Domain()));
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
};

template <class Base>
class checkpoint : public chkpoint_two<Base> {
 public:
  enum option_enum { pack_sparsity_enum, bool_sparsity_enum, set_sparsity_enum };

  template <class Algo, class ADVector>
  checkpoint(const char* name, Algo& algo, const ADVector& ax, ADVector& ay, option_enum = pack_sparsity_enum,
             bool = true)
      : chkpoint_two<Base>(std::string(name)) {
    ADVector x = ax;
    for (std::size_t j = 0; j < std::size_t(x.size()); ++j) x[j] = Var2Par(x[j]);
    Independent(x);
    algo(x, ay);
    this->f_.Dependent(x, ay);
    for (std::size_t i = 0; i < std::size_t(ay.size()); ++i) ay[i] = Var2Par(ay[i]);
  }
};
template <class Base>
using chkpoint_one = checkpoint<Base>;

}  // namespace dyntape::cppad
