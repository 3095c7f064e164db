// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/print_embedded.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/codegen/options/flags.h>
#include <dyntape/codegen/print/c_text.h>
#include <dyntape/codegen/print/own_trig.h>
#include <dyntape/codegen/print/print_header.h>
#include <dyntape/codegen/print/print_lanes.h>
#include <dyntape/codegen/print/print_pieces.h>
#include <dyntape/codegen/print/print_tables.h>

namespace dyntape::codegen {
namespace {

// Saved registers, return address, arguments and temporaries of one function, on any processor.
constexpr std::size_t kFrameBytes = 256;
// dt_sin and what it calls.
constexpr std::size_t kOwnTrigFrames = 4;

constexpr char kStaticWork[] = R"(
/* Compiled with -DDYNTAPE_WORK= the work arrays lie on the stack, and entry points may be entered twice. */
#ifndef DYNTAPE_WORK
#define DYNTAPE_WORK static
#endif)";

constexpr char kMacros[] = R"(
#if defined(__GNUC__)
#define DT_PIECE static __attribute__((noinline))
#define DT_RESTRICT __restrict__
#else
#define DT_PIECE static
#define DT_RESTRICT
#endif
)";

constexpr char kSelect[] = "#define dt_select(condition, a, b) ((condition) ? (a) : (b))\n";

// Of several violated guards the first is reported, in whatever order they are met.
constexpr char kCheck[] =
    "typedef unsigned dt_words;\n"
    "#define DT_CHECK(violated, k) if ((violated) && (*guard == 0 || *guard > (k))) *guard = (k)\n";

constexpr char kKernel[] = R"(#define DT_KERNEL(name, n_in, n_out) \
  DT_PIECE void name(const double* DT_RESTRICT in, double* DT_RESTRICT out)
)";

constexpr char kSingleKernel[] = R"(#define DT_KERNEL(name, n_in, n_out) \
  static void name##_in_double(const double* DT_RESTRICT in, double* DT_RESTRICT out); \
  DT_PIECE void name(const float* DT_RESTRICT in, float* DT_RESTRICT out) { \
    double a[n_in + 1], b[n_out + 1]; \
    int i; \
    for (i = 0; i < n_in; ++i) a[i] = in[i]; \
    name##_in_double(a, b); \
    for (i = 0; i < n_out; ++i) out[i] = (float)b[i]; \
  } \
  static void name##_in_double(const double* DT_RESTRICT in, double* DT_RESTRICT out)
)";

class EmbeddedPrinter {
 public:
  EmbeddedPrinter(const KernelSets& sets, const EmbeddedOptions& options)
      : sets_(sets),
        options_(options),
        dialect_{.lanes = false, .single = options.single, .functions = Functions::kLibm},
        real_(options.single ? "float" : "double"),
        functions_(sets.kernels, sets.piece_statements, dialect_),
        words_(vocabulary(sets, functions_.callees())) {
    result_.source.name = c_identifier(sets.name);
  }

  EmbeddedSource run() {
    std::string entries;
    for (std::size_t k = 0; k < sets_.kernels.size(); ++k) entries += entry_point(k);
    for (const Called& called : called_functions(words_.operators))
      if (!is_own(called.function)) result_.calls.push_back(called.function);
    Source& source = result_.source;
    if (is_part()) {
      source.text = headers() + kMacros + types() + definitions() + "\n" + entries;
      return std::move(result_);
    }
    const std::string declarations = declare();
    source.text = banner() + headers() + open_c_linkage() + declarations + kStaticWork + kMacros + types() +
                  definitions() + "\n" + entries + tables() + close_c_linkage();
    const std::string guard = macro_prefix(source.name) + "_H";
    source.header = header_banner(sets_, source) + "#ifndef " + guard + "\n#define " + guard + "\n" +
                    open_c_linkage() + header_sizes(sets_, source, {}) + declarations + close_c_linkage() +
                    "#endif\n";
    return std::move(result_);
  }

 private:
  bool is_part() const { return !options_.parts.empty(); }

  // Kernels written by hand come first: what functions of libm are called by is not changed yet.
  std::string definitions() const {
    std::string text;
    for (const bool is_kernel : {true, false}) {
      for (const auto& d : functions_.definitions()) {
        if (d.is_kernel() == is_kernel) text += "\n" + d.head + " {\n" + d.body + "}\n";
      }
      if (is_kernel) text += functions();
    }
    return text;
  }

  std::string name_of(std::size_t k) const {
    return is_part() ? options_.parts[k] : result_.source.name + "_" + kKernelNames[k];
  }

  bool has_kernels() const {
    const auto& callees = functions_.callees();
    return std::any_of(callees.begin(), callees.end(), [](const Callee* callee) { return callee->kernel(); });
  }

  bool is_guarded(std::size_t k) const { return !sets_.kernels[k].derivatives.function.guards.empty(); }

  // "void arm_value(const double x[21], double y[7])"
  std::string head(std::size_t k) const {
    const Derivatives& d = sets_.kernels[k].derivatives;
    std::string parameters;
    const auto add = [&](const char* constness, const char* name, std::size_t n) {
      if (n == 0) return;
      parameters +=
          (parameters.empty() ? "" : ", ") + (constness + real_) + " " + name + "[" + std::to_string(n) + "]";
    };
    for (int block = 0; block < kBlocks; ++block) add("const ", kInputNames[block], d.function.inputs[block]);
    const std::size_t sizes[] = {d.n_y, d.jacobian.nnz(), d.hessian.nnz()};
    for (std::size_t order = 0; order <= std::size_t(d.order); ++order)
      add("", kOutputNames[order], sizes[order]);
    return std::string(is_part() ? "static " : "") + (is_guarded(k) ? "unsigned " : "void ") + name_of(k) +
           "(" + (parameters.empty() ? "void" : parameters) + ")";
  }

  // The function of a kernel; its pieces are added to the others.
  std::string entry_point(std::size_t k) {
    const KernelPlan& kernel = sets_.kernels[k];
    const Function& function = kernel.derivatives.function;
    const BodyStyle style{{kInputNames[0], kInputNames[1], kInputNames[2]},
                          outputs_of(kernel.derivatives),
                          functions_.texts(),
                          dialect_};
    const std::size_t first = functions_.definitions().size();
    const std::string calls =
        functions_.add_pieces(is_part() ? name_of(k) : std::string("dt_") + kKernelNames[k], function,
                              kernel.schedule, style, "", "  ");
    std::string body;
    const std::size_t work = functions_.work(function, kernel.schedule);
    if (work)
      body += std::string("  ") + (is_part() ? "" : "DYNTAPE_WORK ") + "real work[" + std::to_string(work) +
              "];\n";
    if (is_guarded(k)) body += "  dt_words guard = 0;\n";
    for (int block = 0; block < kBlocks; ++block) {
      if (function.inputs[block] && calls.find(kInputNames[block]) == std::string::npos)
        body += std::string("  (void)") + kInputNames[block] + ";\n";
    }
    body += calls + (is_guarded(k) ? "  return guard;\n" : "");

    result_.entries.push_back(name_of(k));
    result_.source.operations.push_back(total_operations(function));
    const std::size_t bytes = options_.single ? sizeof(float) : sizeof(double);
    result_.work.push_back(work * bytes);
    std::size_t values = 0, frames = 0;
    for (std::size_t i = first; i < functions_.definitions().size(); ++i) {
      values = std::max(values, functions_.definitions()[i].values);
      frames = std::max(frames, functions_.definitions()[i].frames);
    }
    frames += 1 + (sets_.functions == Functions::kSines ? kOwnTrigFrames : 0);
    result_.stack_bounds.push_back(has_kernels() ? 0 : values * bytes + frames * kFrameBytes);
    return head(k) + " {\n" + body + "}\n\n";
  }

  // Of the non-zeros' places.
  template <class Visit>
  void for_each_table(Visit&& visit) const {
    const Derivatives& d = sets_.kernels.back().derivatives;
    for (const auto& [name, pattern] :
         {std::pair("jacobian", &d.jacobian), std::pair("hessian", &d.hessian)}) {
      const std::string type = std::max(pattern->rows, pattern->cols) < 65536 ? "short" : "long";
      const std::string head = "unsigned " + type + " " + result_.source.name + "_" + name;
      if (pattern->nnz()) visit(head + "_row", pattern->row), visit(head + "_col", pattern->col);
    }
  }

  std::string declare() const {
    std::string text;
    for (std::size_t k = 0; k < sets_.kernels.size(); ++k) text += head(k) + ";\n";
    for_each_table([&](const std::string& name, const std::vector<std::uint32_t>& numbers) {
      text += "extern const " + name + "[" + std::to_string(numbers.size()) + "];\n";
    });
    return text;
  }

  std::string tables() const {
    std::string text;
    for_each_table([&](const std::string& name, const std::vector<std::uint32_t>& numbers) {
      text += c_numbers(name, numbers);
    });
    return text;
  }

  bool is_own(const std::string& function) const {
    return sets_.functions == Functions::kSines && (function == "sin" || function == "cos");
  }

  // math.h for functions of libm, infinities and NaN.
  std::string headers() const {
    bool math = has_kernels(), own = false;
    for (const Called& called : called_functions(words_.operators))
      (is_own(called.function) ? own : math) = true;
    for (const auto& d : functions_.definitions())
      math = math || d.body.find("NAN") != std::string::npos || d.body.find("HUGE_VAL") != std::string::npos;
    return std::string(math ? "#include <math.h>\n" : "") + (own ? "#include <stdint.h>\n" : "") + "\n";
  }

  std::string types() const {
    const bool selects = std::any_of(words_.operators.begin(), words_.operators.end(), [](Op op) {
      return info(op).c.find("dt_select") != std::string_view::npos;
    });
    return "typedef " + real_ + " real;\n" + (selects ? kSelect : "") + (words_.guards ? kCheck : "") +
           (has_kernels() ? (options_.single ? kSingleKernel : kKernel) : "");
  }

  // What sin(x) and the others are, where they are not libm's functions of doubles.
  std::string functions() const {
    std::string macros;
    bool sine = false, cosine = false;
    for (const auto& [function, arity] : called_functions(words_.operators)) {
      if (is_own(function)) {
        (function == "sin" ? sine : cosine) = true;
      } else if (options_.single) {
        const std::string arguments = arity == 1 ? "(a)" : arity == 2 ? "(a, b)" : "(a, b, c)";
        macros += "#define " + function + arguments + " " + function + "f" + arguments + "\n";
      }
    }
    return own_trig(options_.single, sine, cosine) + (macros.empty() ? "" : "\n" + macros);
  }

  std::string memory_of(std::size_t k) const {
    const StackUse& stack = options_.stack;
    std::string text = wrapped(" *   " + result_.entries[k] + ":", operation_words(sets_.kernels[k]));
    text += " *     " + std::to_string(result_.work[k]) + " bytes of static arrays";
    if (result_.stack_bounds[k])
      text += "; stack below " + std::to_string(result_.stack_bounds[k]) + " bytes at any optimisation level";
    text += "\n";
    if (k < stack.bytes.size())
      text +=
          " *     stack " + std::to_string(stack.bytes[k]) + " bytes with " + c_comment(stack.with) + "\n";
    return text;
  }

  std::string banner() const {
    std::string text = description(sets_) + " *\n * functions, in " + real_ +
                       "; the static arrays may lie on the stack instead: -DDYNTAPE_WORK=\n";
    for (std::size_t k = 0; k < sets_.kernels.size(); ++k) text += memory_of(k);
    std::vector<std::string> beyond = {"functions that are called and have stacks of their own:"};
    for (const auto& [function, arity] : called_functions(words_.operators)) {
      if (!is_own(function)) beyond.push_back(function + (options_.single ? "f" : ""));
    }
    if (beyond.size() > 1) text += wrapped(" *  ", beyond);
    return text + guard_list(sets_, "returned") + " */\n";
  }

  const KernelSets& sets_;
  const EmbeddedOptions& options_;
  const Dialect dialect_;
  const std::string real_;
  PieceFunctions functions_;
  const Vocabulary words_;
  EmbeddedSource result_;
};

}  // namespace

EmbeddedSource print_embedded(const KernelSets& sets, const EmbeddedOptions& options) {
  if (sets.functions == Functions::kPortable)
    throw ArgumentError("embedded text of \"" + sets.name +
                        "\" needs no library but libm; expected functions sines or libm, got portable");
  return EmbeddedPrinter(sets, options).run();
}

}  // namespace dyntape::codegen
