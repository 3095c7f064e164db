// SPDX-License-Identifier: BSD-3-Clause
// Defined in another folder than the program that calls it.
#include <cppad/cppad.hpp>

CppAD::AD<double> of_another_folder(const CppAD::AD<double>& x) { return exp(x) - 1; }
