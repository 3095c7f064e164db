// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/rigid/rigid_dips.h>

#include <cmath>

namespace dyntape {

GapCurve::GapCurve(double gap, double rate, double later_gap, double later_rate, double h)
    : gap_(gap),
      slope_(h * rate),
      b_(3 * (later_gap - gap) - h * (2 * rate + later_rate)),
      c_(h * (rate + later_rate) - 2 * (later_gap - gap)),
      h_(h) {}

// The root of slope + 2 b s + 3 c s^2 at which it rises, by whichever form does not cancel.
std::optional<GapCurve::Low> GapCurve::lowest() const {
  const double root = b_ * b_ - 3 * c_ * slope_;
  if (!(root > 0)) return {};
  const double sum = std::sqrt(root);
  const double s = b_ > 0 ? -slope_ / (b_ + sum) : (sum - b_) / (3 * c_);
  if (!(s > 0 && s < 1)) return {};
  return Low{s * h_, at(s)};
}

}  // namespace dyntape
