// SPDX-License-Identifier: BSD-3-Clause
//
// Identifies masses of an arm from its torques: which combinations are identifiable from a noisy motion, and how
// accurately.
#include <cstdio>
#include <random>

#include <dyntape/dynamics/algorithms/algorithms.h>
#include <dyntape/dynamics/urdf/urdf.h>
#include <dyntape/interface/identification/estimator.h>
#include <dyntape/interface/identification/excitation.h>

using namespace dyntape;

int main(int argc, char** argv) {
  const auto arm = dynamics::load_urdf(argc > 1 ? argv[1] : "config/robots/double_pendulum.urdf");
  const BaseParameters base = base_parameters(arm);
  std::printf("%s: %d base parameters of %d\n", arm.name.c_str(), base.rank(), 10 * arm.njoints());

  // The most informative motion within the limits, compared with a random one.
  ExcitationOptions options;
  options.max_iterations = 30;
  const Excitation best = optimal_excitation(arm, base, options);
  std::printf("log det of the information %.2f, of the best random series %.2f\n", best.log_det,
              best.random_log_det);

  // Driven ten times, with noisy torque sensors.
  const Eigen::VectorXd times = Eigen::VectorXd::LinSpaced(2000, 0, 10 * options.period);
  Samples measured = sample(arm, best.series, times);
  measured.tau.resize(arm.nv, times.size());
  dynamics::Data<double> data(arm);
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 0.05);  // N m
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    measured.tau.col(i) = dynamics::rnea(arm, data, measured.q.col(i), measured.v.col(i), measured.a.col(i),
                                         {.armature = false});
    for (double& tau : measured.tau.col(i)) tau += noise(random);
  }

  const Identification found = identify(arm, base, measured);
  const Eigen::VectorXd truth = base.regrouping * dynamics::inertial_parameters(arm);
  double worst = 0;
  for (int k = 0; k < base.rank(); ++k) {
    const double off = (found.beta[k] - truth[k]) / found.standard_deviation[k];
    std::printf("%10.6f +- %.6f  (%10.6f)  %s\n", found.beta[k], found.standard_deviation[k], truth[k],
                base.names[static_cast<std::size_t>(k)].c_str());
    worst = std::max(worst, std::abs(off));
  }
  std::printf("largest error: %.1f standard deviations\n", worst);
  return worst < 5 && best.log_det > best.random_log_det ? 0 : 1;
}
