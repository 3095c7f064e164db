// SPDX-License-Identifier: BSD-3-Clause
//
// State spaces: what holds of every one, and of pairs.
#include <gtest/gtest.h>

#include <dyntape/dynamics/simulation/state_space.h>

#include "dynamics/exact_robot.h"

namespace dyntape::dynamics::state_space_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

static_assert(StateSpace<EuclideanSpace<float>>);
static_assert(StateSpace<ConfigurationSpace<Float128>>);
static_assert(StateSpace<ProductSpace<ConfigurationSpace<double>, EuclideanSpace<double>>>);

template <class T>
auto phase_space(const Model<T>& model, int motors) {
  return ProductSpace(ProductSpace(ConfigurationSpace<T>(model), EuclideanSpace<T>(model.nv)),
                      EuclideanSpace<T>(motors));
}

class StateSpaces : public ::testing::TestWithParam<unsigned long> {
 protected:
  static constexpr int kMotors = 3;
  StateSpaces() : random(GetParam()) {
    model =
        random_tree(random, {7, GetParam() % 2 ? Base::kFloating : Base::kFixed, false, GetParam() % 3 == 0});
    const State s = random_state(model, random);
    x.resize(model.nq + model.nv + kMotors);
    x << s.q, s.v, random.vector(kMotors);
    d = random.vector(2 * model.nv + kMotors);  // rotations stay below half a turn
  }

  Random random;
  Model<double> model;
  VectorXd x, d;
};

TEST_P(StateSpaces, DifferenceUndoesIntegrate) {
  const auto space = phase_space(model, kMotors);
  ASSERT_EQ(space.nx(), x.size());
  ASSERT_EQ(space.nt(), d.size());
  const VectorXd moved = space.integrate(x, d);
  EXPECT_LE((space.difference(x, moved) - d).norm(), 1e-14 * (1 + x.norm())) << "seed " << GetParam();
  EXPECT_LE((space.integrate(moved, VectorXd::Zero(d.size())) - moved).norm(), 1e-14 * (1 + x.norm()));
}

// d = (x (+) d) (-) x, derived by d and by x.
TEST_P(StateSpaces, JacobiansAreInverse) {
  const auto space = phase_space(model, kMotors);
  const auto there = space.integrate_jacobians(d), back = space.difference_jacobians(d);
  const MatrixXd one = MatrixXd::Identity(space.nt(), space.nt());
  EXPECT_LE((back.second * there.second - one).cwiseAbs().maxCoeff(), 1e-14) << "seed " << GetParam();
  EXPECT_LE((back.first + back.second * there.first).cwiseAbs().maxCoeff(), 1e-14) << "seed " << GetParam();
}

TEST_P(StateSpaces, JacobiansMatchDifferences) {
  const Model<Float128> exact = model.cast<Float128>();
  const auto space = phase_space(exact, kMotors);
  const VectorXq at = x.cast<Float128>(), by = d.cast<Float128>(), end = space.integrate(at, by);
  const auto J = phase_space(model, kMotors).integrate_jacobians(d);
  const VectorXq zero = VectorXq::Zero(by.size());
  const MatrixXd by_x = vector_difference(zero, [&](const VectorXq& e) {
    return space.difference(end, space.integrate(space.integrate(at, e), by));
  });
  const MatrixXd by_d =
      vector_difference(by, [&](const VectorXq& e) { return space.difference(end, space.integrate(at, e)); });
  EXPECT_LE((J.first - by_x).cwiseAbs().maxCoeff(), 1e-14) << "seed " << GetParam();
  EXPECT_LE((J.second - by_d).cwiseAbs().maxCoeff(), 1e-14) << "seed " << GetParam();
}

// A pair has the entries of its parts, one after the other; lines are where moving is adding.
TEST_P(StateSpaces, PairsAndLines) {
  const auto space = phase_space(model, kMotors);
  const VectorXd moved = space.integrate(x, d);
  EXPECT_EQ(moved.head(model.nq), integrate(model, x.head(model.nq), d.head(model.nv)));
  EXPECT_EQ(moved.tail(model.nv + kMotors),
            VectorXd(x.tail(model.nv + kMotors) + d.tail(model.nv + kMotors)));
  std::size_t on_lines = std::size_t(model.nv + kMotors);
  for (const auto& joint : model.joints) on_lines += traits(joint.type).on_a_line;
  EXPECT_EQ(space.lines().size(), on_lines);
  for (const Line& line : space.lines()) EXPECT_EQ(moved[line.x], x[line.x] + d[line.t]);
}

INSTANTIATE_TEST_SUITE_P(Seeds, StateSpaces, ::testing::Range(1UL, 21UL));

}  // namespace
}  // namespace dyntape::dynamics::state_space_test
