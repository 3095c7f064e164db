// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/machine/machine_code.h>

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include <dyntape/codegen/machine/assemble.h>
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
  std::size_t k = 0;
  for (const auto& instructions : code.instructions())
    map << std::hex << reinterpret_cast<std::uintptr_t>(instructions.data()) << " " << instructions.size()
        << std::dec << " dyntape " << name << " kernel " << k++ << "\n";
}

}  // namespace

void rethrow_thrown() {
  if (const std::exception_ptr thrown = take_thrown()) std::rethrow_exception(thrown);
}

bool MachineCode::is_possible() {
  const char* const wanted = std::getenv("DYNTAPE_MACHINE_CODE");
  return Encoder::can_encode(1) && !(wanted && std::string(wanted) == "off");
}

MachineCode::MachineCode(const Derivatives& highest)
    : jacobian_(highest.jacobian), hessian_(highest.hessian) {}
MachineCode::~MachineCode() = default;

std::vector<std::span<const std::uint8_t>> MachineCode::instructions() const {
  std::vector<std::span<const std::uint8_t>> all;
  for (const auto& kernel : made_) all.push_back(kernel->memory->code());
  return all;
}

std::shared_ptr<const MachineCode> MachineCode::make(const std::vector<Derivatives>& derived,
                                                     const CodegenOptions& options) {
  if (!is_possible()) throw Unavailable("there is no machine code for this processor");
  const std::shared_ptr<MachineCode> code(new MachineCode(derived.back()));
  std::vector<unsigned> widths = {1};
  for (unsigned width : lane_widths(options.lanes)) {
    if (width > 1 && has_lanes(width) && Encoder::can_encode(int(width))) widths.push_back(width);
  }
  for (unsigned width : widths) {
    CalledKernels called;
    for (const Derivatives& d : derived) {
      code->made_.push_back(assemble(d, int(width), options.functions, called));
      code->kernels_.push_back(code->made_.back()->kernel);
    }
  }
  note_in_perf_map(derived.front().function.name, *code);
  code->descriptor_.jacobian = described(code->jacobian_);
  code->descriptor_.hessian = described(code->hessian_);
  code->descriptor_.kernels = code->kernels_.data();
  code->descriptor_.n_kernels = static_cast<std::uint32_t>(code->kernels_.size());
  return code;
}

}  // namespace dyntape::codegen
