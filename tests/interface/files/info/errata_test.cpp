// SPDX-License-Identifier: BSD-3-Clause
//
// More often printed statements that give wrong numbers (tests/dynamics/algorithms/errata_test.cpp), of the tape and of files.
#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/autodiff/record/eigen.h>
#include <dyntape/autodiff/record/record.h>
#include <dyntape/interface/files/info/info.h>
#include <gtest/gtest.h>

#include <cmath>

namespace dyntape::errata_test {
namespace {

// E7: for x' = f(x, theta), Phi(x(T)), mu' = -f_x^T mu, mu(T) = grad Phi, the gradient is PLUS the integral of
// mu^T f_theta.  Here f = theta x, Phi = x, of which everything is known in closed form.
TEST(Errata, the_continuous_adjoint_has_a_plus_sign) {
  constexpr double kTheta = 0.7, kStart = 1.3, kEnd = 1;
  constexpr int kSteps = 100;
  const Function f = record("growth", 1, [&](const VectorXad& theta) {
    AD x = kStart;
    const AD h = kEnd / kSteps;
    for (int k = 0; k < kSteps; ++k) {
      const AD k1 = theta[0] * x, k2 = theta[0] * (x + h / 2 * k1), k3 = theta[0] * (x + h / 2 * k2),
               k4 = theta[0] * (x + h * k3);
      x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    }
    VectorXad y(1);
    y << x;
    return y;
  });
  const Function reverse = vjp(f);
  const Interpreter run(reverse);
  Interpreter::Workspace workspace(run);
  const double theta = kTheta, seed = 1;
  double by_tape = 0;
  run(&theta, nullptr, &seed, &by_tape, workspace);

  double integral = 0;  // Simpson
  for (int k = 0; k <= 2 * kSteps; ++k) {
    const double t = kEnd * k / (2 * kSteps), weight = k == 0 || k == 2 * kSteps ? 1 : k % 2 ? 4 : 2;
    const double x = kStart * std::exp(kTheta * t), mu = std::exp(kTheta * (kEnd - t));
    integral += weight * mu * x;
  }
  integral *= kEnd / (6 * kSteps);
  EXPECT_NEAR(by_tape, integral, 1e-8);
  EXPECT_NEAR(by_tape, kStart * kEnd * std::exp(kTheta * kEnd), 1e-8);
  EXPECT_GT(std::abs(by_tape + integral), 1);
}

// E31: task files are in INFO, key and value with a blank between; `[section]` and `key = value` are not.
TEST(Errata, ini_syntax_is_not_info) {
  EXPECT_THROW(io::parse_info("[model_settings]\nrecompileLibraries = true\n", "task.info"), FileError);
}

}  // namespace
}  // namespace dyntape::errata_test
