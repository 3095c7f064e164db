// SPDX-License-Identifier: BSD-3-Clause
//
// The balance of energy of one sample, mechanism by mechanism, as simulate takes it (interface/run/simulate/motion_work.h): what it says of
// a motion is what a sweep says of its row.
//
//   SampleBalance balance(scene, layout);
//   balance.start(energy);                       // at the start
//   balance.step(energy), or balance.step(energy, work);         // after each step
//   const std::string warning = balance.warning();   // "" or a sentence
//
// Internal.
#pragma once

#include <deque>
#include <string>

#include <dyntape/interface/files/scene/scene.h>
#include <dyntape/interface/system/energy_balance.h>
#include <dyntape/interface/system/quadrature.h>

namespace dyntape {

// What the work of a step is integrated by: powers at four neighbouring steps where commands stay, at its beginning, middle and
// end where they change, within internal steps where these adapt.
enum class WorkRule { kCubic, kSimpson, kGauss };
WorkRule work_rule(const Scene& scene);

class SampleBalance {
 public:
  SampleBalance(const Scene& scene, const EnergyLayout& layout);

  void start(const Energy& energy);
  void step(const Energy& energy);                               // by the cubic
  void step(const Energy& energy, const Eigen::MatrixXd& work);  // (flows + 1, mechanisms) J, of this step
  std::string warning();

 private:
  void take(const Eigen::VectorXd& work);

  bool is_cubic_;
  Eigen::Index flows_, mechanisms_;
  EnergyBalances balances_;
  Quadrature cubic_;
  Eigen::MatrixXd work_;
  std::deque<Energy> waiting_;  // for their work
};

}  // namespace dyntape
