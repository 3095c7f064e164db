// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/print_c.h>

#include <dyntape/codegen/print/c_text.h>
#include <dyntape/codegen/print/print_header.h>
#include <dyntape/codegen/print/print_lanes.h>
#include <dyntape/codegen/print/print_pieces.h>
#include <dyntape/codegen/print/print_tables.h>

namespace dyntape::codegen {
namespace {

class Printer {
 public:
  explicit Printer(const KernelSets& sets)
      : sets_(sets),
        dialect_{.functions = sets.functions},
        functions_(sets.kernels, sets.piece_statements, dialect_) {
    source_.name = c_identifier(sets.name);
    source_.symbol = descriptor_symbol(sets.content_hash);
  }

  Source run() {
    std::string entries;
    for (std::size_t order = 0; order < sets_.kernels.size(); ++order) entries += add_kernel(order);
    add_descriptor(entries);
    source_.pieces.push_back(0);
    for (const Definition& d : functions_.definitions()) source_.pieces.push_back(d.statements);
    assemble();
    return std::move(source_);
  }

 private:
  using Definition = PieceFunctions::Definition;

  // Prints the pieces; returns the text of the entry point.
  std::string add_kernel(std::size_t order) {
    const KernelPlan& kernel = sets_.kernels[order];
    const Function& function = kernel.derivatives.function;
    const BodyStyle style{{kInputNames[0], kInputNames[1], kInputNames[2]},
                          outputs_of(kernel.derivatives),
                          functions_.texts(),
                          dialect_};
    const std::string calls = functions_.add_pieces(std::string("dt_") + kKernelNames[order], function,
                                                    kernel.schedule, style, "_block", "    ");
    source_.operations.push_back(total_operations(function));
    return entry_point(order, style, calls);
  }

  // The loop over blocks of lanes.  Outputs that are not wanted are written to the work array.
  std::string entry_point(std::size_t order, const BodyStyle& style, const std::string& calls) const {
    const KernelPlan& kernel = sets_.kernels[order];
    std::string pointers, unused;
    const auto offset = [](const std::string& name, std::size_t n) {
      return name + " + block * (strides ? strides->" + name + " : " + std::to_string(n) +
             " * DYNTAPE_LANES)";
    };
    for (int block = 0; block < kBlocks; ++block) {
      const std::string name = kInputNames[block];
      if (calls.find(name + "_block") == std::string::npos) {
        unused += "  (void)" + name + ";\n";
        continue;
      }
      pointers += "    const reals* const " + name + "_block = (const reals*)(" +
                  offset(name, kernel.derivatives.function.inputs[block]) + ");\n";
    }
    const std::size_t work = functions_.work(kernel.derivatives.function, kernel.schedule);
    std::size_t scratch = work;
    for (std::size_t g = 0; g < std::size(kOutputNames); ++g) {
      const std::string name = kOutputNames[g];
      const std::size_t n = g < style.outputs.size() ? style.outputs[g].end - style.outputs[g].begin : 0;
      if (n == 0) {
        unused += "  (void)" + name + ";\n";
        continue;
      }
      pointers += "    reals* const " + name + "_block = (reals*)(" + name + " ? " + offset(name, n) +
                  " : work + " + std::to_string(scratch) + " * DYNTAPE_LANES);\n";
      scratch += n;
    }
    if (scratch == 0) unused += "  (void)work;\n";
    if (work) pointers += "    reals* const work_block = (reals*)work;\n";
    if (pointers.empty()) unused += "  (void)strides;\n";
    const bool guarded = !kernel.derivatives.function.guards.empty();
    return "void DT_NAME(" + source_.name + "_" + kKernelNames[order] + ")(" + entry_parameters() +
           ") {\n  size_t block, lane;\n" + unused +
           "  for (block = 0; block < lanes / DYNTAPE_LANES; ++block) {\n" + pointers +
           (guarded ? "    dt_words guard = {0};\n" : "") + calls +
           "    for (lane = 0; status && lane < DYNTAPE_LANES; ++lane)\n"
           "      status[block * DYNTAPE_LANES + lane] = " +
           (guarded ? "(uint32_t)((const int64_t*)&guard)[lane]" : "0u") +
           ";\n  }\n  DT_LEAVE(block);\n}\n\n";
  }

  static std::string entry_parameters() {
    return "const double* x, const double* p, const double* w, double* y,\n    double* jacobian, double* "
           "hessian, "
           "double* work, size_t lanes, const dyntape_strides* strides,\n    uint32_t* status";
  }

  void add_descriptor(const std::string& entries) {
    for (std::size_t order = 0; order < sets_.kernels.size(); ++order) {
      const KernelPlan& kernel = sets_.kernels[order];
      kernels_.push_back(
          {source_.name + "_" + kKernelNames[order], order,
           functions_.work(kernel.derivatives.function, kernel.schedule) + kernel.derivatives.function.n_y(),
           source_.operations[order], kernel.schedule.live});
    }
    descriptor_ =
        entries + "#if DYNTAPE_LANES == 1\n" + descriptor_tables(sets_, source_, kernels_) + "#endif\n";
  }

  std::string entry_declarations() const {
    std::string text;
    for (std::size_t order = 0; order < sets_.kernels.size(); ++order)
      text += "void " + source_.name + "_" + kKernelNames[order] + "(" + entry_parameters() + ");\n";
    return text + "extern DYNTAPE_EXPORT const dyntape_descriptor " + source_.symbol + ";\n";
  }

  void assemble() {
    const Vocabulary words = vocabulary(sets_, functions_.callees());
    source_.needs_sleef = needs_sleef(words, sets_.functions);
    const std::vector<Definition>& definitions = functions_.definitions();
    std::string& text = source_.text;
    text = banner(sets_, source_) + preamble() + open_c_linkage() + abi_text() + "\n" + export_macro() +
           piece_macros() + real_types(words);
    // Kernels written by hand come first, and what their functions are called by is not changed yet.
    for (std::size_t k = 0; k < definitions.size(); ++k) {
      if (definitions[k].is_kernel()) text += piece(k);
    }
    text += real_functions(words, sets_.functions) + "\n";
    for (const Definition& d : definitions) text += d.declaration + ";\n";
    text += entry_declarations();
    for (std::size_t k = 0; k < definitions.size(); ++k) {
      if (!definitions[k].is_kernel()) text += piece(k);
    }
    text += "\n" + piece_guard(0) + descriptor_ + "#endif\n" + close_c_linkage();
    source_.header = header_banner(sets_, source_) + "#ifndef " + source_.symbol + "_H\n#define " +
                     source_.symbol + "_H\n" + preamble() + open_c_linkage() + abi_text() + "\n" +
                     export_macro() + "\n" + header_sizes(sets_, source_, kernels_) + entry_declarations() +
                     close_c_linkage() + "#endif\n";
  }

  std::string piece(std::size_t k) const {
    const Definition& d = functions_.definitions()[k];
    return "\n" + piece_guard(k + 1) + d.head + " {\n" + d.body + "}\n#endif\n";
  }

  static std::string piece_guard(std::size_t k) {
    const std::string number = std::to_string(k);
    return "#if DYNTAPE_FIRST <= " + number + " && " + number + " <= DYNTAPE_LAST\n";
  }

  const KernelSets& sets_;
  const Dialect dialect_;
  Source source_;
  PieceFunctions functions_;
  std::string descriptor_;
  std::vector<KernelEntry> kernels_;
};

}  // namespace

Source print_c(const KernelSets& sets) { return Printer(sets).run(); }

}  // namespace dyntape::codegen
