// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/codegen/machine/elementary.h>

#include <array>
#include <utility>

#include <dyntape/autodiff/scalars/pack.h>

namespace dyntape::codegen {
namespace {

template <Op op>
double scalar(double x, double y, double z) {
  return evaluate<op, double>(x, y, z);
}
template <Op op>
double of_libm(double x, double y, double z) {
  return evaluate_by_libm<op>(x, y, z);
}

template <Op op, int lanes, Functions functions>
void in_lanes(const double* x, const double* y, const double* z, double* result) {
  if constexpr (is_portable(op, functions)) {
    (void)z;
    portable_values(op, x, y, result, lanes);
  } else {
    for (int l = 0; l < lanes; ++l) result[l] = evaluate_by_libm<op>(x[l], y[l], z[l]);
  }
}

template <Op op, Functions functions>
LaneFunction* of_lanes(int lanes) {
  switch (lanes) {
    case 1:
      return in_lanes<op, 1, functions>;
    case 2:
      return in_lanes<op, 2, functions>;
    case 4:
      return in_lanes<op, 4, functions>;
    default:
      return in_lanes<op, 8, functions>;
  }
}

template <Op op>
LaneFunction* of_lanes(int lanes, Functions functions) {
  if (!has_portable_form(op)) return of_lanes<op, Functions::kLibm>(lanes);
  switch (functions) {
    case Functions::kSines:
      return of_lanes<op, Functions::kSines>(lanes);
    case Functions::kLibm:
      return of_lanes<op, Functions::kLibm>(lanes);
    default:
      return of_lanes<op, Functions::kPortable>(lanes);
  }
}

// glibc's sincos has the bits of its sin and cos.
template <int lanes, bool own>
void both(const double* x, const double*, const double*, double* result) {
  if constexpr (own) {
    own::sincos(x, result, result + lanes, lanes);
  } else {
    for (int l = 0; l < lanes; ++l) ::sincos(x[l], &result[l], &result[lanes + l]);
  }
}

// What a template makes of each operator of the table, by its number.
template <template <Op> class Make, std::size_t... op>
constexpr auto by_operator(std::index_sequence<op...>) {
  return std::array{Make<static_cast<Op>(op)>::make...};
}

template <Op op>
struct Scalar {
  static ScalarFunction* make(Functions functions) {
    if (functions == Functions::kLibm) return of_libm<op>;
    return is_portable(op, functions) && !is_turn(op) ? nullptr : scalar<op>;
  }
};
template <Op op>
struct InLanes {
  static LaneFunction* make(int lanes, Functions functions) { return of_lanes<op>(lanes, functions); }
};

using Table = std::make_index_sequence<kTableOps>;

}  // namespace

ScalarFunction* scalar_function(Op op, Functions functions) {
  constexpr auto all = by_operator<Scalar>(Table());
  return all[static_cast<std::size_t>(op)](functions);
}

LaneFunction* lane_function(Op op, int lanes, Functions functions) {
  constexpr auto all = by_operator<InLanes>(Table());
  return all[static_cast<std::size_t>(op)](lanes, functions);
}

LaneFunction* sine_and_cosine(int lanes, Functions functions) {
  const bool own = is_portable(Op::Sin, functions);
  switch (lanes) {
    case 1:
      return own ? both<1, true> : both<1, false>;
    case 2:
      return own ? both<2, true> : both<2, false>;
    case 4:
      return own ? both<4, true> : both<4, false>;
    default:
      return own ? both<8, true> : both<8, false>;
  }
}

}  // namespace dyntape::codegen
