// SPDX-License-Identifier: BSD-3-Clause
//
// Prints a function and its derivatives as self-contained C.
//
//   KernelSets sets = {function, "arm", content_hash(function), Profile::kStrict, plans};
//   Source source = print_c(sets);
//   source.text            C99 that is also C++: no heap, no globals but constant tables, nothing but libm
//   source.pieces          functions that may be compiled apart: -DDYNTAPE_FIRST=3 -DDYNTAPE_LAST=5 compiles
//                          pieces 3 to 5 and declares the others; without them it is one translation unit
//   source.symbol          the exported dyntape_descriptor (abi.h)
//
// Compiled with -DDYNTAPE_LANES=4 (2, 8) the text gives the kernels of that many lanes, arm_value_x4, and no
// descriptor; -DDYNTAPE_X4 where the descriptor is compiled makes it list them (print_lanes.h).
//
// Text and time are linear in the graph.  Numbers are printed exactly, whatever the locale.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <dyntape/codegen/options.h>
#include <dyntape/codegen/schedule/schedule.h>

namespace dyntape::codegen {

// One kernel: a derived function and the order in which it is computed.
struct KernelPlan {
  Derivatives derivatives;
  Schedule schedule;
};

struct KernelSets {
  const Function& function;  // before derivation
  std::string name;          // any text
  std::string content_hash;
  Profile profile = Profile::kStrict;
  std::vector<KernelPlan> kernels;     // by order, from kValue
  std::size_t piece_statements = 250;  // of the functions that are called
  Functions functions = Functions::kLibm;
};

struct Source {
  std::string text;
  std::string header;  // declares what the text exports
  std::string name;    // as a C identifier
  std::string symbol;
  std::vector<std::size_t> pieces;      // length of each in statements; piece 0 holds tables and entry points
  std::vector<std::size_t> operations;  // by kernel
};

Source print_c(const KernelSets& sets);

// "0.1.0", and a fingerprint of the sources that decide what is derived and printed.
const char* generator_version();
const char* generator_fingerprint();

// The descriptor's name for a function with this content hash.
std::string descriptor_symbol(const std::string& content_hash);

}  // namespace dyntape::codegen
