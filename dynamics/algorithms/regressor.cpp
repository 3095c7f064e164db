// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/dynamics/algorithms/regressor.h>

#include <Eigen/Eigenvalues>

namespace dyntape::dynamics {

double physical_margin(const Vector10<double>& theta) {
  if (theta.isZero(0)) return 0;
  const Inertia<double> body = inertia_from(theta);
  const double size = 0.5 * (theta[4] + theta[6] + theta[9]);  // integral of |r|^2 dm
  if (!(body.mass > 0) || size < 0) return -1;
  if (size == 0) return theta.tail<9>().isZero(0) ? 0 : -1;
  const Matrix3<double> second_moment = 0.5 * body.I_c.trace() * Matrix3<double>::Identity() - body.I_c;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(second_moment, Eigen::EigenvaluesOnly);
  return principal.eigenvalues()[0] / size;
}

std::vector<std::string> inertial_parameter_names(int njoints) {
  std::vector<std::string> names;
  for (int i = 1; i <= njoints; ++i) {
    for (const char* name : {"m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz"}) {
      names.push_back(name + std::to_string(i));
    }
  }
  return names;
}

}  // namespace dyntape::dynamics
