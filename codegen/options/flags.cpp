// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/options/flags.h>

#include <algorithm>
#include <set>
#include <string_view>

#include <dyntape/codegen/system/warn_once.h>

namespace dyntape::codegen {
namespace {

// Correctly rounded or exact in every implementation, and worth an instruction.
constexpr std::string_view kExact[] = {"fma", "sqrt", "fabs", "floor", "ceil", "trunc", "rint", "copysign"};

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

bool starts_with_any(std::string_view flag, std::initializer_list<std::string_view> prefixes) {
  return std::any_of(prefixes.begin(), prefixes.end(), [&](auto p) { return flag.starts_with(p); });
}

// Processors, and what they can do besides.  Anything else that starts with -m may change how numbers are passed,
// stored or added (-mabi=ms, -mno-sse2, -mfpmath=387, -mlong-double-64, ...).
bool is_of_processor(std::string_view flag) {
  return starts_with_any(flag, {"-march=", "-mcpu=", "-mtune=", "-mavx", "-mno-avx", "-mfma", "-mno-fma",
                                "-msse", "-mbmi", "-mprefer-vector-width=", "-mcmodel="}) &&
         !flag.starts_with("-msse2avx") && !flag.starts_with("-msseregparm");
}

// NAME or NAME=VALUE in capitals, as no word of C, no function of libm and nothing that is printed is called.
bool is_definition(std::string_view text) {
  const std::string_view name = text.substr(0, text.find('='));
  constexpr std::string_view kCapitals = "ABCDEFGHIJKLMNOPQRSTUVWXYZ";
  return !name.empty() && kCapitals.find(name[0]) != std::string_view::npos && !name.starts_with("DYNTAPE") &&
         name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") == std::string_view::npos &&
         text.find_first_of("\n\r") == std::string_view::npos;
}

bool is_level(std::string_view flag) {
  constexpr std::string_view kLevels[] = {"-O", "-O0", "-O1", "-O2", "-O3", "-Og", "-Os", "-Oz"};
  return std::find(std::begin(kLevels), std::end(kLevels), flag) != std::end(kLevels);
}

// Without a name the compiler would take the flag that comes next for one.
bool is_folder(std::string_view flag) { return flag.starts_with("-I") && flag != "-I"; }

bool is_warning(std::string_view flag) {
  return flag.starts_with("-W") && !starts_with_any(flag, {"-Wl,", "-Wa,", "-Wp,"});
}

bool is_accepted(std::string_view flag) {
  return is_level(flag) || flag.starts_with("-g") || is_folder(flag) || is_of_processor(flag) ||
         is_warning(flag) || (flag.starts_with("-D") && is_definition(flag.substr(2)));
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
    const bool takes_the_next = (flags[i] == "-D" || flags[i] == "-I") && i + 1 < flags.size();
    const std::size_t last = i + takes_the_next;
    const std::string whole = takes_the_next ? flags[i] + flags[last] : flags[i];
    if (is_accepted(whole)) {
      accepted.insert(accepted.end(), &flags[i], &flags[last] + 1);
    } else if (!whole.empty()) {
      warn_once("the compile flag " + whole +
                " is left out: passed on are -O0 to -O3, -g, -W, -I, -march, -mcpu, -mtune, features of the "
                "processor "
                "(-mavx2, -mfma, ...) and definitions in capitals (-DNAME=1), which do not change results");
    }
    i = last;
  }
  return accepted;
}

}  // namespace dyntape::codegen
