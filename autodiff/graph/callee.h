// SPDX-License-Identifier: BSD-3-Clause
//
// The target of a Call node: a recorded function, or a hand-written kernel (a loop, an iterative solve).  A call is
// one node on the tape and one function in the generated C; its derivatives are calls again.
//
//   auto leg = recorded_callee(leg_function);          // recorded_callee.h: derivatives are generated on demand
//
//   Kernel newton;                                     // E - e sin E = M, solved by a loop for E
//   newton.evaluate = [](const double* in, double* out) { ... };
//   newton.c_body = "...";                             // the same loop in C99: reads in[i], writes out[i]
//   auto kepler = std::make_shared<Callee>("kepler", 2, 1, newton);
//   kepler->jvp = [] { return recorded_callee(...); };  // (in, tangents of in) -> tangents of out
//   kepler->vjp = [] { return recorded_callee(...); };  // (in, adjoints of out) -> adjoints of in
//
// A missing tangent or adjoint enters such a jvp or vjp as the number 0, so jvp and vjp must ensure that it meets no
// infinity.  In derivatives of recorded functions a missing one does not enter.
//
// Make one callee and use it for all calls: calls with the same callee and arguments are equal and merged.
// examples/cpp/kernel_call.cpp is the complete program.
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

// The tangent of an argument, or adjoint of a result, in the derivative of a call: none; a number; or a weight,
// which is present only if another argument of the derivative callee is nonzero.
enum class SeedKind : std::uint8_t { kNone, kNumber, kWeight };
using Seeds = std::vector<SeedKind>;

enum class AdMode : std::uint8_t { kForward, kReverse };

using CalleeMaker = std::function<std::shared_ptr<const Callee>()>;

// A hand-written kernel.  `evaluate` and `c_body` must do the same arithmetic in the same order.
struct Kernel {
  std::function<void(const double* in, double* out)> evaluate;
  // Several lanes at once, entry i of lane l at [i lanes + l]; empty: lane by lane.
  std::function<void(const double* in, double* out, int lanes)> evaluate_lanes;
  // The body of `static void name(const double* in, double* out)`.
  std::string c_body;
  // The body over arrays of `reals`, several lanes at once; empty: c_body runs lane by lane.
  std::string c_body_of_lanes;
  // Operations of one call, by kind.
  std::vector<OperationCount> operations;
  // The kernel as a recorded function, made when a number type other than double needs it.
  std::function<std::shared_ptr<const Function>()> unrolled;
};

// A recorded function of n_in variables as a callee; made by recorded_callee().
struct Recorded {
  enum class Use : std::uint8_t {
    kCall,  // remains a call
    kDissolve,  // analytic derivatives: after differentiation derive() replaces the call by the function's statements,
                // which share operations with the code around
    kPart,  // part of a function that codegen splits, with parameters: after derivation only
  };
  // Returns the derivative for given seeds as a callee of the same kind.
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

  // Derivative callees, made when a derivation meets the call; they may call this callee.  If empty, those of a
  // recorded function are generated, and differentiating a kernel throws.
  CalleeMaker jvp;  // n_in + n_in -> n_out
  CalleeMaker vjp;  // n_in + n_out -> n_in

  // Which outputs depend on which inputs (n_out x n_in), sorted by row and then by column; with zero rows: dense.
  // For any other pattern a call throws ArgumentError.
  Pattern pattern;

  // True if the value or a derivative may be infinite although the arguments are finite.  For a recorded function
  // this is computed.
  bool has_poles = true;

  // The body as one of the two kinds; the other is null.
  const Kernel* kernel() const { return std::get_if<Kernel>(&body); }
  const Recorded* recorded() const { return std::get_if<Recorded>(&body); }
  bool dissolves() const { return recorded() && recorded()->use == Recorded::Use::kDissolve; }
  bool is_part() const { return recorded() && recorded()->use == Recorded::Use::kPart; }

  // Cached results: derivative callees (while a graph holds them), digests for content_hash(), operations and
  // program of the recorded function.  A copy has an empty cache, so its fields may be changed.  Do not change a
  // callee after a call.
  struct Made {
    std::map<std::pair<AdMode, Seeds>, std::weak_ptr<const Callee>> derivatives;
    std::map<int, std::string> digests;  // by content
    std::optional<std::vector<OperationCount>> operations;
    std::shared_ptr<const Interpreter> program;
    Made() = default;
    Made(const Made&) {}
    Made& operator=(const Made&) { return *this = Made(), *this; }
    Made& operator=(Made&&) = default;
  };
  mutable Made made;
};

// Returns true if both derivatives follow from the recorded function, i.e. none is given.
bool derivatives_follow(const Callee& callee);

// Throws ArgumentError, naming the entry, if the pattern is invalid.
void check_pattern(const Callee& callee);

// The derivative callees of a callee, cached while a graph holds them.  ArgumentError if a kernel has none.
//   seeds   derivative of (in, present seeds, and for each weight among them whether it is present).  Numbers only,
//           or empty: as declared above; other seeds only if derivatives_follow().
std::shared_ptr<const Callee> jvp_callee(const std::shared_ptr<const Callee>& callee,
                                         const Seeds& seeds = {});
std::shared_ptr<const Callee> vjp_callee(const std::shared_ptr<const Callee>& callee,
                                         const Seeds& seeds = {});

}  // namespace dyntape
