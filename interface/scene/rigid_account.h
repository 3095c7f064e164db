// SPDX-License-Identifier: BSD-3-Clause
//
// The work of all that acts along steps with rigid contacts, and what these carry.
//
//   RigidAccount account(scene, energy_meter);
//   account.add(rigid, u, h);                        // after each step of a RigidStepper
//   account.work()                                   // (J) since the start: the meter's flows, rigid contacts, hard limits
//   account.released()                               // (J) of what is stored
//   account.reactions()                              // (m) mean forces of the rows over the last step (N, N m)
//
// Powers are integrated piece by piece, between events, by Simpson's rule.  Impulses: p . (u- + u+) / 2, which is the
// change of the kinetic energy exactly.
#pragma once

#include <dyntape/interface/scene/energy.h>
#include <dyntape/interface/scene/rigid_step.h>
#include <dyntape/interface/scene/scene.h>

namespace dyntape {

class RigidAccount {
 public:
  RigidAccount(const Scene& scene, EnergyMeter& meter);

  // Besides those of the meter: of what the scene has.
  static std::vector<std::string> names(const SceneConstraints& constraints);

  void add(RigidStepper& rigid, const Eigen::VectorXd& u, double h);

  const Eigen::VectorXd& work() const { return work_; }
  double released() const { return released_; }
  const Eigen::VectorXd& reactions() const { return reactions_; }
  long impacts() const { return impacts_; }  // contacts and stops that hit

 private:
  // Of each flow, by how much of the piece it counts.
  void add_powers(RigidStepper& rigid, const Eigen::VectorXd& x, const Eigen::VectorXd& u,
                  const Eigen::VectorXd& forces, double weight);
  void add_rows(const Eigen::VectorXd& products, Eigen::Ref<Eigen::VectorXd> sums) const;

  const Scene& scene_;
  EnergyMeter& meter_;
  Eigen::Index contact_rows_ = 0;
  Eigen::VectorXd work_, reactions_;
  double released_ = 0;
  long impacts_ = 0;
};

}  // namespace dyntape
