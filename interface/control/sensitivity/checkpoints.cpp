// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/control/sensitivity/checkpoints.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include <dyntape/autodiff/error.h>

namespace dyntape {

namespace {

constexpr long kMany = std::numeric_limits<long>::max();

long times(long a, long b) {
  long product = 0;
  return __builtin_mul_overflow(a, b, &product) ? kMany : product;
}

// Steps that s checkpoints reverse with no step taken more often than r times: (s + r)! / (s! r!), or kMany.
long reversible(long s, long r) {
  if (r < 0) return 0;
  const long few = std::min(s, r), many = std::max(s, r);
  long value = 1;
  for (long i = 1; i <= few; ++i) {
    value = times(value, many + i);
    if (value == kMany) return kMany;
    value /= i;
  }
  return value;
}

// The least r with reversible(s, r) >= steps.
long repetitions(long steps, long s) {
  if (steps <= 1) return 0;
  long low = 0, high = 1;
  while (reversible(s, high) < steps) low = high, high = high < steps / 2 ? 2 * high : steps - 1;
  while (high - low > 1) {
    const long middle = low + (high - low) / 2;
    (reversible(s, middle) < steps ? low : high) = middle;
  }
  return high;
}

// How far behind the first of s checkpoints the second one stands, when so many steps are left.
long second_snapshot(long steps, long s) {
  const long r = repetitions(steps, s);
  return std::max({1L, reversible(s, r - 2), steps - reversible(s - 1, r)});
}

void check_sweep(long steps, long checkpoints) {
  if (checkpoints < 1)
    throw ArgumentError("a reverse sweep with " + std::to_string(checkpoints) +
                        " checkpoints: expected at least 1, that of the start");
  if (steps < 0)
    throw ArgumentError("a reverse sweep of " + std::to_string(steps) + " steps: expected 0 or more");
}

struct Checkpoint {
  long k;
  Eigen::VectorXd x;
};

}  // namespace

long fewest_forward_steps(long steps, long checkpoints) {
  check_sweep(steps, checkpoints);
  checkpoints = std::clamp(steps, 1L, checkpoints);
  const long r = repetitions(steps, checkpoints), all = times(r, steps);
  return all == kMany ? kMany : all - reversible(checkpoints + 1, r - 1);
}

ReverseSweep reverse_sweep(long steps, long checkpoints, const Eigen::VectorXd& x0,
                           const ReversibleSteps& of) {
  check_sweep(steps, checkpoints);
  checkpoints = std::clamp(steps, 1L, checkpoints);
  if (!of.forward || !of.end || !of.back)
    throw ArgumentError("a reverse sweep needs all of forward, end and back");
  ReverseSweep sweep;
  if (steps == 0) {
    sweep.adjoint = of.end(x0);
    return sweep;
  }
  std::vector<Checkpoint> kept{{0, x0}};
  sweep.stored = 1;
  Eigen::VectorXd x = x0, next(x0.size());
  const auto advance = [&](long from, long to) {  // x
    for (long k = from; k < to; ++k, ++sweep.forward_steps) {
      of.forward(k, x, next);
      x.swap(next);
    }
  };
  for (long end = steps; end > 0; --end) {  // the step before `end` is the next to be reversed
    if (kept.back().k == end) kept.pop_back();
    x = kept.back().x;
    for (long from = kept.back().k; from < end - 1;) {
      const long left = checkpoints - long(kept.size()) + 1;
      const long to = left > 1 ? from + second_snapshot(end - from, left) : end - 1;
      advance(from, to);
      if (left > 1) kept.push_back({to, x});
      sweep.stored = std::max(sweep.stored, long(kept.size()));
      from = to;
    }
    if (end == steps) {
      advance(end - 1, end);
      sweep.adjoint = of.end(x);
      x.swap(next);  // the state before the last step
    }
    of.back(end - 1, x, sweep.adjoint);
  }
  return sweep;
}

}  // namespace dyntape
