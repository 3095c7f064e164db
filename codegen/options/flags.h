// SPDX-License-Identifier: BSD-3-Clause
//
// Which flags generated code is compiled with.
//
//   contract_flags()                   -ffp-contract=off -fno-tree-slp-vectorize -fno-builtin-pow ...
//   accepted_flags({"-O3", "-ffast-math"})        {"-O3"}, and a notice that -ffast-math is left out
//
// The contract: no contraction into fma, no relaxed arithmetic, and every elementary function is libm's, once
// for each time it stands in the text.  Left to itself gcc rewrites pow(x, 2.0) to x * x and pairs sin and
// cos into one call, and folds calls of constants, with other last bits.  Functions that are exact whoever
// computes them (sqrt, fabs, floor, ...) stay built in: they are single instructions.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <dyntape/autodiff/graph/op.h>

namespace dyntape::codegen {

const std::vector<std::string>& contract_flags();
// What of it matters to code with these operators only: shorter, for people.
std::vector<std::string> contract_flags(const std::vector<Op>& operators);

// The function of libm that the operator's C is a call of: "atan2"; empty for the others.
std::string_view called_function(Op op);

// Those that text with these operators calls, each once, with the number of arguments.
struct Called {
  std::string function;
  int arity;
};
std::vector<Called> called_functions(const std::vector<Op>& operators);

// Whether what is compiled for this machine with these flags of a user has an instruction for fma(x, y, z).  Of
// another processor than the one at hand only what its flags say by name is known: -mfma.
bool has_fma(const std::vector<std::string>& flags);

// The flags of a user that may be passed on, in order; what is left out is said once on stderr.  Passed on are levels
// (-O2), -g, -W, processors and what they can do (-march=, -mcpu=, -mtune=, -mavx2, -mno-avx512f, -mfma, ...),
// definitions of names in capitals, which nothing that is printed uses (-DNAME=1), and folders of headers (-I), whose
// text then is a part of the key of a library (identity.h).
std::vector<std::string> accepted_flags(const std::vector<std::string>& flags);

}  // namespace dyntape::codegen
