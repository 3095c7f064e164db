// SPDX-License-Identifier: BSD-3-Clause
//
// A compiled function behind CasADi's interface, in this process: what print_casadi() prints, without a file or a compiler.
//
//   const CasadiProgram program(recorded, blocks, options);        as machine code, unless the options say otherwise
//   program.functions()[1]                                         jac_f: what its arguments are (print/casadi_functions.h)
//   program.call(1, arg, res)                                      0, or 1 where the evaluation fails
#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include <dyntape/codegen/compiled_function.h>
#include <dyntape/codegen/print/casadi_functions.h>

namespace dyntape::codegen {

class CasadiProgram {
 public:
  CasadiProgram(const Function& function, const CasadiBlocks& blocks, const CodegenOptions& options);
  ~CasadiProgram();

  const std::vector<CasadiFunction>& functions() const { return functions_; }
  // Any number of threads at a time.  What is null is zero, or not wanted.
  int call(std::size_t function, const double* const* arg, double* const* res) const noexcept;

 private:
  struct Room;
  void run(const CasadiFunction& function, const double* const* arg, double* const* res, Room& room) const;

  const CompiledFunction compiled_;
  const std::vector<CasadiFunction> functions_;
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Room>> rooms_;  // not in use by an evaluation
};

}  // namespace dyntape::codegen
