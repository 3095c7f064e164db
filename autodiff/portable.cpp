// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/autodiff/portable.h>

#include <dyntape/autodiff/pack.h>

namespace dyntape {
namespace portable {

// The names that the cells of the table call.  In this namespace they hide <cmath>'s.
#define DYNTAPE_DEFINE(fn, ulp)   \
  double fn(double x) {           \
    double y;                     \
    detail::pack_##fn(&x, &y, 1); \
    return y;                     \
  }
DYNTAPE_PORTABLE_UNARY(DYNTAPE_DEFINE)
#undef DYNTAPE_DEFINE
#define DYNTAPE_DEFINE(fn, ulp)       \
  double fn(double x, double y) {     \
    double z;                         \
    detail::pack_##fn(&x, &y, &z, 1); \
    return z;                         \
  }
DYNTAPE_PORTABLE_BINARY(DYNTAPE_DEFINE)
#undef DYNTAPE_DEFINE
using std::abs, std::ceil, std::copysign, std::floor, std::fmod, std::round, std::sqrt, std::trunc;

double value(Op op, double x, double y, double z) {
  using T = double;
  (void)y, (void)z;
  switch (op) {
#define OP(name, fn, n, value, ...) \
  case Op::name:                    \
    return value;
#define FN OP
#include "ops.def"
#undef OP
#undef FN
    default:
      return x;
  }
}

}  // namespace portable

double portable_value(Op op, double x, double y, double z) { return portable::value(op, x, y, z); }

}  // namespace dyntape
