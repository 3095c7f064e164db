// SPDX-License-Identifier: BSD-3-Clause
//
// The balance of energy of a motion, mechanism by mechanism, from its start step by step.
//
//   EnergyAccount account(scene, meter.layout(), [](const MatrixXd& work) { ... });    // (flows, mechanisms) J
//   account.start(energy);
//   account.add(energy, unstored_work_of_step);
//   doubt_of_energy(account.finish())                     // "" or a sentence (energy_balance.h)
//
// The work since the start is told once for the start and once a step, in order; a step or two later where the quadrature looks
// ahead.  The work of a potential is what it stores less.  That of everything else is the integral of its power over the step, by
// the rule that the scheme itself follows (step_work.h):
//   kStage     schemes with one evaluation of the forces a step: the impulse h f of the step along its mean velocity, which
//              changes the kinetic energy by exactly that where the mass matrix is constant
//   kCubic     Runge-Kutta, commands that stay: the cubic through the powers at four neighbouring steps, exact to h^4 (quadrature.h)
//   kSimpson   Runge-Kutta, commands that change: Simpson's rule within each step, with the state after half a step
//   kGauss     adaptive steps: Gauss' rule within each internal step, on the scheme's own interpolant
#pragma once

#include <deque>
#include <functional>

#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/system/energy_balance.h>
#include <dyntape/interface/system/quadrature.h>

namespace dyntape {

enum class WorkRule { kStage, kCubic, kSimpson, kGauss };
WorkRule work_rule(const Scene& scene);

class EnergyAccount {
 public:
  using Take = std::function<void(const Eigen::MatrixXd& work)>;

  EnergyAccount(const Scene& scene, const EnergyLayout& layout, Take take = {});

  void start(const Energy& energy);
  // After a step.  The cubic needs the powers of `energy` alone.
  void add(const Energy& energy, const Eigen::MatrixXd& unstored_work_of_step);
  // Of motions whose unstored work since the start is known by other means; more rows than flows are of rigid contacts.
  void reach(const Energy& energy, const Eigen::MatrixXd& unstored_work);
  const std::vector<MechanismBalance>& finish();

 private:
  void append(const Energy& energy);
  void take_next(const Eigen::VectorXd& work);

  bool is_cubic_;
  Take take_;
  EnergyBalances balances_;
  Eigen::MatrixXd work_;       // of what is not stored
  Eigen::MatrixXd stored_of_;  // at the start
  Quadrature cubic_;
  std::deque<Energy> waiting_;  // for the work until then
};

}  // namespace dyntape
