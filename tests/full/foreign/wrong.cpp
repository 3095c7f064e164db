// SPDX-License-Identifier: BSD-3-Clause
#include <cppad/cppad.hpp>
bool right(void) { return true; }
bool wrong(void) { return CppAD::AD<double>(1) == CppAD::AD<double>(2); }
