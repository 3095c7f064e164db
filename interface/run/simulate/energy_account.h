// SPDX-License-Identifier: BSD-3-Clause
//
// The balance of energy of a motion, mechanism by mechanism, from its start step by step.
//
//   EnergyAccount account(scene, meter.layout(), [](const MatrixXd& work) { ... });    // (flows + 1, mechanisms) J
//   account.start(energy);
//   account.add(energy, work_of_step);
//   doubt_of_energy(account.finish())                     // "" or a sentence (energy_balance.h)
//
// The work since the start is told once for the start and once a step, in order; a step or two later where the quadrature looks
// ahead.  Between the places where it is looked at the motion is that of its scheme:
//   commands that stay      the cubic through the powers at four neighbouring steps, exact to h^4 (quadrature.h)
//   commands that change    Simpson's rule within each step, with the state after half a step (step_work.h)
//   adaptive steps          Gauss' rule within each internal step, on the scheme's own interpolant
#pragma once

#include <deque>
#include <functional>

#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/system/energy_balance.h>
#include <dyntape/interface/system/quadrature.h>

namespace dyntape {

enum class WorkRule { kCubic, kSimpson, kGauss };
WorkRule work_rule(const Scene& scene);

class EnergyAccount {
 public:
  using Take = std::function<void(const Eigen::MatrixXd& work)>;

  EnergyAccount(const Scene& scene, const EnergyLayout& layout, Take take = {});

  void start(const Energy& energy);
  // After a step.  The cubic needs the powers of `energy` alone.
  void add(const Energy& energy, const Eigen::MatrixXd& work_of_step);
  // Of motions whose work since the start is known by other means.
  void reach(const Energy& energy, const Eigen::MatrixXd& work);
  const std::vector<MechanismBalance>& finish();

 private:
  void append(const Energy& energy);
  void take_next(const Eigen::VectorXd& work);

  bool is_cubic_;
  Take take_;
  EnergyBalances balances_;
  Eigen::MatrixXd work_;
  Quadrature cubic_;
  std::deque<Energy> waiting_;  // for the work until then
};

}  // namespace dyntape
