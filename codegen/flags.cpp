// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/flags.h>

#include <algorithm>
#include <set>
#include <string_view>

#include <dyntape/codegen/notice.h>

namespace dyntape::codegen {
namespace {

// Correctly rounded or exact in every implementation, and worth an instruction.
constexpr std::string_view kExact[] = {"fma", "sqrt", "fabs", "floor", "ceil", "trunc", "copysign"};

std::vector<std::string> make_contract_flags(const std::vector<Op>& operators) {
  // No errno: sqrt need not look for a negative argument.  Values are the same.
  // No vectoriser: gcc 12's makes vfmaddsub of neighbouring a * b + c and a * b - c, contraction off or not.
  std::vector<std::string> flags = {"-ffp-contract=off", "-fno-tree-vectorize", "-fno-tree-slp-vectorize",
                                    "-fno-math-errno"};
  std::set<std::string> functions;
  for (Op op : operators) {
    const std::string function(called_function(op));
    if (!function.empty() && std::find(std::begin(kExact), std::end(kExact), function) == std::end(kExact))
      functions.insert("-fno-builtin-" + function);
  }
  flags.insert(flags.end(), functions.begin(), functions.end());
  return flags;
}

std::vector<Op> all_operators() {
  std::vector<Op> operators;
  for (int op = 0; op < kTableOps; ++op) operators.push_back(static_cast<Op>(op));
  return operators;
}

bool processor_has_fma() {
#if defined(__x86_64__) || defined(__i386__)
  return __builtin_cpu_supports("fma");
#elif defined(__FP_FAST_FMA) || defined(__aarch64__)
  return true;
#else
  return false;
#endif
}

bool starts_with_any(std::string_view flag, std::initializer_list<std::string_view> prefixes) {
  return std::any_of(prefixes.begin(), prefixes.end(), [&](auto p) { return flag.starts_with(p); });
}

bool is_accepted(std::string_view flag) {
  if (flag == "-Ofast") return false;
  // -m takes part: processors are named by it.  These few change arithmetic.
  if (starts_with_any(flag,
                      {"-mfpmath", "-mrecip", "-mpc", "-mdaz", "-m32", "-mx32", "-m96", "-mlong-double"}))
    return false;
  return starts_with_any(flag, {"-O", "-g", "-m", "-D", "-I", "-W"}) && !flag.starts_with("-Wl,") &&
         !flag.starts_with("-Wa,") && !flag.starts_with("-Wp,");
}

}  // namespace

std::string_view called_function(Op op) {
  const std::string_view spelling = info(op).c;
  if (spelling.starts_with("dt_")) return {};
  const std::size_t end = spelling.find('(');
  return end == std::string_view::npos ? std::string_view() : spelling.substr(0, end);
}

std::vector<Called> called_functions(const std::vector<Op>& operators) {
  std::vector<Called> all;
  for (Op op : operators) {
    const std::string function(called_function(op));
    const bool is_known =
        std::any_of(all.begin(), all.end(), [&](const Called& c) { return c.function == function; });
    if (!function.empty() && !is_known) all.push_back({function, info(op).arity});
  }
  return all;
}

bool has_fma(const std::vector<std::string>& flags) {
  bool has = processor_has_fma();
  for (const std::string& flag : flags) {
    if (flag.starts_with("-march=") || flag.starts_with("-mcpu="))
      has = flag.ends_with("=native") && processor_has_fma();
    if (flag == "-mfma") has = true;
    if (flag == "-mno-fma" || flag == "-mno-avx" || flag == "-mgeneral-regs-only") has = false;
  }
  return has;
}

const std::vector<std::string>& contract_flags() {
  static const std::vector<std::string> flags = make_contract_flags(all_operators());
  return flags;
}

std::vector<std::string> contract_flags(const std::vector<Op>& operators) {
  return make_contract_flags(operators);
}

std::vector<std::string> accepted_flags(const std::vector<std::string>& flags) {
  std::vector<std::string> accepted;
  for (std::size_t i = 0; i < flags.size(); ++i) {
    const std::string& flag = flags[i];
    if (flag.empty()) continue;
    if (!is_accepted(flag)) {
      say_once("the compile flag " + flag +
               " is left out: passed on are -O0 to -O3, -g, -m, -D, -I and -W, which do not change results");
      continue;
    }
    accepted.push_back(flag);
    if ((flag == "-D" || flag == "-I") && i + 1 < flags.size()) accepted.push_back(flags[++i]);
  }
  return accepted;
}

}  // namespace dyntape::codegen
