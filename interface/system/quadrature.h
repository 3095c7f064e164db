// SPDX-License-Identifier: BSD-3-Clause
//
// Running integrals of functions known at equal steps, by the cubic through four neighbouring values:
//   int_{k}^{k+1} f = h/24 (-f_{k-1} + 13 f_k + 13 f_{k+1} - f_{k+2}),   at the ends h/24 (9 f_0 + 19 f_1 - 5 f_2 +
//                                                                        f_3).
//
//   Quadrature integral(h, n);                    // of n functions
//   integral.append(f);                           // (n) at 0, h, 2 h, ...
//   integral.finish();
//   integral.at(k)                                // (n) from 0 to k h
//
// Error O(h^4) each; with two or three values that of the trapezoid or the parabola.
#pragma once

#include <Eigen/Core>
#include <deque>

namespace dyntape {

class Quadrature {
 public:
  Quadrature(double h, Eigen::Index n) : h_(h), sum_(Eigen::VectorXd::Zero(n)) {}

  // The integrals up to the newly known points, in order: none for the first values, usually one per call.
  template <class Take>
  void append(const Eigen::VectorXd& f, const Take& take) {
    if (count_ == 0) take(sum_);
    ++count_;
    last_.push_back(f);
    if (last_.size() < 4) return;
    if (count_ == 4) add({9, 19, -5, 1}, take);
    add({-1, 13, 13, -1}, take);
    last_.pop_front();
  }

  // The remaining integrals.
  template <class Take>
  void finish(const Take& take) {
    if (count_ >= 4) {  // three values remain, the last interval is missing
      last_.push_front(before_);
      return add({1, -5, 19, 9}, take);
    }
    if (last_.size() == 3) add_short({5, 8, -1}, take), add_short({-1, 8, 5}, take);
    if (last_.size() == 2) add_short({6, 6, 0}, take);
  }

 private:
  template <class Take>
  void add(const std::array<double, 4>& weights, const Take& take) {
    for (std::size_t i = 0; i < 4; ++i) sum_ += h_ / 24 * weights[i] * last_[i];
    before_ = last_.front();
    take(sum_);
  }
  template <class Take>
  void add_short(const std::array<double, 3>& weights, const Take& take) {
    for (std::size_t i = 0; i < last_.size(); ++i) sum_ += h_ / 12 * weights[i] * last_[i];
    take(sum_);
  }

  double h_;
  long count_ = 0;
  Eigen::VectorXd sum_, before_;
  std::deque<Eigen::VectorXd> last_;  // at most four
};

}  // namespace dyntape
