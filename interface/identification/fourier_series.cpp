// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/identification/fourier_series.h>

#include <cmath>
#include <numbers>

namespace dyntape {

Eigen::MatrixXd FourierSeries::basis(double period, int harmonics, int derivative,
                                     const Eigen::VectorXd& times) {
  const double w = 2 * std::numbers::pi / period;
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(2 * harmonics + 1, times.size());
  if (derivative == 0) B.row(0).setOnes();
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    for (int k = 1; k <= harmonics; ++k) {
      const double s = std::sin(k * w * times[i]), c = std::cos(k * w * times[i]);
      const double of_a[] = {s / (k * w), c, -s * k * w}, of_b[] = {-c / (k * w), s, c * k * w};
      B(k, i) = of_a[derivative];
      B(harmonics + k, i) = of_b[derivative];
    }
  }
  return B;
}

Eigen::VectorXd times_of_period(double period, int count) {
  return Eigen::VectorXd::LinSpaced(count + 1, 0, period).head(count);
}

}  // namespace dyntape
