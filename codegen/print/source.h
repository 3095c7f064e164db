// SPDX-License-Identifier: BSD-3-Clause
//
// Input and output of the printers.
//
//   KernelSets sets = {function, "arm", content_hash(function), plans};
//   Source source = print_c(sets);                                                          print_c.h
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <dyntape/codegen/options/options.h>
#include <dyntape/codegen/schedule/schedule.h>

namespace dyntape::codegen {

// One kernel: a derived function and its order of computation.
struct KernelPlan {
  Derivatives derivatives;
  Schedule schedule;
};

struct KernelSets {
  const Function& function;  // before derivation
  std::string name;          // any text
  std::string content_hash;
  std::vector<KernelPlan> kernels;     // by order, from kValue
  std::size_t piece_statements = 250;  // length of the called functions
  Functions functions = kDefaultFunctions;
};

struct Source {
  std::string text;
  std::string header;  // declarations of the exports
  std::string name;    // as a C identifier
  std::string symbol;
  std::vector<std::size_t> pieces;      // length of each in statements; piece 0 holds tables and entry points
  std::vector<std::size_t> operations;  // by kernel
  bool needs_sleef = false;             // -lsleef
};

}  // namespace dyntape::codegen
