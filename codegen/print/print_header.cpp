// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/print_header.h>

#include <algorithm>

#include <dyntape/codegen/print/c_text.h>
#include <dyntape/codegen/print/print_pieces.h>

namespace dyntape::codegen {
namespace {

// " *   x[3]  q0, v0, a0"; nothing for an array without entries.
std::string array_line(const std::string& array, std::size_t size, const std::string& what,
                       const std::vector<std::string>& names) {
  if (size == 0) return {};
  std::vector<std::string> words = {what + (names.empty() ? "" : ":")};
  for (std::size_t i = 0; i < names.size(); ++i)
    words.push_back(c_comment(names[i]) + (i + 1 < names.size() ? "," : ""));
  return wrapped(" *   " + array + "[" + std::to_string(size) + "]", words);
}

std::string pattern_words(const char* what, const Pattern& pattern) {
  return "non-zeros of " + std::string(what) + " (" + std::to_string(pattern.rows) + " x " +
         std::to_string(pattern.cols) + ")";
}

}  // namespace

std::string macro_prefix(const std::string& name) {
  std::string prefix = name;
  std::transform(prefix.begin(), prefix.end(), prefix.begin(),
                 [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
  return prefix;
}

std::string header_sizes(const KernelSets& sets, const Source& source,
                         const std::vector<KernelEntry>& kernels) {
  const Function& f = sets.function;
  const Derivatives& d = sets.kernels.back().derivatives;
  const bool is_second = d.order >= Order::kSecond;
  const std::size_t n_w = f.n_w() + (is_second ? f.n_y() : 0);
  std::string text = "/* Arrays of one point:\n";
  text += array_line("x", f.n_x(), "variables", f.input_names[0]);
  text += array_line("p", f.n_p(), "parameters", f.input_names[1]);
  text += array_line("w", n_w, is_second ? "weights, the last of them one an output" : "weights",
                     f.input_names[2]);
  text += array_line("y", f.n_y(), "values", f.output_names);
  text += array_line("jacobian", d.jacobian.nnz(), pattern_words("dy/dx", d.jacobian), {});
  text += array_line("hessian", d.hessian.nnz(),
                     pattern_words("the lower triangle of the weighted Hessian", d.hessian), {});
  text += " */\n";
  const std::string prefix = "#define " + macro_prefix(source.name) + "_";
  const auto define = [&](const std::string& name, std::size_t value) {
    text += prefix + name + " " + std::to_string(value) + "\n";
  };
  define("N_X", f.n_x());
  define("N_P", f.n_p());
  define("N_W", n_w);
  define("N_Y", f.n_y());
  if (d.order >= Order::kFirst) define("JACOBIAN_NNZ", d.jacobian.nnz());
  if (is_second) define("HESSIAN_NNZ", d.hessian.nnz());
  for (const KernelEntry& kernel : kernels)
    define(macro_prefix(kKernelNames[kernel.order]) + "_WORK", kernel.work);
  if (!source.symbol.empty()) text += prefix + "DESCRIPTOR " + source.symbol + "\n";
  return text + "\n";
}

}  // namespace dyntape::codegen
