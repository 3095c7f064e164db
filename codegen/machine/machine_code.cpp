// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/machine/machine_code.h>

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>

#include <dyntape/codegen/machine/assemble.h>
#include <dyntape/codegen/machine/executable_memory.h>
#include <dyntape/codegen/options/lane_widths.h>
#include <dyntape/codegen/system/files.h>

namespace dyntape::codegen {
namespace {

dyntape_pattern described(const Pattern& p) {
  return {static_cast<std::uint32_t>(p.rows), static_cast<std::uint32_t>(p.cols),
          static_cast<std::uint32_t>(p.nnz()), p.row.data(), p.col.data()};
}

// A line for each kernel: where, how long, what.
void note_in_perf_map(const std::string& name, const MachineCode& code) {
  const char* const wanted = std::getenv("DYNTAPE_PERF_MAP");
  if (!wanted || !*wanted) return;
  std::ofstream map("/tmp/perf-" + std::to_string(getpid()) + ".map", std::ios::app);
  std::string line = name;
  std::replace(line.begin(), line.end(), '\n', ' ');
  std::size_t k = 0;
  for (const auto& instructions : code.instructions())
    map << std::hex << reinterpret_cast<std::uintptr_t>(instructions.data()) << " " << instructions.size()
        << std::dec << " dyntape " << line << " kernel " << k++ << "\n";
}

}  // namespace

bool MachineCode::is_possible() {
  const char* const wanted = std::getenv("DYNTAPE_MACHINE_CODE");
  return Encoder::can_encode(1) && !(wanted && std::string(wanted) == "off");
}

MachineCode::MachineCode(const Derivatives& highest)
    : jacobian_(highest.jacobian), hessian_(highest.hessian) {}
MachineCode::~MachineCode() = default;

std::vector<std::span<const std::uint8_t>> MachineCode::instructions() const {
  std::vector<std::span<const std::uint8_t>> all;
  for (std::size_t k = 0; k < made_.size(); ++k) all.push_back(memory_->code(k));
  return all;
}

void MachineCode::place() {
  std::vector<std::span<const std::uint8_t>> codes;
  for (const auto& kernel : made_) codes.emplace_back(kernel->instructions);
  memory_ = std::make_unique<const ExecutableMemory>(codes);
  for (std::size_t k = 0; k < made_.size(); ++k) {
    made_[k]->run_at(memory_->code(k));
    made_[k]->instructions = {};
  }
}

std::shared_ptr<const MachineCode> MachineCode::make(const std::vector<Derivatives>& derived,
                                                     const CodegenOptions& options) {
  if (!is_possible()) throw Unavailable("there is no machine code for this processor");
  const std::shared_ptr<MachineCode> code(new MachineCode(derived.back()));
  std::vector<unsigned> widths = {1};
  for (unsigned width : lane_widths(options.lanes)) {
    if (width > 1 && has_lanes(width) && Encoder::can_encode(int(width))) widths.push_back(width);
  }
  std::vector<std::shared_ptr<MachineKernel>> called;
  for (unsigned width : widths) {
    CalledKernels known;
    std::vector<std::shared_ptr<MachineKernel>> of_width;
    try {
      for (const Derivatives& d : derived) of_width.push_back(assemble(d, int(width), options, known));
    } catch (const Unavailable&) {
      if (width == 1) throw;
      continue;  // too long in lanes
    }
    code->made_.insert(code->made_.end(), of_width.begin(), of_width.end());
    for (const auto& [callee, kernel] : known) called.push_back(kernel);
  }
  const std::size_t own = code->made_.size();
  code->made_.insert(code->made_.end(), called.begin(), called.end());
  code->place();
  for (std::size_t k = 0; k < own; ++k) code->kernels_.push_back(code->made_[k]->kernel);
  note_in_perf_map(derived.front().function.name, *code);
  code->descriptor_.jacobian = described(code->jacobian_);
  code->descriptor_.hessian = described(code->hessian_);
  code->descriptor_.kernels = code->kernels_.data();
  code->descriptor_.n_kernels = static_cast<std::uint32_t>(code->kernels_.size());
  return code;
}

}  // namespace dyntape::codegen
