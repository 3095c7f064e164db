// SPDX-License-Identifier: BSD-3-Clause
// The compiled step of a quadruped on the ground, and its Jacobians, against the same step in 113 bits.
#include <gtest/gtest.h>
#include <cmath>
#include <random>

#include <dyntape/dynamics/algebra/float128.h>
#include <dyntape/dynamics/simulation/steps.h>
#include <dyntape/interface/run/simulate/simulate.h>
#include <dyntape/interface/system/scene_system.h>

#include "source_folder.h"

namespace dyntape::step_accuracy_test {
namespace {

using dynamics::ConfigurationSpace;
using dynamics::EuclideanSpace;
using dynamics::Float128;
using dynamics::ProductSpace;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Exact = dynamics::VectorX<Float128>;

// The step as dynamics/ has it, with nothing recorded, simplified or compiled.
class ExactStep {
 public:
  explicit ExactStep(const Scene& scene)
      : model_(scene.robot.model.cast<Float128>()),
        effects_(scene.robot.effects.cast<Float128>()),
        data_(model_),
        torques_(model_),
        dofs_(actuated_dofs(scene.robot)),
        configurations_(model_),
        states_(configurations_, EuclideanSpace<Float128>(model_.nv)) {}

  Exact operator()(const Float128& h, const Exact& x, const Exact& u) {
    const Exact tau = torques_at(dofs_, u, model_.nv);
    const auto acceleration = [&](const Float128&, const Exact& q, const Exact& v) -> Exact {
      return dynamics::forward_dynamics<Float128>(model_, data_, torques_, effects_, q, v, tau);
    };
    const auto end = dynamics::semi_implicit_euler(configurations_, acceleration, h,
                                                   {x.head(model_.nq), x.tail(model_.nv)});
    Exact next(x.size());
    next << end.q, end.v;
    return next;
  }

  // (nt x nt), (nt x n_u): central differences, off by 1e-20 of third derivatives.
  std::pair<MatrixXd, MatrixXd> jacobians(const Float128& h, const Exact& x, const Exact& u) {
    const Float128 eps = 1e-10;
    const auto slope = [&](const Exact& x_more, const Exact& u_more, const Exact& x_less,
                           const Exact& u_less) {
      const Exact d = states_.difference((*this)(h, x_less, u_less), (*this)(h, x_more, u_more));
      return VectorXd((d / (2 * eps)).template cast<double>());
    };
    MatrixXd A(states_.nt(), states_.nt()), B(states_.nt(), u.size());
    for (int k = 0; k < states_.nt(); ++k) {
      const Exact d = eps * Exact::Unit(states_.nt(), k);
      A.col(k) = slope(states_.integrate(x, d), u, states_.integrate(x, Exact(-d)), u);
    }
    for (int k = 0; k < u.size(); ++k) {
      const Exact d = eps * Exact::Unit(u.size(), k);
      B.col(k) = slope(x, u + d, x, u - d);
    }
    return {A, B};
  }

 private:
  dynamics::Model<Float128> model_;
  dynamics::Effects<Float128> effects_;
  dynamics::Data<Float128> data_;
  dynamics::EffectTorques<Float128> torques_;
  std::vector<int> dofs_;
  ConfigurationSpace<Float128> configurations_;
  ProductSpace<ConfigurationSpace<Float128>, EuclideanSpace<Float128>> states_;
};

// Of the largest entry.
double relative(const MatrixXd& a, const MatrixXd& exact) {
  return (a - exact).cwiseAbs().maxCoeff() / exact.cwiseAbs().maxCoeff();
}

TEST(StepAccuracy, OfAQuadrupedThatLandsOnItsFeet) {
  Scene scene = read_scene(test::source_folder() + "/tests/bench/quadruped.info");
  scene.integrator = Integrator::kSemiImplicitEuler;
  const SimulatedMotion motion = simulate(scene);
  ASSERT_TRUE(motion.trouble.empty()) << motion.trouble;  // what steps of Euler's lose is not looked at
  Stepper stepper(system_of(scene.robot), scene.integrator, scene.evaluation, true);
  ExactStep exact(scene);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  double worst_end = 0, worst_A = 0, worst_B = 0;
  for (int k = 0; k < motion.samples(); k += motion.samples() / 10) {
    VectorXd x(stepper.nx()), next(stepper.nx()), u(stepper.n_u());
    x << motion.q.col(k), motion.v.col(k);
    for (double& torque : u) torque = normal(random);
    MatrixXd A, B, P;
    ASSERT_TRUE(stepper.jacobians(0, scene.step, x.data(), u.data(), nullptr, next.data(), A, B, P));
    const Exact x_exact = x.cast<Float128>(), u_exact = u.cast<Float128>();
    const Float128 h = scene.step;
    worst_end = std::max(worst_end, relative(next, exact(h, x_exact, u_exact).cast<double>()));
    const auto [A_exact, B_exact] = exact.jacobians(h, x_exact, u_exact);
    worst_A = std::max(worst_A, relative(A, A_exact));
    worst_B = std::max(worst_B, relative(B, B_exact));
  }
  EXPECT_LT(worst_end, 1e-13);
  EXPECT_LT(worst_A, 1e-13);
  EXPECT_LT(worst_B, 1e-13);
}

}  // namespace
}  // namespace dyntape::step_accuracy_test
