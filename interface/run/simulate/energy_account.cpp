// SPDX-License-Identifier: BSD-3-Clause
#include <dyntape/interface/run/simulate/energy_account.h>

namespace dyntape {

using Eigen::MatrixXd;
using Eigen::VectorXd;

WorkRule work_rule(const Scene& scene) {
  if (is_adaptive(scene.integrator)) return WorkRule::kGauss;
  if (scene.integrator != Integrator::kRungeKutta4) return WorkRule::kStage;
  return scene.commands.t.size() > 1 || scene.commands.followed ? WorkRule::kSimpson : WorkRule::kCubic;
}

EnergyAccount::EnergyAccount(const Scene& scene, const EnergyLayout& layout, Take take)
    : is_cubic_(work_rule(scene) == WorkRule::kCubic),
      take_(std::move(take)),
      balances_(layout.mechanisms),
      work_(MatrixXd::Zero(Eigen::Index(layout.flows.size()), Eigen::Index(layout.mechanisms.size()))),
      cubic_(scene.step, work_.size()) {}

void EnergyAccount::start(const Energy& energy) {
  if (is_cubic_) return append(energy);
  reach(energy, work_);
}

void EnergyAccount::add(const Energy& energy, const MatrixXd& unstored_work_of_step) {
  if (is_cubic_) return append(energy);
  work_ += unstored_work_of_step;
  reach(energy, work_);
}

void EnergyAccount::append(const Energy& energy) {
  waiting_.push_back(energy);
  cubic_.append(energy.unstored.reshaped(), [this](const VectorXd& work) { take_next(work); });
}

// Of the first step whose energy waits for its work.
void EnergyAccount::take_next(const VectorXd& work) {
  reach(waiting_.front(), work.reshaped(work_.rows(), work_.cols()));
  waiting_.pop_front();
}

void EnergyAccount::reach(const Energy& energy, const MatrixXd& unstored_work) {
  if (stored_of_.size() == 0) stored_of_ = energy.stored_of;
  MatrixXd work = unstored_work;
  work.topRows(stored_of_.rows()) += stored_of_ - energy.stored_of;
  balances_.add(energy, work);
  if (take_) take_(work);
}

const std::vector<MechanismBalance>& EnergyAccount::finish() {
  cubic_.finish([this](const VectorXd& work) { take_next(work); });
  return balances_.all();
}

}  // namespace dyntape
