// SPDX-License-Identifier: BSD-3-Clause
//
// The content of <cppad/cppad.hpp> and of CppAD's other headers in the drop-in folder: the names of cppad.h, the
// macros of <cppad/drop_in/configure.hpp>, and the standard headers that programs expect CppAD to include.
//
//   #include <cppad/cppad.hpp>                // target_link_libraries(program PRIVATE dyntape::cppad_drop_in)
//
// A program uses either CppAD's own headers or these, not both.
#pragma once

#if defined(CPPAD_CPPAD_HPP) || defined(CPPAD_CORE_AD_HPP) || defined(CPPAD_CG_INCLUDED) || \
    defined(CPPAD_UTILITY_VECTOR_HPP)
#error \
    "CppAD's own headers have been included before dyntape's: take the folder of one of the two off the include path"
#endif

#include <algorithm>
#include <array>
#include <cassert>
#include <cctype>
#include <cfloat>
#include <chrono>
#include <climits>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <limits>
#include <list>
#include <map>
#include <memory>
#include <set>
#include <sstream>
#include <stack>
#include <string>
#include <utility>
#include <valarray>
#include <vector>

#include <dyntape/interface/cppad/cg/dll_lib.h>
#include <dyntape/interface/cppad/cppad.h>
#include <dyntape/interface/cppad/drop_in/configure.h>
#include <dyntape/interface/cppad/drop_in/old_names.h>
#include <dyntape/interface/cppad/nodes/user_atomic.h>
