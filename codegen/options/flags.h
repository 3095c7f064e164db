// SPDX-License-Identifier: BSD-3-Clause
//
// Compiler flags of generated code.  The contract flags keep the results of compiled code equal to the
// interpreter's, bit for bit.
//
//   contract_flags()                   -ffp-contract=off -fno-tree-slp-vectorize -fno-builtin-pow ...
//   accepted_flags({"-O3", "-ffast-math"})        {"-O3"}, and a notice that -ffast-math is left out
//
// The contract: no contraction into fma, no relaxed arithmetic, and one call of libm for each elementary function in
// the text.  Without these flags, gcc rewrites pow(x, 2.0) to x * x, joins sin and cos into one call, and folds
// calls of constants; the last bits change.  Exact functions (sqrt, fabs, floor, ...) stay built in: they are single
// instructions and give the same bits everywhere.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <dyntape/autodiff/graph/op.h>

namespace dyntape::codegen {

const std::vector<std::string>& contract_flags();
// The contract flags that affect code with these operators: a shorter list, to be read by people.
std::vector<std::string> contract_flags(const std::vector<Op>& operators);

// The libm function that is called in the operator's C code: "atan2"; empty if there is none.
std::string_view called_function(Op op);

// The libm functions that text with these operators calls, each once, with the number of arguments.
struct Called {
  std::string function;
  int arity;
};
std::vector<Called> called_functions(const std::vector<Op>& operators);

// The user's flags that are passed on, in order.  Flags that are left out are reported once on stderr.  Passed on
// are:
// - levels (-O2), -g, -W
// - processors and their features (-march=, -mcpu=, -mtune=, -mavx2, -mno-avx512f, -mfma, ...)
// - definitions of names in capitals (-DNAME=1); generated code uses no such names
// - folders of headers (-I); their text becomes part of a library's key (identity.h)
std::vector<std::string> accepted_flags(const std::vector<std::string>& flags);

}  // namespace dyntape::codegen
