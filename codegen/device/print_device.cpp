// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/device/print_device.h>

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

// The words in which the languages differ; the rest of a text is C that both are.
struct Words {
  const char *name, *how_to_compile, *text;
  const char* nan;  // in double: NAN is a float, and a call of two numbers is then of no type
};

constexpr Words kOpenClWords = {
    "OpenCL C 1.2", "without -cl-mad-enable, -cl-unsafe-math-optimizations and -cl-fast-relaxed-math",
    R"(#pragma OPENCL FP_CONTRACT OFF
typedef uint uint32_t;
typedef ulong uint64_t;
typedef ulong dt_count;
#define DT_ENTRY __kernel
#define DT_GLOBAL __global
#define DT_TABLE __constant
#define DT_TABLE_OF __constant
#define DT_PIECE static
#define DT_RESTRICT restrict
#define DT_STATE get_global_id(0)
#define half dt_half /* a type of the language, a name in the text */
)",
    "as_double(0x7ff8000000000000ul)"};

constexpr Words kCudaWords = {"CUDA C", "with -fmad=false, and without -use_fast_math",
                              R"(#ifdef __CUDACC_RTC__
typedef unsigned int uint32_t;
typedef unsigned long long uint64_t;
#else
#include <math.h>
#include <stdint.h>
#endif
#ifndef HUGE_VAL
#define HUGE_VAL __longlong_as_double(0x7ff0000000000000ll)
#define HUGE_VALF __int_as_float(0x7f800000)
#endif
#ifndef NAN
#define NAN __int_as_float(0x7fc00000)
#endif
typedef unsigned long long dt_count;
#define DT_ENTRY extern "C" __global__
#define DT_GLOBAL
#define DT_TABLE static __device__
#define DT_TABLE_OF
#define DT_PIECE static __device__ __attribute__((unused))
#define DT_RESTRICT __restrict__
#define DT_STATE ((dt_count)blockIdx.x * blockDim.x + threadIdx.x)
)",
                              "__longlong_as_double(0x7ff8000000000000ll)"};

const Words& words_of(DeviceLanguage language) {
  return language == DeviceLanguage::kCuda ? kCudaWords : kOpenClWords;
}

constexpr char kDeviceSelect[] = "#define dt_select(condition, a, b) ((condition) ? (a) : (b))\n";

// Of several violated guards the first is reported, in whatever order they are met.
constexpr char kDeviceCheck[] =
    "typedef uint32_t dt_words;\n"
    "#define DT_CHECK(violated, k) if ((violated) && (*guard == 0 || *guard > (k))) *guard = (k)\n";

constexpr char kDeviceKernel[] = R"(#define dt_fma(x, y, z) fma(x, y, z)
#define DT_KERNEL(name, n_in, n_out) DT_PIECE void name(const real* DT_RESTRICT in, real* DT_RESTRICT out)
)";

constexpr char kDeviceSingleKernel[] = R"(#define dt_fma(x, y, z) fma(x, y, z)
#define DT_KERNEL(name, n_in, n_out) \
  DT_PIECE void name##_in_double(const double* DT_RESTRICT in, double* DT_RESTRICT out); \
  DT_PIECE void name(const float* DT_RESTRICT in, float* DT_RESTRICT out) { \
    double a[n_in + 1], b[n_out + 1]; \
    int i; \
    for (i = 0; i < n_in; ++i) a[i] = in[i]; \
    name##_in_double(a, b); \
    for (i = 0; i < n_out; ++i) out[i] = (float)b[i]; \
  } \
  DT_PIECE void name##_in_double(const double* DT_RESTRICT in, double* DT_RESTRICT out)
)";

constexpr char kTwoCalls[] = "#define dt_sincos(x, s, c) (*(s) = sin(x), *(c) = cos(x))\n";

void replace_all(std::string& text, std::string_view from, std::string_view to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

// The sines are C of the library itself: its functions become the device's, its table moves to constant memory.
std::string sines_of_device(std::string text) {
  replace_all(text, "static __inline__ __attribute__((unused)) ", "DT_PIECE ");
  replace_all(text, "static const uint32_t dt_two_over_pi", "DT_TABLE const uint32_t dt_two_over_pi");
  replace_all(text, "const uint32_t* const bits", "DT_TABLE_OF const uint32_t* const bits");
  replace_all(text, "static dt_number", "DT_PIECE dt_number");
  replace_all(text, "static unsigned", "DT_PIECE unsigned");
  replace_all(text, "static double", "DT_PIECE double");
  return text;
}

class DevicePrinter {
 public:
  DevicePrinter(const KernelSets& sets, const DeviceOptions& options)
      : sets_(sets),
        options_(options),
        language_(words_of(options.language)),
        dialect_{.lanes = false, .single = options.single, .device = true, .functions = Functions::kLibm},
        real_(options.single ? "float" : "double"),
        functions_(sets.kernels, sets.piece_statements, dialect_),
        words_(vocabulary(sets, functions_.callees())) {
    result_.source.name = c_identifier(sets.name);
  }

  DeviceSource run() {
    std::string entries;
    for (std::size_t k = 0; k < sets_.kernels.size(); ++k) entries += options_.loop ? loop() : entry_point(k);
    Source& source = result_.source;
    source.text = banner() + doubles() + language_.text + types();
    // Kernels written by hand come first: what functions of the device are called by is not changed yet.
    for (const bool is_kernel : {true, false}) {
      for (const auto& d : functions_.definitions()) {
        if (d.is_kernel() == is_kernel) source.text += "\n" + d.head + " {\n" + body_of(d) + "}\n";
      }
      if (is_kernel) source.text += functions();
    }
    source.text += "\n" + entries;
    source.header = header();
    result_.jacobian = sets_.kernels.back().derivatives.jacobian;
    result_.hessian = sets_.kernels.back().derivatives.hessian;
    return std::move(result_);
  }

 private:
  using Definition = PieceFunctions::Definition;

  const Function& function(std::size_t k) const { return sets_.kernels[k].derivatives.function; }
  bool is_guarded(std::size_t k) const { return !function(k).guards.empty(); }

  bool has_kernels() const {
    const auto& callees = functions_.callees();
    return std::any_of(callees.begin(), callees.end(), [](const Callee* callee) { return callee->kernel(); });
  }

  // OpenCL C has no static variables in functions; constant arrays need not be.
  static std::string body_of(const Definition& d) {
    std::string body = d.body;
    replace_all(body, "static const ", "const ");
    return body;
  }

  std::size_t size_of_output(std::size_t k, std::size_t order) const {
    const Derivatives& d = sets_.kernels[k].derivatives;
    return order == 0 ? d.n_y : order == 1 ? d.jacobian.nnz() : d.hessian.nnz();
  }

  // Sizes of the arrays of a kernel: x, p, w, and what it writes.
  std::vector<std::pair<const char*, std::size_t>> arrays(std::size_t k, bool written) const {
    std::vector<std::pair<const char*, std::size_t>> all;
    for (std::size_t i = 0; i < (written ? k + 1 : std::size_t{kBlocks}); ++i) {
      const std::size_t n = written ? size_of_output(k, i) : function(k).inputs[i];
      if (n) all.emplace_back(written ? kOutputNames[i] : kInputNames[i], n);
    }
    return all;
  }

  std::string head(std::size_t k) const {
    std::string parameters;
    for (const bool written : {false, true}) {
      for (const auto& [name, n] : arrays(k, written))
        parameters +=
            std::string("DT_GLOBAL ") + (written ? "" : "const ") + "real* DT_RESTRICT " + name + ", ";
    }
    if (is_guarded(k)) parameters += "DT_GLOBAL uint32_t* DT_RESTRICT status, ";
    return "DT_ENTRY void " + result_.source.name + "_" + kKernelNames[k] + "(" + parameters +
           "const dt_count count)";
  }

  // Calls write their results into memory of the state's own, which is copied.
  std::string entry_point(std::size_t k) {
    const KernelPlan& kernel = sets_.kernels[k];
    const bool stages = !kernel.schedule.calls.empty();
    BodyStyle style{{kInputNames[0], kInputNames[1], kInputNames[2]},
                    outputs_of(kernel.derivatives),
                    functions_.texts(),
                    dialect_};
    style.read = {"DT_GLOBAL ", " * count"};
    if (!stages) style.written = style.read;
    const std::string calls = functions_.add_pieces(std::string("dt_") + kKernelNames[k], function(k),
                                                    kernel.schedule, style, "_of_state", "  ");
    std::string body = "  const dt_count state = DT_STATE;\n", after;
    std::size_t work = functions_.work(function(k), kernel.schedule), own = work;
    for (const auto& [name, n] : arrays(k, false)) {
      if (calls.find(std::string(name) + "_of_state") == std::string::npos) continue;
      body += std::string("  DT_GLOBAL const real* const ") + name + "_of_state = " + name + " + state;\n";
    }
    for (const auto& [name, n] : arrays(k, true)) {
      if (stages) {
        const std::string number = std::to_string(n);
        own += n;
        body += std::string("  real ") + name + "_of_state[" + number + "];\n";
        after += "  for (k = 0; k < " + number + "; ++k) " + name + "[k * count + state] = " + name +
                 "_of_state[k];\n";
      } else {
        body += std::string("  DT_GLOBAL real* const ") + name + "_of_state = " + name + " + state;\n";
      }
    }
    if (!after.empty()) body += "  dt_count k;\n";
    if (work) body += "  real work_of_state[" + std::to_string(work) + "];\n";
    if (is_guarded(k)) body += "  dt_words guard = 0;\n", after += "  status[state] = guard;\n";
    body += "  if (state >= count) return;\n";
    const std::size_t bytes = options_.single ? sizeof(float) : sizeof(double);
    DeviceKernel entry{result_.source.name + "_" + kKernelNames[k], is_guarded(k)};
    entry.work = own * bytes;
    for (std::size_t block = 0; block < kBlocks; ++block) entry.inputs[block] = function(k).inputs[block];
    for (std::size_t order = 0; order <= k; ++order) entry.outputs[order] = size_of_output(k, order);
    result_.kernels.push_back(std::move(entry));
    result_.source.operations.push_back(total_operations(function(k)));
    return head(k) + " {\n" + body + calls + after + "}\n\n";
  }

  // `for` of a few entries, whose arrays become registers.
  static std::string for_each(std::size_t n, const std::string& indent, const std::string& statement) {
    return n == 0 ? ""
                  : "#pragma unroll\n" + indent + "for (k = 0; k < " + std::to_string(n) + "; ++k) " +
                        statement + "\n";
  }

  std::string loop() {
    const KernelPlan& kernel = sets_.kernels[0];
    const Function& step = function(0);
    const auto [shared, constants] = *options_.loop;
    const std::size_t n_x = step.n_x(), n_y = step.n_y(), n_p = step.n_p(), rest = n_p - shared - constants;
    const std::string nx = std::to_string(n_x), ns = std::to_string(shared);
    const BodyStyle style{{kInputNames[0], kInputNames[1], kInputNames[2]},
                          outputs_of(kernel.derivatives),
                          functions_.texts(),
                          dialect_};
    const std::string calls =
        functions_.add_pieces("dt_loop", step, kernel.schedule, style, "_of_state", "    ");
    const std::size_t work = functions_.work(step, kernel.schedule);
    DeviceKernel entry{result_.source.name + "_loop"};
    entry.inputs[0] = n_x, entry.inputs[1] = n_p, entry.outputs[0] = n_x;
    entry.work = (n_x + n_y + n_p + work) * (options_.single ? sizeof(float) : sizeof(double));
    std::string text = "DT_ENTRY void " + entry.name + "(DT_GLOBAL real* DT_RESTRICT x, ";
    if (shared) text += "DT_GLOBAL const real* DT_RESTRICT shared, ";
    if (rest) text += "DT_GLOBAL const real* DT_RESTRICT p, ";
    if (constants) text += "DT_GLOBAL const real* DT_RESTRICT constants, ";
    text +=
        "DT_GLOBAL real* DT_RESTRICT states, DT_GLOBAL const dt_count* DT_RESTRICT loop, const dt_count "
        "count) {\n  const dt_count state = DT_STATE, steps = loop[0], every = loop[1], before = loop[2];\n";
    if (rest) text += "  const dt_count p_count = loop[3], own = p_count == 1 ? 0 : state;\n";
    text += "  real x_of_state[" + nx + "], y_of_state[" + std::to_string(n_y) + "];\n";
    if (n_p) text += "  real p_of_state[" + std::to_string(n_p) + "];\n";
    if (work) text += "  real work_of_state[" + std::to_string(work) + "];\n";
    text += "  dt_count at, kept = 0;\n  int k;\n  if (state >= count) return;\n";
    text += for_each(n_x, "  ", "x_of_state[k] = x[k * count + state];");
    text += for_each(constants, "  ",
                     "p_of_state[k + " + std::to_string(shared + rest) +
                         "] = constants[loop[4] == 1 ? k : k * count + state];");
    text += "  for (at = 0; at < steps; ++at) {\n    int sound = 1;\n";
    if (is_guarded(0)) text += "    dt_words guard = 0;\n";
    text += for_each(shared, "    ", "p_of_state[k] = shared[at * " + ns + " + k];");
    text +=
        for_each(rest, "    ",
                 "p_of_state[k + " + ns + "] = p[(at * " + std::to_string(rest) + " + k) * p_count + own];");
    text += for_each(n_p, "    ", "sound &= p_of_state[k] - p_of_state[k] == 0;");
    text += for_each(n_x, "    ", "sound &= x_of_state[k] - x_of_state[k] == 0;");
    text += calls;
    text += for_each(n_y, "    ", "sound &= y_of_state[k] - y_of_state[k] == 0;");
    if (is_guarded(0)) text += "    sound &= guard == 0;\n";
    text += for_each(n_x, "    ", "x_of_state[k] = sound ? y_of_state[k] : NAN;");
    text += "    if ((before + at + 1) % every != 0) continue;\n";
    text += for_each(n_x, "    ", "states[(kept * " + nx + " + k) * count + state] = x_of_state[k];");
    text += "    ++kept;\n  }\n";
    text += for_each(n_x, "  ", "x[k * count + state] = x_of_state[k];");
    result_.kernels.push_back(std::move(entry));
    result_.source.operations.push_back(total_operations(step));
    return text + "}\n";
  }

  std::string doubles() const {
    const bool needed = !options_.single || has_kernels();
    return needed && options_.language == DeviceLanguage::kOpenCl
               ? "#pragma OPENCL EXTENSION cl_khr_fp64 : enable\n"
               : "";
  }

  std::string types() const {
    const bool selects = std::any_of(words_.operators.begin(), words_.operators.end(), [](Op op) {
      return info(op).c.find("dt_select") != std::string_view::npos;
    });
    const bool calls = !functions_.callees().empty();
    const std::string nan =
        options_.single ? "" : std::string("#undef NAN\n#define NAN ") + language_.nan + "\n";
    return "typedef " + real_ + " real, reals;\n" + nan + (selects ? kDeviceSelect : "") +
           (words_.guards ? kDeviceCheck : "") +
           (calls ? options_.single ? kDeviceSingleKernel : kDeviceKernel : "");
  }

  // sin(x) and cos(x), and both at once.  The device's others have the names that the statements have.
  std::string functions() const {
    bool sine = false, cosine = false;
    for (const Op op : words_.operators) {
      sine = sine || op == Op::Sin;
      cosine = cosine || op == Op::Cos;
    }
    const bool pairs = sine && cosine;
    if (sets_.functions != Functions::kSines) return pairs ? kTwoCalls : "";
    return sines_of_device(own_trig(options_.single, sine, cosine) + (pairs ? own_circle() : "")) +
           (pairs ? "#define dt_sincos(x, s, c) dt_circle(x, s, c)\n" : "");
  }

  std::string banner() const {
    std::string text = description(sets_, language_.how_to_compile) + " *\n * " + language_.name + ", in " +
                       real_ +
                       ": one state a work-item.  Entry i of state s is at [i * count + s] of every array.\n";
    for (std::size_t k = 0; k < sets_.kernels.size(); ++k) {
      text += wrapped(" *   " + result_.kernels[k].name + ":", operation_words(sets_.kernels[k]));
      if (result_.kernels[k].work)
        text += " *     " + std::to_string(result_.kernels[k].work) + " bytes of memory a state\n";
    }
    return text + guard_list(sets_, "status") + " */\n";
  }

  // For the program that calls the kernels: sizes, and where the non-zeros are.
  std::string header() const {
    const Source& source = result_.source;
    const Derivatives& d = sets_.kernels.back().derivatives;
    const std::string guard = macro_prefix(source.name) + "_H";
    std::string tables;
    for (const auto& [name, pattern] :
         {std::pair("_jacobian", &d.jacobian), std::pair("_hessian", &d.hessian)}) {
      for (const auto& [suffix, numbers] :
           {std::pair("_row", &pattern->row), std::pair("_col", &pattern->col)}) {
        if (!numbers->empty())
          tables += "static " + c_numbers("unsigned " + source.name + name + suffix, *numbers);
      }
    }
    return header_banner(sets_, source) + "#ifndef " + guard + "\n#define " + guard + "\n" +
           header_sizes(sets_, source, {}) + tables + "#endif\n";
  }

  const KernelSets& sets_;
  const DeviceOptions& options_;
  const Words& language_;
  const Dialect dialect_;
  const std::string real_;
  PieceFunctions functions_;
  const Vocabulary words_;
  DeviceSource result_;
};

}  // namespace

DeviceSource print_device(const KernelSets& sets, const DeviceOptions& options) {
  if (sets.functions == Functions::kPortable)
    throw ArgumentError("text of \"" + sets.name +
                        "\" for a device has no library; expected functions sines or libm, got portable");
  const Function& first = sets.kernels[0].derivatives.function;
  if (options.loop && (sets.kernels.size() > 1 || sets.kernels[0].derivatives.n_y < first.n_x() ||
                       first.n_w() > 0 || options.loop->shared + options.loop->constants > first.n_p()))
    throw ArgumentError(
        "loop of \"" + sets.name + "\": " + std::to_string(first.n_x()) + " variables, " +
        std::to_string(first.n_y()) +
        " outputs; expected the value of a function with as many outputs or more, without weights");
  return DevicePrinter(sets, options).run();
}

}  // namespace dyntape::codegen
