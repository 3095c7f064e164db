// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/cg/code_handler.h>

#include <map>

#include <dyntape/codegen/pipeline.h>
#include <dyntape/codegen/print/print_body.h>
#include <dyntape/codegen/schedule/schedule.h>
#include <dyntape/interface/cppad/library.h>

namespace CppAD::inline dyntape_names::cg {

using namespace dyntape;

namespace {

// The statements of a function, without what they stand in.
std::string statements_of(const Function& function, const PrintedNames& names, bool single) {
  // Where the statements will stand sin is libm's.
  const codegen::Schedule order =
      codegen::schedule(function, {{0, function.outputs.size()}}, SIZE_MAX, Functions::kLibm);
  const std::map<const Callee*, codegen::CalleeText> none;
  const codegen::BodyStyle style{{names.independent, "p", "w"},
                                 {{names.dependent, "results", 0, function.outputs.size()}},
                                 none,
                                 {.lanes = false, .single = single}};
  std::string text = std::string("  typedef ") + (single ? "float" : "double") + " real;\n" +
                     "#undef dt_select\n#define dt_select(condition, a, b) ((condition) ? (a) : (b))\n";
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

}  // namespace

void print_recording(std::ostream& out, const std::vector<AD<double>>& y, const std::string& type,
                     const std::string& name, const PrintedNames& names) {
  const bool single = is_single("LanguageC", type);
  ADFun<double> f;
  f.Dependent(y);
  if (!f.core().recording().kernels.empty())
    detail::refuse("CodeHandler: the recording calls a function of the user, of which there is no C");
  if (name.empty()) {
    out << block_of(to_function(f), names, single);
    return;
  }
  f.function_name_set(name);
  CodegenOptions options;
  options.order = Order::kValue;
  codegen::EmbeddedOptions how;
  how.single = single;
  out << generate_embedded(to_function(f), options, how).source.text;
}

}  // namespace CppAD::inline dyntape_names::cg

namespace CppAD::inline dyntape_names::detail {

void write_csrc(std::ostream& out, const Function& function, std::size_t range, const std::string& name,
                const std::string& type) {
  const bool single = cg::is_single("to_csrc", type);
  if (name.empty()) refuse("to_csrc: the function has no name, expected function_name_set(...) before it");
  if (!function.graph.callees().empty())
    refuse("to_csrc: \"" + name +
           "\" calls a function of the user, of which there is no C; to_library() interprets it");
  Function values = function;
  values.outputs.resize(range);
  values = compact(values);
  const std::size_t n_p = values.n_p(), n_u = n_p + values.n_x();
  out << "#include <math.h>\n#include <stddef.h>\n\n"
         "#define DT_CHECK(violated, k) if (violated) ++*compare_change\n\n"
      << "int cppad_jit_" << name << "(size_t nu, const " << type << "* u, size_t ny, " << type
      << "* y, size_t* compare_change) {\n"
      << "  const " << type << " *const p = u, *const x = u + " << n_p << ";\n"
      << "  (void)p, (void)x, (void)compare_change;\n  if (nu != " << n_u
      << ") return 1;\n  if (ny != " << range << ") return 2;\n  {\n"
      << cg::statements_of(values, {}, single) << "  }\n  return 0;\n}\n";
}

}  // namespace CppAD::inline dyntape_names::detail
