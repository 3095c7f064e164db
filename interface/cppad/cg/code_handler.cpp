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

// The statements of a function as a block of C.
std::string statements_of(Function function, bool single, const PrintedNames& names) {
  std::string text = function.guards.empty()
                         ? ""
                         : "  /* holds where the comparisons of the recording come out as they did */\n";
  function.guards.clear();
  const codegen::Schedule order = codegen::schedule(function, {{0, function.outputs.size()}}, SIZE_MAX);
  const std::map<const Callee*, codegen::CalleeText> none;
  codegen::BodyStyle style{{names.independent, "p", "w"},
                           {{names.dependent, "results", 0, function.outputs.size()}},
                           none,
                           {.lanes = false, .single = single}};
  text += std::string("  {\n  typedef ") + (single ? "float" : "double") + " real;\n" +
          "#undef dt_select\n#define dt_select(condition, a, b) ((condition) ? (a) : (b))\n";
  codegen::append_piece(text, function, order, 0, style);
  return text + "  }\n";
}

}  // namespace

void print_recording(std::ostream& out, const std::vector<AD<double>>& y, const std::string& type,
                     const std::string& name, const PrintedNames& names) {
  if (type != "double" && type != "float")
    detail::refuse("LanguageC: there is no C of the type \"" + type + "\"; there are double and float");
  ADFun<double> f;
  f.Dependent(y);
  if (!f.core().recording().kernels.empty())
    detail::refuse("CodeHandler: the recording calls a function of the user, of which there is no C");
  if (name.empty()) {
    out << statements_of(to_function(f), type == "float", names);
    return;
  }
  f.function_name_set(name);
  CodegenOptions options;
  options.order = Order::kValue;
  codegen::EmbeddedOptions how;
  how.single = type == "float";
  out << generate_embedded(to_function(f), options, how).source.text;
}

}  // namespace CppAD::inline dyntape_names::cg
