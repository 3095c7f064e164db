// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/identification/excitation.h>

#include <algorithm>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/factorisations.h>
#include <dyntape/interface/control/ipopt/ipopt.h>
#include <dyntape/interface/identification/excitation_problem.h>

namespace dyntape {

using dynamics::Model;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double condition(const Model<double>& model, const BaseParameters& base, const Samples& samples) {
  const MatrixXd W = stacked_base_regressor(model, base, samples) * base.scale.cwiseInverse().asDiagonal();
  const Eigen::Index r = W.cols();
  if (W.rows() < r) return std::numeric_limits<double>::infinity();
  const VectorXd s = singular_values(triangular_factor(W)).values;
  return s[0] / s[r - 1];
}

Excitation optimal_excitation(const Model<double>& model, const BaseParameters& base,
                              const ExcitationOptions& options) {
  if (!base.mimics.empty()) {
    throw ArgumentError(
        "excitation of \"" + model.name +
        "\": every joint moves by itself; expected base parameters without joints that follow others");
  }
  excitation_limits(model, options);  // its complaints ahead of any work
  if (static_cast<Eigen::Index>(options.samples) * model.nv < base.rank())
    throw ArgumentError("excitation: " + std::to_string(options.samples) + " samples are too few for " +
                        std::to_string(base.rank()) + " base parameters");
  ExcitationProblem problem(model, base, options);
  FourierSeries best;
  double least = std::numeric_limits<double>::infinity();
  std::vector<double> conditions;
  Excitation result;
  for (int k = 0; k < std::max(options.starts, 1); ++k) {
    const FourierSeries series = random_series(model, options, options.seed + static_cast<unsigned long>(k));
    if (!problem.look_at(series)) continue;
    conditions.push_back(problem.condition());
    if (problem.value() < least) {
      least = problem.value();
      result.random_log_det = problem.log_det();
      best = series;
    }
  }
  if (conditions.empty()) {
    throw NumericalError("excitation: no random series excites all base parameters of \"" + model.name +
                         "\"; more harmonics or samples may");
  }
  std::nth_element(conditions.begin(), conditions.begin() + static_cast<long>(conditions.size() / 2),
                   conditions.end());
  result.random_condition = conditions[conditions.size() / 2];

  const NlpSolution solution =
      solve_with_ipopt(problem, ExcitationProblem::flat(best),
                       {.tolerance = 1e-4,
                        .max_iterations = options.max_iterations,
                        .extra = {{"jac_c_constant", "yes"}, {"jac_d_constant", "yes"}}});
  result.status = solution.status;
  result.iterations = solution.iterations();
  result.seconds = solution.times.total;
  result.series = problem.series(solution.x.data());
  problem.look_at(result.series);
  result.condition = problem.condition();
  result.log_det = problem.log_det();
  result.conditions = problem.conditions();
  result.errors = problem.errors();
  result.samples = sample(model, result.series, times_of_period(options.period, options.samples));
  return result;
}

}  // namespace dyntape
