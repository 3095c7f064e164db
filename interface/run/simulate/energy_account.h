// SPDX-License-Identifier: BSD-3-Clause
//
// The energy balance of a motion, by mechanism, from the start, step by step.
//
//   EnergyAccount account(scene, meter.layout(), [](const MatrixXd& work) { ... });    // (flows, mechanisms) J
//   account.start(energy);
//   account.add(energy, unstored_work_of_step);
//   doubt_of_energy(account.finish())                     // "" or a sentence (energy_balance.h)
//
// The callback gets the work since the start: once for the start and once for each step, in order.  With the rule
// kCubic the call comes a step or two later.  The work of a potential is minus the change of its energy.  All other
// work is the integral of the power over the step, by the rule of the scheme (step_work.h):
//   kStage     schemes with one evaluation of the forces per step: the impulse h f of the step along its mean velocity;
//              with a constant mass matrix this is exactly the change of kinetic energy
//   kCubic     Runge-Kutta with constant commands: the cubic through the powers at four neighbouring steps, exact to
//              h^4 (quadrature.h)
//   kSimpson   Runge-Kutta with changing commands: Simpson's rule within each step, with the state after half a step
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
  // Call after each step.  The rule kCubic needs only the powers in `energy`.
  void add(const Energy& energy, const Eigen::MatrixXd& unstored_work_of_step);
  // For motions with known unstored work since the start; rows after the flows belong to rigid contacts.
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
