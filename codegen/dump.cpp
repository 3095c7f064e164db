// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/dump.h>

#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include <dyntape/autodiff/graph/dump.h>
#include <dyntape/codegen/print/c_text.h>
#include <dyntape/codegen/system/files.h>
#include <dyntape/codegen/system/process.h>

namespace dyntape::codegen {
namespace {

std::string schedule_text(const Schedule& schedule) {
  std::string text = std::to_string(schedule.steps.size()) + " steps, " + std::to_string(schedule.live) +
                     " values live at most, " + std::to_string(schedule.work) + " slots of work\n";
  for (const Section& section : schedule.sections)
    text += "section " + std::to_string(section.group) + ": steps " + std::to_string(section.begin) + " to " +
            std::to_string(section.end) + "\n";
  for (const Piece& piece : schedule.pieces)
    text += "piece: steps " + std::to_string(piece.begin) + " to " + std::to_string(piece.end) + ", loads " +
            std::to_string(piece.loads.size()) + ", stores " + std::to_string(piece.stores.size()) + "\n";
  return text;
}

}  // namespace

Dump::Dump(const std::string& name) {
  const char* folder = std::getenv("DYNTAPE_DUMP");
  if (!folder || !*folder) return;
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  prefix_ = std::string(folder) + "/" + c_identifier(name) + ".";
}

void Dump::graph(const std::string& stage, const Function& function) const {
  if (!prefix_.empty()) text(stage + ".txt", dyntape::to_text(function));
}

void Dump::graphs(const std::string& stage, const std::vector<Derivatives>& derivatives) const {
  for (const Derivatives& d : derivatives)
    graph(stage + std::to_string(static_cast<int>(d.order)), d.function);
}

void Dump::schedules(const std::vector<KernelPlan>& plans) const {
  if (prefix_.empty()) return;
  for (const KernelPlan& plan : plans)
    text("schedule" + std::to_string(static_cast<int>(plan.derivatives.order)) + ".txt",
         schedule_text(plan.schedule));
}

void Dump::machine(const MachineCode& code) const {
  if (prefix_.empty()) return;
  const std::string objdump = "/usr/bin/objdump";
  std::size_t k = 0;
  for (const auto& instructions : code.instructions()) {
    const dyntape_kernel& kernel = code.descriptor().kernels[k++];
    const std::string name =
        "machine" + std::to_string(kernel.order) + ".lanes" + std::to_string(kernel.lane_width);
    text(name + ".bin", {reinterpret_cast<const char*>(instructions.data()), instructions.size()});
    if (access(objdump.c_str(), X_OK) != 0) continue;
    std::vector<std::string> command = {objdump, "-D", "-b", "binary"};
#if defined(__aarch64__)
    command.insert(command.end(), {"-m", "aarch64"});
#else
    command.insert(command.end(), {"-m", "i386:x86-64", "-M", "intel"});
#endif
    command.push_back(prefix_ + name + ".bin");
    run_all({{command, prefix_ + name + ".asm", {}}}, {});
  }
}

void Dump::text(const std::string& extension, const std::string& text) const {
  if (!prefix_.empty()) write_file(prefix_ + extension, text);
}

}  // namespace dyntape::codegen
