// SPDX-License-Identifier: BSD-3-Clause
// Programs for foreign_programs: one for each of its outcomes.
#include <cppad/cppad.hpp>

bool helper_in_other_file(double x);

namespace {
bool inner(void) { return false; }  // is not called: not at global scope
}  // namespace

bool square(void) {
  CPPAD_TESTVECTOR(CppAD::AD<double>) x(1), y(1);
  x[0] = 3.0;
  CppAD::Independent(x);
  y[0] = x[0] * x[0];
  CppAD::ADFun<double> f(x, y);
  CPPAD_TESTVECTOR(double) w(1);
  w[0] = 1;
  return f.Reverse(1, w)[0] == 6 && helper_in_other_file(6) && !inner();
}
