// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/options/lane_widths.h>

namespace dyntape::codegen {
namespace {

#if defined(__x86_64__)
const std::vector<unsigned> kWidths = {2, 4, 8};
#else
const std::vector<unsigned> kWidths = {2};
#endif

}  // namespace

bool has_lanes(unsigned width) {
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (width == 8) return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
  if (width == 4) return __builtin_cpu_supports("avx2");
#endif
  return width <= 2;
}

std::vector<unsigned> lane_widths(Lanes lanes) {
  if (lanes == Lanes::kNone) return {};
  if (lanes == Lanes::kAll) return kWidths;
  unsigned widest = 0;
  for (unsigned width : kWidths) widest = has_lanes(width) ? width : widest;
  return {widest};
}

std::vector<std::string> lane_flags(unsigned width) {
  std::vector<std::string> flags = {"-DDYNTAPE_LANES=" + std::to_string(width)};
#if defined(__x86_64__)
  if (width == 4) flags.push_back("-mavx2");
  if (width == 8) flags.insert(flags.end(), {"-mavx512f", "-mavx512dq", "-mprefer-vector-width=512"});
#endif
  return flags;
}

}  // namespace dyntape::codegen
