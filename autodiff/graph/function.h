// SPDX-License-Identifier: BSD-3-Clause
//
// A recorded function: a graph, its output nodes, and the names of its inputs and outputs.
//
//   Function f = record("norm", 3, [](const VectorXad& x) { return VectorXad::Constant(1, x.norm()); });
//   evaluate(f, {1, 2, 2})         -> {3}                                                  interpret.h
//   derive(f, Order::kSecond)      value, Jacobian and Hessian as one function             derive.h
//   to_text(f)                     one line per node                                       dump.h
//
// A Function is a plain value: each pass takes a const Function and returns a new one.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <dyntape/autodiff/graph/graph.h>

namespace dyntape {

// A branch of the recorded code: `condition` was nonzero (expected) or zero in the recording.  If it differs in an
// evaluation, the evaluation is invalid and reports the guard's position.
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
  std::array<std::vector<std::string>, kBlocks>
      input_names;                        // empty, or one per variable / parameter / weight
  std::vector<std::string> output_names;  // empty, or one per output

  std::size_t n_x() const { return inputs[0]; }
  std::size_t n_p() const { return inputs[1]; }
  std::size_t n_w() const { return inputs[2]; }
  std::size_t n_y() const { return outputs.size(); }
};

// Removes unreachable nodes and renumbers the rest in canonical order.  RecordingError if check() finds the graph
// invalid.
Function compact(const Function& function);

// Inlines callees that are marked as dissolving (callee.h): replaces each call by the callee's operations.
Function dissolved(const Function& function);

// Returns these outputs and guards with the part of the graph that they need, without names and numbers of inputs.
struct LivePartMemory {  // for use again
  std::vector<std::uint8_t> needed;
  std::vector<NodeId> image;
};
Function live_part(const Graph& graph, const std::vector<NodeId>& outputs, const std::vector<Guard>& guards,
                   LivePartMemory&& memory = {});

// Throws RecordingError, naming the node, unless every argument precedes its user, every index is in range and every
// output exists.
void check(const Function& function);

// 128-bit hash, 32 hexadecimal digits, of the function's computation: live operations in canonical order, constants
// bit for bit, sizes, guards and callees.  Names are not included.
std::string content_hash(const Function& function);

// The hash of the function and its derive() results up to the order `derivatives`.  It includes the properties of
// callees (callee.h) that do not follow from their values: given derivatives, patterns, operations, and whether they
// dissolve.  If needed, given derivatives are made for hashing.
std::string content_hash(const Function& function, int derivatives);

// Replaces some inputs of a block by constants and simplifies (partial evaluation).  Other inputs keep their
// indices.  If all inputs of a block are replaced, the block becomes empty.
struct Binding {
  std::size_t index;
  double value;
};
Function bind(const Function& function, Block block, const std::vector<Binding>& bindings);

// Turns all weights and all parameters into variables, which are differentiated: x' = (x, w, p).  A weight of zero is
// then an ordinary number: zero times infinity is NaN, since the gates that make the product zero (flow.h) are
// removed.
Function all_as_variables(const Function& function);

// The same, but keeps the gates: for a callee whose other arguments say which weights are present.
Function weights_as_variables(const Function& function);

// The function with the given outputs only, in this order.
Function select_outputs(const Function& function, const std::vector<std::size_t>& outputs);

// Counts live operations by kind, without inputs and constants: {"Add": 12, "Mul": 20, ...}, in table order.  A call
// counts as one, plus the operations of the callee.
std::vector<OperationCount> count_operations(const Function& function);
std::size_t total_operations(const Function& function);
std::vector<OperationCount> count_operations(const Callee& callee);  // of one call

// Copies the part of `source` that `roots` need into `target`; input(block, index) returns the node of `target` for
// an input.  Returns the copies of the roots.
std::vector<NodeId> splice(const Graph& source, const std::vector<NodeId>& roots, Graph& target,
                           const std::function<NodeId(Block, std::uint32_t)>& input);

}  // namespace dyntape
