// SPDX-License-Identifier: BSD-3-Clause
//
// Checks the energy balance of a motion for each mechanism (mechanisms.h) separately, so that a small mechanism is
// not hidden by a large one.
//
//   EnergyBalances balances(mechanisms);
//   balances.add(energy, work);                                    // at the start, then after each step
//   const std::string warning = doubt_of_energy(balances.all());     // "" or a warning
//
// The kinetic energy changes by the work of all flows; for a potential this is the decrease of its energy.  The
// difference is the energy that the steps add or remove; implicit-velocity removes some, of the order of its step.
#pragma once

#include <string>
#include <vector>

#include <dyntape/interface/system/energy.h>

namespace dyntape {

struct MechanismBalance {
  std::string name;  // of its first joint
  double error = 0;  // (J) largest difference
  double moved = 0;  // (J) largest moving energy, the reference of the error
  double taken = 0;  // (J) energy removed by the steps until the end; negative: added

  double part() const;  // error relative to `moved`
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

// A motion with a larger error, relative to the moving energy, is no success.
constexpr double kMostUnaccounted = 0.1;

std::string doubt_of_energy(const std::vector<MechanismBalance>& balances);

// The balance with the largest relative error.
const MechanismBalance& worst_of(const std::vector<MechanismBalance>& balances);

}  // namespace dyntape
