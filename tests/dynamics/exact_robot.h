// SPDX-License-Identifier: BSD-3-Clause
//
// A random robot in double and the same in 113 bits, and central differences there: a step of 1e-11 leaves an error
// near 1e-21, so that what a comparison sees is the rounding of the double result.
#pragma once

#include <gtest/gtest.h>

#include <dyntape/dynamics/algebra/float128.h>

#include <memory>

#include "random_robots.h"

namespace dyntape::dynamics {

using MatrixXq = MatrixX<Float128>;
using VectorXq = VectorX<Float128>;

// d f(q (+) d) at d = 0: a column for each direction.
template <class F>
Eigen::MatrixXd tangent_difference(const Model<Float128>& model, const VectorXq& q, const F& f) {
  const Float128 h(1e-11);
  MatrixXq d;
  for (int k = 0; k < model.nv; ++k) {
    const VectorXq step = VectorXq::Unit(model.nv, k) * h;
    const VectorXq up = f(integrate<Float128>(model, q, step)),
                   down = f(integrate<Float128>(model, q, -step));
    if (k == 0) d.resize(up.size(), model.nv);
    d.col(k) = (up - down) / (2 * h);
  }
  return d.cast<double>();
}

// d f(x + d) at d = 0.
template <class F>
Eigen::MatrixXd vector_difference(const VectorXq& x, const F& f) {
  const Float128 h(1e-11);
  MatrixXq d;
  for (long k = 0; k < x.size(); ++k) {
    const VectorXq step = VectorXq::Unit(x.size(), k) * h;
    const VectorXq up = f(VectorXq(x + step)), down = f(VectorXq(x - step));
    if (k == 0) d.resize(up.size(), x.size());
    d.col(k) = (up - down) / (2 * h);
  }
  return d.cast<double>();
}

// What tests with a seed as their parameter start from.
class ExactRobot : public ::testing::TestWithParam<unsigned long> {
 protected:
  // Up to so many joints; every `inner`-th seed may hang free-flyers on bodies.
  explicit ExactRobot(int most_joints, unsigned long inner) : random(GetParam()) {
    const RandomTreeShape shape{1 + random.below(most_joints),
                                GetParam() % 2 ? Base::kFloating : Base::kFixed, GetParam() % 5 == 0,
                                GetParam() % inner == 0};
    model = random_tree(random, shape);
    exact = model.cast<Float128>();
    s = random_state(model, random);
    q = s.q.cast<Float128>();
    v = s.v.cast<Float128>();
    a = s.a.cast<Float128>();
    tau = s.tau.cast<Float128>();
    data = std::make_unique<Data<double>>(model);
    data128 = std::make_unique<Data<Float128>>(exact);
  }

  Random random;
  Model<double> model;
  Model<Float128> exact;
  State s;
  VectorXq q, v, a, tau;
  std::unique_ptr<Data<double>> data;
  std::unique_ptr<Data<Float128>> data128;
};

}  // namespace dyntape::dynamics
