// SPDX-License-Identifier: BSD-3-Clause
//
// What makes one text a kernel of one state or of several: the types and macros that its statements use.
//
//   real            a double, or a vector of DYNTAPE_LANES doubles, one a state
//   reals           the same in memory, of any alignment
//   DT_NAME(f)      f, or f_x4: objects of several widths are linked together
//   DT_ALL(1.5)     a constant in all lanes
//   dt_select       a decision, lane by lane, by masks
//   dt_fma          x y + z, rounded once: in lanes only, where fma(x, y, z) becomes it
//   DT_CHECK        a guard; DT_KERNEL   a callee written by hand, which is called lane by lane
//
// The text of `sin(x)` stays: in lanes, and for portable functions, it is a macro.
#pragma once

#include <string>
#include <vector>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

// What a text uses; the rest is not printed.
struct Vocabulary {
  std::vector<Op> operators;  // of the table, each once
  bool guards = false, kernels = false, fuses = false;
};
Vocabulary vocabulary(const KernelSets& sets, const std::vector<const Callee*>& callees);

std::string real_types(const Vocabulary& words);
// Whether functions of SLEEF are called: portable ones other than sine and cosine.
bool needs_sleef(const Vocabulary& words, Functions functions);
// Behind the kernels written by hand, whose functions are libm's.
std::string real_functions(const Vocabulary& words, Functions functions);

}  // namespace dyntape::codegen
