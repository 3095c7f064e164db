// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/cppad/cg/code_handler.h>

#include <dyntape/codegen/pipeline.h>
#include <dyntape/interface/cppad/library.h>

namespace CppAD::inline dyntape_names::cg {

using namespace dyntape;

void print_recording(std::ostream& out, const std::vector<AD<double>>& y, const std::string& type,
                     const std::string& name) {
  if (type != "double" && type != "float")
    detail::refuse("LanguageC: there is no C of the type \"" + type + "\"; there are double and float");
  ADFun<double> f;
  f.Dependent(y);
  f.function_name_set(name);
  CodegenOptions options;
  options.order = Order::kValue;
  codegen::EmbeddedOptions how;
  how.single = type == "float";
  out << generate_embedded(to_function(f), options, how).source.text;
}

}  // namespace CppAD::inline dyntape_names::cg
