// SPDX-License-Identifier: BSD-3-Clause
//
// The work of all forces along steps with rigid contacts, and the contacts' reactions.
//
//   RigidAccount account(scene, energy_meter);
//   account.add(rigid, u, h, p);                     // after each step of a RigidStepper; p: parameters of the scene
//   account.work()                                   // (J) since the start, unstored: the meter's flows, rigid contacts,
//                                                    //   hard limits; of each mechanism
//   account.reactions()                              // (m) mean forces of the rows over the last step (N, N m)
//
// Powers are integrated piece by piece, between events (step_work.h).  The work of an impulse is p . (u- + u+) / 2,
// exactly the change of the kinetic energy.
#pragma once

#include <dyntape/interface/run/simulate/step_work.h>
#include <dyntape/interface/system/rigid/rigid_step.h>

namespace dyntape {

class RigidAccount {
 public:
  RigidAccount(const Scene& scene, EnergyMeter& meter);

  // The flows besides those of the meter that the scene has.
  static std::vector<std::string> names(const SceneConstraints& constraints);

  void add(RigidStepper& rigid, const Eigen::VectorXd& u, double h, const Eigen::VectorXd& p = {});

  const Eigen::MatrixXd& work() const { return work_; }
  const Eigen::VectorXd& reactions() const { return reactions_; }
  long impacts() const { return impacts_; }  // number of contacts and stops that hit

 private:
  void add_rows(const Eigen::VectorXd& products);

  Eigen::VectorXd mean_velocities(RigidFunctions& functions, const RigidPiece& piece,
                                  const Eigen::VectorXd& u) const;

  StepWork of_steps_;
  Eigen::Index nq_;
  Eigen::Index flows_;                  // of the meter
  std::vector<Eigen::Index> row_flow_;  // of each row of contacts and stops: its flow, and its mechanism
  std::vector<int> row_mechanism_;
  Eigen::MatrixXd work_;
  Eigen::VectorXd reactions_;
  long impacts_ = 0;
};

}  // namespace dyntape
