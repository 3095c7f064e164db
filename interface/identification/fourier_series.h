// SPDX-License-Identifier: BSD-3-Clause
//
// Periodic joint motions as finite Fourier series: smooth, band-limited, with exact velocities and accelerations.
//
//   FourierSeries series{10.0, coefficients};                  // (joints x 2 H + 1)
//   MatrixXd q = series.positions(times), v = series.velocities(times);
//
// With w = 2 pi / period and coefficients (c, a_1 ... a_H, b_1 ... b_H) of a joint:
//   q(t) = c + sum_k (a_k sin(k w t) - b_k cos(k w t)) / (k w)
//   v(t) =     sum_k  a_k cos(k w t) + b_k sin(k w t)
//   a(t) =     sum_k (b_k cos(k w t) - a_k sin(k w t)) k w
// All three are linear in the coefficients: q = coefficients basis(0, t), and so on.  Source: J. Swevers et al.,
// Optimal robot excitation and identification, IEEE Trans. Robotics and Automation 13(5), 1997.
#pragma once

#include <Eigen/Core>

#include <dyntape/autodiff/eigen_layout.h>

namespace dyntape {

struct FourierSeries {
  double period = 10;            // s
  Eigen::MatrixXd coefficients;  // (joints x 2 H + 1): c (rad or m), a_k and b_k (rad/s or m/s)

  // The basis functions of derivative 0, 1 or 2, (2 H + 1 x times).
  static Eigen::MatrixXd basis(double period, int harmonics, int derivative, const Eigen::VectorXd& times);

  int harmonics() const { return static_cast<int>(coefficients.cols() - 1) / 2; }
  Eigen::MatrixXd positions(const Eigen::VectorXd& times) const { return values(0, times); }
  Eigen::MatrixXd velocities(const Eigen::VectorXd& times) const { return values(1, times); }
  Eigen::MatrixXd accelerations(const Eigen::VectorXd& times) const { return values(2, times); }

 private:
  Eigen::MatrixXd values(int derivative, const Eigen::VectorXd& times) const {
    return coefficients * basis(period, harmonics(), derivative, times);
  }
};

// `count` evenly spaced times of one period, from 0.
Eigen::VectorXd times_of_period(double period, int count);

}  // namespace dyntape
