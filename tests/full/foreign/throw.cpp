// SPDX-License-Identifier: BSD-3-Clause
#include <cppad/cppad.hpp>
bool throws(void) { return CppAD::ADFun<double>().Forward(0, CPPAD_TESTVECTOR(double)(1)).size() > 0; }
