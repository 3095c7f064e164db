// SPDX-License-Identifier: BSD-3-Clause
// Needs a function of helpers/.
#include <cppad/cppad.hpp>

CppAD::AD<double> of_another_folder(const CppAD::AD<double>& x);

bool helped(void) {
  CPPAD_TESTVECTOR(CppAD::AD<double>) x(1), y(1);
  x[0] = 0;
  Independent(x);
  y[0] = of_another_folder(x[0]);
  CppAD::ADFun<double> f(x, y);
  return f.Jacobian(CPPAD_TESTVECTOR(double){0})[0] == 1;
}
