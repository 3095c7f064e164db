// SPDX-License-Identifier: BSD-3-Clause
//
// The parts of a generated file that are not arithmetic: banner, includes, tables, descriptor.
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

// "0.1.0", and a fingerprint of the sources that decide what is derived and printed.
const char* generator_version();
const char* generator_fingerprint();

// The descriptor's name for a function with this content hash.
std::string descriptor_symbol(const std::string& content_hash);

// What the function is, its inputs and outputs, and operations by kind.  No date: the same function always
// gives the same text.
std::string banner(const KernelSets& sets, const Source& source);
// The part of it before the kernels; `compile_with`: if empty, flags of C compilers.
std::string description(const KernelSets& sets, const std::string& compile_with = {});
// Words in comment lines of bounded width, the first line after `head`, the others indented alike.
std::string wrapped(const std::string& head, const std::vector<std::string>& words);
std::vector<std::string> operation_words(const KernelPlan& kernel);

// The guards of the function with file and line, as lines of a comment; empty if it has none.  `name`: of the value
// that is 0, or the number of the first violated guard.
std::string guard_list(const KernelSets& sets, const std::string& name);
std::string header_banner(const KernelSets& sets, const Source& source);

std::string preamble();  // the headers
std::string open_c_linkage();
std::string close_c_linkage();
std::string abi_text();      // the interface of abi.h
std::string export_macro();  // DYNTAPE_EXPORT
std::string piece_macros();  // DYNTAPE_FIRST, DYNTAPE_LAST, DT_PIECE, DT_RESTRICT

// A kernel as its descriptor lists it.
struct KernelEntry {
  std::string symbol;
  std::size_t order, work, operations, live;
};
std::string descriptor_tables(const KernelSets& sets, const Source& source,
                              const std::vector<KernelEntry>& kernels);

}  // namespace dyntape::codegen
