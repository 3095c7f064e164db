// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/system/energy_balance.h>

#include <algorithm>
#include <cmath>

#include <dyntape/interface/io/number.h>
#include <dyntape/interface/io/table.h>

namespace dyntape {

namespace {

constexpr double kNoEnergy = 1e-12;   // J
constexpr double kOfTheScene = 1e-9;  // what is less of the energy that moved anywhere is nothing

}  // namespace

double MechanismBalance::part() const { return error > kNoEnergy ? error / std::max(moved, kNoEnergy) : 0; }

EnergyBalances::EnergyBalances(const std::vector<Mechanism>& mechanisms) {
  for (const Mechanism& mechanism : mechanisms) balances_.push_back({mechanism.name});
}

void EnergyBalances::add(const Energy& energy, const Eigen::MatrixXd& work) {
  if (kinetic_.size() == 0) kinetic_ = energy.kinetic_of;
  for (Eigen::Index m = 0; m < work.cols(); ++m) {
    MechanismBalance& balance = balances_[std::size_t(m)];
    const auto of_flows = work.col(m);
    balance.taken = of_flows.sum() - (energy.kinetic_of[m] - kinetic_[m]);
    const double error = std::abs(balance.taken);
    if (!(error <= balance.error)) balance.error = error;  // NaN as well
    balance.moved = std::max({balance.moved, energy.kinetic_of[m], of_flows.cwiseAbs().maxCoeff()});
  }
}

const MechanismBalance& worst_of(const std::vector<MechanismBalance>& balances) {
  return *std::max_element(balances.begin(), balances.end(),
                           [](const auto& a, const auto& b) { return a.part() < b.part(); });
}

std::string doubt_of_energy(const std::vector<MechanismBalance>& balances) {
  double most = 0;
  for (const MechanismBalance& balance : balances) most = std::max(most, balance.moved);
  for (const MechanismBalance& balance : balances) {
    if (balance.error <= kMostUnaccounted * balance.moved + kOfTheScene * most + kNoEnergy) continue;
    const std::string whose = balances.size() > 1 ? " of the mechanism at joint '" + balance.name + "'" : "";
    return "the balance of energy" + whose + " is off by " + io::scientific(balance.error) + " J of " +
           io::significant(balance.moved, 3) + " J that moved, more than a tenth; take shorter steps";
  }
  return "";
}

}  // namespace dyntape
