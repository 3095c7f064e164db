// SPDX-License-Identifier: BSD-3-Clause
#include <cppad/cppad.hpp>
bool unknown(void) { return CppAD::local::nothing_of_the_kind(); }
