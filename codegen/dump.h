// SPDX-License-Identifier: BSD-3-Clause
//
// Writes the result of each stage of the pipeline to files, for inspection, if DYNTAPE_DUMP=folder is set.
//
//   const Dump dump("arm");            does nothing unless the variable is set
//   dump.graph("recorded", function);  folder/arm.recorded.txt
#pragma once

#include <string>
#include <vector>

#include <dyntape/codegen/machine/machine_code.h>
#include <dyntape/codegen/print/source.h>

namespace dyntape::codegen {

class Dump {
 public:
  explicit Dump(const std::string& name);

  void graph(const std::string& stage, const Function& function) const;
  void graphs(const std::string& stage, const std::vector<Derivatives>& derivatives) const;
  void schedules(const std::vector<KernelPlan>& plans) const;
  // Instructions, disassembled if objdump exists.
  void machine(const MachineCode& code) const;
  void text(const std::string& extension, const std::string& text) const;

 private:
  std::string prefix_;  // empty: nothing is written
};

}  // namespace dyntape::codegen
