// SPDX-License-Identifier: BSD-3-Clause
//
// What a Call node calls: another recorded function, or a kernel written by hand (a loop, an iterative
// solve). It stays one node on the tape and one function in the generated C, and its derivatives are calls
// again.
//
//   auto leg = recorded_callee(leg_function);          // recorded_callee.h: derivatives are derived when asked for
//
//   Kernel newton;                                     // E - e sin E = M, solved by a loop for E
//   newton.evaluate = [](const double* in, double* out) { ... };
//   newton.c_body = "...";                             // the same loop in C99: reads in[i], writes out[i]
//   auto kepler = std::make_shared<Callee>("kepler", 2, 1, newton);
//   kepler->jvp = [] { return recorded_callee(...); };  // (in, tangents of in) -> tangents of out
//   kepler->vjp = [] { return recorded_callee(...); };  // (in, adjoints of out) -> adjoints of in
//
// A tangent or adjoint that there is not enters such a jvp or vjp as 0, a number: the two see to it themselves that
// it meets no infinity.  In derivatives of recorded functions it does not enter.
//
// Make one callee and use it for every call: calls are equal, and shared, if callee and arguments are the same.
// tests/examples/kernel_call.cpp is the complete program.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <dyntape/autodiff/graph/op.h>
#include <dyntape/autodiff/graph/pattern.h>

namespace dyntape {

struct Callee;
struct Function;
class Interpreter;

// What enters the derivative of a call as tangent of an argument or adjoint of a result: nothing; a number; or a
// weight, which is there only where another argument of the derivative callee is not zero.
enum class SeedKind : std::uint8_t { kNone, kNumber, kWeight };
using Seeds = std::vector<SeedKind>;

enum class AdMode : std::uint8_t { kForward, kReverse };

using CalleeMaker = std::function<std::shared_ptr<const Callee>()>;

// A kernel written by hand.  `evaluate` and `c_body` are the same arithmetic in the same order.
struct Kernel {
  std::function<void(const double* in, double* out)> evaluate;
  // The same of several lanes at once, entry i of lane l at [i lanes + l]; empty: one lane after the other.
  std::function<void(const double* in, double* out, int lanes)> evaluate_lanes;
  // What stands between the braces of `static void name(const double* in, double* out)`, ...
  std::string c_body;
  // ... and the same over arrays of `reals`, several lanes at once; empty: c_body runs lane by lane.
  std::string c_body_of_lanes;
  // What one call takes, by kind.
  std::vector<OperationCount> operations;
  // The same kernel with products fused into sums (fma), for the profile fast; empty: there is nothing to fuse.
  CalleeMaker fused;
  // The kernel once more as a recorded function, made when number types other than double ask for it.
  std::function<std::shared_ptr<const Function>()> unrolled;
};

// A recorded function of n_in variables; recorded_callee() makes callees of them.
struct Recorded {
  enum class Use : std::uint8_t {
    kCall,  // stays a call
    kDissolve,  // stands in for what derivation would find: derive() gives the call back as the function's statements,
                // which share with everything around, once the derivatives are taken
    kPart,  // of a function that codegen takes apart, with parameters: after derivation only
  };
  // Finds the derivative by some seeds as a callee of the same kind.
  using Rule = std::shared_ptr<const Callee> (*)(const Recorded&, AdMode, const Seeds&);

  std::shared_ptr<const Function> function;
  Use use = Use::kCall;
  Rule derivative = nullptr;
};

struct Callee {
  Callee() = default;
  Callee(std::string name, std::size_t n_in, std::size_t n_out, std::variant<Kernel, Recorded> body)
      : name(std::move(name)), n_in(n_in), n_out(n_out), body(std::move(body)) {}

  std::string name;  // a C identifier
  std::size_t n_in = 0, n_out = 0;
  std::variant<Kernel, Recorded> body;

  // Derivative callees, made when a derivation meets the call; they may call this one again.  Without them those of a
  // recorded function are derived, and a kernel throws when it is differentiated.
  CalleeMaker jvp;  // n_in + n_in -> n_out
  CalleeMaker vjp;  // n_in + n_out -> n_in

  // Which outputs depend on which inputs (n_out x n_in), sorted by row and then by column; with zero rows: all on
  // all.  A call of a callee whose pattern is anything else is an ArgumentError.
  Pattern pattern;

  // Whether it, or a derivative of it, may be infinite though its arguments are not; of a recorded function this
  // is found out.
  bool has_poles = true;

  // The one of the two that it is; the other is null.
  const Kernel* kernel() const { return std::get_if<Kernel>(&body); }
  const Recorded* recorded() const { return std::get_if<Recorded>(&body); }
  bool dissolves() const { return recorded() && recorded()->use == Recorded::Use::kDissolve; }
  bool is_part() const { return recorded() && recorded()->use == Recorded::Use::kPart; }

  // What has been made of it so far: derivative callees, while some graph holds them, digests for content_hash(), the
  // operations and the program of the recorded function.  A copy, in which anything may be given anew, has made nothing;
  // a callee that has been called stays as it is.
  struct Made {
    std::map<std::pair<AdMode, Seeds>, std::weak_ptr<const Callee>> derivatives;
    std::map<int, std::string> digests;  // by what they cover
    std::optional<std::vector<OperationCount>> operations;
    std::shared_ptr<const Interpreter> program;
    Made() = default;
    Made(const Made&) {}
    Made& operator=(const Made&) { return *this = Made(), *this; }
    Made& operator=(Made&&) = default;
  };
  mutable Made made;
};

// Whether both derivatives follow from the recorded function: nobody gives one.
bool derivatives_follow(const Callee& callee);

// Throws ArgumentError, naming the entry, unless the pattern is one.
void check_pattern(const Callee& callee);

// The derivative callees of a callee, made once for as long as some graph holds them; ArgumentError if a
// kernel gives none.
//   seeds   of (in, seeds that are there, and for each weight among them whether it is).  Numbers only, or none: as
//           declared above; others only where derivatives_follow().
std::shared_ptr<const Callee> jvp_callee(const std::shared_ptr<const Callee>& callee,
                                         const Seeds& seeds = {});
std::shared_ptr<const Callee> vjp_callee(const std::shared_ptr<const Callee>& callee,
                                         const Seeds& seeds = {});

}  // namespace dyntape
