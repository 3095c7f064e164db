// SPDX-License-Identifier: BSD-3-Clause
//
// No algorithm takes memory once its workspaces are there, whatever acts on the robot.
#include <gtest/gtest.h>

#include <dyntape/dynamics/algorithms/mimic.h>
#include <dyntape/dynamics/algorithms/second_order.h>
#include <dyntape/dynamics/contact/constrained_hessian.h>

#include "counted_allocations.h"
#include "dynamics/all_effects.h"

#if DYNTAPE_COUNTS_ALLOCATIONS
namespace dyntape::dynamics::allocation_test {
namespace {

// Allocations of the second call: the first may find out sizes.
template <class F>
long count(F call) {
  call();
  const long before = test::allocations;
  call();
  return test::allocations - before;
}

class Allocation : public ::testing::TestWithParam<unsigned long> {
 protected:
  Allocation() : random(GetParam()) {
    model = random_tree(random, {12, GetParam() % 2 ? Base::kFloating : Base::kFixed});
    s = random_state(model, random);
    effects = all_effects(model, random);
  }

  Random random;
  Model<double> model;
  State s;
  Effects<double> effects;
};

TEST_P(Allocation, TheCounterCounts) {
  EXPECT_GE(count([] { delete new int(3); }), 0);  // may be left out by the compiler
  EXPECT_GE(count([&] { s.a = Eigen::VectorXd(random.vector(model.nv)); }), 1);
}

TEST_P(Allocation, Algorithms) {
  Data<double> data(model);
  const auto &q = s.q, &v = s.v, &a = s.a, &tau = s.tau;
  EXPECT_EQ(count([&] { rnea(model, data, q, v, a); }), 0);
  EXPECT_EQ(count([&] { crba(model, data, q); }), 0);
  EXPECT_EQ(count([&] { aba(model, data, q, v, tau); }), 0);
  EXPECT_EQ(count([&] { minverse(model, data, q); }), 0);
  EXPECT_EQ(count([&] { id_derivatives(model, data, q, v, a); }), 0);
  EXPECT_EQ(count([&] { fd_derivatives(model, data, q, v, tau); }), 0);
  Hessian<double> hessian(model);
  EXPECT_EQ(count([&] { fd_hessian(model, data, hessian, q, v, tau, a); }), 0);
}

TEST_P(Allocation, Effects) {
  Data<double> data(model);
  EffectTorques<double> torques(model);
  const auto &q = s.q, &v = s.v, &a = s.a, &tau = s.tau;
  EXPECT_EQ(count([&] { forward_dynamics(model, data, torques, effects, q, v, tau); }), 0);
  EXPECT_EQ(count([&] { inverse_dynamics(model, data, torques, effects, q, v, a); }), 0);
  EXPECT_EQ(count([&] { forward_dynamics_derivatives(model, data, torques, effects, q, v, tau); }), 0);
  EXPECT_EQ(count([&] { inverse_dynamics_derivatives(model, data, torques, effects, q, v, a); }), 0);
}

TEST_P(Allocation, ConstraintsAndFollowers) {
  Data<double> data(model);
  EffectTorques<double> torques(model);
  ConstraintData<double> c(model, {point_constraint(model, 5, Vector3<double>::Zero()),
                                   point_constraint(model, 9, Vector3<double>::Zero())});
  const auto &q = s.q, &v = s.v, &tau = s.tau;
  const auto step = [&] {
    constrained_dynamics_derivatives(model, data, c, torques, effects, q, v, tau);
    impulse_dynamics_derivatives(model, data, c, q, v, 0.5, effects.acting());
  };
  EXPECT_EQ(count(step), 0);
  ConstrainedHessian<double> second(model, c);
  const Eigen::VectorXd mu = random.vector(model.nv), nu = random.vector(6);
  EXPECT_EQ(count([&] { constrained_hessian(model, data, c, second, q, v, tau, mu, nu); }), 0);
  EXPECT_EQ(count([&] { impulse_hessian(model, data, c, second, q, v, 0.5, mu, nu); }), 0);
  data.following = following(MimicModel<double>(model, random_rules(model, random)));
  EXPECT_EQ(count(step), 0);
  EXPECT_EQ(count([&] { fd_derivatives(model, data, q, v, tau); }), 0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, Allocation, ::testing::Range(1UL, 5UL));

}  // namespace
}  // namespace dyntape::dynamics::allocation_test
#endif
