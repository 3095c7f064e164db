// SPDX-License-Identifier: BSD-3-Clause
//
// What to generate, how to compile it and where to keep it.
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

// automatic:    compiled, or machine code where there is no compiler (said once on stderr).
// interpreter:  node by node.
// machine code: made in this process, without a compiler, in milliseconds (machine/machine_code.h); interpreted where that cannot be.
// compiled:     a ToolError where there is no compiler.
// tiered:       as automatic, but there at once: machine code until a compiler in the background is done.
enum class Route { kAutomatic, kInterpreter, kMachineCode, kCompiled, kTiered };

// What of a tiered function serves now.
enum class Tier {
  kInterpreted,
  kMachineCode,
  kQuick,  // compiled at -O1, where there is no machine code and the options ask for more
  kFinal   // compiled as the options say, or from the cache
};

// Which kernels that evaluate several points at once are compiled besides the one of a single point.
//   kNone     none
//   kNative   of as many lanes as the registers of this processor hold: 8 with AVX-512, 4 with AVX2, else 2
//   kAll      of 2, 4 and 8 lanes where there are such processors of this kind; what the processor has is used
enum class Lanes { kNone, kNative, kAll };

const char* to_string(Functions functions);
const char* to_string(Route route);
const char* to_string(Tier tier);
// Throw ArgumentError for any other word.
Functions functions_from(const std::string& word);
Order order_from(int number);

// options.only_cached, and the cache has no library of exactly this function and these options.
struct NotCached : ArgumentError {
  using ArgumentError::ArgumentError;
};

struct CodegenOptions {
  Order order = Order::kFirst;  // the highest that will be asked for; lower ones are always there
  Route route = Route::kAutomatic;
  // kSines: quickest for one point, whose sines are computed four at a time, and with the bits of dynamics/ in plain double.
  // kPortable: the same bits on every processor, and quickest in lanes.  kLibm: std::sin's bits.
  Functions functions = kDefaultFunctions;

  // Every kernel of several lanes takes as long to compile as the one of a single point, and evaluates a point
  // five to eight times faster (CompiledFunction::run).
  Lanes lanes = Lanes::kNone;
  std::size_t widest_lanes = 8;  // wider kernels are not used, even if the library has them

  // Empty: $DYNTAPE_CACHE, $XDG_CACHE_HOME/dyntape or ~/.cache/dyntape.
  std::string cache_folder = {};
  bool use_cache = true;       // false: compiled in a temporary folder that is removed again
  bool force_rebuild = false;  // compiles even if the library is there
  bool only_cached = false;    // NotCached if the library is not there: nothing is made

  // Empty: $DYNTAPE_CC, cc, gcc or clang, the first that exists.
  std::string compiler = {};
  // Levels, -g, -W, processors and their features, -DNAME=1, -I are passed on (flags.h); others are left out, said once.
  std::vector<std::string> flags = {};

  std::string label = {};  // name in the generated code; empty: the name of the function

  std::size_t piece_statements = 250;      // longer bodies are cut into functions of about this length
  unsigned jobs = 0;                       // compilers at a time; 0: one a hardware thread
  double compile_seconds = 900;            // a compiler that takes longer is ended
  std::size_t compile_bytes = 8ull << 30;  // address space of one compiler
  std::stop_token stop = {};               // a request ends the compilers: ToolError
  // Called in the thread that compiles, when it begins and whenever a compiler is done: pieces done, and of how many.  The
  // last copy of a tiered function must not go there: it waits for that thread.
  std::function<void(std::size_t done, std::size_t of)> compiled_piece = {};
};

}  // namespace dyntape
