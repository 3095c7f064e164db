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

template <Op op, int lanes, Functions functions>
void in_lanes(const double* x, const double* y, const double* z, double* result) {
  if constexpr (functions == Functions::kPortable && has_portable_form(op)) {
    (void)z;
    portable_values(op, x, y, result, lanes);
  } else {
    for (int l = 0; l < lanes; ++l) result[l] = evaluate<op, double>(x[l], y[l], z[l]);
  }
}

template <Op op>
LaneFunction* of_lanes(int lanes, Functions functions) {
  const bool is_portable = functions == Functions::kPortable;
  switch (lanes) {
    case 1:
      return is_portable ? in_lanes<op, 1, Functions::kPortable> : in_lanes<op, 1, Functions::kLibm>;
    case 2:
      return is_portable ? in_lanes<op, 2, Functions::kPortable> : in_lanes<op, 2, Functions::kLibm>;
    case 4:
      return is_portable ? in_lanes<op, 4, Functions::kPortable> : in_lanes<op, 4, Functions::kLibm>;
    default:
      return is_portable ? in_lanes<op, 8, Functions::kPortable> : in_lanes<op, 8, Functions::kLibm>;
  }
}

// glibc's sincos has the bits of its sin and cos.
template <int lanes, Functions functions>
void both(const double* x, const double*, const double*, double* result) {
  if constexpr (functions == Functions::kPortable) {
    detail::pack_sincos(x, result, result + lanes, lanes);
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
  static ScalarFunction* make() { return scalar<op>; }
};
template <Op op>
struct InLanes {
  static LaneFunction* make(int lanes, Functions functions) { return of_lanes<op>(lanes, functions); }
};

using Table = std::make_index_sequence<kTableOps>;

}  // namespace

ScalarFunction* scalar_function(Op op, Functions functions) {
  constexpr auto all = by_operator<Scalar>(Table());
  if (functions == Functions::kPortable && has_portable_form(op)) return nullptr;
  return all[static_cast<std::size_t>(op)]();
}

LaneFunction* lane_function(Op op, int lanes, Functions functions) {
  constexpr auto all = by_operator<InLanes>(Table());
  return all[static_cast<std::size_t>(op)](lanes, functions);
}

LaneFunction* sine_and_cosine(int lanes, Functions functions) {
  const bool is_portable = functions == Functions::kPortable;
  switch (lanes) {
    case 1:
      return is_portable ? both<1, Functions::kPortable> : both<1, Functions::kLibm>;
    case 2:
      return is_portable ? both<2, Functions::kPortable> : both<2, Functions::kLibm>;
    case 4:
      return is_portable ? both<4, Functions::kPortable> : both<4, Functions::kLibm>;
    default:
      return is_portable ? both<8, Functions::kPortable> : both<8, Functions::kLibm>;
  }
}

}  // namespace dyntape::codegen
