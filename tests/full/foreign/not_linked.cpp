// SPDX-License-Identifier: BSD-3-Clause
#include <cppad/cppad.hpp>
bool defined_nowhere(void*);
bool missing(void) { return defined_nowhere(nullptr); }
