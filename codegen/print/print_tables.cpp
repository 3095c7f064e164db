// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/print_tables.h>

#include <dyntape/codegen/options/flags.h>
#include <dyntape/codegen/print/c_text.h>
#include <dyntape/codegen/print/print_pieces.h>

#include "embedded.inc"

namespace dyntape::codegen {
namespace {

constexpr const char* kWhat[] = {"values", "values and Jacobian", "values, Jacobian and weighted Hessian"};

std::string padded(std::string text, std::size_t width) {
  text.resize(std::max(width, text.size()), ' ');
  return text;
}

std::string block_line(const char* letter, const char* what, std::size_t n,
                       const std::vector<std::string>& names) {
  std::vector<std::string> words = {std::to_string(n), names.empty() ? what : std::string(what) + ":"};
  for (std::size_t i = 0; i < names.size(); ++i)
    words.push_back(c_comment(names[i]) + (i + 1 < names.size() ? "," : ""));
  return wrapped(std::string(" *   ") + padded(letter, 8), words);
}

std::string pattern_line(const char* letter, const char* what, const Pattern& pattern) {
  return wrapped(std::string(" *   ") + padded(letter, 8),
                 {std::to_string(pattern.nnz()), what, "(" + std::to_string(pattern.rows), "x",
                  std::to_string(pattern.cols) + ")"});
}

// The contract for this text; all of it where there are calls, whose text may contain anything.
std::vector<std::string> flags_for(const KernelSets& sets) {
  std::vector<Op> operators;
  for (const KernelPlan& kernel : sets.kernels) {
    const Graph& graph = kernel.derivatives.function.graph;
    if (!graph.callees().empty()) return contract_flags();
    for (const Node& node : graph.nodes()) operators.push_back(node.op);
  }
  return contract_flags(operators);
}

std::string pattern_initialiser(const char* name, const Pattern& pattern) {
  const std::string table = std::string("dt_") + name;
  return "  {" + std::to_string(pattern.rows) + "u, " + std::to_string(pattern.cols) + "u, " +
         std::to_string(pattern.nnz()) + "u, " +
         (pattern.nnz() ? table + "_row, " + table + "_col" : "NULL, NULL") + "}, /* " + name + " */\n";
}

std::string pattern_tables(const char* name, const Pattern& pattern) {
  return c_table(std::string("dt_") + name + "_row", pattern.row) +
         c_table(std::string("dt_") + name + "_col", pattern.col);
}

std::string block_initialiser(const char* letter, std::size_t n, const std::vector<std::string>& names) {
  return "  {" + std::to_string(n) + "u, " + (names.empty() ? "NULL" : std::string("dt_names_") + letter) +
         "}, /* " + letter + " */\n";
}

std::string guard_table(const Function& function) {
  if (function.guards.empty()) return {};
  std::string text =
      "static const dyntape_guard dt_guards[" + std::to_string(function.guards.size()) + "] = {\n";
  for (const Guard& guard : function.guards)
    text += "  {" + c_string(guard.file) + ", " + std::to_string(guard.line) + "u, " +
            (guard.expected ? "1u" : "0u") + "},\n";
  return text + "};\n";
}

std::string kernel_row(const KernelEntry& k, std::size_t lanes, const std::string& symbol) {
  return "  {" + std::to_string(k.order) + "u, " + std::to_string(lanes) + "u, " +
         std::to_string(k.work * lanes) + "u, " + std::to_string(k.operations) + "u, " +
         std::to_string(k.live) + "u, " + symbol + "},\n";
}

std::string kernel_table(const std::vector<KernelEntry>& kernels) {
  std::string declarations, rows;
  for (const int lanes : {1, 2, 4, 8}) {
    const std::string number = std::to_string(lanes);
    const std::string condition = lanes > 1 ? "#ifdef DYNTAPE_X" + number + "\n" : "";
    std::string names;
    rows += condition;
    for (const KernelEntry& k : kernels) {
      const std::string symbol = k.symbol + (lanes > 1 ? "_x" + number : "");
      names += (names.empty() ? "" : ", ") + symbol;
      rows += kernel_row(k, static_cast<std::size_t>(lanes), symbol);
    }
    if (lanes == 1) continue;
    declarations += condition + "dyntape_function " + names + ";\n#endif\n";
    rows += "#endif\n";
  }
  return declarations + "static const dyntape_kernel dt_kernels[] = {\n" + rows + "};\n";
}

}  // namespace

const char* generator_version() { return kVersion; }
const char* generator_fingerprint() { return kFingerprint; }
std::string descriptor_symbol(const std::string& content_hash) { return "dyntape_" + content_hash; }

std::string wrapped(const std::string& head, const std::vector<std::string>& words) {
  std::string text = head;
  std::size_t column = head.size();
  for (const std::string& word : words) {
    if (column + word.size() > 108 && column > head.size()) {
      text += "\n *" + std::string(head.size() - 2, ' ');
      column = head.size();
    }
    text += " " + word;
    column += word.size() + 1;
  }
  return text + "\n";
}

std::vector<std::string> operation_words(const KernelPlan& kernel) {
  const Function& function = kernel.derivatives.function;
  std::vector<std::string> words = {std::to_string(total_operations(function)), "operations:"};
  for (const OperationCount& entry : count_operations(function))
    words.push_back(std::to_string(entry.count) + " " + std::string(info(entry.op).name) + ",");
  const std::size_t pieces = kernel.schedule.pieces.size();
  words.push_back(std::to_string(kernel.schedule.live) + " values live at most,");
  words.push_back(std::to_string(pieces) + (pieces == 1 ? " piece" : " pieces"));
  return words;
}

std::string guard_list(const KernelSets& sets, const std::string& name) {
  const std::vector<Guard>& guards = sets.kernels.back().derivatives.function.guards;
  if (guards.empty()) return "";
  std::string text =
      " *\n * " + name + ": 0, or the number of the first branch that the recording did not take\n";
  for (std::size_t k = 0; k < guards.size(); ++k)
    text += " *   " + std::to_string(k + 1) + "  " + c_comment(guards[k].file) + ":" +
            std::to_string(guards[k].line) + "\n";
  return text;
}

std::string description(const KernelSets& sets, const std::string& compile_with) {
  const Function& f = sets.function;
  const Derivatives& d = sets.kernels.back().derivatives;
  std::string text = "/* " + c_comment(sets.name) + ": " + kWhat[sets.kernels.size() - 1] +
                     ".\n *\n * Generated by dyntape " + kVersion + "; do not edit.\n *   content hash  " +
                     sets.content_hash + "\n";
  text += compile_with.empty()
              ? wrapped(" *   compile with ", flags_for(sets)) + " *                 and never -ffast-math\n"
              : " *   compile       " + compile_with + "\n";
  if (sets.functions != Functions::kLibm)
    text += std::string(" *   ") +
            (sets.functions == Functions::kPortable ? "functions     " : "sin and cos   ") +
            "with the same bits on every processor\n";
  text += " *\n * inputs\n";
  text += block_line("x", "variables", f.n_x(), f.input_names[0]);
  text += block_line("p", "parameters", f.n_p(), f.input_names[1]);
  text += block_line("w", sets.kernels.size() > 2 ? "weights, then one an output for the Hessian" : "weights",
                     f.n_w(), f.input_names[2]);
  text += " *\n * outputs\n" + block_line("y", "values", f.n_y(), f.output_names);
  if (d.order >= Order::kFirst) text += pattern_line("jacobian", "non-zeros of dy/dx", d.jacobian);
  if (d.order >= Order::kSecond)
    text += pattern_line("hessian", "non-zeros of the lower triangle of sum_i w_i d2y_i/dx2", d.hessian);
  return text;
}

std::string banner(const KernelSets& sets, const Source& source) {
  std::string text =
      description(sets) + " *\n * kernels" + (source.needs_sleef ? ", to link with -lsleef" : "") + "\n";
  for (std::size_t k = 0; k < sets.kernels.size(); ++k)
    text += wrapped(" *   " + source.name + "_" + kKernelNames[k] + ":", operation_words(sets.kernels[k]));
  return text + " */\n";
}

std::string header_banner(const KernelSets& sets, const Source& source) {
  return "/* " + c_comment(sets.name) + ": declares what " + source.name +
         ".c defines.\n *\n * Generated by dyntape " + kVersion + "; do not edit.\n */\n";
}

std::string preamble() { return "#include <math.h>\n#include <stddef.h>\n#include <stdint.h>\n\n"; }

std::string open_c_linkage() { return "#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n"; }
std::string close_c_linkage() { return "\n#ifdef __cplusplus\n}\n#endif\n"; }
std::string abi_text() { return kAbiText; }

std::string export_macro() {
  return "#ifndef DYNTAPE_EXPORT\n#if defined(__GNUC__)\n"
         "#define DYNTAPE_EXPORT __attribute__((visibility(\"default\")))\n"
         "#else\n#define DYNTAPE_EXPORT\n#endif\n#endif\n";
}

std::string piece_macros() {
  return "\n/* The pieces of this file may be compiled apart, each unit with the numbers of its first and "
         "last. */\n"
         "#ifdef DYNTAPE_FIRST\n#define DT_LINKAGE\n#else\n#define DYNTAPE_FIRST 0\n"
         "#define DYNTAPE_LAST 2147483647\n#define DT_LINKAGE static\n#endif\n"
         "#if defined(__GNUC__)\n#define DT_PIECE DT_LINKAGE __attribute__((noinline))\n"
         "#define DT_RESTRICT __restrict__\n#else\n#define DT_PIECE DT_LINKAGE\n"
         "#define DT_RESTRICT\n#endif\n\n";
}

std::string descriptor_tables(const KernelSets& sets, const Source& source,
                              const std::vector<KernelEntry>& kernels) {
  const Function& f = sets.function;
  const Derivatives& d = sets.kernels.back().derivatives;
  std::string text = pattern_tables("jacobian", d.jacobian) + pattern_tables("hessian", d.hessian);
  text += c_table("dt_names_x", f.input_names[0]) + c_table("dt_names_p", f.input_names[1]) +
          c_table("dt_names_w", f.input_names[2]) + c_table("dt_names_y", f.output_names);
  text += guard_table(f) + kernel_table(kernels);
  text += "\nconst dyntape_descriptor " + source.symbol +
          " = {\n  DYNTAPE_ABI, (uint32_t)sizeof(dyntape_descriptor),\n  " +
          c_string(std::string("dyntape ") + kVersion) + ", " + c_string(sets.name) + ",\n  " +
          c_string(sets.content_hash) + ", \"double\",\n";
  text += block_initialiser("x", f.n_x(), f.input_names[0]) +
          block_initialiser("p", f.n_p(), f.input_names[1]) +
          block_initialiser("w", f.n_w(), f.input_names[2]) + block_initialiser("y", f.n_y(), f.output_names);
  text += pattern_initialiser("jacobian", d.jacobian) + pattern_initialiser("hessian", d.hessian);
  text += "  " + std::to_string(f.guards.size()) + "u, (uint32_t)(sizeof dt_kernels / sizeof *dt_kernels), " +
          (f.guards.empty() ? "NULL" : "dt_guards") + ", dt_kernels\n};\n";
  return text;
}

}  // namespace dyntape::codegen
