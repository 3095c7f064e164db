// SPDX-License-Identifier: BSD-3-Clause
//
// Checks of template types, and of a recorded function against the code that it was recorded from.
//
//   CheckSimpleVector<double, Vector>();            // size(), resize(), [], value_type exist and work
//   CheckNumericType<Type>();                       // + - * / += -= *= /= and construction from int
//   FunCheck(f, g, x, 1e-10, 1e-10)                 // whether f.Forward(0, x) is nearly g(x)
#pragma once

#include <type_traits>

#include <dyntape/interface/cppad/utilities/error_handler.h>
#include <dyntape/interface/cppad/utilities/near_equal.h>

namespace CppAD::inline dyntape_names {

template <class Scalar, class Vector>
void CheckSimpleVector(const Scalar& x, const Scalar& y) {
  static_assert(std::is_same_v<typename Vector::value_type, Scalar>,
                "CheckSimpleVector: the vector's value_type is not the scalar");
  Vector v(1);
  v.resize(2);
  v[0] = x, v[1] = y;
  const Vector copy(v);
  Vector assigned;
  assigned.resize(2);
  assigned = copy;
  CPPAD_ASSERT_KNOWN(assigned.size() == 2 && copy[0] == x && assigned[1] == y,
                     "CheckSimpleVector: the vector does not keep its elements")
}
template <class Scalar, class Vector>
void CheckSimpleVector() {
  CheckSimpleVector<Scalar, Vector>(Scalar(0), Scalar(1));
}

template <class Type>
void CheckNumericType() {
  static_assert(
      requires(Type a, const Type b) {
        Type(1), Type(b), a = b, +a, -a, a + b, a - b, a * b, a / b, a += b, a -= b, a *= b, a /= b;
      },
      "CheckNumericType: the type lacks one of Type(int), =, + - * / and their assignments");
}

template <class Base, class RecBase, class Function, class Vector>
bool FunCheck(ADFun<Base, RecBase>& f, Function& g, const Vector& x, const Base& r, const Base& a) {
  const Vector recorded = f.Forward(0, x), computed = g(x);
  bool equal = recorded.size() == computed.size();
  for (std::size_t i = 0; equal && i < std::size_t(recorded.size()); ++i)
    equal = NearEqual(recorded[i], computed[i], r, a);
  return equal;
}

}  // namespace CppAD::inline dyntape_names
