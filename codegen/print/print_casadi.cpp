// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/print/print_casadi.h>

#include <map>

#include <dyntape/codegen/print/c_text.h>
#include <dyntape/codegen/print/print_embedded.h>

namespace dyntape::codegen {
namespace {

// Work arrays of the functions are a thread's own, and too long for a stack.
constexpr char kWork[] = R"(#if defined(__GNUC__)
#define DYNTAPE_WORK static __thread
#else
#define DYNTAPE_WORK
#endif
)";

constexpr char kInterface[] = R"(
/* --- what CasADi and acados look up --- */

typedef long long int dt_int;
#if defined(__GNUC__)
#define DT_EXPORT __attribute__((visibility("default")))
#elif defined(_WIN32)
#define DT_EXPORT __declspec(dllexport)
#else
#define DT_EXPORT
#endif

/* What is not there is zero. */
static void dt_place(const double* from, const unsigned* places, int count, double* to) {
  int k;
  for (k = 0; k < count; ++k) to[places[k]] = from ? from[k] : 0.0;
}

static void dt_pick(const double* from, const unsigned* places, int count, double* to) {
  int k;
  if (!to) return;
  for (k = 0; k < count; ++k) to[k] = from[places[k]];
}
)";

const char* name_of(CasadiArgument::Array array) {
  constexpr const char* kNames[] = {"", "x", "weights", "y", "jacobian", "hessian", "gradient"};
  return kNames[array];
}

class CasadiPrinter {
 public:
  CasadiPrinter(const KernelSets& sets, const CasadiBlocks& blocks)
      : sets_(sets),
        derived_(sets.kernels.back().derivatives),
        functions_(
            casadi_functions(sets.function, blocks, derived_.order, derived_.jacobian, derived_.hessian)) {}

  Source run() {
    Source source = print_embedded(sets_, {}).source;
    name_ = source.name;
    std::string functions;
    for (const CasadiFunction& f : functions_) functions += exported(f);
    const std::size_t close = source.text.find("*/\n") + 3;  // of the banner
    source.text.insert(close, kWork);
    source.text += kInterface + tables_ + functions;
    source.header.clear();
    source.pieces = {1};
    return source;
  }

 private:
  template <class Numbers>
  std::string table(const std::string& type, const std::string& name, const Numbers& numbers) {
    std::string text;
    std::size_t line = 0;
    for (const auto& number : numbers) {
      const std::string word = std::to_string(number);
      if (!text.empty()) text += line > 100 ? ",\n  " : ", ";
      line = line > 100 ? word.size() : line + word.size() + 2;
      text += word;
    }
    const auto [at, fresh] = known_.emplace(name + text, name + std::to_string(known_.size()));
    if (fresh) tables_ += "static const " + type + " " + at->second + "[] = {" + text + "};\n";
    return at->second;
  }

  // How many arguments there are, their names and patterns.
  std::string questions(const std::string& name, const std::string& side,
                        const std::vector<CasadiArgument>& arguments) {
    const std::string n = std::to_string(arguments.size()), inside = "i >= 0 && i < " + n;
    std::string names, patterns;
    for (const CasadiArgument& argument : arguments) {
      names += (names.empty() ? "" : ", ") + c_string(argument.name);
      patterns += (patterns.empty() ? "" : ", ") + table("dt_int", "dt_sparsity", argument.sparsity);
    }
    return "DT_EXPORT dt_int " + name + "_n_" + side + "(void) { return " + n + "; }\n" +
           "DT_EXPORT const char* " + name + "_name_" + side +
           "(dt_int i) {\n  static const char* const names[] = {" + names + "};\n  return " + inside +
           " ? names[i] : 0;\n}\nDT_EXPORT const dt_int* " + name + "_sparsity_" + side +
           "(dt_int i) {\n  static const dt_int* const patterns[] = {" + patterns + "};\n  return " + inside +
           " ? patterns[i] : 0;\n}\n";
  }

  std::string exported(const CasadiFunction& f) {
    std::size_t work = 0;
    const std::string name = f.prefix + name_, body = arrays(f.order, work) + reading(f) + call(f.order) +
                                                      (f.prefix == "adj1_" ? gradient() : "") + writing(f);
    std::string text = "\nDT_EXPORT int " + name +
                       "(const double** arg, double** res, dt_int* iw, double* w, int mem) {\n" + body +
                       "  return 0;\n}\n";
    text += questions(name, "in", f.in);
    text += questions(name, "out", f.out);
    return text + "DT_EXPORT int " + name +
           "_work(dt_int* sz_arg, dt_int* sz_res, dt_int* sz_iw, dt_int* sz_w) {\n  if (sz_arg) *sz_arg = " +
           std::to_string(f.in.size()) + ";\n  if (sz_res) *sz_res = " + std::to_string(f.out.size()) +
           ";\n  if (sz_iw) *sz_iw = 0;\n  if (sz_w) *sz_w = " + std::to_string(work) +
           ";\n  return 0;\n}\nDT_EXPORT void " + name + "_incref(void) {}\nDT_EXPORT void " + name +
           "_decref(void) {}\n";
  }

  // In w, those without entries as well.
  std::string arrays(Order order, std::size_t& work) const {
    const Function& f = sets_.function;
    std::string text;
    const auto add = [&](const char* name, std::size_t n) {
      text += std::string("  double* const ") + name + " = w + " + std::to_string(work) + ";\n";
      work += n;
    };
    add("x", f.n_x()), add("y", f.n_y());
    std::string unused = "(void)x, (void)y";
    if (order >= Order::kFirst) {
      add("jacobian", derived_.jacobian.nnz()), add("weights", f.n_y()), add("gradient", f.n_x());
      unused += ", (void)jacobian, (void)weights, (void)gradient";
    }
    if (order == Order::kSecond) add("hessian", derived_.hessian.nnz()), unused += ", (void)hessian";
    return text + "  (void)arg, (void)res, (void)iw, (void)mem, " + unused + ";\n";
  }

  std::string places(const CasadiArgument& argument) {
    return table("unsigned", "dt_places", argument.places) + ", " + std::to_string(argument.places.size());
  }
  std::string reading(const CasadiFunction& f) {
    std::string text;
    for (std::size_t i = 0; i < f.in.size(); ++i)
      if (!f.in[i].places.empty())
        text += "  dt_place(arg[" + std::to_string(i) + "], " + places(f.in[i]) + ", " +
                name_of(f.in[i].array) + ");\n";
    return text;
  }
  std::string writing(const CasadiFunction& f) {
    std::string text;
    for (std::size_t i = 0; i < f.out.size(); ++i)
      if (!f.out[i].places.empty())
        text += std::string("  dt_pick(") + name_of(f.out[i].array) + ", " + places(f.out[i]) + ", res[" +
                std::to_string(i) + "]);\n";
    return text;
  }

  // Of the entry point of that order, whose arguments are those with entries.
  std::string call(Order order) const {
    const Function& f = sets_.function;
    std::string arguments;
    const auto add = [&](const char* name, std::size_t n) {
      if (n) arguments += (arguments.empty() ? "" : ", ") + std::string(name);
    };
    add("x", f.n_x());
    if (order == Order::kSecond) add("weights", f.n_y());
    add("y", f.n_y());
    if (order >= Order::kFirst) add("jacobian", derived_.jacobian.nnz());
    if (order == Order::kSecond) add("hessian", derived_.hessian.nnz());
    const char* const kernels[] = {"_value", "_first_order", "_second_order"};
    const std::string called = name_ + kernels[static_cast<int>(order)] + "(" + arguments + ")";
    const bool guarded = !derived_.function.guards.empty();
    return guarded ? "  if (" + called + ") return 1;\n" : "  " + called + ";\n";
  }

  std::string gradient() const {
    const std::size_t n_x = sets_.function.n_x(), nnz = derived_.jacobian.nnz();
    std::string text =
        "  {\n    int k;\n    for (k = 0; k < " + std::to_string(n_x) + "; ++k) gradient[k] = 0.0;\n";
    if (nnz)
      text += "    for (k = 0; k < " + std::to_string(nnz) + "; ++k)\n      gradient[" + name_ +
              "_jacobian_col[k]] += jacobian[k] * weights[" + name_ + "_jacobian_row[k]];\n";
    return text + "  }\n";
  }

  const KernelSets& sets_;
  const Derivatives& derived_;
  const std::vector<CasadiFunction> functions_;
  std::string name_, tables_;
  std::map<std::string, std::string> known_;
};

}  // namespace

Source print_casadi(const KernelSets& sets, const CasadiBlocks& blocks) {
  return CasadiPrinter(sets, blocks).run();
}

}  // namespace dyntape::codegen
