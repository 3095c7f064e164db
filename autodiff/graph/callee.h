// SPDX-License-Identifier: BSD-3-Clause
//
// What a Call node calls: another recorded function, or a kernel written by hand (a loop, an iterative
// solve). It stays one node on the tape and one function in the generated C, and its derivatives are calls
// again.
//
//   auto leg = recorded_callee(leg_function);                // derivatives are derived when asked for
//
//   Callee kepler;                                           // E - e sin E = M, solved by a loop for E
//   kepler.name = "kepler"; kepler.n_in = 2; kepler.n_out = 1;
//   kepler.evaluate = [](const double* in, double* out) { ... };
//   kepler.c_body = "...";                             // the same loop in C99: reads in[i], writes out[i]
//   kepler.jvp = [] { return recorded_callee(...); };  // (in, tangents of in) -> tangents of out
//   kepler.vjp = [] { return recorded_callee(...); };  // (in, adjoints of out) -> adjoints of in
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
#include <vector>

#include <dyntape/autodiff/graph/graph.h>
#include <dyntape/autodiff/graph/op.h>
#include <dyntape/autodiff/graph/pattern.h>

namespace dyntape {

struct Function;

// What enters the derivative of a call as tangent of an argument or adjoint of a result: nothing; a number; or a
// weight, which is there only where another argument of the derivative callee is not zero.
enum class SeedKind : std::uint8_t { kNone, kNumber, kWeight };
using Seeds = std::vector<SeedKind>;

struct Callee {
  std::string name;  // a C identifier
  std::size_t n_in = 0, n_out = 0;

  // Either a recorded function of n_in variables without parameters, ...
  std::shared_ptr<const Function> recorded;

  // ... or a kernel.  `evaluate` and `c_body` are the same arithmetic in the same order; the body is what
  // stands between the braces of `static void name(const double* in, double* out)`.
  std::function<void(const double* in, double* out)> evaluate;
  std::string c_body;
  // The same over arrays of `reals`, several lanes at once; empty: c_body runs lane by lane.
  std::string c_body_of_lanes;
  // What one call takes, by kind; of a recorded function it is counted.
  std::vector<OperationCount> operations;
  // The same kernel with products fused into sums (fma), for the profile fast; empty: there is nothing to fuse.
  std::function<std::shared_ptr<const Callee>()> fused;
  // The kernel once more as a recorded function, made when number types other than double ask for it.
  std::function<std::shared_ptr<const Function>()> unrolled;

  // A recorded function that stands in for what derivation would find: derive() gives its call back as the
  // statements of the function, which share with everything around, once the derivatives below are taken.
  bool dissolves = false;

  // Derivative callees, made when a derivation meets the call; they may call this kernel again.  A kernel
  // without them throws when it is differentiated.
  std::function<std::shared_ptr<const Callee>()> jvp;  // n_in + n_in -> n_out
  std::function<std::shared_ptr<const Callee>()> vjp;  // n_in + n_out -> n_in

  // Which outputs depend on which inputs (n_out x n_in), sorted by row and then by column; with zero rows: all on
  // all.  A call of a callee whose pattern is anything else is an ArgumentError.
  Pattern pattern;

  // Whether it, or a derivative of it, may be infinite though its arguments are not; of a recorded function this
  // is found out.
  bool has_poles = true;

  // What has been made of it so far: derivative callees, while some graph holds them, digests for content_hash(), the
  // operations of the recorded function.  A copy, in which anything may be given anew, has made nothing; a callee that
  // has been called stays as it is.
  struct Made {
    std::weak_ptr<const Callee> jvp, vjp;
    std::map<Seeds, std::weak_ptr<const Callee>> jvps, vjps;  // by some seeds
    std::map<int, std::string> digests;                       // by what they cover
    std::optional<std::vector<OperationCount>> operations;
    Made() = default;
    Made(const Made&) {}
    Made& operator=(const Made&) { return *this = Made(), *this; }
    Made& operator=(Made&&) = default;
  };
  mutable Made made;
};

// Whether the value or a slope at a node may be infinite though its arguments are not.
bool has_pole(const Graph& graph, NodeId id);

// A recorded function as a callee.  Throws ArgumentError if it has parameters, weights or guards.
std::shared_ptr<const Callee> recorded_callee(const Function& function);

// The same, dissolving in the code around its calls, with derivatives that the caller knows better than
// derivation would find them (none: as derivation finds them, dissolving as well).
//   jvp, vjp   recorded callees of (in, tangents of in) and of (in, adjoints of out)
using CalleeMaker = std::function<std::shared_ptr<const Callee>()>;
std::shared_ptr<const Callee> dissolving_callee(const Function& function, CalleeMaker jvp = {},
                                                CalleeMaker vjp = {});

// Whether the makers of both derivatives are those that recorded_callee() or dissolving_callee() put there: what they
// find follows from the recorded function.
bool derivatives_follow(const Callee& callee);

// Throws ArgumentError, naming the entry, unless the pattern is one.
void check_pattern(const Callee& callee);

// Operations of one call, those of callees of its own included.
std::vector<OperationCount> count_operations(const Callee& callee);

// The derivative callees of a callee, made once for as long as some graph holds them; ArgumentError if a
// kernel gives none.
std::shared_ptr<const Callee> jvp_callee(const std::shared_ptr<const Callee>& callee);
std::shared_ptr<const Callee> vjp_callee(const std::shared_ptr<const Callee>& callee);
// By some seeds: of (in, seeds that are there, and for each weight among them whether it is).  With numbers only
// they are the ones above; others only where derivatives_follow().
std::shared_ptr<const Callee> jvp_callee(const std::shared_ptr<const Callee>& callee, const Seeds& seeds);
std::shared_ptr<const Callee> vjp_callee(const std::shared_ptr<const Callee>& callee, const Seeds& seeds);

}  // namespace dyntape
