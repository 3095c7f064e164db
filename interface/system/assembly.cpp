// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/assembly.h>

#include <dyntape/autodiff/error.h>
#include <dyntape/autodiff/factorisations.h>
#include <dyntape/dynamics/model/configuration.h>
#include <dyntape/interface/io/number.h>

namespace dyntape {

namespace {

using Eigen::VectorXd;
using LoopData = dynamics::ConstraintData<double>;

double error_at(const RobotScene& scene, dynamics::Data<double>& data, LoopData& loops, const VectorXd& q) {
  const VectorXd still = VectorXd::Zero(scene.model.nv);
  dynamics::constraint_kinematics<double>(scene.model, data, loops, q, still);
  return loops.error.cwiseAbs().maxCoeff();
}

}  // namespace

double close_loops(const RobotScene& scene, VectorXd& q, VectorXd& v) {
  constexpr double kClosed = 1e-13, kAccepted = 1e-10, kLongest = 0.5;
  constexpr int kMostRounds = 200;
  if (scene.constraints.loops.empty()) return 0;
  const Ties ties = ties_of(scene);
  dynamics::Data<double> data(scene.model);
  data.following = ties.following<double>();
  LoopData loops(scene.model, scene.constraints.loops);
  const VectorXd given = q;
  double error = error_at(scene, data, loops, q);
  VectorXd best = q;
  double least = error;
  for (int round = 0; round < kMostRounds && least > kClosed; ++round) {
    VectorXd step = -ties.all_v(least_norm_solution(ties.columns(loops.J), loops.error, 1e-9));
    const double length = step.cwiseAbs().maxCoeff();
    if (length > kLongest) step *= kLongest / length;
    q = dynamics::integrate<double>(scene.model, q, step);
    error = error_at(scene, data, loops, q);
    if (!(error < HUGE_VAL)) break;
    if (error < least) {
      least = error;
      best = q;
    } else if (least < kAccepted) {
      break;  // rounding
    }
  }
  if (!(least <= kAccepted)) {
    std::size_t worst = 0;
    error_at(scene, data, loops, best);
    for (std::size_t i = 0; i < loops.chains.size(); ++i) {
      const auto of = [&](std::size_t k) {
        return loops.error.segment(loops.chains[k].first_row, loops.chains[k].rows).cwiseAbs().maxCoeff();
      };
      if (of(i) > of(worst)) worst = i;
    }
    throw ArgumentError("the loop " + scene.constraints.loop_names[worst] +
                        " does not close near the start; the nearest that is found leaves " +
                        io::with_digits(least, 3) + " m or rad open");
  }
  q = best;
  v = dynamics::impulse_dynamics<double>(scene.model, data, loops, q, v, 0.0, scene.effects.acting());
  return dynamics::difference<double>(scene.model, given, q).cwiseAbs().maxCoeff();
}

double loop_error(const RobotScene& scene, const VectorXd& q) {
  if (scene.constraints.loops.empty()) return 0;
  dynamics::Data<double> data(scene.model);
  LoopData loops(scene.model, scene.constraints.loops);
  return error_at(scene, data, loops, q);
}

}  // namespace dyntape
