// SPDX-License-Identifier: BSD-3-Clause
// Random programs over every operator: derivatives by sweeps, and by sweeps that are recorded and evaluated again, against derivation.
#include <dyntape/autodiff/derive/derive.h>
#include <dyntape/autodiff/evaluate/interpret.h>
#include <dyntape/interface/cppad/detail/recording.h>

#include "autodiff/random_program.h"
#include "programs.h"

namespace {

using dyntape::Derivatives;

ADFun<double> function_of(const dyntape::Function& function, const std::vector<double>& x,
                          const std::vector<double>& p) {
  auto recording = std::make_shared<CppAD::detail::Recording<double>>();
  recording->function = std::make_shared<const dyntape::Function>(function);
  recording->range = function.n_y();
  recording->variables = x;
  recording->dynamics = p;
  return ADFun<double>(std::make_shared<CppAD::detail::Fun<double>>(recording));
}

struct Expected {
  std::vector<double> J, H;  // dense
};
Expected derived_at(const dyntape::Function& f, const std::vector<double>& x, const std::vector<double>& p,
                    const std::vector<double>& w) {
  const Derivatives d = dyntape::derive(f, dyntape::Order::kSecond);
  const std::vector<double> all = dyntape::evaluate(d.function, x, p, w);
  const std::size_t n = f.n_x();
  Expected e{std::vector<double>(f.n_y() * n, 0.0), std::vector<double>(n * n, 0.0)};
  for (std::size_t k = 0; k < d.jacobian.nnz(); ++k)
    e.J[d.jacobian.row[k] * n + d.jacobian.col[k]] = all[f.n_y() + k];
  for (std::size_t k = 0; k < d.hessian.nnz(); ++k) {
    const std::size_t i = d.hessian.row[k], j = d.hessian.col[k];
    e.H[i * n + j] = e.H[j * n + i] = all[f.n_y() + d.jacobian.nnz() + k];
  }
  return e;
}

class CppadRandomPrograms : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(CppadRandomPrograms, AgreeWithDerivation) {
  for (std::uint64_t seed = GetParam(); seed < GetParam() + 25; ++seed) {
    dyntape::testing::Random random(seed);
    SCOPED_TRACE(random.seed_text());
    const auto program = dyntape::testing::random_program(random, 10 + random.below(40));
    const dyntape::Function function = dyntape::testing::recorded(program);
    std::vector<double> w(function.n_y());
    for (double& weight : w) weight = random.uniform(-1, 1);
    const Expected expected = derived_at(function, program.x, program.p, w);
    const DVector x(program.x.begin(), program.x.end()), weights(w.begin(), w.end());

    ADFun<double> f = function_of(function, program.x, program.p);
    expect_near(f.Jacobian(x), expected.J, 1e-9);
    expect_near(f.Hessian(x, weights), expected.H, 1e-9);

    // The gradient of the weighted sum, recorded in reverse and derived once more.
    auto af = f.base2ad();
    AVector ax(x.size()), aw(w.size());
    for (std::size_t j = 0; j < ax.size(); ++j) ax[j] = program.x[j];
    for (std::size_t i = 0; i < aw.size(); ++i) aw[i] = w[i];
    Independent(ax);
    af.Forward(0, ax);
    AVector gradient = af.Reverse(1, aw);
    ADFun<double> g(ax, gradient);
    expect_near(g.Jacobian(x), expected.H, 1e-9);
    // And the slopes, recorded forwards.
    Independent(ax);
    AVector slopes = af.Jacobian(ax);
    ADFun<double> h(ax, slopes);
    expect_near(h.Forward(0, x), expected.J, 1e-9);
    if (HasFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, CppadRandomPrograms, ::testing::Values(9000, 9100, 9200, 9300));

}  // namespace
