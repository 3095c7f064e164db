// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/io/range.h>

#include <cmath>
#include <utility>

#include <dyntape/interface/io/number.h>

namespace dyntape::io {

namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

Range closed(double low, double high, std::string text) {
  return {low, high, false, false, false, std::move(text)};
}

}  // namespace

std::string Range::fault(double value) const {
  if (std::isnan(value) || (std::isinf(value) && !infinite)) return "must be finite";
  return holds(value) ? "" : "must be " + text;
}

Range positive() { return {0, kUnbounded, true, false, false, "positive"}; }
Range not_negative() { return closed(0, kUnbounded, "zero or more"); }
Range at_least(double low) { return closed(low, kUnbounded, "at least " + shortest(low)); }
Range between(double low, double high) {
  return closed(low, high, "between " + shortest(low) + " and " + shortest(high));
}
Range or_infinite(Range range) {
  range.infinite = true;
  if (!range.text.empty()) range.text += " or infinite";
  return range;
}

}  // namespace dyntape::io
