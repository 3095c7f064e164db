// SPDX-License-Identifier: BSD-3-Clause
//
// Many evaluations at once: the torques of an arm and their derivatives at 20000 states, one by one, in SIMD lanes,
// and in threads.  The results have the same bits.
//
//   x = (q, v, a) (18) states of six joints         y = tau (6) N m         dy/dx: its non-zeros
#include <chrono>
#include <cstdio>
#include <random>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/ocs2/ad_function.h>

using namespace dyntape;

int main(int argc, char** argv) {
  const auto arm = dynamics::load_urdf(argc > 1 ? argv[1] : "config/robots/ur5.urdf",
                                       {.continuous = dynamics::ContinuousJoint::kAngle});
  const auto taped = arm.cast<AD>();
  const std::size_t n = std::size_t(arm.nv), inputs = 3 * n, count = 20000;
  const auto torques = [&](const ad_vector_t& x, const ad_vector_t&, ad_vector_t& y) {
    dynamics::Data<AD> data(taped);
    const Eigen::Index nv = arm.nv;
    y = dynamics::rnea<AD>(taped, data, x.head(nv), x.segment(nv, nv), x.tail(nv));
  };

  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> number(-2, 2);
  std::vector<double> states(count * inputs);
  for (double& value : states) value = number(random);

  std::vector<double> first_y, first_J;
  double alone = 0;
  bool same = true;
  for (const auto& [name, lanes, threads] : {std::tuple("one by one", Lanes::kNone, 1u),
                                             {"in lanes", Lanes::kNative, 1u},
                                             {"in lanes, by all threads", Lanes::kNative, 0u}}) {
    AdFunctionSettings settings;
    settings.name = "torques";
    settings.threads = threads;
    settings.codegen.lanes = lanes;
    AdFunction f(torques, inputs, 0, settings);
    f.createModels(AdFunction::ApproximationOrder::First, false);
    std::vector<double> y(count * n), J(count * f.jacobianPattern().nnz());
    double least = 1e9;
    for (int round = 0; round < 5; ++round) {
      const auto begin = std::chrono::steady_clock::now();
      f.evaluateBatch(count, states.data(), nullptr, y.data(), J.data());
      least =
          std::min(least, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    if (alone == 0) alone = least, first_y = y, first_J = J;
    same = same && y == first_y && J == first_J;
    std::printf("%-25s %6.3f us a state, %.1f times as fast\n", name, 1e6 * least / count, alone / least);
  }

  // All ways give these torques.
  dynamics::Data<double> data(arm);
  double off = 0;
  for (std::size_t k = 0; k < count; k += 1000) {
    const auto x = Eigen::VectorXd::Map(&states[k * inputs], Eigen::Index(inputs));
    const Eigen::Index nv = arm.nv;
    const Eigen::VectorXd tau = dynamics::rnea<double>(arm, data, x.head(nv), x.segment(nv, nv), x.tail(nv));
    off = std::max(off, (tau - Eigen::VectorXd::Map(&first_y[k * n], nv)).cwiseAbs().maxCoeff());
  }
  std::printf("same bits: %s; off from the plain functions by %.1e N m\n", same ? "yes" : "NO", off);
  return same && off < 1e-12 * 100 ? 0 : 1;
}
