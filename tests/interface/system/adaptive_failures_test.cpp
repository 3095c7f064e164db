// SPDX-License-Identifier: BSD-3-Clause
//
// Adaptive steps that have no end, and say why; tries that are refused on the way to one.
#include <cmath>

#include "simulated_systems.h"

namespace dyntape::adaptive_failures_test {
namespace {

using namespace test;
using Eigen::MatrixXd;

constexpr Integrator kBoth[] = {Integrator::kAdaptive, Integrator::kAdaptiveStiff};

std::string failure(const System& system, Integrator integrator, const VectorXd& x, double h,
                    const Tolerances& tolerances = {}) {
  Stepper stepper(system, integrator, kInterpreted, false, 1, tolerances);
  VectorXd next = VectorXd::Zero(stepper.nx());
  std::string why;
  ::testing::internal::CaptureStderr();
  EXPECT_FALSE(stepper.step(0, h, x.data(), nullptr, nullptr, next.data(), &why));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_TRUE(next.array().isNaN().all());
  return why;
}

TEST(AdaptiveFailures, FailuresAreSentences) {
  System s = spring(1, 1);
  for (const Integrator integrator : kBoth) {
    s.acceleration = [](const SystemPoint<AD>& at) {
      return VectorXad(VectorXad::Constant(1, sqrt(at.q[0])));
    };
    EXPECT_EQ(failure(s, integrator, Eigen::Vector2d(-1, 0), 1),
              "step of \"spring\" from t = 0 s by 1 s: the accelerations are not finite at t = 0 s");
    const std::string beyond = failure(s, integrator, Eigen::Vector2d(1, -10), 1);
    EXPECT_NE(beyond.find("by 1 s: the accelerations are not finite beyond t = 0.10"), std::string::npos)
        << beyond;
    s.acceleration = [](const SystemPoint<AD>& at) {
      if (at.q[0] < 0) return VectorXad(-at.q);
      return VectorXad(at.q * AD(-2));
    };
    const std::string branch = failure(s, integrator, Eigen::Vector2d(1, -10), 1);
    EXPECT_NE(branch.find("adaptive_failures_test.cpp"), std::string::npos) << branch;
    s.acceleration = [](const SystemPoint<AD>& at) {
      return VectorXad(at.v.cwiseProduct(at.v).array() + AD(1));  // infinite at t = pi / 2
    };
    const std::string pole = failure(s, integrator, Eigen::Vector2d(0, 0), 2);
    EXPECT_NE(pole.find("t = 1.5707"), std::string::npos) << pole;
  }
}

// The velocity overtakes the doubles while there is no time left between two of them.
TEST(AdaptiveFailures, WhereAMotionEndsInFiniteTime) {
  System s = spring(1, 1);
  s.acceleration = [](const SystemPoint<AD>& at) {
    return VectorXad(VectorXad::Constant(1, exp(at.q[0] * 800.)));
  };
  for (const Integrator integrator : kBoth) {
    const std::string why = failure(s, integrator, Eigen::Vector2d(0, 1), 5);
    EXPECT_NE(why.find("the accelerations are not finite beyond t = 0.0092"), std::string::npos) << why;
  }
}

TEST(AdaptiveFailures, SlopesThatAreNotFinite) {
  System s = spring(1, 1);
  s.acceleration = [](const SystemPoint<AD>& at) {
    return VectorXad(VectorXad::Constant(1, -sqrt(abs(at.q[0]))));
  };
  Stepper stepper(s, Integrator::kAdaptive, kInterpreted, true);
  MatrixXd A, B, P;
  VectorXd x = Eigen::Vector2d(0, 0);
  std::string why;
  EXPECT_FALSE(stepper.jacobians(0, 1, x.data(), nullptr, nullptr, x.data(), A, B, P, &why));
  EXPECT_NE(why.find("its Jacobians: derivatives of the accelerations are not finite beyond t = 0 s"),
            std::string::npos)
      << why;
}

// With coarse tolerances a try goes to the end at once, where it is below zero; shorter steps get there.
TEST(AdaptiveFailures, ATryThatIsRefusedAtTheEnd) {
  System s = spring(1, 1);
  s.acceleration = [](const SystemPoint<AD>& at) {
    const AD q = at.q[0];
    return VectorXad(VectorXad::Constant(1, -10.339294847441543 * (q - 0.0017569082041137402) -
                                                8.0765988390594448 * at.v[0] + 1e-3 * sqrt(q) +
                                                1e-3 * log(q)));
  };
  Stepper stepper(s, Integrator::kAdaptiveStiff, kInterpreted, false, 1, {0.1, 0.1});
  VectorXd x = Eigen::Vector2d(0.0070276328164549607, -0.004010299230745736);
  std::string why;
  EXPECT_TRUE(stepper.step(0, 3.0320929952164755, x.data(), nullptr, nullptr, x.data(), &why)) << why;
  EXPECT_NEAR(x[0], 0.00118, 0.1);
}

}  // namespace
}  // namespace dyntape::adaptive_failures_test
