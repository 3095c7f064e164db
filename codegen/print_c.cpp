// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print_c.h>

#include <algorithm>
#include <map>

#include <dyntape/autodiff/callee.h>
#include <dyntape/codegen/c_text.h>
#include <dyntape/codegen/print_body.h>
#include <dyntape/codegen/print_lanes.h>
#include <dyntape/codegen/print_tables.h>

namespace dyntape::codegen {
namespace {

constexpr const char* kKernelNames[] = {"value", "first_order", "second_order"};
constexpr const char* kOutputNames[] = {"y", "jacobian", "hessian"};
constexpr const char* kInputNames[] = {"x", "p", "w"};

// All callees that the kernels reach, each after those it calls itself.  An explicit stack: calls nest.
std::vector<const Callee*> collect_callees(const KernelSets& sets) {
  std::vector<const Callee*> order, stack;
  std::map<const Callee*, bool> done;
  const auto push_all = [&](const Graph& graph) {
    for (const auto& callee : graph.callees()) stack.push_back(callee.get());
  };
  for (const KernelPlan& kernel : sets.kernels) push_all(kernel.derivatives.function.graph);
  while (!stack.empty()) {
    const Callee* callee = stack.back();
    const auto [entry, is_new] = done.emplace(callee, false);
    if (is_new && callee->recorded) {
      push_all(callee->recorded->graph);
      continue;
    }
    stack.pop_back();
    if (!entry->second) order.push_back(callee);
    entry->second = true;
  }
  return order;
}

class Printer {
 public:
  explicit Printer(const KernelSets& sets) : sets_(sets) {
    source_.name = c_identifier(sets.name);
    source_.symbol = descriptor_symbol(sets.content_hash);
    for (const Callee* callee : collect_callees(sets)) {
      callees_.emplace_back(callee);
      callee_names_[callee] = "dt_" + c_identifier(callee->name) + "_" + std::to_string(callees_.size());
    }
  }

  Source run() {
    source_.pieces.push_back(0);
    for (const Callee* callee : callees_) add_callee(*callee);
    std::string entries;
    for (std::size_t order = 0; order < sets_.kernels.size(); ++order) entries += add_kernel(order);
    add_descriptor(entries);
    assemble();
    return std::move(source_);
  }

 private:
  struct Definition {
    std::string declaration, head, body;
  };

  // `head` begins the definition: empty, the same as the declaration.
  void add_piece(const std::string& declaration, std::string body, std::size_t statements,
                 const std::string& head = "") {
    const std::string declared = "DT_PIECE " + declaration;
    definitions_.push_back({declared, head.empty() ? declared : head, std::move(body)});
    source_.pieces.push_back(statements);
  }

  void add_callee(const Callee& callee) {
    const std::string name = callee_names_.at(&callee);
    std::string body = "  (void)in;\n  (void)out;\n";
    std::string head;
    if (callee.recorded) {
      const Function& function = *callee.recorded;
      const Schedule s = schedule(function, {{0, function.n_y()}}, sets_.piece_statements);
      const BodyStyle style{{"in", "", ""}, {{"out", "out", 0, function.n_y()}}, callee_names_};
      if (s.work) body += "  real work[" + std::to_string(s.work) + "];\n";
      if (s.pieces.size() == 1) {
        append_piece(body, function, s, 0, style);
      } else {
        body += add_pieces(name, function, s, style, "", "  ");
      }
    } else if (!callee.c_body_of_lanes.empty()) {
      body += "#if DYNTAPE_LANES == 1\n" + callee.c_body + "#else\n" + callee.c_body_of_lanes + "#endif\n";
    } else {
      body += callee.c_body + "\n";
      head = "DT_KERNEL(" + name + ", " + std::to_string(callee.n_in) + ", " + std::to_string(callee.n_out) +
             ")";
    }
    const auto statements = static_cast<std::size_t>(std::count(body.begin(), body.end(), '\n'));
    add_piece("void DT_NAME(" + name + ")(\n    const reals* DT_RESTRICT in, reals* DT_RESTRICT out)",
              std::move(body), statements, head);
  }

  // A function for each piece; returns the text that calls them in order.  The caller's arrays are called as
  // in the style, with a suffix.
  std::string add_pieces(const std::string& name, const Function& function, const Schedule& s,
                         const BodyStyle& style, const std::string& suffix, const std::string& indent) {
    std::string calls;
    for (std::size_t k = 0; k < s.pieces.size(); ++k) {
      const std::string piece = name + "_" + std::to_string(k + 1);
      std::string body;
      append_piece(body, function, s, k, style);
      const auto [parameters, arguments] = signature(s, s.pieces[k], style, suffix);
      add_piece("void DT_NAME(" + piece + ")(" + parameters + ")", std::move(body),
                s.pieces[k].end - s.pieces[k].begin);
      calls += indent + "DT_NAME(" + piece + ")(" + arguments + ");\n";
    }
    return calls;
  }

  // Output arrays of the kernel with their headings.
  static std::vector<OutputArray> outputs_of(const Derivatives& d) {
    const auto heading = [](const char* what, const Pattern& pattern, std::size_t places) {
      return std::string(what) + " (" + std::to_string(pattern.nnz()) + " of " + std::to_string(places) +
             " entries)";
    };
    const std::size_t j = d.n_y, h = j + d.jacobian.nnz(), end = h + d.hessian.nnz();
    std::vector<OutputArray> outputs = {{kOutputNames[0], "value (" + std::to_string(d.n_y) + ")", 0, j}};
    if (d.order >= Order::kFirst)
      outputs.push_back(
          {kOutputNames[1], heading("Jacobian", d.jacobian, d.jacobian.rows * d.jacobian.cols), j, h});
    if (d.order >= Order::kSecond)
      outputs.push_back(
          {kOutputNames[2],
           heading("lower triangle of the Hessian", d.hessian, d.hessian.rows * (d.hessian.rows + 1) / 2), h,
           end});
    return outputs;
  }

  // Prints the pieces; returns the text of the entry point.
  std::string add_kernel(std::size_t order) {
    const KernelPlan& kernel = sets_.kernels[order];
    const Function& function = kernel.derivatives.function;
    const BodyStyle style{
        {kInputNames[0], kInputNames[1], kInputNames[2]}, outputs_of(kernel.derivatives), callee_names_};
    const std::string calls = add_pieces(std::string("dt_") + kKernelNames[order], function, kernel.schedule,
                                         style, "_block", "    ");
    source_.operations.push_back(operations(function));
    return entry_point(order, style, calls);
  }

  // Parameters of the function for a piece, and what its caller passes: only what it uses.
  static std::pair<std::string, std::string> signature(const Schedule& schedule, const Piece& piece,
                                                       const BodyStyle& style, const std::string& suffix) {
    std::string parameters, arguments;
    const auto add = [&](const std::string& type, const std::string& name, const std::string& argument) {
      parameters += (parameters.empty() ? "\n    " : ", ") + type + name;
      arguments += (arguments.empty() ? "" : ", ") + argument;
    };
    for (int block = 0; block < kBlocks; ++block) {
      if (!piece.inputs[block].empty())
        add("const reals* DT_RESTRICT ", style.inputs[block], style.inputs[block] + suffix);
    }
    std::vector<bool> writes(style.outputs.size(), false);
    bool checks = false, works = !piece.loads.empty() || !piece.stores.empty();
    for (std::size_t i = piece.begin; i < piece.end; ++i) {
      const Step& step = schedule.steps[i];
      checks = checks || step.kind == Step::Kind::kCheck;
      const CallPlace* place = step.kind == Step::Kind::kCompute ? schedule.long_call(step.index) : nullptr;
      works = works || place;
      if (step.kind != Step::Kind::kStore && !place) continue;
      const std::size_t output = place ? place->outputs : step.index;
      for (std::size_t g = 0; g < writes.size(); ++g) {
        if (output >= style.outputs[g].begin && output < style.outputs[g].end) writes[g] = true;
      }
    }
    for (std::size_t g = 0; g < writes.size(); ++g) {
      if (writes[g]) add("reals* DT_RESTRICT ", style.outputs[g].name, style.outputs[g].name + suffix);
    }
    if (works) add("reals* DT_RESTRICT ", "work", "work" + suffix);
    if (checks) add("dt_words* ", "guard", "&guard");
    return {parameters.empty() ? "void" : parameters, arguments};
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
    std::size_t scratch = kernel.schedule.work;
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
    if (kernel.schedule.work) pointers += "    reals* const work_block = (reals*)work;\n";
    if (pointers.empty()) unused += "  (void)strides;\n";
    const bool guarded = !kernel.derivatives.function.guards.empty();
    return "void DT_NAME(" + source_.name + "_" + kKernelNames[order] + ")(" + entry_parameters() +
           ") {\n  size_t block, lane;\n" + unused +
           "  for (block = 0; block < lanes / DYNTAPE_LANES; ++block) {\n" + pointers +
           (guarded ? "    dt_words guard = {0};\n" : "") + calls +
           "    for (lane = 0; status && lane < DYNTAPE_LANES; ++lane)\n"
           "      status[block * DYNTAPE_LANES + lane] = " +
           (guarded ? "(uint32_t)((const int64_t*)&guard)[lane]" : "0u") + ";\n  }\n}\n\n";
  }

  static std::string entry_parameters() {
    return "const double* x, const double* p, const double* w, double* y,\n    double* jacobian, double* "
           "hessian, "
           "double* work, size_t lanes, const dyntape_strides* strides,\n    uint32_t* status";
  }

  void add_descriptor(const std::string& entries) {
    std::vector<KernelEntry> kernels;
    for (std::size_t order = 0; order < sets_.kernels.size(); ++order) {
      const KernelPlan& kernel = sets_.kernels[order];
      kernels.push_back({source_.name + "_" + kKernelNames[order], order,
                         kernel.schedule.work + kernel.derivatives.function.n_y(), source_.operations[order],
                         kernel.schedule.live});
    }
    descriptor_ =
        entries + "#if DYNTAPE_LANES == 1\n" + descriptor_tables(sets_, source_, kernels) + "#endif\n";
  }

  std::string entry_declarations() const {
    std::string text;
    for (std::size_t order = 0; order < sets_.kernels.size(); ++order)
      text += "void " + source_.name + "_" + kKernelNames[order] + "(" + entry_parameters() + ");\n";
    return text + "extern DYNTAPE_EXPORT const dyntape_descriptor " + source_.symbol + ";\n";
  }

  void assemble() {
    const Vocabulary words = vocabulary(sets_, callees_);
    std::string& text = source_.text;
    text = banner(sets_, source_) + preamble() + open_c_linkage() + abi_text() + "\n" + export_macro() +
           piece_macros() + real_types(words);
    // Kernels written by hand come first, and what their functions are called by is not changed yet.
    for (std::size_t k = 0; k < definitions_.size(); ++k) {
      if (definitions_[k].head != definitions_[k].declaration) text += piece(k);
    }
    text += real_functions(words, sets_.functions) + "\n";
    for (const Definition& d : definitions_) text += d.declaration + ";\n";
    text += entry_declarations();
    for (std::size_t k = 0; k < definitions_.size(); ++k) {
      if (definitions_[k].head == definitions_[k].declaration) text += piece(k);
    }
    text += "\n" + piece_guard(0) + descriptor_ + "#endif\n" + close_c_linkage();
    source_.header = header_banner(sets_, source_) + "#ifndef " + source_.symbol + "_H\n#define " +
                     source_.symbol + "_H\n" + preamble() + open_c_linkage() + abi_text() + "\n" +
                     export_macro() + entry_declarations() + close_c_linkage() + "#endif\n";
  }

  std::string piece(std::size_t k) const {
    const Definition& d = definitions_[k];
    return "\n" + piece_guard(k + 1) + d.head + " {\n" + d.body + "}\n#endif\n";
  }

  static std::string piece_guard(std::size_t k) {
    const std::string number = std::to_string(k);
    return "#if DYNTAPE_FIRST <= " + number + " && " + number + " <= DYNTAPE_LAST\n";
  }

  const KernelSets& sets_;
  Source source_;
  std::vector<const Callee*> callees_;
  std::map<const Callee*, std::string> callee_names_;
  std::vector<Definition> definitions_;
  std::string descriptor_;
};

}  // namespace

Source print_c(const KernelSets& sets) { return Printer(sets).run(); }

}  // namespace dyntape::codegen
