// SPDX-License-Identifier: BSD-3-Clause
// Needs a function and a member of a class template of helpers/.
#include <cppad/cppad.hpp>

CppAD::AD<double> of_another_folder(const CppAD::AD<double>& x);

template <class Type>
struct Shifted {
  Type value;
  explicit Shifted(Type x);
};

bool helped(void) {
  CPPAD_TESTVECTOR(CppAD::AD<double>) x(1), y(1);
  x[0] = Shifted<double>(-1).value;
  Independent(x);
  y[0] = of_another_folder(x[0]);
  CppAD::ADFun<double> f(x, y);
  return f.Jacobian(CPPAD_TESTVECTOR(double){0})[0] == 1;
}
