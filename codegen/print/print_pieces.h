// SPDX-License-Identifier: BSD-3-Clause
//
// The functions of a text that hold its statements: one for each piece of a schedule, and one for each callee.
//
//   PieceFunctions functions(plans, 250, Dialect{});
//   std::string calls = functions.add_pieces("dt_value", function, schedule, style, "", "  ");
//   functions.definitions()            callees first, then the pieces in the order in which they were added
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include <dyntape/autodiff/graph/callee.h>
#include <dyntape/codegen/print/print_body.h>
#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

inline constexpr const char* kKernelNames[] = {"value", "first_order", "second_order"};
inline constexpr const char* kOutputNames[] = {"y", "jacobian", "hessian"};
inline constexpr const char* kInputNames[] = {"x", "p", "w"};

// Output arrays of a kernel with their headings.
std::vector<OutputArray> outputs_of(const Derivatives& derivatives);

class PieceFunctions {
 public:
  struct Definition {
    std::string declaration, head, body;  // the head begins the definition; mostly it is the declaration
    std::size_t statements = 0;
    // The most numbers that are in memory at once: its own, and those of the functions it calls.
    std::size_t values = 0, frames = 1;
    bool is_kernel() const { return head != declaration; }  // a callee written by hand
  };

  // Prints the callees that the kernels reach.
  PieceFunctions(const std::vector<KernelPlan>& kernels, std::size_t piece_statements, Dialect dialect);

  // A function for each piece; returns the text that calls them in order.  The caller's arrays are called as
  // in the style, with a suffix.
  std::string add_pieces(const std::string& name, const Function& function, const Schedule& schedule,
                         const BodyStyle& style, const std::string& suffix, const std::string& indent);

  const std::vector<Definition>& definitions() const { return definitions_; }
  const std::vector<const Callee*>& callees() const { return callees_; }
  const std::map<const Callee*, CalleeText>& texts() const { return texts_; }
  // Slots of the work array of a function, those of the callees that it reaches included.
  std::size_t work(const Function& function, const Schedule& schedule) const;

 private:
  void add_callee(const Callee& callee);
  void add(const std::string& declaration, Definition definition);
  std::pair<std::string, std::string> signature(const Function& function, const Schedule& schedule,
                                                const Piece& piece, const BodyStyle& style,
                                                const std::string& suffix) const;
  std::vector<OutputArray> outputs_of_part(const Callee& callee) const;
  Definition measured(const Function& function, const Piece& piece, const Schedule& schedule) const;
  std::string named(const std::string& name) const;

  std::size_t piece_statements_;
  Dialect dialect_;
  std::vector<const Callee*> callees_;
  std::map<const Callee*, CalleeText> texts_;
  std::map<const Callee*, std::pair<std::size_t, std::size_t>> depth_;  // values and frames
  std::map<const Callee*, std::vector<OutputRun>> runs_;                // of parts
  std::vector<Definition> definitions_;
};

}  // namespace dyntape::codegen
