// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function: a graph, which of its nodes are the outputs, and what the inputs are called.
//
//   Function f = record("norm", 3, [](const VectorXad& x) { return VectorXad::Constant(1, x.norm()); });
//   evaluate(f, {1, 2, 2})         -> {3}                                                  interpret.h
//   derive(f, Order::kSecond)      value, Jacobian and Hessian as one function             derive.h
//   to_text(f)                     one line a node                                         dump.h
//
// A Function is a value: stages take it const and return a new one.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <dyntape/autodiff/graph/graph.h>

namespace dyntape {

// A branch that the recorded code took: `condition` was non-zero (expected) or zero when it was recorded.  An
// evaluation in which it comes out otherwise has left the recording and reports the guard's place.
struct Guard {
  NodeId condition;
  bool expected;
  std::string file;
  int line;
};

struct Function {
  std::string name;
  std::array<std::size_t, kBlocks> inputs{};  // number of variables, parameters, weights
  Graph graph;
  std::vector<NodeId> outputs;
  std::vector<Guard> guards;
  std::array<std::vector<std::string>, kBlocks> input_names;  // empty, or one a variable / parameter / weight
  std::vector<std::string> output_names;                      // empty, or one an output

  std::size_t n_x() const { return inputs[0]; }
  std::size_t n_p() const { return inputs[1]; }
  std::size_t n_w() const { return inputs[2]; }
  std::size_t n_y() const { return outputs.size(); }
};

// The same function with unreachable nodes left out, in canonical order: nodes renumbered as they are met.
// Throws RecordingError where check() finds the graph broken.
Function compact(const Function& function);

// Calls of callees that dissolve (callee.h) replaced by the statements of these.
Function dissolved(const Function& function);

// What outputs and guards need of a sound graph, as a function without a name and without numbers of inputs.
Function live_part(const Graph& graph, const std::vector<NodeId>& outputs, const std::vector<Guard>& guards);

// Throws RecordingError, naming the node, unless every argument precedes its user, every index is in range
// and every output exists.
void check(const Function& function);

// 128-bit hash, 32 hexadecimal digits, of what the function computes: its live operations in canonical order,
// constants bit for bit, sizes, guards and callees.  Names are labels and do not enter.
std::string content_hash(const Function& function);

// The same of all that derive() finds up to that order: also of what callees bring along and does not follow from their
// values (callee.h): derivatives, patterns, operations, and whether they dissolve.  Derivatives that somebody gives are
// made to be hashed, those that are needed.
std::string content_hash(const Function& function, int derivatives);

// The function with some inputs of a block replaced by constants (partial evaluation, simplified again).  The
// others keep their places; a block that is bound as a whole is empty afterwards.
struct Binding {
  std::size_t index;
  double value;
};
Function bind(const Function& function, Block block, const std::vector<Binding>& bindings);

// The function with all weights, and then all parameters, turned into further variables:
// x' = (x, w, p).  What is now a variable is differentiated.  A weight of zero is then a number like others: it may
// meet an infinity, and what it meets is its slope (the gates that derivation made are open).
Function all_as_variables(const Function& function);

// The same with the gates as they are, for a callee that is told by other arguments which weights are there.
Function weights_as_variables(const Function& function);

// The function with the given outputs only, in that order.
Function select_outputs(const Function& function, const std::vector<std::size_t>& outputs);

// Live operations by kind, inputs and constants left out: {"Add": 12, "Mul": 20, ...}, in table order.  Each call
// counts as one, and with it what is done in the callee.
std::vector<OperationCount> count_operations(const Function& function);
std::size_t total_operations(const Function& function);
std::vector<OperationCount> count_operations(const Callee& callee);  // of one call

// Copies the part of `source` that `roots` need into `target`, with inputs replaced by `input(block, index)`.
// Returns the images of the roots.
std::vector<NodeId> splice(const Graph& source, const std::vector<NodeId>& roots, Graph& target,
                           const std::function<NodeId(Block, std::uint32_t)>& input);

}  // namespace dyntape
