// SPDX-License-Identifier: BSD-3-Clause
//
// Whether the energy of a motion is accounted for, mechanism by mechanism (mechanisms.h): a small one beside a large one has
// a balance of its own.
//
//   EnergyBalances balances(mechanisms);
//   balances.add(energy, work);                                    // at the start, then after each step
//   const std::string warning = doubt_of_energy(balances.all());     // "" or a sentence
//
// The kinetic energy changes by the work of all that acts; of what has a potential that is what it stores less.  The
// difference is what the steps themselves take or give: implicit-velocity takes some, of the order of its step.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/system/energy.h>

namespace dyntape {

struct MechanismBalance {
  std::string name;  // of its first joint
  double error = 0;  // (J) largest difference
  double moved = 0;  // (J) the largest energy that moved, which it is compared with
  double taken = 0;  // (J) what the steps have taken by the end; less than zero: what they have given

  double part() const;  // of what moved
};

class EnergyBalances {
 public:
  explicit EnergyBalances(const std::vector<Mechanism>& mechanisms);

  // work: (flows, mechanisms), J since the start.
  void add(const Energy& energy, const Eigen::MatrixXd& work);

  const std::vector<MechanismBalance>& all() const { return balances_; }

 private:
  std::vector<MechanismBalance> balances_;
  Eigen::VectorXd kinetic_;  // at the start
};

// More than this part of the energy that moved unaccounted for is no success.
constexpr double kMostUnaccounted = 0.1;

std::string doubt_of_energy(const std::vector<MechanismBalance>& balances);

// The one whose part is the largest.
const MechanismBalance& worst_of(const std::vector<MechanismBalance>& balances);

}  // namespace dyntape
