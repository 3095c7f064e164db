// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/scalars/portable.h>

#include <array>

#include <dyntape/autodiff/scalars/pack.h>

namespace dyntape {
namespace {

// The portable function of an operator.
struct Entry {
  void (*unary)(const double*, double*, int) = nullptr;
  void (*binary)(const double*, const double*, double*, int) = nullptr;
};

constexpr std::array<Entry, kTableOps> kEntries = [] {
  std::array<Entry, kTableOps> entries{};
  for (std::size_t op = 0; op < entries.size(); ++op) {
#define DYNTAPE_ROW(fn, ulp) \
  if (kOpInfo[op].function == #fn) entries[op].unary = detail::pack_##fn;
    DYNTAPE_PORTABLE_UNARY(DYNTAPE_ROW)
#undef DYNTAPE_ROW
#define DYNTAPE_ROW(fn, ulp) \
  if (kOpInfo[op].function == #fn) entries[op].binary = detail::pack_##fn;
    DYNTAPE_PORTABLE_BINARY(DYNTAPE_ROW)
#undef DYNTAPE_ROW
  }
  return entries;
}();

}  // namespace

void portable_values(Op op, const double* x, const double* y, double* result, int n) {
  const Entry& entry = kEntries[static_cast<std::size_t>(op)];
  if (entry.unary) entry.unary(x, result, n);
  if (entry.binary) entry.binary(x, y, result, n);
}

}  // namespace dyntape
