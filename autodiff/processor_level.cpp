// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/processor_level.h>

#if defined(DYNTAPE_LEVELS)
#include <cpuid.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <string_view>

namespace dyntape {
namespace {

constexpr std::array<const char*, 3> kLevels = {"x86-64-v2", "x86-64-v3", "x86-64-v4"};
constexpr std::string_view kBuilt = DYNTAPE_LEVELS;  // "v2 v3 v4", or one of these

constexpr bool is_built(int level) {
  return kBuilt.find(kLevels[static_cast<std::size_t>(level)] + 7) != kBuilt.npos;
}

// Before main: nothing of the C++ library has been initialised.
[[noreturn]] void refuse(const std::string& why) {
  const std::string sentence = "dyntape: " + why + "\n";
  [[maybe_unused]] const auto written = write(STDERR_FILENO, sentence.data(), sentence.size());
  _exit(2);
}

bool has(unsigned leaf, unsigned mask) {  // in ecx of a leaf
  unsigned a, b, c, d;
  return __get_cpuid(leaf, &a, &b, &c, &d) && (c & mask) == mask;
}

// -1: below the lowest.  The compiler's test asks the operating system besides whether it keeps the registers.
int level_of_processor() {
  __builtin_cpu_init();
  if (!__builtin_cpu_supports("sse4.2") || !__builtin_cpu_supports("ssse3") ||
      !__builtin_cpu_supports("popcnt"))
    return -1;
  constexpr unsigned kMovbe = 1u << 22, kF16c = 1u << 29, kLzcnt = 1u << 5;
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") || !__builtin_cpu_supports("bmi") ||
      !__builtin_cpu_supports("bmi2") || !has(1, kMovbe | kF16c) || !has(0x80000001, kLzcnt))
    return 0;
  if (!__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512bw") ||
      !__builtin_cpu_supports("avx512cd") || !__builtin_cpu_supports("avx512dq") ||
      !__builtin_cpu_supports("avx512vl"))
    return 1;
  return 2;
}

int choose() {
  int level = level_of_processor();
  if (level < 0) {
    refuse(std::string("this processor is below ") + kLevels[0] +
           " (it lacks SSSE3, SSE4.2 or POPCNT), the least that this build runs on: build it on this machine "
           "with "
           "-DDYNTAPE_ARCH=native");
  }
  while (level >= 0 && !is_built(level)) --level;
  if (level < 0)
    refuse("this build is for x86-64-" + std::string(kBuilt) +
           " alone, which this processor is below; build it with -DDYNTAPE_ARCH=every");
  const char* const wanted = std::getenv("DYNTAPE_PROCESSOR");
  if (!wanted || !*wanted) return level;
  const auto* const found = std::find(kLevels.begin(), kLevels.end(), std::string(wanted));
  if (found == kLevels.end())
    refuse(std::string("DYNTAPE_PROCESSOR is \"") + wanted +
           "\"; expected x86-64-v2, x86-64-v3 or x86-64-v4");
  const auto chosen = static_cast<int>(found - kLevels.begin());
  if (chosen > level)
    refuse(std::string("DYNTAPE_PROCESSOR is ") + wanted + ", and this processor is " +
           kLevels[static_cast<std::size_t>(level)]);
  if (!is_built(chosen))
    refuse(std::string("DYNTAPE_PROCESSOR is ") + wanted + ", and this build is for x86-64-" +
           std::string(kBuilt) + " alone; build it with -DDYNTAPE_ARCH=every");
  return chosen;
}

int chosen_level() {
  static const int level = choose();
  return level;
}

}  // namespace

std::string processor_level() { return kLevels[static_cast<std::size_t>(chosen_level())]; }

}  // namespace dyntape

// Called by what tools/levels.sh makes, once a library: `count` functions of each level that is built.
extern "C" void dyntape_choose_functions(void** chosen, void* const* const* levels, int count) {
  int place = 0;
  for (int level = 0; level < dyntape::chosen_level(); ++level) place += dyntape::is_built(level);
  std::copy_n(levels[place], count, chosen);
}

#else
namespace dyntape {

std::string processor_level() { return DYNTAPE_ARCH[0] ? DYNTAPE_ARCH : "the compiler's default"; }

}  // namespace dyntape
#endif
