// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/cg/code_handler.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <sstream>

#include <dyntape/autodiff/graph/dump.h>
#include <dyntape/autodiff/graph/formulas.h>
#include <dyntape/codegen/pipeline.h>
#include <dyntape/codegen/print/print_body.h>
#include <dyntape/codegen/schedule/schedule.h>
#include <dyntape/interface/cppad/library.h>

namespace CppAD::inline dyntape_names::cg {

using namespace dyntape;

namespace {

// The statements of a function, without what they stand in.
std::string statements_of(const Function& function, const PrintedNames& names, bool single,
                          const std::map<const Callee*, codegen::CalleeText>& callees = {}) {
  // Where the statements will stand sin is libm's.
  const codegen::Schedule order =
      codegen::schedule(function, {{0, function.outputs.size()}}, SIZE_MAX, Functions::kLibm);
  const codegen::BodyStyle style{{names.independent, "p", "w"},
                                 {{names.dependent, "results", 0, function.outputs.size()}},
                                 callees,
                                 {.lanes = false, .single = single}};
  std::string text = std::string("  typedef ") + (single ? "float" : "double") + " real;\n" +
                     "#undef dt_select\n#define dt_select(condition, a, b) ((condition) ? (a) : (b))\n";
  if (order.work) text += "  real work[" + std::to_string(order.work) + "];\n";
  codegen::append_piece(text, function, order, 0, style);
  return text;
}

std::string block_of(Function function, const PrintedNames& names, bool single) {
  const bool branches = !function.guards.empty();
  function.guards.clear();
  return std::string(branches ? "  /* holds where the comparisons of the recording come out as they did */\n"
                              : "") +
         "  {\n" + statements_of(function, names, single) + "  }\n";
}

bool is_single(const char* who, const std::string& type) {
  if (type != "double" && type != "float")
    detail::refuse(std::string(who) + ": there is no C of the type \"" + type +
                   "\"; there are double and float");
  return type == "float";
}

std::string c_of(Function function, const PrintedLanguage& language, const PrintedNames& names) {
  const bool single = is_single("LanguageC", language.type);
  if (language.name.empty()) return block_of(std::move(function), names, single);
  function.name = language.name;
  CodegenOptions options;
  options.order = Order::kValue;
  codegen::EmbeddedOptions how;
  how.single = single;
  return generate_embedded(function, options, how).source.text;
}

// A drawing, or formulas.
std::string readable(Function function, const PrintedLanguage& language, const PrintedNames& names) {
  if (language.kind == PrintedLanguage::kDot) {
    function.name = "algorithm";
    for (std::size_t j = 0; j < function.n_x(); ++j)
      function.input_names[0].push_back(names.independent + "[" + std::to_string(j) + "]");
    for (std::size_t i = 0; i < function.n_y(); ++i)
      function.output_names.push_back(names.dependent + "[" + std::to_string(i) + "]");
    return to_dot(function, SIZE_MAX);
  }
  const FormulaStyle style{language.open, language.close, names.independent, names.dependent,
                           names.temporary};
  if (language.kind == PrintedLanguage::kLatex) return to_latex(function, style);
  return "<!DOCTYPE html>\n<html>\n<head>\n<meta charset=\"utf-8\">\n<style>\n" + language.style +
         "\n</style>\n<script>\n" + language.script + "\n</script>\n" + language.head +
         "\n</head>\n<body>\n" + to_mathml(function, style) + "</body>\n</html>\n";
}

}  // namespace

std::size_t print_recording(std::ostream& out, const std::vector<AD<double>>& y,
                            const PrintedLanguage& language, const PrintedNames& names) {
  const auto recording = detail::recorded_so_far(y.data(), y.size());
  if (!recording->kernels.empty())
    detail::refuse("CodeHandler: the recording calls a function of the user, of which there is no C");
  Function function = *recording->function;
  function.outputs.resize(recording->range);  // without those of prints
  function = compact(function);
  const std::size_t shared = shared_values(function);
  if (language.kind == PrintedLanguage::kC) {
    const std::string text = c_of(std::move(function), language, names);
    out << text;
    if (language.sources && !language.name.empty()) (*language.sources)[language.name + ".c"] = text;
  } else {
    out << readable(std::move(function), language, names);
  }
  return shared;
}

}  // namespace CppAD::inline dyntape_names::cg

namespace CppAD::inline dyntape_names::detail {

namespace {

bool is_c_name(const std::string& name) {
  return std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_'; });
}

// Declares the user's C function of this name, and a macro of (in, out) that calls it.
void write_called(std::ostream& out, const Callee& callee, const KernelName& called, const std::string& macro,
                  const std::string& type) {
  if (called.kind == KernelName::kDiscrete) {
    const std::string function = "cppad_discrete_" + called.name;
    out << type << " " << function << "(const " << type << " x);\n"
        << "#define " << macro << "(in, out) (out)[0] = " << function << "((in)[0])\n";
    return;
  }
  const std::string function = "cppad_atomic_" + called.name;
  out << "int " << function << "(size_t call_id, size_t nx, const " << type << "* x, size_t ny, " << type
      << "* y, size_t* compare_change);\n"
      << "#define " << macro << "(in, out) do { const int error = " << function << "(" << called.call_id
      << ", " << callee.n_in << ", in, " << callee.n_out
      << ", out, compare_change); if (error) return error; } while (0)\n";
}

}  // namespace

void write_csrc(std::ostream& out, const Function& function, const Kernels& kernels,
                const std::vector<std::size_t>& guard_counts, std::size_t range, const std::string& name,
                const std::string& type) {
  const bool single = cg::is_single("to_csrc", type);
  if (name.empty()) refuse("to_csrc: the function has no name, expected function_name_set(...) before it");
  Function values = function;
  values.outputs.resize(range);
  values = compact(values);
  std::ostringstream declarations;
  std::map<const Callee*, codegen::CalleeText> callees;
  for (const auto& callee : values.graph.callees()) {
    const auto kernel = kernels.find(callee.get());
    const KernelName called = kernel == kernels.end() ? KernelName() : kernel->second->called();
    if (called.kind == KernelName::kOther || !is_c_name(called.name))
      refuse("to_csrc: \"" + name + "\" calls \"" + (called.name.empty() ? callee->name : called.name) +
             "\", expected atomic_three, atomic_four or discrete functions whose names are names in C;"
             " to_library() interprets others");
    const std::string macro = "dt_call_" + std::to_string(callees.size());
    write_called(declarations, *callee, called, macro, type);
    callees[callee.get()].name = macro;
  }
  const std::size_t n_p = values.n_p(), n_u = n_p + values.n_x();
  std::ostringstream counts;  // of equal comparisons
  for (std::size_t k = 0; k < values.guards.size(); ++k)
    counts << "#define dt_count_" << k + 1 << "u " << (guard_counts.empty() ? 1 : guard_counts[k]) << "\n";
  out << "#include <math.h>\n#include <stddef.h>\n\n"
         "#define DT_CHECK(violated, k) if (violated) *compare_change += dt_count_##k\n"
      << counts.str() << "\n"
      << declarations.str() << "int cppad_jit_" << name << "(size_t nu, const " << type << "* u, size_t ny, "
      << type << "* y, size_t* compare_change) {\n"
      << "  const " << type << " *const p = u, *const x = u + " << n_p << ";\n"
      << "  (void)p, (void)x, (void)compare_change;\n  if (nu != " << n_u
      << ") return 1;\n  if (ny != " << range << ") return 2;\n  {\n"
      << cg::statements_of(values, {}, single, callees) << "  }\n  return 0;\n}\n";
}

}  // namespace CppAD::inline dyntape_names::detail
