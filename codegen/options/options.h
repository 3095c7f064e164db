// SPDX-License-Identifier: BSD-3-Clause
//
// Options of code generation: the highest derivative, the route, the compiler and its flags, and the cache.
//
//   CodegenOptions options;
//   options.order = Order::kSecond;
//   options.flags = {"-O3"};
//   CompiledFunction f = CompiledFunction::make(function, options);          // compiled_function.h
#pragma once

#include <cstddef>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/scalars/portable.h>

namespace dyntape {

// automatic:    compiled C; if there is no compiler, machine code, with one notice on stderr.
// interpreter:  runs a list of operations without compiling (autodiff/evaluate/program.h).
// machine code: generated in this process in milliseconds (machine/machine_code.h); interpreted if impossible.
// compiled:     compiled C; throws ToolError if there is no compiler.
// tiered:       machine code at once; compiled C replaces it when the compiler in the background has finished.
enum class Route { kAutomatic, kInterpreter, kMachineCode, kCompiled, kTiered };

// The form of a tiered function that evaluates now.
enum class Tier {
  kInterpreted,
  kMachineCode,
  kQuick,  // compiled at -O1 until kFinal is ready: without machine code, if the flags ask for more
  kFinal   // compiled with the given options, or loaded from the cache
};

// The SIMD kernels (several points at once) that are compiled in addition to the kernel for one point.
//   kNone     none
//   kNative   one kernel, as wide as the registers of this processor: 8 lanes with AVX-512, 4 with AVX2, else 2
//   kAll      kernels of 2, 4 and 8 lanes on x86-64, of 2 lanes elsewhere; the widest that this processor has runs
enum class Lanes { kNone, kNative, kAll };

const char* to_string(Functions functions);
const char* to_string(Route route);
const char* to_string(Tier tier);
// Throw ArgumentError for an unknown word or number.
Functions functions_from(const std::string& word);
Order order_from(int number);

// Thrown with options.only_cached if the cache has no library of exactly this function and these options.
struct NotCached : ArgumentError {
  using ArgumentError::ArgumentError;
};

struct CodegenOptions {
  Order order = Order::kFirst;  // the highest order that can be evaluated; includes the lower orders
  Route route = Route::kAutomatic;
  // kSines: fastest for one point (computes four sines at a time); the bits of dynamics/ in plain double.
  // kPortable: the same bits on every processor; fastest in lanes.  kLibm: the bits of the C library (std::sin).
  Functions functions = kDefaultFunctions;

  // Each SIMD kernel takes as long to compile as the kernel for one point.  It evaluates a point five to eight times
  // faster (CompiledFunction::run).
  Lanes lanes = Lanes::kNone;
  std::size_t widest_lanes = 8;  // wider kernels are not used, even if the library has them

  // Empty: $DYNTAPE_CACHE, $XDG_CACHE_HOME/dyntape or ~/.cache/dyntape.
  std::string cache_folder = {};
  bool use_cache = true;       // false: compiles in a temporary folder and removes it
  bool force_rebuild = false;  // compiles even if the cache has the library
  bool only_cached = false;    // throws NotCached if the cache has no library; compiles nothing

  // Empty: $DYNTAPE_CC, cc, gcc or clang, the first that exists.
  std::string compiler = {};
  // Passed on: levels, -g, -W, processors and features, -DNAME=1, -I (flags.h).  Others are ignored, with a notice.
  std::vector<std::string> flags = {};

  std::string label = {};  // name in the generated code; empty: the name of the function

  std::size_t piece_statements = 250;      // longer functions are split into functions of about this length
  unsigned jobs = 0;                       // compilers in parallel; 0: one per hardware thread
  double compile_seconds = 900;            // (s) a compiler that takes longer is terminated
  std::size_t compile_bytes = 8ull << 30;  // limit of one compiler's address space
  std::stop_token stop = {};               // a stop request terminates the compilers; throws ToolError
  // Called in the compiling thread at the start and after each compiler run: runs done, runs in all.  Must not
  // destroy the last copy of a tiered function: the destructor waits for this thread.
  std::function<void(std::size_t done, std::size_t of)> compiled_piece = {};
};

}  // namespace dyntape
