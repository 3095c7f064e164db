// SPDX-License-Identifier: BSD-3-Clause
//
// AD<Base> for a base of the program, or for AD of a base that is not in cppad.h: AD<AD<std::complex<double>>>,
// AD<AD<float>>.  The drop-in folder has it as <cppad/base_require.hpp>.
//
//   #include <dyntape/interface/cppad/bases.h>
//   class Interval { ... };                          // Interval(double), + - * / += -= *= /= == !=
//   namespace CppAD {                                // and CppAD's other requirements of a base
//   inline Interval sin(const Interval& x) { ... }
//   CPPAD_COND_EXP_REL(Interval)
//   }
//   CppAD::AD<Interval> x = 1.0, y = sin(x) * x;
//
// Forward, Reverse, Jacobian and Hessian call the functions of the base.  A function that the base does not have is an
// ArgumentError when it is called.  Graphs, C and libraries are of doubles, and not for such bases.
#pragma once

#include <dyntape/interface/cppad/cppad.h>
#include <dyntape/interface/cppad/bases/recorded.hxx>
#include <dyntape/interface/cppad/detail/fun.hxx>
#include <dyntape/interface/cppad/nodes/detail/atomic.hxx>

namespace CppAD::inline dyntape_names::detail {
template <class Base>
void define_any_base(Defined<Base>);
}  // namespace CppAD::inline dyntape_names::detail

#define DYNTAPE_CPPAD_BASES(of, ...)                                                                      \
  of(float, __VA_ARGS__) of(double, __VA_ARGS__) of(long double, __VA_ARGS__) of(AD<double>, __VA_ARGS__) \
      of(AD<AD<double>>, __VA_ARGS__) of(std::complex<float>, __VA_ARGS__)                                \
          of(std::complex<double>, __VA_ARGS__)
#define DYNTAPE_CPPAD_TEMPLATE extern template
#include <dyntape/interface/cppad/bases/instantiate.hxx>

namespace CppAD::inline dyntape_names::detail {

extern template class AtomicFunction<float>;
extern template class AtomicFunction<double>;
extern template class AtomicFunction<long double>;
extern template class AtomicFunction<AD<double>>;
extern template class AtomicFunction<std::complex<float>>;
extern template class AtomicFunction<std::complex<double>>;
extern template std::shared_ptr<Fun<AD<double>>> on_recorded(const Fun<double>&);
extern template std::shared_ptr<Fun<AD<AD<double>>>> on_recorded(const Fun<AD<double>>&);

}  // namespace CppAD::inline dyntape_names::detail

// --- what CppAD's requirements of a base are written with ---
#define CPPAD_COND_EXP_REL(Type)    \
  DYNTAPE_CPPAD_CONDITION(Type, Lt) \
  DYNTAPE_CPPAD_CONDITION(Type, Le) \
  DYNTAPE_CPPAD_CONDITION(Type, Eq) \
  DYNTAPE_CPPAD_CONDITION(Type, Ge) \
  DYNTAPE_CPPAD_CONDITION(Type, Gt)
#define DYNTAPE_CPPAD_CONDITION(Type, Rel)                                                                   \
  inline Type CondExp##Rel(const Type& left, const Type& right, const Type& if_true, const Type& if_false) { \
    return CondExpOp(::CppAD::Compare##Rel, left, right, if_true, if_false);                                 \
  }
#define CPPAD_AZMUL(Base) \
  inline Base azmul(const Base& x, const Base& y) { return x == Base(0.0) ? Base(0.0) : Base(x * y); }
#define CPPAD_STANDARD_MATH_UNARY(Type, Fun) \
  inline Type Fun(const Type& x) { return std::Fun(x); }
#define CPPAD_NUMERIC_LIMITS(Other, Base) \
  template <>                             \
  struct numeric_limits<Base> : detail::LimitsAs<Base, std::numeric_limits<Other>> {};
#define CPPAD_TO_STRING(Base)        // to_string prints any base
#define CPPAD_HASH_TABLE_SIZE 10000  // for hash_code, which nothing calls
